"""The proof of a build: every way to call what was emitted, inverses among them, against the reference."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np

from kinegen.derive.inverse.derive import family_of, size_of
from kinegen.ir.lower import program_of
from kinegen.ir.program import Program
from kinegen.model.dh_conversion.elementary_transforms import chain_of
from kinegen.model.joint_bounds import reach
from kinegen.model.outputs import (
    COMPLETE_INVERSE,
    INVERSE_TRACKER,
    INVERSES,
    NUMERIC_INVERSE,
    REDUNDANCY_RANGE,
    SOLVERS,
    Array,
    Kind,
    Quantity,
)
from kinegen.model.robot import TOOL, Robot
from kinegen.verify.bit_consistency import Called, require_same_bits
from kinegen.verify.closed_form_inverse import Trial, counts_line, try_inverse
from kinegen.verify.compare import Judge, Store, compare, compare_usage
from kinegen.verify.complete_inverse import try_complete
from kinegen.verify.expectations import JACOBIANS, ByDifferences, by_adjoint, expect
from kinegen.verify.expected_results import FORMS
from kinegen.verify.five_axis import try_machine
from kinegen.verify.inverse_tracker import try_tracker
from kinegen.verify.invocations import DTYPES, Arrays, KernelCall, results_of, ways_to_call
from kinegen.verify.isolation import calling
from kinegen.verify.numeric_inverse import try_search
from kinegen.verify.parameter_batches import Alternating, require_varied, require_varied_batches
from kinegen.verify.records import NUMPY, Comparison, Invocation, Proof, solver_comparison
from kinegen.verify.redundancy_range import try_ranges
from kinegen.verify.reference_cache import PLACES, ReferenceResults
from kinegen.verify.samples import (
    FloatArray,
    move_parameters,
    parameter_sets,
    proof_samples,
    singular_samples,
    vector_samples,
)

Values = tuple[float, ...] | None

Attempt = Callable[[Robot, ModuleType, Quantity, str, Values], tuple[list[Comparison], str]]
"""Tries an output of one number type, with other values of the runtime parameters or those of the file. Returns the
comparisons, and in words how much was tried."""


def attempt_of(quantity: Quantity) -> Attempt:
    """Returns what tries an output."""
    return _ATTEMPTS.get(quantity, _solve)


def _solve(
    robot: Robot, package: ModuleType, quantity: Quantity, real: str, values: Values
) -> tuple[list[Comparison], str]:
    attempt = try_machine if quantity.kind is Kind.AXIS_INVERSE else try_inverse
    trials = attempt(robot, package, quantity, real, values)
    told = counts_line(max(trials, key=lambda trial: trial.poses))
    return [inverse_comparison(robot, quantity, trial) for trial in trials], told


def inverse_comparison(robot: Robot, quantity: Quantity, trial: Trial) -> Comparison:
    """Returns what a trial of an inverse comes to."""
    chain = chain_of(robot, quantity)
    size = reach(robot) if quantity.kind is Kind.AXIS_INVERSE else size_of(chain, family_of(chain))
    errors, accepted = (trial.position_error, trial.rotation_error), (trial.accepted * size, trial.accepted)
    way, frame = trial.invocation, quantity.way or TOOL
    return solver_comparison(way, "there and back", quantity, trial.poses, errors, accepted, trial.worst, frame)


_ATTEMPTS: dict[Quantity, Attempt] = {
    NUMERIC_INVERSE: try_search,
    COMPLETE_INVERSE: try_complete,
    REDUNDANCY_RANGE: try_ranges,
    INVERSE_TRACKER: try_tracker,
}
"""What tries an output without a program."""


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
        calling(f"{'C' if package.backend == 'c' else 'NumPy'} {real} {quantity}")
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
    """Returns a comparison with other values of the runtime parameters, which counts in a row of its own."""
    return replace(comparison, invocation=replace(comparison.invocation, is_moved=True))


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
    robot: Robot, program: Program, ways: Sequence[KernelCall], real: str, store: Store, samples: FloatArray
) -> tuple[Arrays, list[Arrays], list[Comparison]]:
    """Compare a kernel with the reference in some ways of calling it.

    `robot`: the robot, with the values of the runtime parameters that are tried; `samples`: joint vectors (N, dof), of
    which kernels with large results get a part. Returns the inputs, and for each way the results and the comparison.
    """
    quantity, kernel = program.quantity, ways[0].kernel
    points = held(robot, quantity, samples)
    points = points if quantity.kind in PLACES else _fewer(points, kernel.results, NUMBERS)
    inputs, expectation = store.expect(quantity, kernel.inputs, points)
    judge = Judge(expectation, program, real)
    found = [way.call(inputs) for way in ways]
    compared = [judge.compare(way.invocation, results) for way, results in zip(ways, found, strict=True)]
    return inputs, found, compared


def _compare_exactly(robot: Robot, package: ModuleType, programs: Programs) -> list[Comparison]:
    """Returns the double kernels against 50 digits, which shows their own error and not the reference's rounding."""
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
        comparisons.append(judge.compare(_of_double(kernel, "50 digits"), results_of(kernel, None, inputs)))
    return comparisons


def _compare_laws(robot: Robot, package: ModuleType, programs: Programs) -> list[Comparison]:
    """Jacobians against differences of poses, and against each other."""
    comparisons = []
    poses = max(1, LAW_POSES // max(1, robot.dof))
    points = np.concatenate([singular_samples(robot)[:poses], vector_samples(robot)[-poses:]])
    known, results, limits = ReferenceResults(robot, {"q": points}), {}, {}
    by_differences = ByDifferences(robot, {"q": points}, exact=True)
    for quantity in [each for each in programs if each.kind in JACOBIANS]:
        kernel = getattr(package, quantity.function)
        results[quantity] = results_of(kernel, None, (points,))
        judge = Judge(expect(by_differences, quantity), programs[quantity], "double")
        comparisons.append(judge.compare(_of_double(kernel, "differences"), results[quantity]))
        limits[quantity] = judge.limits(library=kernel.backend != "c")
    for quantity, expectation, found, allowed in by_adjoint(known, results, limits):
        invocation = _of_double(getattr(package, quantity.function), "adjoint")
        comparisons.append(replace(compare(expectation, invocation, found, allowed), quantity=quantity))
    return comparisons


def _of_double(kernel: Any, case: str) -> Invocation:
    return Invocation("C" if kernel.backend == "c" else NUMPY, "double", case=case)


def _fewer(points: FloatArray, results: Sequence[Array], numbers: int) -> FloatArray:
    """Returns every second joint vector, or fourth and so on, for kernels with large results."""
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
