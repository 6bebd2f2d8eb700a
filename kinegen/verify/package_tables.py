"""Names, limits, defaults and types of a package, in C and in Python, against the robot.

The limits are worked out here once more with 50 digits; the functions are called at every limit, at the next numbers on
both sides of it, and with NaN and infinities.

Every table is worked out here once more, so that one that was printed wrong is seen; nothing is read from the programs.
"""

from __future__ import annotations

import ast
import ctypes
import inspect
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from kinegen.backends.python.stub import STUB
from kinegen.errors import ProofError
from kinegen.model.actuator_limits import reading_ranges
from kinegen.model.expression_parser import Expression, evaluate
from kinegen.model.expression_values import FLOAT64, Dimension
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import Robot
from kinegen.support.naming import macro, prefix, python_identifier
from kinegen.verify.c_library import TYPES, Probe
from kinegen.verify.isolation import GuardedRows, calling
from kinegen.verify.reference.exact_numbers import DIGITS, digits
from kinegen.verify.reference_cache import quantity_frames

_DIGITS = 1e-12

DRIVEN = (Kind.ACTUATORS_TO_JOINTS, Kind.JOINTS_TO_ACTUATORS, Kind.FK_ACTUATORS, Kind.JACOBIAN_ACTUATORS)
"""Kinds that take or give readings of actuators."""


def require_tables(robot: Robot, package: ModuleType, quantities: tuple[Quantity, ...]) -> None:
    """Compare what a package says of its robot with the robot. Raises `ProofError` naming the table."""
    for name, wanted in python_tables(robot, quantities).items():
        found = getattr(package, name, None)
        if not agree(found, wanted):
            raise ProofError(f"{robot.name}: {name} of the package is {found}, expected {wanted}; nothing was written")
    _require_defaults(robot, package)
    _require_names(robot, package, quantities)
    if any(quantity.kind in DRIVEN for quantity in quantities):
        _require_check(robot, package)


def python_tables(robot: Robot, quantities: tuple[Quantity, ...]) -> dict[str, Any]:
    """Returns what the tables of a package hold, by name."""
    kinds = {quantity.kind for quantity in quantities}
    limits = tuple(
        None if variable.limits is None else tuple(_number(limit) for limit in variable.limits)
        for variable in robot.variables
    )
    found: dict[str, Any] = {
        "DOF": len(robot.variables),
        "JOINTS": tuple(variable.name for variable in robot.variables),
        "LIMITS": limits,
    }
    if Kind.FRAMES in kinds:
        found["FRAMES"] = quantity_frames(robot, Quantity.FRAMES)
    if robot.is_tree:
        found["TIPS"] = tuple(robot.tips)
    if Kind.PARAMETER_JACOBIAN in kinds:
        found["PARAMETERS"] = tuple(parameter.name for parameter in robot.varied_parameters)
    if kinds & set(DRIVEN):
        found["ACTUATORS"] = tuple(reading.name for reading in robot.actuators.readings)
        found["ACTUATOR_RANGES"] = tuple(tuple(bounds) for bounds in reading_ranges(robot))
        units = {Dimension.LENGTH: robot.units.length, Dimension.ANGLE: "rad", Dimension.NUMBER: ""}
        found["ACTUATOR_UNITS"] = tuple(units[reading.dimension] for reading in robot.actuators.readings)
    return found


def _require_names(robot: Robot, package: ModuleType, quantities: tuple[Quantity, ...]) -> None:
    """Kernels whose results have an axis of tips or frames know their names, and where each part of a result is."""
    for quantity in quantities:
        kernel: Any = getattr(package, quantity.function)
        wanted = quantity_frames(robot, quantity)
        if not hasattr(kernel, "by_name"):
            continue
        if tuple(kernel.names) != tuple(wanted):
            reason = f"{quantity.function} of the package names {kernel.names}, expected {tuple(wanted)}"
            raise ProofError(f"{robot.name}: {reason}; nothing was written")
        for layout in ("4x4", "joint_major"):
            _require_parts(robot, kernel, layout)


def _require_parts(robot: Robot, kernel: Any, layout: str) -> None:
    """The parts of a result by name are its equal shares, in order."""
    shapes = [each.shape if layout == "4x4" else (each.size, 1) for each in kernel.results]
    whole = tuple(np.arange(math.prod(shape), dtype=float).reshape(shape) for shape in shapes)
    parts = kernel.named(whole if len(whole) > 1 else whole[0], layout=layout)
    for index, name in enumerate(kernel.names):
        found = parts[name] if len(whole) > 1 else (parts[name],)
        for part, array in zip(found, whole, strict=True):
            if not np.array_equal(part.ravel(), np.split(array.ravel(), len(kernel.names))[index]):
                reason = f"{kernel.__name__} of the package gives another part as that of {name}, in layout {layout}"
                raise ProofError(f"{robot.name}: {reason}; nothing was written")


