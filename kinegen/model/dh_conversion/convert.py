"""A robot in another convention with every pose kept, and the lengths that nearly parallel axes make.

Their common normal is far away. A table with such lengths is exact, but a kernel adds them up in numbers of 16 digits:
they are reported from a thousand times the robot's own lengths on, and refused where they cost half of a double's
digits.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import mpmath

from kinegen.errors import KinegenError
from kinegen.model.dh_conversion.elementary_transforms import Steps, row_steps
from kinegen.model.dh_conversion.exact_poses import MP, Values, value_of
from kinegen.model.dh_conversion.motion_tree import cells_of, slide
from kinegen.model.dh_conversion.row_placement import Frames, Placed, frames_of, neat, place
from kinegen.model.robot import TOOL, Convention, Robot, StepKind
from kinegen.model.variants import digest, used_names, with_frames_renamed
from kinegen.support.dataclass import dataclass
from kinegen.verify.reference import DIGITS, frames_mp

_FAR = 1e3
_TOO_FAR = 1e8
"""Multiples of the robot's largest length."""


def far_lengths(robot: Robot, found: Robot) -> tuple[str, ...]:
    """Describe each row of a table whose length is far greater than those of the robot as it was.

    Raises:
        KinegenError: If a length costs more than half of the digits of a double.
    """
    values: dict[str, Any] = {each.name: value_of(each.value, {}) for each in robot.parameters}
    values.update({each.name: MP.mpf(0) for each in robot.variables})
    size = max((_longest(steps, values) for _, steps in _places(robot)), default=MP.mpf(0)) or MP.mpf(1)
    places = tuple(_places(found))
    apart = [MP.inf, *(_apart(steps, values) for _, steps in places), MP.inf]
    lines = []
    for number, (name, steps) in enumerate(places):
        length = _longest(steps, values)
        if length > _FAR * size:
            # The twist that causes it is in the same row, or in one beside it.
            where = f"{name}: two axes are {float(min(apart[number : number + 3])):.2g} rad from being parallel"
            lines.append(_line(where, length, size, found))
    return tuple(lines)


def _line(where: str, length: Any, size: Any, found: Robot) -> str:
    far = f"{float(length):.2g} {found.units.length}"
    if length > _TOO_FAR * size:
        raise KinegenError(
            f"{where}, so a {found.convention} table would have a length of {far}, too large for 16 digits; "
            f"--snap 1e-6 takes such axes as parallel, --convention {Convention.ETS} keeps them as they are",
            found.source,
        )
    return f"{where}, so there is a length of {far}; kernels lose {round(float(MP.log10(length / size)))} digits"


def _places(robot: Robot) -> Iterator[tuple[str, Steps]]:
    """Return everything that has lengths, from the base to the tool."""
    yield "base", robot.base
    yield from ((f"row {row.name}", row_steps(row)) for row in robot.rows)
    yield "tool", robot.tool


def _longest(steps: Steps, values: dict[str, Any]) -> Any:
    """Return the longest shift where all joints are at zero."""
    shifts = (step.value for step in steps if not step.kind.is_rotation)
    return max((abs(value_of(each, values)) for each in shifts), default=MP.mpf(0))


def _apart(steps: Steps, values: dict[str, Any]) -> Any:
    """Return how far the twists are from half turns; those that are half turns do not count."""
    twists = [value_of(step.value, values) for step in steps if step.kind is StepKind.RX]
    distances = (abs(twist - MP.pi * MP.nint(twist / MP.pi)) for twist in twists)
    return min((each for each in distances if each > 0), default=MP.inf)


TARGETS = (Convention.STANDARD, Convention.MODIFIED, Convention.ETS)

MOST_ROWS = 256

_MOST = 1e-30
"""How far a pose may move, as a share of the largest length: axes that are nearly parallel meet far away, where the 50
digits to which numbers are rounded count for less."""


@dataclass(frozen=True, slots=True)
class Converted:
    """A robot in another convention.

    Attributes:
        free: What could have been chosen otherwise, one line each: between which joints, and what.
        rounded: Places where numbers are rounded to 50 digits, because robot-file expressions cannot represent them.
        frames: What the frame of each old row is called now.
        dropped: Rows whose frames have no name any more, because a robot file has at most 200 named frames.
        parameters: Parameters that no entry uses any more; their values are in the numbers.
        far: Where axes are nearly parallel, so that a length is far greater than the robot's, one line each.
    """

    robot: Robot
    free: tuple[str, ...] = ()
    rounded: tuple[str, ...] = ()
    frames: tuple[tuple[str, str], ...] = ()
    dropped: tuple[str, ...] = ()
    parameters: tuple[str, ...] = ()
    far: tuple[str, ...] = ()


