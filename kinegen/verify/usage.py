"""What a kernel does beyond the usual inputs: joint values beyond the limits, and numbers that are none.

In: a package. Out: comparisons with the reference beyond the limits; a kernel that loses a NaN is refused at once.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
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
        comparisons += _beyond(robot, package, programs, real)
    for quantity in programs:
        if quantity.kind is Kind.JOINTS_TO_ACTUATORS:
            continue  # few joint vectors can be brought about, so none can be moved to see what depends on it
        kernel = getattr(package, quantity.function)
        spoilt = spoil(robot, quantity, kernel.inputs, kernel.results)
        for real in reals:
            for way in _forms(package, quantity, real):
                require_spoilt(robot, quantity, way, spoilt, str(DTYPES[real]))
        if robot.runtime_parameters:
            spoilt = spoil_params(robot, programs[quantity], kernel.inputs, kernel.results)
            for real in reals:
                for way in _forms(package, quantity, real):
                    require_spoilt(robot, quantity, with_params(package, way), spoilt, str(DTYPES[real]))
    return comparisons


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


def _beyond(robot: Robot, package: ModuleType, programs: Mapping[Quantity, Program], real: str) -> list[Comparison]:
    comparisons = []
    points, store = beyond_limits(robot, real), Store(robot, DTYPES[real], exact=False)
    for quantity, program in programs.items():
        kernel = getattr(package, quantity.function)
        if kernel.inputs[0].name == "q" and len(points):
            inputs, expectation = store.expect(quantity, kernel.inputs, points)
            judge = Judge(expectation, program, real, within=False)
            for way in _forms(package, quantity, real):
                target, row = f"{way.target}, beyond limits", f"{way.row.partition(',')[0]}, beyond limits"
                comparisons.append(judge.compare(target, way.call(inputs), row))
    return comparisons


def _forms(package: ModuleType, quantity: Quantity, real: str) -> list[Way]:
    """The scalar kernel, the batch in each variant, and NumPy; layouts hold the same numbers."""
    return [way for way in ways_to_call(package, quantity, real) if way.is_plain or way.target == way.row]