def default_parameters(robot: Robot) -> dict[str, float]:
    """Returns the runtime parameters with the values of the file."""
    return {parameter.name: _number(parameter.value) for parameter in robot.runtime_parameters}


def _require_defaults(robot: Robot, package: ModuleType) -> None:
    wanted = {python_identifier(name): value for name, value in default_parameters(robot).items()}
    if not wanted:
        return
    found = package.Params()._asdict()
    if list(found) != list(wanted) or not agree(tuple(found.values()), tuple(wanted.values())):
        raise ProofError(f"{robot.name}: Params() of the package is {found}, expected {wanted}; nothing was written")


def _require_check(robot: Robot, package: ModuleType) -> None:
    """`check_actuators` lets through what is in range and refuses everything else."""
    ranges = np.array(reading_ranges(robot), dtype=float)
    inside = np.where(np.isfinite(ranges).all(axis=1), np.nan_to_num(ranges).mean(axis=1), 0.0)
    inside = np.clip(inside, ranges[:, 0], ranges[:, 1])
    for readings, is_right in _readings(inside, ranges):
        try:
            package.check_actuators(readings)
            passed = True
        except ValueError:
            passed = False
        if passed != is_right:
            words = "lets through" if passed else "refuses"
            raise ProofError(f"{robot.name}: check_actuators {words} {readings.tolist()}; nothing was written")


def _readings(inside: Any, ranges: Any) -> Iterator[tuple[Any, bool]]:
    yield inside, True
    for place, bounds in enumerate(ranges):
        for bound, step in zip(bounds, (-1e-6, 1e-6), strict=True):
            if math.isfinite(bound):
                yield _with(inside, place, bound), True
                yield _with(inside, place, bound + step * max(1.0, abs(bound))), False
        yield _with(inside, place, math.nan), False


def _with(values: Any, place: int, value: float) -> Any:
    found = values.copy()
    found[place] = value
    return found


def _number(expression: Expression) -> float:
    return float(evaluate(expression, {}, FLOAT64))


def agree(found: Any, wanted: Any) -> bool:
    """Returns whether two tables say the same, numbers to twelve digits."""
    if isinstance(wanted, tuple):
        is_long = isinstance(found, tuple) and len(found) == len(wanted)
        return is_long and all(agree(*pair) for pair in zip(found, wanted))
    if isinstance(wanted, float) and isinstance(found, float | int):
        return found == wanted or math.isclose(found, wanted, rel_tol=_DIGITS, abs_tol=_DIGITS)
    return type(found) is type(wanted) and bool(found == wanted)


def require_types(robot: Robot, package: ModuleType, folder: Path) -> None:
    """Compare the stub of a package with the package. Raises `ProofError` naming what differs."""
    try:
        tree = ast.parse((folder / STUB).read_text(encoding="utf-8"))
    except (OSError, SyntaxError) as error:
        raise ProofError(f"{robot.name}: {STUB} cannot be read: {error}; nothing was written") from None
    classes = {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}
    declared = [node for node in tree.body if isinstance(node, ast.AnnAssign)]
    types = {ast.unparse(node.target): ast.unparse(node.annotation) for node in declared}
    lists = [ast.literal_eval(node.value) for node in tree.body if isinstance(node, ast.Assign)]
    exported = lists[0] if lists else None
    if exported != package.__all__:
        raise ProofError(f"{robot.name}: {STUB} has other names than the module; nothing was written")
    for name in package.__all__:
        kernel = getattr(package, name)
        if not hasattr(kernel, "inputs"):
            continue
        found = _arguments(classes.get(types.get(name, "")))
        wanted = list(inspect.signature(kernel).parameters)
        if found != wanted:
            reason = f"{STUB} has the arguments {', '.join(found)} for {name}, expected {', '.join(wanted)}"
            raise ProofError(f"{robot.name}: {reason}; nothing was written")


def _arguments(kernel: ast.ClassDef | None) -> list[str]:
    """Returns the arguments of a call by the type of a kernel."""
    for node in kernel.body if kernel else ():
        if isinstance(node, ast.FunctionDef) and node.name == "__call__":
            given = node.args
            return [each.arg for each in (*given.posonlyargs, *given.args, *given.kwonlyargs) if each.arg != "self"]
    return []


Rows = NDArray[Any]