def to_convention(robot: Robot, convention: Convention) -> Converted:
    """Write a robot in another convention.

    Args:
        robot: Any robot, also a tree, with rows of any convention.
        convention: Standard, modified, or elementary sequences.

    Returns:
        The robot with the same joint vector, limits, actuators, tips and poses of all frames, and what was free.

    Raises:
        KinegenError: If the robot has no joint, the table would be too long, or two axes are so nearly parallel that
            its lengths would be useless.
    """
    if convention not in TARGETS:
        raise KinegenError(f"a robot cannot be converted to {convention} (expected {', '.join(TARGETS)})")
    if all(row.convention is convention for row in robot.rows):
        unchanged = tuple((row.name, row.name) for row in robot.rows)
        return Converted(replace(robot, convention=_stated(robot, convention)), frames=unchanged)
    if convention is Convention.ETS:
        return _elementary(robot)
    if not robot.dof:
        raise KinegenError(f"robot {robot.name} has no joint, so there is no {convention} table to find")
    # Joints move about their own z, so each fixed transform between two of them is taken apart by itself.
    values = Values(
        tuple((each.name, value_of(each.value, {})) for each in robot.parameters),
        frozenset(each.name for each in robot.runtime_parameters),
    )
    cells = cells_of(robot)
    sliding = slide(cells, values)
    placed = place(robot, cells, values, convention)
    if len(placed.rows) > MOST_ROWS:
        raise KinegenError(f"the {convention} table has {len(placed.rows)} rows (at most {MOST_ROWS})")
    # Old frames keep their poses, fixed to the rows of the new table.
    frames = frames_of(robot, cells, placed, values)
    found = _robot(robot, placed, frames, values, convention)
    _check(robot, found, frames)
    far = far_lengths(robot, found)
    free = (*(f"{cells.cells[number].name}: {line}" for number, line in sliding.items()), *placed.free)
    lost = {each.name for each in robot.parameters} - {each.name for each in found.parameters}
    gone = tuple(each.name for each in robot.parameters if each.name in lost)
    return Converted(found, free, tuple(placed.rounded), frames.names, frames.dropped, gone, far)


def _stated(robot: Robot, convention: Convention) -> Convention:
    """Return the convention of the file: rows that are elementary sequences leave it as it is."""
    return robot.convention if convention is Convention.ETS else convention


def _elementary(robot: Robot) -> Converted:
    """Convert row by row, as the conventions are defined; all frames stay where they are."""
    rows = tuple(
        replace(row, convention=Convention.ETS, alpha=None, a=None, d=None, theta=None, beta=None, steps=row_steps(row))
        for row in robot.rows
    )
    found = replace(robot, rows=rows)
    return Converted(replace(found, digest=digest(found)), frames=tuple((row.name, row.name) for row in rows))


def _robot(robot: Robot, placed: Placed, frames: Frames, values: Values, convention: Convention) -> Robot:
    """Return the new robot, without the parameters that no entry uses."""
    # What the table has no place for goes into base and tool.
    base = neat((*robot.base, *placed.base), values).steps if placed.base else robot.base
    tool = robot.tool
    if placed.tail and not robot.is_tree:
        tool = neat((*placed.tail, *robot.tool), values).steps
    found = replace(
        robot,
        convention=convention,
        rows=tuple(placed.rows),
        base=base,
        tool=tool,
        frames=frames.frames,
    )
    used = used_names(found)
    kept = tuple(each for each in robot.parameters if each.name in used or robot.actuators.readings)
    names_now = {**dict(frames.names), **dict.fromkeys(frames.dropped, "")}
    found = with_frames_renamed(replace(found, parameters=kept), names_now)
    return replace(found, digest=digest(found))


def _check(robot: Robot, found: Robot, frames: Frames) -> None:
    """Compare every frame at one joint vector with 50 digits: a conversion changes no pose."""
    q = [0.37 + 0.11 * number for number in range(robot.dof)]
    before, after = frames_mp(robot, q), frames_mp(found, q)
    pairs = [*frames.names, *((frame.name, frame.name) for frame in robot.frames)]
    pairs += [] if robot.is_tree else [(TOOL, TOOL)]
    with mpmath.workdps(DIGITS):
        scale = 1 + max(abs(entry) for matrix in before.values() for entry in matrix)
        moved = [(old, max(abs(entry) for entry in before[old] - after[new])) for old, new in pairs]
    for old, difference in moved:
        if difference > _MOST * scale:
            raise KinegenError(
                f"robot {robot.name}: the conversion moves frame {old} by {float(difference):.2g}; please report this"
            )
