"""One comparison of a kernel with the reference: at usual inputs, and at values beyond the limits."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np

from kinegen.errors import ProofError
from kinegen.ir.program import Program
from kinegen.model.outputs import Array, Kind, Quantity
from kinegen.model.robot import Robot
from kinegen.verify.expectations import Expectation, Limits, expect
from kinegen.verify.invocations import DTYPES, Arrays, Floats, KernelCall, ways_to_call
from kinegen.verify.nan_propagation import FAR, inject_nan, require_spoilt, spoil_params, with_params
from kinegen.verify.records import BEYOND_LIMITS, NUMPY, Comparison, Invocation
from kinegen.verify.reference_cache import ReferenceResults
from kinegen.verify.samples import LARGEST_ANGLE, FloatArray, beyond_limits, input_samples
from kinegen.verify.tolerances import accepted, number_type


class Store:
    """The reference at the inputs of all kernels of one number type, each asked once."""

    def __init__(self, robot: Robot, dtype: Any, *, exact: bool) -> None:
        self._robot, self._dtype, self._exact = robot, dtype, exact
        self._known: dict[Any, ReferenceResults] = {}

    def expect(self, quantity: Quantity, arrays: Sequence[Array], points: FloatArray) -> tuple[Arrays, Expectation]:
        """Returns the inputs of a kernel, and what it must return for them."""
        key = len(points), *(array.name for array in arrays)
        known = self._known.get(key)
        if known is None:
            values = input_samples(self._robot, arrays, points)
            rounded = {name: value.astype(self._dtype).astype(np.float64) for name, value in values.items()}
            known = self._known[key] = ReferenceResults(
                self._robot, rounded, exact=self._exact, unit=float(np.finfo(self._dtype).eps) / 2
            )
        return tuple(known.inputs[array.name].astype(self._dtype) for array in arrays), expect(known, quantity)


class Judge:
    """Compares what kernels return at some inputs with what they must; limits are found once for each number type.

    Args:
        within: Whether the inputs lie where samples are taken from, for which errors are proven.
    """

    def __init__(self, expectation: Expectation, program: Program, real: str, *, within: bool = True) -> None:
        self.expectation, self._program, self._real, self._within = expectation, program, real, within
        self._limits: dict[bool, Limits] = {}
        self._found: dict[bool, tuple[tuple[bytes, ...], Comparison]] = {}

    def limits(self, *, library: bool = False) -> Limits:
        """Returns what is accepted of a kernel; the sines of NumPy, a `library`, are its own."""
        return self._accepted(library=library)

    def compare(self, invocation: Invocation, results: Arrays) -> Comparison:
        """Compare the results of one way of calling.

        The sines of NumPy may be off by more than those of C. Most of its results keep the limits of C all the same;
        its own, which take as long to find, are asked for only where they do not.
        """
        found = self._compare(results, library=False)
        if not found.holds and invocation.language == NUMPY:
            found = self._compare(results, library=True)
        return replace(found, invocation=invocation)

    def _accepted(self, *, library: bool) -> Limits:
        if library not in self._limits:
            kind = number_type(self._real, library=library)
            self._limits[library] = accepted(self.expectation, self._program, kind, within=self._within)
        return self._limits[library]

    def _compare(self, results: Arrays, *, library: bool) -> Comparison:
        """Returns a comparison without its names; of the same bits it is found once."""
        bits, limits = tuple(map(_bits, results)), self._accepted(library=library)
        before, known = self._found.get(library, ((), None))
        if known is None or bits != before:
            known = compare(self.expectation, Invocation("", self._real), results, limits)
            self._found[library] = bits, known
        return known


def _bits(result: Floats) -> bytes:
    """Everything that an array holds, and of what type and shape it is."""
    return f"{result.dtype} {result.shape} ".encode() + result.tobytes()


def compare(expectation: Expectation, invocation: Invocation, results: Arrays, limits: Limits) -> Comparison:
    """Hold the results of a kernel against what it must return. `results`: what it returned, N configurations each."""
    verdict = expectation.judge(results, limits)
    return Comparison(
        invocation=invocation,
        quantity=expectation.quantity,
        poses=expectation.known.count,
        position_error=verdict.position_error,
        rotation_error=verdict.rotation_error,
        position_tolerance=verdict.position_limit,
        rotation_tolerance=verdict.rotation_limit,
        worst=tuple(float(entry) for entry in expectation.known.joints[verdict.row]),
        frame=verdict.frame,
        worst_share=verdict.share,
        compared=verdict.compared,
        uncompared=verdict.uncompared,
        is_zero=verdict.is_zero,
    )


def compare_usage(
    robot: Robot, package: ModuleType, programs: Mapping[Quantity, Program], reals: tuple[str, ...]
) -> list[Comparison]:
    """Compare kernels where the samples of a proof do not reach.

    `programs`: the quantities it was built for, without inverses, and their programs. Returns the comparisons beyond
    the limits. Raises `ProofError` if a result that depends on a NaN is a number, or one that does not is changed by
    it.
    """
    comparisons = []
    for real in reals:
        _require_guard(robot, package, real)
        _require_routines(robot, package, real)
        comparisons += compare_beyond(robot, programs, real, partial(_forms, package, real))
    for quantity, program in programs.items():
        ways = {real: _forms(package, real, quantity) for real in reals}
        require_nans(robot, quantity, ways)
        if robot.runtime_parameters and quantity.kind is not Kind.JOINTS_TO_ACTUATORS:
            kernel = getattr(package, quantity.function)
            spoilt = spoil_params(robot, program, kernel.inputs, kernel.results)
            for real, forms in ways.items():
                for way in forms:
                    require_spoilt(robot, quantity, with_params(package, way), spoilt, str(DTYPES[real]))
    return comparisons


def require_nans(robot: Robot, quantity: Quantity, ways: Mapping[str, Sequence[KernelCall]]) -> None:
    """Refuse a kernel that loses a NaN or spreads it, in any of some ways of calling it.

    `ways`: the ways by number type, all of the same kernel. Raises `ProofError` naming the kernel and what it was
    given.
    """
    if quantity.kind is Kind.JOINTS_TO_ACTUATORS:
        return  # few joint vectors can be brought about, so none can be moved to see what depends on it
    kernel = next(iter(ways.values()))[0].kernel
    spoilt = inject_nan(robot, quantity, kernel.inputs, kernel.results)
    for real, forms in ways.items():
        for way in forms:
            require_spoilt(robot, quantity, way, spoilt, str(DTYPES[real]))


def _require_guard(robot: Robot, package: ModuleType, real: str) -> None:
    """The sine and cosine of the NumPy form end where those of C do."""
    pair = getattr(sys.modules[f"{package.__name__}._numpy"], "_sincos", None)
    if pair is None:
        return
    kind = DTYPES[real].type
    limit = kind(LARGEST_ANGLE[real])
    beyond = np.nextafter(limit, kind(np.inf))
    for angle, is_number in ((limit, True), (beyond, False), (kind(FAR), False), (kind(np.inf), False)):
        for x in (angle, -angle):
            with np.errstate(invalid="ignore"):
                found = pair(np.array([x]))
            wanted = (np.sin(x), np.cos(x)) if is_number else (np.nan, np.nan)
            if not np.allclose(np.concatenate(found), wanted, rtol=0, atol=1e-6, equal_nan=True):
                reason = f"the sine and cosine of {x} in NumPy are {found}, expected {wanted}"
                raise ProofError(f"{robot.name}: {reason}; nothing was written")


def _require_routines(robot: Robot, package: ModuleType, real: str) -> None:
    """The functions of C in the NumPy form, which it takes on request."""
    form = sys.modules[f"{package.__name__}._numpy"]
    kind = DTYPES[real].type
    ends = LARGEST_ANGLE[real] * np.array([-1.0, 1.0, -(2.0**-10), 2.0**-10, 2.0**-20, 0.0])
    x = np.concatenate([ends, np.linspace(-7.0, 7.0, 4001)]).astype(kind)
    y = x[::-1]
    exact = x.astype(np.float64)
    checks = {
        f"_sincos_{real}": ((x,), (np.sin(exact), np.cos(exact))),
        f"_atan2_{real}": ((y, x), (np.arctan2(exact[::-1], exact),)),
    }
    for name, (given, wanted) in checks.items():
        routine = getattr(form, name, None)
        if routine is None:
            continue
        found = np.array(routine(*given)).reshape(-1, len(x))
        off = float(np.max(np.abs(found - np.array(wanted))))
        if not (found.dtype == kind and off <= 4 * float(np.finfo(kind).eps)):
            reason = f"{name} of the NumPy form is off by {off:.1e}"
            raise ProofError(f"{robot.name}: {reason}; nothing was written")


def compare_beyond(
    robot: Robot, programs: Mapping[Quantity, Program], real: str, ways_of: Callable[[Quantity], Sequence[KernelCall]]
) -> list[Comparison]:
    """Compare kernels of joint values beyond the limits. `programs`: the programs of its kernels, without inverses."""
    comparisons = []
    points, store = beyond_limits(robot, real), Store(robot, DTYPES[real], exact=False)
    for quantity, program in programs.items():
        ways = ways_of(quantity)
        kernel = ways[0].kernel
        if kernel.inputs[0].name == "q" and len(points):
            inputs, expectation = store.expect(quantity, kernel.inputs, points)
            judge = Judge(expectation, program, real, within=False)
            comparisons += [
                judge.compare(replace(way.invocation, case=BEYOND_LIMITS), way.call(inputs)) for way in ways
            ]
    return comparisons


def _forms(package: ModuleType, real: str, quantity: Quantity) -> list[KernelCall]:
    """Returns the scalar kernel, the batch in each variant, and NumPy; layouts hold the same numbers."""
    return [way for way in ways_to_call(package, quantity, real) if way.is_plain or not way.is_batch]
