"""NaN, infinities and far angles in runtime parameters, which go the same way as those in other inputs.

In: a kernel. Out: inputs for `nonnumbers.py`, with the values of the parameters as one more array: a set for each
configuration, of which every second one holds what is no number. So a NaN in the set of one configuration may not reach
another. What depends on a parameter is found out from the reference: a number that moves when the parameter does.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from types import ModuleType
from typing import Any

import numpy as np

from kinegen.ir.program import Operator, Program
from kinegen.outputs import Array
from kinegen.robot.dimension import Dimension
from kinegen.robot.expressions import evaluate, number
from kinegen.robot.floats import FLOATS
from kinegen.robot.model import Robot
from kinegen.verify.known import Numbers
from kinegen.verify.nonnumbers import FAR, MOVED, POINTS, Spoilt, differ, returned
from kinegen.verify.samples import input_samples, vector_samples
from kinegen.verify.ways import Arrays, Way, results_of

_SUMS = Operator.ADD, Operator.SUB, Operator.MUL, Operator.NEG, Operator.SINCOS
"""Of these alone an infinity or a far angle is passed on; below a fraction bar it may give zero."""


def spoil_params(robot: Robot, program: Program, arrays: Sequence[Array], results: Sequence[Array]) -> Spoilt:
    """Put NaN, infinities and far angles into each runtime parameter.

    Args:
        robot: The robot, with runtime parameters.
        program: What the kernel computes, and how.
        arrays: Its inputs.
        results: Its results.

    Returns:
        The inputs, and after them the values of the parameters (N, parameters).
    """
    points = vector_samples(robot)[-POINTS:]
    samples = input_samples(robot, arrays, points)
    values = {name: value.astype(np.float32).astype(np.float64) for name, value in samples.items()}
    usual = np.array([_value(robot, place) for place in range(len(robot.runtime_parameters))], np.float32)
    before = returned(robot, program.quantity, results, values)
    names, is_nan, sets = list[str](), list[bool](), list[Numbers]()
    depends: list[list[Numbers]] = [[] for _ in results]
    for place, (name, kinds) in enumerate(_entries(robot, program)):
        moved = returned(_moved(robot, place), program.quantity, results, values)
        changes = [differ(*pair) for pair in zip(before, moved, strict=True)]
        for word, value in kinds.items():
            spoilt = usual.copy()
            spoilt[place] = value
            # Every configuration stands beside one whose parameters are as they were.
            sets += [np.tile(each, (len(points), 1)) for each in (spoilt, usual)]
            for found, change in zip(depends, changes, strict=True):
                shape = (len(points), *change.shape)
                found += [np.broadcast_to(change, shape), np.zeros(shape, bool)]
            names += [f"{word} in params.{name}"] * len(points)
            names += [f"{word} in the parameters of another configuration"] * len(points)
            is_nan += [True] * (2 * len(points))
    rows = len(names) // len(points)
    inputs = tuple(np.concatenate([values[array.name]] * rows) for array in arrays)
    given = np.concatenate(sets).astype(np.float64)
    # Configurations with and without what is no number alternate, so that they share every tile.
    order = np.arange(len(names)).reshape(-1, 2, len(points)).swapaxes(1, 2).ravel()
    return Spoilt(
        tuple(names[place] for place in order),
        (*(array[order] for array in inputs), given[order]),
        (*(array[order] for array in inputs), np.tile(usual, (len(names), 1)).astype(np.float64)),
        tuple(np.concatenate(found)[order] for found in depends),
        np.array(is_nan, bool),
        np.arange(len(names)) % 2 == 0,
    )


def with_params(package: ModuleType, way: Way) -> Way:
    """A way to call a kernel that takes the values of the parameters (N, parameters) after the other inputs."""

    def along(inputs: Arrays) -> Arrays:
        way.select()
        return results_of(way.kernel, package.Params(*inputs[-1].T), inputs[:-1])

    def one_by_one(inputs: Arrays) -> Arrays:
        found = [
            results_of(way.kernel, package.Params(*map(float, values)), tuple(point))
            for *point, values in zip(*inputs, strict=True)
        ]
        return tuple(np.stack(results) for results in zip(*found, strict=True))

    call: Any = along if way.is_plain else one_by_one
    return replace(way, call=call)


def _entries(robot: Robot, program: Program) -> Iterator[tuple[str, Mapping[str, float]]]:
    """Every parameter with what is put there."""
    is_sum = all(statement.operator in _SUMS for statement in program.statements)
    for parameter in robot.runtime_parameters:
        kinds = {"NaN": np.nan}
        if is_sum and parameter.dimension is Dimension.ANGLE:
            kinds |= {"a positive infinity": np.inf, "a negative infinity": -np.inf, "a far angle": FAR}
        yield parameter.name, kinds


def _value(robot: Robot, place: int) -> float:
    return float(evaluate(robot.runtime_parameters[place].value, {}, FLOATS))


def _moved(robot: Robot, place: int) -> Robot:
    """The robot with one parameter moved."""
    name, value = robot.runtime_parameters[place].name, Fraction(_value(robot, place) + MOVED)
    parameters = tuple(
        replace(parameter, value=number(value)) if parameter.name == name else parameter
        for parameter in robot.parameters
    )
    return replace(robot, parameters=parameters)
