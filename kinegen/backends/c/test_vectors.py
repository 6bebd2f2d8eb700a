"""The data of test vectors, which the caller computes with 50 digits, and how far results may be from it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction

from kinegen.backends.accuracy import NUMBER_TYPES, bound_over
from kinegen.backends.bundle import RobotPrograms, provenance
from kinegen.backends.inverse import inverse_of
from kinegen.backends.routines import SINCOS
from kinegen.backends.scalar_types import ScalarType
from kinegen.ir.error_analysis import Ranges, has_rules
from kinegen.ir.program import Program
from kinegen.model.joint_bounds import reach
from kinegen.model.outputs import Array, Quantity
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass

Row = tuple[Fraction, ...]

LAST_ROW: Row = (Fraction(0), Fraction(0), Fraction(0), Fraction(1))
"""The constant last row of a pose."""

NOTHING: Row = (Fraction(0),) * 4
"""What is accepted of its entries."""


@dataclass(frozen=True, slots=True)
class Expected:
    """Holds what one result of a kernel must be.

    Attributes:
        rows: For each set of inputs, or for the first of them, the entries of the output array in order, without the
            constant last row of a matrix.
        turns: Whether they are angles, of which whole turns do not matter.
        spreads: For each number type, how far rounding may move each entry at these inputs, in the unit of the entry.
    """

    rows: tuple[Row, ...]
    turns: bool
    spreads: Mapping[ScalarType, Row]


@dataclass(frozen=True, slots=True)
class Vectors:
    """Inputs and what the kernels must return for them.

    Attributes:
        inputs: Rows of each input by name, joint vectors `q` among them; entries that floats hold exactly.
        expected: For each quantity its results in order.
        pairs: Angles that the kernels take, which floats hold exactly, each with its sine and cosine.
        targets: Poses that an inverse has to solve, each with the joint vector that it comes from; none without one.
        given: What it is given besides, a row for each target; none where there is no redundancy.
    """

    inputs: Mapping[str, tuple[Row, ...]]
    expected: Mapping[Quantity, tuple[Expected, ...]]
    pairs: tuple[tuple[Fraction, Fraction, Fraction], ...]
    targets: tuple[tuple[Row, Row], ...]
    given: tuple[Row, ...] = ()


def whole(array: Array, row: Sequence[Fraction], last: Row = LAST_ROW) -> Row:
    """Adds the last rows of matrices to the computed entries of a result: those of a pose, or `NOTHING`."""
    if not array.is_pose:
        return tuple(row)
    step = array.size // array.blocks
    return tuple(each for block in range(array.blocks) for each in (*row[block * step : (block + 1) * step], *last))


SLACK = 2
"""Accepted are so many times the proven errors: a board's own sine and cosine may be a little worse than ours."""


def accepted_differences(
    kernels: RobotPrograms, program: Program, vectors: Vectors, real: ScalarType
) -> tuple[Row, ...]:
    """Computes the largest accepted difference of each entry: what is proven of it, or what rounding does there.

    A length of a robot in millimetres is a large number and an entry of a rotation is not, so every entry is measured
    by its own error. The smaller of two answers counts. The proven bound holds in the box of all vectors; it has no
    rules for roots and arc tangents, and gets wide for derivatives of long chains. The spread of rounding at the
    vectors themselves, which the caller computes, follows the condition of each entry.

    Returns:
        For each result with numbers a row, in the units of its entries; none is zero.
    """
    expected = [each for each in vectors.expected[program.quantity] if each.rows[0]]
    proven = _proven(kernels, program, vectors, real)
    # Bounds come in one row for all results.
    rows, start = [], 0
    for each in expected:
        size = len(each.rows[0])
        errors = proven[start : start + size]
        limits = zip(errors, each.spreads[real], _roundings(each, real), strict=True)
        rows.append(tuple(_smaller(error, spread) + rounding for error, spread, rounding in limits))
        start += size
    return tuple(rows)


def _smaller(proven: float, spread: Fraction) -> Fraction:
    return min(SLACK * Fraction(proven), spread) if math.isfinite(proven) else spread


def accepted_pair_error(real: ScalarType) -> Fraction:
    """Returns the largest accepted error of a sine or cosine."""
    return SLACK * Fraction(SINCOS[real].absolute_error)


def _proven(kernels: RobotPrograms, program: Program, vectors: Vectors, real: ScalarType) -> tuple[float, ...]:
    """Returns the proven errors for the box of all test vectors; infinite where there are no rules."""
    if not has_rules(program):
        return (math.inf,) * sum(array.size for array in program.signature.results)
    # The box of all vectors, for which the bound is proven.
    columns = [
        column
        for array in program.signature.inputs
        for column in zip(*(row[: array.size] for row in vectors.inputs[array.name]), strict=True)
    ]
    names = (parameter.name for parameter in kernels.robot.runtime_parameters)
    defaults = dict(zip(names, kernels.defaults, strict=True))
    ranges = Ranges(
        joints=tuple((min(column), max(column)) for column in columns),
        parameters=tuple(defaults[name] for name in program.parameters),
    )
    return bound_over(program, ranges, NUMBER_TYPES[real]).entries


