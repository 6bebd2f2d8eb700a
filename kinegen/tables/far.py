"""Lengths that a table gets because axes are nearly parallel: their common normal is far away.

A table with such lengths is exact, but a kernel adds them up in numbers of 16 digits. `to_convention` reports them
from a thousand times the robot's own lengths on, and refuses tables in which they cost half of a double's digits.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from kinegen.errors import KinegenError
from kinegen.robot.model import Convention, Robot, StepKind
from kinegen.tables.numbers import MP, value_of
from kinegen.tables.steps import Steps, row_steps

_FAR = 1e3
_TOO_FAR = 1e8
"""Multiples of the robot's largest length."""


def far_lengths(robot: Robot, found: Robot) -> tuple[str, ...]:
    """The rows whose lengths are far greater than the robot's.

    Args:
        robot: The robot as it was.
        found: The same robot as a table.

    Returns:
        One line for each such row.

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
    """Everything that has lengths, from the base to the tool."""
    yield "base", robot.base
    yield from ((f"row {row.name}", row_steps(row)) for row in robot.rows)
    yield "tool", robot.tool


def _longest(steps: Steps, values: dict[str, Any]) -> Any:
    """The longest shift where all joints are at zero."""
    shifts = (step.value for step in steps if not step.kind.is_rotation)
    return max((abs(value_of(each, values)) for each in shifts), default=MP.mpf(0))


def _apart(steps: Steps, values: dict[str, Any]) -> Any:
    """How far the twists are from half turns; those that are half turns do not count."""
    twists = [value_of(step.value, values) for step in steps if step.kind is StepKind.RX]
    distances = (abs(twist - MP.pi * MP.nint(twist / MP.pi)) for twist in twists)
    return min((each for each in distances if each > 0), default=MP.inf)
