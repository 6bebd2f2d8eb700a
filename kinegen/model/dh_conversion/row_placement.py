"""Rows of the new table from the chosen screws, and the frames of the robot on them, each with its pose.

Standard rows are a screw about z and then one about x, modified rows one about x and then one about z. In both the
screws on either side of a joint's motion are in the row of the joint, because they are about its axis.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field, replace
from typing import Any

from kinegen.model.dh_conversion.elementary_transforms import Steps, folded, inverse
from kinegen.model.dh_conversion.exact_poses import (
    MP,
    Matrix,
    NotNumeric,
    Pose,
    Values,
    expression_of,
    identified_angle,
    is_noise,
    pose_of,
)
from kinegen.model.dh_conversion.fixed_transforms import Link, Screw, choose, links, step_list
from kinegen.model.dh_conversion.motion_tree import Cells, JointMotion, fresh
from kinegen.model.expression_parser import ZERO, Expression, add
from kinegen.model.robot import WRIST, Convention, Frame, JointType, Robot, Row, Step, StepKind
from kinegen.support.dataclass import dataclass


@dataclass(slots=True)
class Placed:
    """The new table as it grows.

    Attributes:
        rows: In order.
        base: Steps that follow the robot's base.
        ends: For each cell, the steps from its frame to the frame of its new row.
        tail: What is left behind the last row of a chain.
        free: What could have been chosen otherwise, with the place.
        rounded: Places where a number was rounded.
    """

    rows: list[Row] = field(default_factory=list)
    base: list[Step] = field(default_factory=list)
    ends: dict[int, Steps] = field(default_factory=dict)
    tail: list[Step] = field(default_factory=list)
    free: list[str] = field(default_factory=list)
    rounded: list[str] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class _Path:
    """Cells behind each other with the transforms before, between and behind them.

    Attributes:
        cells: Their numbers.
        chosen: One transform before each cell, and one behind the last.
    """

    cells: tuple[int, ...]
    chosen: tuple[Link, ...]


def place(robot: Robot, cells: Cells, values: Values, convention: Convention) -> Placed:
    """Make the standard or modified rows."""
    found = Placed()
    modified = convention is Convention.MODIFIED
    entries: dict[int, tuple[Link, bool]] = {}
    exits: dict[int, Link] = {}
    roots = cells.children(None)
    # Paths from the root, then those that leave them at a fork.
    starts = [(start, len(roots) == 1) for start in roots]
    while starts:
        start, alone = starts.pop(0)
        path = _path(robot, cells, values, found, start, modified=modified)
        for index, number in enumerate(path.cells):
            entries[number] = path.chosen[index], index > 0 or alone
            exits[number] = path.chosen[index + 1]
            found.ends[number] = _end(path.chosen[index + 1], modified=modified)
            starts += [(child, False) for child in cells.children(number)[1:]]
        _note(found, cells, path)
        if alone:
            found.base = _before(path.chosen[0], modified=modified)
            entries[start] = (Link(((Screw(), path.chosen[0].pairs[-1][1]),), path.chosen[0].last), True)
        found.tail = _behind(path.chosen[-1], modified=modified)
    taken = [row.name for row in robot.rows] + [frame.name for frame in robot.frames]
    taken += [cell.name for cell in cells.cells]
    writer = _Rows(robot, convention, found, taken)
    for number, cell in enumerate(cells.cells):
        parent = robot.root if cell.parent is None else cells.cells[cell.parent].name
        writer.add(cell, parent, *entries[number], exits[number])
    return found


def _path(robot: Robot, cells: Cells, values: Values, found: Placed, start: int, *, modified: bool) -> _Path:
    """Follow the first child of each cell, and choose the transforms along the way."""
    numbers = [start]
    while behind := cells.children(numbers[-1]):
        numbers.append(behind[0])
    first = cells.cells[start]
    entry = first.link
    if first.parent is not None:
        entry = folded((*inverse(found.ends[first.parent]), *entry))
    steps = [entry, *(cells.cells[number].link for number in numbers[1:]), _tail(robot, cells, numbers[-1])]
    options = [links(each, values) for each in steps]
    return _Path(tuple(numbers), choose(options, modified=modified))


def _tail(robot: Robot, cells: Cells, number: int) -> Steps:
    """Return the steps from a last cell to the frame that ends its branch."""
    last = robot.rows[-1].name if not robot.is_tree else cells.cells[number].origin.name
    anchor = cells.anchors[last]
    return anchor.steps if anchor.cell == number else ()


def _note(found: Placed, cells: Cells, path: _Path) -> None:
    """Say what was free, and what was rounded."""
    names = ["base" if cells.cells[path.cells[0]].parent is None else "the fork"]
    names += [cells.cells[number].name for number in path.cells]
    ends = [*names[1:], "the end"]
    for before, after, link in zip(names, ends, path.chosen, strict=True):
        found.free += [f"{before} to {after}: {each}" for each in link.free]
        found.rounded += [] if link.exact else [f"{before} to {after}"]


def _end(link: Link, *, modified: bool) -> Steps:
    """Return the steps from a cell's frame, after its motion, to the frame of its new row."""
    along, across = link.pairs[0]
    return tuple(step_list(along, "z") + ([] if modified else step_list(across, "x")))