def _roundings(expected: Expected, real: ScalarType) -> Row:
    """Returns what rounding the expected entries costs, and at least what it costs for a small number: none is zero."""
    unit = Fraction(1, 2 ** NUMBER_TYPES[real].precision)
    return tuple(unit * max(Fraction(1, 2**10), *map(abs, column)) for column in zip(*expected.rows, strict=True))


Write = Callable[[Array, Sequence[Fraction]], str]
"""Writes the numbers of an array as a language does."""


@dataclass(frozen=True, slots=True)
class Checked:
    """Holds the check of one result: what it must be for each vector, and what is accepted in each number type."""

    array: Array
    index: int
    rows: tuple[str, ...]
    accepted: tuple[str, ...]
    turns: bool

    @property
    def size(self) -> int:
        """Its numbers, last rows of matrices among them."""
        return self.array.blocks * self.array.stored


@dataclass(frozen=True, slots=True)
class Tested:
    """Holds the test of one function at the first `count` vectors."""

    program: Program
    count: int
    results: tuple[Checked, ...]

    @property
    def has_inputs(self) -> bool:
        """Returns whether any input holds numbers."""
        return any(array.size for array in self.program.signature.inputs)

    @property
    def sized(self) -> tuple[Checked, ...]:
        """The results that hold numbers."""
        return tuple(each for each in self.results if each.array.size)


@dataclass(frozen=True, slots=True)
class Targets:
    """Holds the test of an inverse.

    Attributes:
        inverse: Its function; empty where there is a search alone.
        joints: The joint vectors that poses come from.
        given: What is given besides, as a row for each target.
        turns: A whole turn of each joint, 0 for one that shifts.
        extents: What each joint is measured by; see `extents_of`.
    """

    inverse: str
    poses: tuple[str, ...]
    joints: tuple[str, ...]
    given: tuple[str, ...]
    given_count: int
    turns: str
    extents: str


@dataclass(frozen=True, slots=True)
class VectorTests:
    """Holds the tests of a package: inputs, their values by name, functions, and targets of an inverse."""

    robot: str
    provenance: str
    inputs: tuple[Array, ...]
    rows: Mapping[str, tuple[str, ...]]
    tests: tuple[Tested, ...]
    targets: Targets | None


def vector_tests(
    kernels: RobotPrograms,
    vectors: Vectors,
    reals: Sequence[ScalarType],
    write: Write,
    write_result: Write | None = None,
) -> VectorTests:
    """Writes the tests of a package in the number types that one file tests.

    `write_result` is for results, if that is another way.
    """
    checked = [program for program in kernels.programs if program.quantity in vectors.expected]
    arrays = {array.name: array for program in checked for array in program.signature.inputs}
    return VectorTests(
        robot=kernels.robot.name,
        provenance=provenance(kernels.robot),
        inputs=tuple(arrays.values()),
        rows={name: tuple(write(array, row) for row in vectors.inputs[name]) for name, array in arrays.items()},
        tests=tuple(_tested(kernels, program, vectors, reals, write_result or write) for program in checked),
        targets=targets_of(kernels, vectors, write) if vectors.targets else None,
    )


def _tested(
    kernels: RobotPrograms, program: Program, vectors: Vectors, reals: Sequence[ScalarType], write: Write
) -> Tested:
    # Some results have fewer vectors than others.
    expected = vectors.expected[program.quantity]
    count = min(len(each.rows) for each in expected)
    limits = [iter(accepted_differences(kernels, program, vectors, real)) for real in reals]
    results = []
    for index, (array, each) in enumerate(zip(program.signature.results, expected, strict=True)):
        rows = tuple(write(array, whole(array, row)) for row in each.rows[:count])
        # Arrays without numbers have no limits.
        own = [whole(array, next(found), NOTHING) if array.size else () for found in limits]
        rounded = [[Fraction(real.round(entry)) for entry in row] for real, row in zip(reals, own, strict=True)]
        results.append(Checked(array, index, rows, tuple(write(array, row) for row in rounded), each.turns))
    return Tested(program, count, tuple(results))


def targets_of(kernels: RobotPrograms, vectors: Vectors, write: Write) -> Targets:
    """Writes the targets of an inverse, in closed form or by a search."""
    solved, robot = inverse_of(kernels), kernels.robot
    pose = Array("base_T_tool", (4, 4), is_pose=True)

    def row(numbers: Sequence[Fraction]) -> str:
        return write(Array("q", (len(numbers),)), numbers)

    turns = solved[1].turns if solved else ()
    return Targets(
        inverse=solved[0].quantity.function if solved else "",
        poses=tuple(write(pose, target) for target, _ in vectors.targets),
        joints=tuple(row(joints) for _, joints in vectors.targets),
        given=tuple(map(row, vectors.given)),
        given_count=solved[1].given if solved else 0,
        turns=row([Fraction(0 if math.isinf(turn) else turn) for turn in turns]),
        extents=row(extents_of(robot, turns)),
    )


def extents_of(robot: Robot, turns: Sequence[float]) -> list[Fraction]:
    """Returns what errors of joints are measured by: 1 rad, or the reach for a joint that shifts."""
    return [Fraction(reach(robot) if math.isinf(turn) else 1) for turn in turns]
