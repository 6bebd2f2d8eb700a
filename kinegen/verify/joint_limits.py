"""Limits of the joints: the numbers in C, and the functions that ask and clamp, in C and in Python.

In: a package, or a library with the kernels of one number type. Out: nothing, or the first number or answer that is
wrong. The limits are worked out here once more with 50 digits; the functions are called at every limit, at the next
numbers on both sides of it, and with NaN and infinities.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from types import ModuleType
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from kinegen.errors import ProofError
from kinegen.naming import macro, prefix
from kinegen.reference.numbers import DIGITS, digits
from kinegen.robot.expressions import Expression, evaluate
from kinegen.robot.model import Robot
from kinegen.verify.probe import TYPES, Probe

Rows = NDArray[Any]

_ROUNDING = 1e-40
"""Far above what 50 digits lose, and far below the distance of two numbers of a type, relatively."""

_DTYPES: tuple[tuple[str, Any], ...] = (("double", np.float64), ("float", np.float32))


def require_python_limits(robot: Robot, package: ModuleType) -> None:
    """Call `within_limits` and `clamp` of a package, in both number types.

    Args:
        robot: The robot.
        package: Its generated package, imported.

    Raises:
        ProofError: If an answer is wrong.
    """
    for name, kind in _DTYPES:
        low, high = _sides(robot, kind)
        low, high = (
            np.where(np.abs(side) == np.finfo(kind).max, np.copysign(np.inf, side), side) for side in (low, high)
        )
        q = _vectors(low, high)
        _require(robot, f"within_limits of the package, in {name}", q, package.within_limits(q), _within(q, low, high))
        _require(robot, f"clamp of the package, in {name}", q, package.clamp(q), _clamped(q, low, high))


def require_limits(robot: Robot, probe: Probe) -> None:
    """Compare the limits in C with those of the robot, and call the functions in C.

    Args:
        robot: The robot.
        probe: The compiled kernels of a number type.

    Raises:
        ProofError: If a number or an answer is wrong.
    """
    if not robot.dof:
        return
    stem, kind = prefix(robot.name, probe.real), dict(_DTYPES)[probe.real]
    low, high = _sides(robot, kind)
    for name, wanted in (("LIMITS_LOW", low), ("LIMITS_HIGH", high)):
        found = (TYPES[probe.real] * robot.dof).in_dll(probe.library, macro(stem, name))
        if list(found) != wanted.tolist():
            reason = f"{macro(stem, name)} holds {list(found)}, expected {wanted.tolist()}"
            raise ProofError(f"{robot.name}: {reason}; nothing was written")
    q = _vectors(low, high)
    within = [probe.library[f"{stem}_within_limits"](_pointer(row)) for row in q]
    _require(robot, f"{stem}_within_limits", q, np.array(within), _within(q, low, high).astype(int))
    clamp = probe.library[f"{stem}_clamp"]
    clamp.restype = None
    for name, result in ((f"{stem}_clamp", np.full_like(q, 7)), (f"{stem}_clamp in place", q.copy())):
        for row, place in zip(q, result, strict=True):
            clamp(_pointer(place if name.endswith("place") else row), _pointer(place))
        _require(robot, name, q, result, _clamped(q, low, high))


def _require(robot: Robot, name: str, q: Rows, found: Rows, wanted: Rows) -> None:
    same = np.equal(found, wanted) | (np.isnan(found) & np.isnan(wanted))
    if not same.all():
        row = int(np.argmin(same.reshape(len(q), -1).all(axis=1)))
        reason = f"{name} gives {found[row].tolist()} for {q[row].tolist()}, expected {wanted[row].tolist()}"
        raise ProofError(f"{robot.name}: {reason}; nothing was written")


def _pointer(row: Rows) -> ctypes.c_void_p:
    return ctypes.c_void_p(row.ctypes.data)


def _within(q: Rows, low: Rows, high: Rows) -> Rows:
    return np.asarray(((low <= q) & (q <= high) & np.isfinite(q)).all(axis=1))


def _clamped(q: Rows, low: Rows, high: Rows) -> Rows:
    return np.where(q < low, low, np.where(q > high, high, q))  # NaN is neither


def _vectors(low: Rows, high: Rows) -> Rows:
    """Joint vectors (N, dof): within, and with one joint at a time at a limit, next to it, far away, or no number."""
    kind = low.dtype.type
    limited = np.isfinite(low) & (np.abs(low) < np.finfo(kind).max)
    lower, upper = (np.where(limited, side, kind(0.25)) for side in (low, high))
    finite = lower / 2 + upper / 2
    rows = [low, high, finite, np.full_like(low, np.nan), np.full_like(low, np.inf)]
    for joint, (below, above) in enumerate(zip(low, high, strict=True)):
        with np.errstate(all="ignore"):  # beyond the largest number is infinity
            ends = [np.nextafter(end, kind(side)) for end in (below, above) for side in (-np.inf, np.inf)]
        for value in (below, above, *ends, kind(1e30), kind(-1e30), kind(np.nan), kind(np.inf), kind(-np.inf)):
            row = finite.copy()
            row[joint] = value
            rows.append(row)
    return np.ascontiguousarray(np.array(rows, kind).reshape(len(rows), len(low)))


def _sides(robot: Robot, kind: Any) -> tuple[Rows, Rows]:
    """Lower and upper limits (dof,) as numbers of a type: the limits, rounded outwards; the largest ones without."""
    largest = np.finfo(kind).max
    pairs = [
        (-largest, largest)
        if variable.limits is None
        else (_outside(variable.limits[0], kind, -1), _outside(variable.limits[1], kind, 1))
        for variable in robot.variables
    ]
    low, high = np.array(pairs, kind).reshape(-1, 2).T
    return np.ascontiguousarray(low), np.ascontiguousarray(high)


def _outside(limit: Expression, kind: Callable[[Any], Any], side: int) -> Any:
    """The number of a type that is next to a limit and not within it; the limit itself where it is such a number."""
    with mpmath.workdps(DIGITS):
        exact = mpmath.mpf(evaluate(limit, {}, digits().arithmetic))
        number = kind(float(exact))
        slack = abs(exact) * mpmath.mpf(_ROUNDING)
        # a step inwards, then outwards until the limit is reached
        number = np.nextafter(number, kind(-side * math.inf))
        while side * (mpmath.mpf(float(number)) - exact) < -slack:
            number = np.nextafter(number, kind(side * math.inf))
        return number