_ROUNDING = 1e-40
"""Far above what 50 digits lose, and far below the distance of two numbers of a type, relatively."""

_DTYPES: tuple[tuple[str, Any], ...] = (("double", np.float64), ("float", np.float32))


def require_python_limits(robot: Robot, package: ModuleType) -> None:
    """Call `within_limits` and `clamp` of a package, in both number types.

    Raises `ProofError` if an answer is wrong.
    """
    for name, kind in _DTYPES:
        low, high = _sides(robot, kind)
        low, high = (
            np.where(np.abs(side) == np.finfo(kind).max, np.copysign(np.inf, side), side) for side in (low, high)
        )
        q = _vectors(low, high)
        _require(robot, f"within_limits of the package, in {name}", q, package.within_limits(q), _within(q, low, high))
        _require(robot, f"clamp of the package, in {name}", q, package.clamp(q), _clamped(q, low, high))


def limit_readings(robot: Robot, real: str) -> Rows:
    """Actuator vectors (N, readings): within, and with one at an end of its range, beside it, far away, or NaN."""
    return _vectors(*_reading_sides(robot, dict(_DTYPES)[real]))


def require_limits(robot: Robot, probe: Probe, *, has_readings: bool) -> None:
    """Compare the limits in C with those of the robot, and call the functions in C.

    `has_readings`: whether kernels take or give readings of actuators, whose limits are there too then. Raises
    `ProofError` if a number or an answer is wrong.
    """
    kind = dict(_DTYPES)[probe.real]
    if robot.dof:
        _require_in_c(robot, probe, ("LIMITS_LOW", "LIMITS_HIGH", "within_limits", "clamp"), _sides(robot, kind))
    if has_readings:
        names = ("ACTUATORS_LOW", "ACTUATORS_HIGH", "actuators_within_limits", "clamp_actuators")
        _require_in_c(robot, probe, names, _reading_sides(robot, kind))


def _require_in_c(robot: Robot, probe: Probe, names: tuple[str, str, str, str], sides: tuple[Rows, Rows]) -> None:
    """Arrays of lower and upper limits, a function that asks and one that clamps, by the ends of their names."""
    stem, (low, high) = prefix(robot.name, probe.real), sides
    for name, wanted in zip(names[:2], sides, strict=True):
        found = (TYPES[probe.real] * len(wanted)).in_dll(probe.library, macro(stem, name))
        if list(found) != wanted.tolist():
            reason = f"{macro(stem, name)} holds {list(found)}, expected {wanted.tolist()}"
            raise ProofError(f"{robot.name}: {reason}; nothing was written")
    q = _vectors(low, high)
    asked, clamped = (f"{stem}_{name}" for name in names[2:])
    within = [probe.library[asked](_pointer(row)) for row in q]
    _require(robot, asked, q, np.array(within), _within(q, low, high).astype(int))
    clamp = probe.library[clamped]
    clamp.restype = None
    for name, start in ((clamped, np.full_like(q, 7)), (f"{clamped} in place", q)):
        calling(name)
        rows = GuardedRows.of(len(q), q.shape[1:], q.dtype, used=len(q))
        result = rows.cells
        result[...] = start
        for row, place in zip(q, result, strict=True):
            clamp(_pointer(place if name.endswith("place") else row), _pointer(place))
        rows.require(robot.name)
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


def _reading_sides(robot: Robot, kind: Any) -> tuple[Rows, Rows]:
    """Returns the same of the readings of actuators."""
    largest = np.finfo(kind).max
    pairs = [
        [
            kind(math.copysign(largest, bound)) if math.isinf(bound) else _outside(bound, kind, side)
            for bound, side in zip(pair, (-1, 1), strict=True)
        ]
        for pair in reading_ranges(robot)
    ]
    low, high = np.array(pairs, kind).reshape(-1, 2).T
    return np.ascontiguousarray(low), np.ascontiguousarray(high)


def _outside(limit: Expression | float, kind: Callable[[Any], Any], side: int) -> Any:
    """The number of a type that is next to a limit and not within it; the limit itself where it is such a number."""
    with mpmath.workdps(DIGITS):
        exact = mpmath.mpf(limit if isinstance(limit, float) else evaluate(limit, {}, digits().arithmetic))
        number = kind(float(exact))
        slack = abs(exact) * mpmath.mpf(_ROUNDING)
        # a step inwards, then outwards until the limit is reached
        number = np.nextafter(number, kind(-side * math.inf))
        while side * (mpmath.mpf(float(number)) - exact) < -slack:
            number = np.nextafter(number, kind(side * math.inf))
        return number
