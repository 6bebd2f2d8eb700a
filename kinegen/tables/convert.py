"""A robot in another convention, with every pose kept."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import mpmath

from kinegen.errors import KinegenError
from kinegen.reference import DIGITS, frames_mp
from kinegen.robot.digest import digest
from kinegen.robot.expressions import Expression, names
from kinegen.robot.model import TOOL, Convention, Robot, Row
from kinegen.tables.cells import cells_of
from kinegen.tables.far import far_lengths
from kinegen.tables.frames import Frames, frames_of, neat
from kinegen.tables.numbers import value_of
from kinegen.tables.place import Placed, place
from kinegen.tables.poses import Values
from kinegen.tables.slide import slide
from kinegen.tables.steps import row_steps

TARGETS = (Convention.STANDARD, Convention.MODIFIED, Convention.ETS)

MOST_ROWS = 256

_MOST = 1e-30
"""How far a pose may move, as a share of the largest length: axes that are nearly parallel meet far away, where the 50
digits to which numbers are rounded count for less."""


@dataclass(frozen=True, slots=True)
class Converted:
    """A robot in another convention.

    Attributes:
        robot: The same robot.
        free: What could have been chosen otherwise, one line each: between which joints, and what.
        rounded: Places where numbers are rounded to 50 digits, because no expression of a robot file is exact.
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
    values = Values(
        tuple((each.name, value_of(each.value, {})) for each in robot.parameters),
        frozenset(each.name for each in robot.runtime_parameters),
    )
    cells = cells_of(robot)
    sliding = slide(cells, values)
    placed = place(robot, cells, values, convention)
    if len(placed.rows) > MOST_ROWS:
        raise KinegenError(f"the {convention} table has {len(placed.rows)} rows (at most {MOST_ROWS})")
    frames = frames_of(robot, cells, placed, values)
    found = _robot(robot, placed, frames, values, convention)
    _check(robot, found, frames)
    far = far_lengths(robot, found)
    free = (*(f"{cells.cells[number].name}: {line}" for number, line in sliding.items()), *placed.free)
    lost = {each.name for each in robot.parameters} - {each.name for each in found.parameters}
    gone = tuple(each.name for each in robot.parameters if each.name in lost)
    return Converted(found, free, tuple(placed.rounded), frames.names, frames.dropped, gone, far)


def _stated(robot: Robot, convention: Convention) -> Convention:
    """The convention of the file: rows that are elementary sequences leave it as it is."""
    return robot.convention if convention is Convention.ETS else convention


def _elementary(robot: Robot) -> Converted:
    """Row by row, as the conventions are defined; all frames stay where they are."""
    rows = tuple(
        replace(row, convention=Convention.ETS, alpha=None, a=None, d=None, theta=None, beta=None, steps=row_steps(row))
        for row in robot.rows
    )
    found = replace(robot, rows=rows)
    return Converted(replace(found, digest=digest(found)), frames=tuple((row.name, row.name) for row in rows))


def _robot(robot: Robot, placed: Placed, frames: Frames, values: Values, convention: Convention) -> Robot:
    """The new robot, without the parameters that no entry uses."""
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
    used = {name for expression in _expressions(found) for name in names(expression)}
    kept = tuple(each for each in robot.parameters if each.name in used or robot.actuators.readings)
    found = replace(found, parameters=kept)
    return replace(found, digest=digest(found))


def _expressions(robot: Robot) -> Iterator[Expression]:
    for row in robot.rows:
        yield from _entries(row)
    for steps in (robot.base, robot.tool, *(frame.steps for frame in robot.frames)):
        yield from (step.value for step in steps)


def _entries(row: Row) -> Iterator[Expression]:
    yield from (entry for entry in (row.alpha, row.a, row.d, row.theta) if entry is not None)


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