def _before(link: Link, *, modified: bool) -> list[Step]:
    """Return what of the first transform is in the base."""
    steps = []
    for index, (along, across) in enumerate(link.pairs):
        steps += step_list(along, "z")
        if not modified or index < len(link.pairs) - 1:
            steps += step_list(across, "x")
    return steps


def _behind(link: Link, *, modified: bool) -> list[Step]:
    """Return what of the last transform is in the tool."""
    steps = step_list(link.pairs[0][1], "x") if modified else []
    for along, across in link.pairs[1:]:
        steps += step_list(along, "z") + step_list(across, "x")
    return steps + step_list(link.last, "z")


@dataclass(slots=True)
class _Rows:
    """Appends rows."""

    robot: Robot
    convention: Convention
    found: Placed
    taken: list[str]

    def add(self, cell: JointMotion, parent: str, entry: Link, main: bool, behind: Link) -> None:
        """Append the row of a cell, after the fixed rows that its entry needs.

        `entry` is the transform before it; `main` says whether the row before has the first screw of the entry, or the
        base has it; `behind` is the transform behind it.
        """
        modified = self.convention is Convention.MODIFIED
        along, across = entry.last + behind.pairs[0][0], behind.pairs[0][1]
        if modified:
            across = entry.pairs[-1][1]
            fixed = [] if main else [(Screw(), entry.pairs[0][0])]
            fixed += [(x, z) for (_, x), (z, _) in zip(entry.pairs, entry.pairs[1:], strict=False)]
        else:
            fixed = [(x, z) for z, x in (entry.pairs[1:] if main else entry.pairs)]
        for x, z in fixed:
            if not (x.still and z.still):
                name = fresh(f"{cell.name}_base", self.taken)
                self.taken.append(name)
                parent = self._append(cell, name, parent, x, (z.turn, z.shift), JointType.FIXED)
        entries = add(cell.theta, along.turn), add(cell.d, along.shift)
        self._append(cell, cell.name, parent, across, entries, cell.type)

    def _append(
        self, cell: JointMotion, name: str, parent: str, x: Screw, z: tuple[Expression, Expression], kind: JointType
    ) -> str:
        own = name if kind in (JointType.REVOLUTE, JointType.PRISMATIC, JointType.SCREW) else None
        self.found.rows.append(
            Row(
                name=name,
                number=len(self.found.rows) + 1,
                parent=parent,
                convention=self.convention,
                alpha=x.turn,
                a=x.shift,
                d=z[1],
                theta=z[0],
                beta=None,
                steps=(),
                type=kind,
                variable=own,
                line=cell.origin.line,
            )
        )
        return name


MOST = 200
"""Named frames of a robot file."""


@dataclass(frozen=True, slots=True)
class Neat:
    """Fixed steps in the shortest form found, and whether their numbers are exact."""

    steps: Steps
    exact: bool = True


def neat(steps: Iterable[Step], values: Values) -> Neat:
    """Return a fixed transform as it folds, or as a shift and yaw, pitch and roll, whichever is shorter."""
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
    if is_noise(level):
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
    """The named frames of the new robot, parents first.

    Attributes:
        names: What the frame of each row is called now, in the order of the old table.
        dropped: Rows whose frames have no name any more, because a file has no place for more.
    """

    frames: tuple[Frame, ...]
    names: tuple[tuple[str, str], ...]
    dropped: tuple[str, ...]


def frames_of(robot: Robot, cells: Cells, placed: Placed, values: Values) -> Frames:
    """Put every frame where it was."""
    rows = {row.name for row in placed.rows}
    taken = [*rows, *(row.name for row in robot.rows), *(frame.name for frame in robot.frames)]
    # A file has at most 200 frames; those that others or tips need are kept in any case.
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
    # A frame on the wrist of the old table stays there.
    last = robot.rows[-1].name
    carried = {**names, WRIST: names.get(last, last)} if WRIST not in names else names
    kept = (replace(frame, parent=carried.get(frame.parent, frame.parent)) for frame in robot.frames)
    return Frames((*added, *kept), tuple(names.items()), tuple(dropped))


def _from_row(robot: Robot, row: Row, cells: Cells, placed: Placed, values: Values) -> tuple[str, Steps]:
    """Return the parent of an old row's frame in the new robot, and the steps from there."""
    anchor = cells.anchors[row.name]
    if anchor.cell is None:
        return robot.root, neat((*robot.base, *anchor.steps), values).steps
    between = (*inverse(placed.ends[anchor.cell]), *anchor.steps)
    return cells.cells[anchor.cell].name, neat(between, values).steps
