"""Names, limits and defaults of a package, against the robot.

In: an imported package. Out: nothing, or the first table that says something else than the robot file. Every table is
worked out here once more, so that one that was printed wrong is seen; nothing is read from the programs.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import numpy as np

from kinegen.errors import ProofError
from kinegen.naming import python_identifier
from kinegen.outputs import Kind, Quantity
from kinegen.robot.actuators.extent import reading_ranges
from kinegen.robot.dimension import Dimension
from kinegen.robot.expressions import Expression, evaluate
from kinegen.robot.floats import FLOATS
from kinegen.robot.model import Robot
from kinegen.verify.known import quantity_frames

_DIGITS = 1e-12

DRIVEN = (Kind.ACTUATORS_TO_JOINTS, Kind.JOINTS_TO_ACTUATORS, Kind.FK_ACTUATORS, Kind.JACOBIAN_ACTUATORS)
"""Kinds that take or give readings of actuators."""


def require_tables(robot: Robot, package: ModuleType, quantities: tuple[Quantity, ...]) -> None:
    """Compare what a package says of its robot with the robot.

    Args:
        robot: The robot.
        package: Its generated package, imported.
        quantities: The quantities it was built for.

    Raises:
        ProofError: Naming the table.
    """
    for name, wanted in python_tables(robot, quantities).items():
        found = getattr(package, name, None)
        if not agree(found, wanted):
            raise ProofError(f"{robot.name}: {name} of the package is {found}, expected {wanted}; nothing was written")
    _require_defaults(robot, package)
    _require_names(robot, package, quantities)
    if any(quantity.kind in DRIVEN for quantity in quantities):
        _require_check(robot, package)


def python_tables(robot: Robot, quantities: tuple[Quantity, ...]) -> dict[str, Any]:
    """What the tables of a package hold, by name.

    Args:
        robot: The robot.
        quantities: The quantities it was built for.
    """
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
    """The runtime parameters with the values of the file."""
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
    return float(evaluate(expression, {}, FLOATS))


def agree(found: Any, wanted: Any) -> bool:
    """Whether two tables say the same, numbers to twelve digits."""
    if isinstance(wanted, tuple):
        is_long = isinstance(found, tuple) and len(found) == len(wanted)
        return is_long and all(agree(*pair) for pair in zip(found, wanted))
    if isinstance(wanted, float) and isinstance(found, float | int):
        return found == wanted or math.isclose(found, wanted, rel_tol=_DIGITS, abs_tol=_DIGITS)
    return type(found) is type(wanted) and bool(found == wanted)
