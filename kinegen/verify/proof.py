"""The proof of a build: every way to call what was emitted, against the reference."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen.ir.lower import program_of
from kinegen.ir.program import Program
from kinegen.outputs import (
    COMPLETE_INVERSE,
    INVERSE_TRACKER,
    INVERSES,
    SOLVERS,
    Array,
    Kind,
    Quantity,
)
from kinegen.robot.extent import reach
from kinegen.robot.model import Robot
from kinegen.verify.agreement import JACOBIANS, ByDifferences, by_adjoint
from kinegen.verify.calls import Called, require_same_bits
from kinegen.verify.compared import Judge, Store, compare
from kinegen.verify.comparison import Comparison, Proof
from kinegen.verify.expectation import expect
from kinegen.verify.inverses import attempt_of
from kinegen.verify.known import PLACES, Known
from kinegen.verify.moved import move_parameters, parameter_sets
from kinegen.verify.samples import proof_samples, singular_samples, vector_samples
from kinegen.verify.subjects import FORMS
from kinegen.verify.usage import compare_usage
from kinegen.verify.varied import Alternating, require_varied
from kinegen.verify.varied_inverses import require_varied_batches
from kinegen.verify.ways import DTYPES, Arrays, Way, results_of, ways_to_call

FloatArray = NDArray[np.float64]

Programs = Mapping[Quantity, Program]

MOVED_POSES = 1024
"""Joint vectors that are tried with other values of the runtime parameters."""

NUMBERS = 200_000
"""Kernels with large results are tried at about as many joint vectors as give so many numbers."""

EXACT_NUMBERS = 3000
"""The same in 50 digits, where what a number costs grows with the number of joints."""

HELD = 2**23
"""So many numbers at most are held of the transforms of a chain and their derivatives."""

LAW_POSES = 24
"""Singular joint vectors times joints, and as many others, at which Jacobians are held against differences."""

FEWEST = 4
"""Joint vectors are not left out beyond this."""


def prove(robot: Robot, package: ModuleType, quantities: tuple[Quantity, ...], reals: tuple[str, ...]) -> Proof:
    """Compare a generated package with the reference in every way it can be called.

    Args:
        robot: The robot.
        package: Its generated package, imported.
        quantities: The quantities it was built for.
        reals: Its number types, `double` and `float`.

    Returns:
        The comparisons; see `Proof.require`.
    """
    inverses = tuple(each for each in quantities if each.kind in INVERSES or each in SOLVERS)
    quantities = tuple(each for each in quantities if each not in inverses)
    samples = proof_samples(robot)
    programs = {quantity: program_of(robot, quantity) for quantity in quantities}
    comparisons = _compare_ways(robot, package, programs, reals, samples)
    if robot.runtime_parameters:
        moved, values = move_parameters(robot)
        others = _compare_ways(moved, package, programs, reals, samples[-MOVED_POSES:], values)
        comparisons += [with_parameters(other) for other in others]
    if all(comparison.holds for comparison in comparisons):
        comparisons += compare_usage(robot, package, programs, reals)
    if "double" in reals:
        comparisons += _compare_exactly(robot, package, programs)
        comparisons += _compare_laws(robot, package, programs)
    counts: list[str] = []
    for quantity, real in itertools.product(inverses, reals):
        if quantity == COMPLETE_INVERSE and real != reals[0]:
            continue  # it computes in double, whatever the others do
        attempt = attempt_of(quantity)
        found, told = attempt(robot, package, quantity, real, None)
        counts += [told] * (real == reals[0])
        comparisons += found
        if robot.runtime_parameters:
            moved, values = move_parameters(robot)
            others, _ = attempt(moved, package, quantity, real, values)
            comparisons += [with_parameters(other) for other in others]
            has_batches = quantity.kind is not Kind.AXIS_INVERSE and quantity != INVERSE_TRACKER
            if has_batches and all(comparison.holds for comparison in comparisons):
                require_varied_batches(robot, package, quantity, real)
    return Proof(reach(robot), tuple(comparisons), tuple(counts))


def with_parameters(comparison: Comparison) -> Comparison:
    """A comparison with other values of the runtime parameters, which counts in a row of its own."""
    row = f"{comparison.row.partition(',')[0]}, other parameters" if comparison.row else ""
    return replace(comparison, target=f"{comparison.target}, other parameters", row=row)


def _compare_ways(
    robot: Robot,
    package: ModuleType,
    programs: Programs,
    reals: tuple[str, ...],
    samples: FloatArray,
    parameters: tuple[float, ...] | None = None,
) -> list[Comparison]:
    comparisons = []
    for real in reals:
        store = Store(robot, DTYPES[real], exact=False)
        for quantity, program in programs.items():
            ways = ways_to_call(package, quantity, real, parameters)
            inputs, found, compared = compare_kernel(robot, program, ways, real, store, samples)
            comparisons += compared
            if parameters is None and all(comparison.holds for comparison in compared):
                for way, results in zip(ways, found, strict=True):
                    if way.is_plain:
                        way.select()
                        require_same_bits(robot, quantity, way.target, Called(way.kernel, None, inputs, results))
                        if robot.runtime_parameters:
                            sets = parameter_sets(robot)
                            require_varied(
                                robot, quantity, way.target, Alternating(way.kernel, package.Params, sets, inputs)
                            )
    return comparisons


def compare_kernel(
    robot: Robot, program: Program, ways: Sequence[Way], real: str, store: Store, samples: FloatArray
) -> tuple[Arrays, list[Arrays], list[Comparison]]:
    """Compare a kernel with the reference in some ways of calling it.

    Args:
        robot: The robot, with the values of the runtime parameters that are tried.
        program: What the kernel was printed from.
        ways: The ways, all of the same kernel.
        real: Its number type.
        store: The reference.
        samples: Joint vectors (N, dof), of which kernels with large results get a part.

    Returns:
        The inputs, and for each way the results and the comparison.
    """
    quantity, kernel = program.quantity, ways[0].kernel
    points = held(robot, quantity, samples)
    points = points if quantity.kind in PLACES else _fewer(points, kernel.results, NUMBERS)
    inputs, expectation = store.expect(quantity, kernel.inputs, points)
    judge = Judge(expectation, program, real)
    found = [way.call(inputs) for way in ways]
    compared = [judge.compare(way.target, results, way.row) for way, results in zip(ways, found, strict=True)]
    return inputs, found, compared


def _compare_exactly(robot: Robot, package: ModuleType, programs: Programs) -> list[Comparison]:
    """The double kernels against 50 digits, which shows their own error and not the reference's rounding."""
    comparisons = []
    store = Store(robot, DTYPES["double"], exact=True)
    places = vector_samples(robot)
    others = np.concatenate([singular_samples(robot), places])
    for quantity in programs:
        kernel = getattr(package, quantity.function)
        points = (
            places if quantity.kind in PLACES else _fewer(others, kernel.results, EXACT_NUMBERS // max(1, robot.dof))
        )
        inputs, expectation = store.expect(quantity, kernel.inputs, points)
        judge = Judge(expectation, programs[quantity], "double")
        comparisons.append(judge.compare(f"{_language(kernel)}, 50 digits", results_of(kernel, None, inputs)))
    return comparisons


def _compare_laws(robot: Robot, package: ModuleType, programs: Programs) -> list[Comparison]:
    """Jacobians against differences of poses, and against each other."""
    comparisons = []
    poses = max(1, LAW_POSES // max(1, robot.dof))
    points = np.concatenate([singular_samples(robot)[:poses], vector_samples(robot)[-poses:]])
    known, results, limits = Known(robot, {"q": points}), {}, {}
    by_differences = ByDifferences(robot, {"q": points}, exact=True)
    for quantity in [each for each in programs if each.kind in JACOBIANS]:
        kernel = getattr(package, quantity.function)
        results[quantity] = results_of(kernel, None, (points,))
        target = f"{_language(kernel)}, differences"
        judge = Judge(expect(by_differences, quantity), programs[quantity], "double")
        comparisons.append(judge.compare(target, results[quantity]))
        limits[quantity] = judge.limits(target)
    for quantity, expectation, found, allowed in by_adjoint(known, results, limits):
        target = f"{_language(getattr(package, quantity.function))}, adjoint"
        comparisons.append(replace(compare(expectation, target, found, allowed, "double"), quantity=quantity))
    return comparisons


def _language(kernel: Any) -> str:
    return "C double" if kernel.backend == "c" else "NumPy double"


def _fewer(points: FloatArray, results: Sequence[Array], numbers: int) -> FloatArray:
    """Every second joint vector, or fourth and so on, for kernels with large results."""
    size = sum(math.prod(result.shape) for result in results)
    stride = 1
    while len(points) * size > 2 * stride * numbers and len(points) > FEWEST * stride:
        stride *= 2
    return points[::stride]


def held(robot: Robot, quantity: Quantity, points: FloatArray) -> FloatArray:
    """Every second joint vector, or fourth and so on, for robots of many rows, so that the reference stays small."""
    order = 0 if quantity.kind in PLACES or quantity.kind in FORMS else 2 if quantity.kind is Kind.HESSIAN else 1
    numbers = (32 if order else 128) * (1 + len(robot.rows) + len(robot.frames)) * (1 + robot.dof) ** order
    stride = 1
    while len(points) * numbers > 2 * stride * HELD and len(points) > FEWEST * stride:
        stride *= 2
    return points[::stride]
