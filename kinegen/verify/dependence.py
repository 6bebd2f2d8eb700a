"""Which results depend on which entry of an input: found out from the reference, which shares nothing with the kernels.

In: a robot, a quantity, inputs. Out: for each entry and result, which numbers move when the entry does. Sines make NaN
of an angle that has no value, and lengths do not; a joint may be in both, as that of a screw is, so what depends on it
by its sine is asked for as well.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction

import numpy as np

from kinegen.model.expression_nodes import Expression, Name, add, number, substitute
from kinegen.model.expression_parser import evaluate
from kinegen.model.expression_values import FLOAT64
from kinegen.model.outputs import Array, Quantity
from kinegen.model.robot import Parameter, Robot, Row, shifting
from kinegen.verify.expected_results import subjects
from kinegen.verify.reference_cache import Numbers, ReferenceResults, quantity_frames

MOVED = 0.015625
"""What is added to an entry, to see what depends on it."""

_ROUNDED = 1e-13
"""What is added to all entries, to see which results are decided by rounding."""

_STILL = 1e-9
"""Of numbers that move less, relative to the largest, nothing is said: rounding may have moved them."""

_JUMPS = 1e-6
"""Numbers of an orientation jump where it is nearer to a singularity, or to a change of sign."""

NOT, PERHAPS, SURELY = range(3)
"""Whether a number depends on an entry."""

Entry = tuple[str, tuple[int, ...]]
"""An entry of an input: the name of the array, and the place in it."""


def dependence(
    robot: Robot,
    quantity: Quantity,
    results: Sequence[Array],
    values: Mapping[str, Numbers],
    entries: Sequence[Entry],
) -> list[list[Numbers]]:
    """Returns for each entry and each result, whether each number of one configuration depends on the entry.

    `values`: its inputs by name, N configurations each. Arrays of `NOT`, `PERHAPS` and `SURELY`. What rounding moves as
    well is not sure, and neither are the numbers of an orientation where these jump: of one that is singular
    everywhere, rounding decides how two angles share their sum.
    """
    if not entries:
        return []
    found = [_dependence(each, quantity, results, values, entries) for each in variants(robot)]
    return [merged(each) for each in zip(*found, strict=True)]


def _dependence(
    robot: Robot,
    quantity: Quantity,
    results: Sequence[Array],
    values: Mapping[str, Numbers],
    entries: Sequence[Entry],
) -> list[list[Numbers]]:
    """Returns the same with the values of the parameters as they are."""
    usual = Usual(robot, quantity, results, values)
    rounded = returned(robot, quantity, results, {name: value + _ROUNDED for name, value in values.items()})
    stacked = {
        name: np.concatenate([moved_at(value, place) if name == other else value for other, place in entries])
        for name, value in values.items()
    }
    moved = [found.reshape(len(entries), -1, *found.shape[1:]) for found in returned(robot, quantity, results, stacked)]
    return [usual.grades([each[index] for each in moved], rounded) for index in range(len(entries))]


def dependence_by_sine(
    robot: Robot, quantity: Quantity, results: Sequence[Array], values: Mapping[str, Numbers], joint: int
) -> list[Numbers] | None:
    """Returns the same for a joint variable whose lengths stay where they are; None for one that is in no length.

    `values`: its inputs by name, N configurations each.
    """
    name = robot.variables[joint].name
    if name not in shifting(robot):
        return None
    held = replace(robot, rows=tuple(_held(row, name) for row in robot.rows))
    after = returned(held, quantity, results, {**values, "q": moved_at(values["q"], (joint,))})
    return Usual(robot, quantity, results, values).grades(after)


class Usual:
    """What a kernel must return for its inputs as they are, to see what moves when something else is given.

    Args:
        values: Its inputs by name, N configurations each.
    """

    def __init__(
        self, robot: Robot, quantity: Quantity, results: Sequence[Array], values: Mapping[str, Numbers]
    ) -> None:
        self._found = returned(robot, quantity, results, values)
        self._subjects = subjects(quantity)
        self._still = _still(robot, quantity, results, values)

    def grades(self, after: Sequence[Numbers], rounded: Sequence[Numbers] | None = None) -> list[Numbers]:
        """Returns which numbers of one configuration move; readings that are impossible say nothing.

        `after`: what the kernel must return after an entry was moved; `rounded`: the same after all entries were moved
        by as much as rounding does. For each result an array of `NOT`, `PERHAPS` and `SURELY`.
        """
        found = []
        several = zip(self._subjects, self._found, after, rounded or self._found, self._still, strict=True)
        for subject, one, other, third, still in several:
            is_sure = still & _apart(one, other, subject.turns) & ~_apart(one, third, subject.turns)
            found.append(np.where(is_sure, SURELY, np.where((one != other).any(axis=0) | ~still, PERHAPS, NOT)))
        return found


def _still(robot: Robot, quantity: Quantity, results: Sequence[Array], values: Mapping[str, Numbers]) -> list[Numbers]:
    """Returns for each result, which numbers of a configuration are nowhere right beside a jump."""
    known, frames = ReferenceResults(robot, values), quantity_frames(robot, quantity)
    found = []
    for subject, array in zip(subjects(quantity), results, strict=True):
        margins = [1.0 if subject.margin is None else subject.margin(known, frame).min(initial=1) for frame in frames]
        shape = (len(frames), math.prod(array.shape) // len(frames))
        found.append(np.broadcast_to((np.array(margins) > _JUMPS)[:, None], shape).reshape(array.shape))
    return found


def _apart(first: Numbers, second: Numbers, turns: bool) -> Numbers:
    """Returns which numbers differ by more than rounding; of angles, whole turns do not count."""
    size = max(1.0, float(np.nanmax(np.abs(first), initial=0.0)))
    off = np.abs(first - second)
    off = np.abs(off - 2 * np.pi * np.round(off / (2 * np.pi))) if turns else off
    apart: Numbers = (off > _STILL * size).any(axis=0)
    return apart


def returned(
    robot: Robot, quantity: Quantity, results: Sequence[Array], values: Mapping[str, Numbers]
) -> list[Numbers]:
    """Returns what the kernel must return for inputs by name, in the shapes in which it does."""
    known, frames = ReferenceResults(robot, values), quantity_frames(robot, quantity)
    found = []
    for subject, array in zip(subjects(quantity), results, strict=True):
        numbers = [np.asarray(subject.returned(known, frame)) for frame in frames]
        found.append(np.stack(numbers, axis=1).reshape(known.count, *array.shape))
    return found


def variants(robot: Robot) -> tuple[Robot, ...]:
    """Returns the robot, and beside it the same with all its runtime parameters moved, each by another amount."""
    names = [parameter.name for parameter in robot.runtime_parameters]
    moved = {name: MOVED * (1 + 0.375 * place) for place, name in enumerate(names)}
    return (robot, with_moved(robot, moved)) if names else (robot,)


def merged(found: Sequence[list[Numbers]]) -> list[Numbers]:
    """What depends with the values of the parameters as they are, and what perhaps does since it would with others."""
    first, *others = found
    if not others:
        return first
    (moved,) = others
    return [np.where((one == NOT) & (other != NOT), PERHAPS, one) for one, other in zip(first, moved, strict=True)]


def with_moved(robot: Robot, amounts: Mapping[str, float]) -> Robot:
    """Returns the robot with some runtime parameters moved by some amounts."""
    parameters = tuple(
        replace(parameter, value=number(Fraction(value_of(parameter) + amounts[parameter.name])))
        if parameter.name in amounts
        else parameter
        for parameter in robot.parameters
    )
    return replace(robot, parameters=parameters)


def value_of(parameter: Parameter) -> float:
    """Returns the value of a parameter."""
    return float(evaluate(parameter.value, {}, FLOAT64))


def moved_at(values: Numbers, place: tuple[int, ...]) -> Numbers:
    """Inputs with one entry of each configuration moved."""
    found = values.copy()
    for row in found:
        row[place] += MOVED
    return found


def _held(row: Row, name: str) -> Row:
    """A row whose lengths are, after a variable has moved, what they were before; they grow with it as before."""
    before = {name: add(Name(name), number(Fraction(-MOVED)))}

    def held(entry: Expression | None) -> Expression | None:
        return None if entry is None else substitute(entry, before)

    steps = tuple(
        step if step.kind.is_rotation else replace(step, value=substitute(step.value, before)) for step in row.steps
    )
    return replace(row, a=held(row.a), d=held(row.d), steps=steps)
