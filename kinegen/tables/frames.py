"""The frames of a robot on its new table: each keeps its pose, and its name where no row has it now."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

from kinegen.robot.expressions import ZERO
from kinegen.robot.model import WRIST, Frame, Robot, Row, Step, StepKind
from kinegen.tables.cells import Cells, fresh
from kinegen.tables.numbers import MP, identified_angle, is_small
from kinegen.tables.place import Placed
from kinegen.tables.poses import Matrix, NotNumeric, Pose, Values, expression_of, pose_of
from kinegen.tables.steps import Steps, folded, inverse

MOST = 200
"""Named frames of a robot file."""


@dataclass(frozen=True, slots=True)
class Neat:
    """Fixed steps in the shortest form found, and whether their numbers are exact."""

    steps: Steps
    exact: bool = True


def neat(steps: Iterable[Step], values: Values) -> Neat:
    """A fixed transform as it folds, or as a shift and yaw, pitch and roll, whichever is shorter."""
    plain = folded(steps)
    if len(plain) <= 1:
        return Neat(plain)
    try:
        found = _upright(pose_of(plain, values))
    except NotNumeric:
        return Neat(plain)
    return found if found.exact and len(found.steps) <= len(plain) else Neat(plain)


def angles_of(matrix: Matrix) -> tuple[Any, Any, Any]:
    """Yaw, pitch and roll of a rotation `Rz(yaw) Ry(pitch) Rx(roll)`; the yaw is zero where the pitch is upright."""
    level = MP.hypot(matrix[0][0], matrix[1][0])
    pitch = MP.atan2(-matrix[2][0], level)
    if is_small(level):
        return MP.mpf(0), pitch, MP.atan2(matrix[0][1] * MP.sign(pitch), matrix[1][1])
    return MP.atan2(matrix[1][0], matrix[0][0]), pitch, MP.atan2(matrix[2][1], matrix[2][2])


def _upright(pose: Pose) -> Neat:
    yaw, pitch, roll = angles_of(pose.rotation)
    shifts = [expression_of(form, algebraic=pose.algebraic) for form in pose.shift]
    turns = [identified_angle(angle, algebraic=pose.algebraic) for angle in (yaw, pitch, roll)]
    kinds = (StepKind.TX, StepKind.TY, StepKind.TZ, StepKind.RZ, StepKind.RY, StepKind.RX)
    both = tuple(zip(kinds, (*shifts, *turns), strict=True))
    kept = tuple(Step(kind, each.expression) for kind, each in both if each.expression != ZERO)
    return Neat(kept, all(each.exact for _, each in both))


@dataclass(frozen=True, slots=True)
class Frames:
    """The named frames of the new robot.

    Attributes:
        frames: Parents first.
        names: What the frame of each row is called now, in the order of the old table.
        dropped: Rows whose frames have no name any more, because a file has no place for more.
    """

    frames: tuple[Frame, ...]
    names: tuple[tuple[str, str], ...]
    dropped: tuple[str, ...]


def frames_of(robot: Robot, cells: Cells, placed: Placed, values: Values) -> Frames:
    """Put every frame where it was.

    Args:
        robot: The robot as it was.
        cells: Its motions.
        placed: Its new rows.
        values: Its parameters.
    """
    rows = {row.name for row in placed.rows}
    taken = [*rows, *(row.name for row in robot.rows), *(frame.name for frame in robot.frames)]
    needed = {frame.parent for frame in robot.frames}
    room = MOST - len(robot.frames)
    tips = frozenset(robot.tips) if robot.is_tree else frozenset()
    added: list[Frame] = []
    names: dict[str, str] = {}
    dropped = []
    for row in robot.rows:
        parent, steps = _from_row(robot, row, cells, placed, values)
        if not steps and parent == row.name:
            names[row.name] = row.name
            continue
        wanted = row.name in needed or row.name in tips or (WRIST in needed and row is robot.rows[-1])
        if len(added) >= room and not wanted:
            dropped.append(row.name)
            continue
        name = fresh(f"{row.name}_frame", taken) if row.name in rows else row.name
        taken.append(name)
        names[row.name] = name
        added.append(Frame(name, parent, steps, row.line, row.name in tips))
    last = robot.rows[-1].name
    carried = {**names, WRIST: names.get(last, last)} if WRIST not in names else names
    kept = (replace(frame, parent=carried.get(frame.parent, frame.parent)) for frame in robot.frames)
    return Frames((*added, *kept), tuple(names.items()), tuple(dropped))


def _from_row(robot: Robot, row: Row, cells: Cells, placed: Placed, values: Values) -> tuple[str, Steps]:
    """The parent of an old row's frame in the new robot, and the steps from there."""
    anchor = cells.anchors[row.name]
    if anchor.cell is None:
        return robot.root, neat((*robot.base, *anchor.steps), values).steps
    between = (*inverse(placed.ends[anchor.cell]), *anchor.steps)
    return cells.cells[anchor.cell].name, neat(between, values).steps
