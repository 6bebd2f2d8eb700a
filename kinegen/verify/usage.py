"""What a kernel does beyond the usual inputs: joint values beyond the limits, and numbers that are none.

In: a package. Out: comparisons with the reference beyond the limits; a kernel that loses a NaN is refused at once.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from types import ModuleType

import numpy as np

from kinegen.errors import ProofError
from kinegen.ir.program import Program
from kinegen.outputs import Kind, Quantity
from kinegen.robot.model import Robot
from kinegen.verify.beyond import LARGEST_ANGLE, beyond_limits
from kinegen.verify.compared import Judge, Store
from kinegen.verify.comparison import Comparison
from kinegen.verify.nonnumber_params import spoil_params, with_params
from kinegen.verify.nonnumbers import FAR, require_spoilt, spoil
from kinegen.verify.ways import DTYPES, Way, ways_to_call


def compare_usage(
    robot: Robot, package: ModuleType, programs: Mapping[Quantity, Program], reals: tuple[str, ...]
) -> list[Comparison]:
    """Compare kernels where the samples of a proof do not reach.

    Args:
        robot: The robot.
        package: Its generated package, imported.
        programs: The quantities it was built for, without inverses, and their programs.
        reals: Its number types.

    Returns:
        The comparisons beyond the limits.

    Raises:
        ProofError: If a result that depends on a NaN is a number, or one that does not is changed by it.
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


def require_nans(robot: Robot, quantity: Quantity, ways: Mapping[str, Sequence[Way]]) -> None:
    """Refuse a kernel that loses a NaN or spreads it, in any of some ways of calling it.

    Args:
        robot: The robot.
        quantity: What the kernel computes.
        ways: The ways by number type, all of the same kernel.

    Raises:
        ProofError: Naming the kernel and what it was given.
    """
    if quantity.kind is Kind.JOINTS_TO_ACTUATORS:
        return  # few joint vectors can be brought about, so none can be moved to see what depends on it
    kernel = next(iter(ways.values()))[0].kernel
    spoilt = spoil(robot, quantity, kernel.inputs, kernel.results)
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
    robot: Robot, programs: Mapping[Quantity, Program], real: str, ways_of: Callable[[Quantity], Sequence[Way]]
) -> list[Comparison]:
    """Compare kernels of joint values beyond the limits.

    Args:
        robot: The robot.
        programs: The programs of its kernels, without inverses.
        real: Their number type.
        ways_of: The ways to call a kernel.
    """
    comparisons = []
    points, store = beyond_limits(robot, real), Store(robot, DTYPES[real], exact=False)
    for quantity, program in programs.items():
        ways = ways_of(quantity)
        kernel = ways[0].kernel
        if kernel.inputs[0].name == "q" and len(points):
            inputs, expectation = store.expect(quantity, kernel.inputs, points)
            judge = Judge(expectation, program, real, within=False)
            for way in ways:
                target, row = f"{way.target}, beyond limits", f"{way.row.partition(',')[0]}, beyond limits"
                comparisons.append(judge.compare(target, way.call(inputs), row))
    return comparisons


def _forms(package: ModuleType, real: str, quantity: Quantity) -> list[Way]:
    """The scalar kernel, the batch in each variant, and NumPy; layouts hold the same numbers."""
    return [way for way in ways_to_call(package, quantity, real) if way.is_plain or way.target == way.row]
