"""What a controller has to know of an arm: its joints in machine units, its world, joint values to begin at."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from kinegen.backends import bundle
from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.controllers.controller import Controller, macro_clash
from kinegen.backends.inverse import branches_of
from kinegen.errors import KinegenError
from kinegen.model.actuator_limits import reading_box, reading_ranges
from kinegen.model.expression_parser import evaluate
from kinegen.model.expression_values import FLOAT64, Dimension
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.robot import TOOL, JointType, JointVariable, Robot
from kinegen.support.dataclass import dataclass
from kinegen.verify import reference

_TRIED = 200
_MARGIN = 0.2
"""Part of each range that is left free at either end."""

_GRID = math.radians(5.0)
_MULTIPLIER, _INCREMENT, _MODULUS = 1664525, 1013904223, 2**32
"""A linear congruential sequence (Numerical Recipes, 2nd ed., section 7.1): the same on every machine."""

_INSET = 0.05
"""Part of the range of a joint that readings leave free at either end."""


def samples(robot: Robot, count: int = 12) -> Iterator[tuple[float, ...]]:
    """Yield joint vectors within the limits, on a grid of 5 degrees or a hundredth of the range.

    Yields joint values in radians or the file's length unit.
    """
    turns = [variable.type is JointType.REVOLUTE for variable in robot.variables]
    boxes = [
        (max(low, -math.pi), min(high, math.pi)) if each else (low, high)
        for each, (low, high) in zip(turns, joint_box(robot), strict=True)
    ]
    yield from _on_grid(boxes, turns, count)


def _on_grid(boxes: Sequence[tuple[float, float]], turns: Sequence[bool], count: int) -> Iterator[tuple[float, ...]]:
    state = 1
    for _ in range(count):
        vector = []
        for (begin, end), each in zip(boxes, turns, strict=True):
            state = (_MULTIPLIER * state + _INCREMENT) % _MODULUS
            part = _MARGIN + (1 - 2 * _MARGIN) * state / _MODULUS
            grid = _GRID if each else (end - begin) / 100 or 1.0
            vector.append(round((begin + part * (end - begin)) / grid) * grid)
        yield tuple(vector)


def home_of(robot: Robot) -> tuple[float, ...]:
    """Return the one of some joint vectors whose columns of the Jacobian are most nearly at right angles.

    Returns joint values in radians or the file's length unit; of an arm with actuators, those of readings on such a
    grid. Raises KinegenError if no readings within their limits keep the joints within theirs.
    """
    tried = driven_samples(robot) if robot.actuators.readings else list(samples(robot, _TRIED))
    jacobians = reference.Kinematics(robot, tried).jacobian(TOOL)
    return tried[int(np.argmax([_spread(jacobian, reach(robot)) for jacobian in jacobians]))]


def driven_samples(robot: Robot) -> list[tuple[float, ...]]:
    """Return joint vectors within the limits, of readings within theirs."""
    turns = [reading.dimension is Dimension.ANGLE for reading in robot.actuators.readings]
    joints = reference.Actuation(robot, list(_on_grid(reading_box(robot), turns, _TRIED))).joints
    low, high = np.array(joint_box(robot)).T
    room = np.array([variable.limits is not None for variable in robot.variables]) * _INSET * (high - low)
    # A joint without limits may turn further than the box; one that no linkage brings about is NaN.
    low, high = (np.where(room > 0, bound, side) for bound, side in ((low + room, -np.inf), (high - room, np.inf)))
    found = [
        tuple(map(float, row)) for row in joints if np.isfinite(row).all() and ((low <= row) & (row <= high)).all()
    ]
    # Where couplings leave few readings that keep the joints within their limits, joints are tried instead.
    found = found or [q for q in samples(robot, _TRIED) if has_readings(robot, q)]
    if not found:
        raise KinegenError(f"{robot.name}: no readings within their limits keep the joints within theirs", robot.source)
    return found


def has_readings(robot: Robot, joints: Sequence[float]) -> bool:
    """Return whether the readings of the actuators at joint values are within their limits."""
    readings = reference.readings(robot, [joints])[0].astype(float)
    return all(low <= each <= high for each, (low, high) in zip(readings, reading_ranges(robot), strict=True))


def _spread(jacobian: NDArray[np.float64], size: float) -> float:
    """Return product of the squared sines between the columns of a (6, n) Jacobian, with lengths over the reach."""
    rows = jacobian if jacobian.shape[1] > 3 else jacobian[:3]
    scaled = rows / np.array([size] * 3 + [1.0] * 3)[: len(rows), None]
    lengths = np.linalg.norm(scaled, axis=0)
    if not lengths.all():
        return 0.0
    columns = scaled / lengths
    return float(np.linalg.det(columns.T @ columns))


MILLIMETRES = {"m": 1000.0, "cm": 10.0, "mm": 1.0, "in": 25.4}
"""Millimetres in each length unit of robot files."""

INCH = MILLIMETRES["in"]

_LEVEL = 1e-9
"""How far the tool's tilt may vary before it is one that the joints change."""


@dataclass(frozen=True, slots=True)
class MachineJoint:
    """One joint, or one motor by the reading of its actuator, as a controller counts it.

    `index`: its place in the joint vector, or among the readings. `name`: its name in the robot file. `turns`: whether
    it is an angle. `unit`: `deg`, `mm`, or `unit` for a bare number. `scale`: kernel units in one machine unit: radians
    in a degree, or the file's length unit in a millimetre. `low`: lower limit in machine units; None without one.
    `high`: upper limit likewise. `home`: where an example begins, in machine units.
    """

    index: int
    name: str
    turns: bool
    unit: str
    scale: float
    low: float | None
    high: float | None
    home: float


@dataclass(frozen=True, slots=True)
class Machine:
    """An arm as a controller sees it.

    `motors`: what its motors count: the readings of its actuators, or the joints themselves where it has none.
    `coordinates`: letters of the world's axes that it moves: XYZ, XYZC or XYZABC; empty where every arm will do.
    `millimetres`: millimetres in the file's length unit. `tilt`: angles a and b of the tool in radians where no joint
    changes them, else zeros. `turning`: angle c in radians with all joints at 0, and its derivatives by the joints;
    nothing for a tool that does not turn about the vertical only. `reach`: upper bound on the reach, in the file's
    length unit. `home`: position of the tool at home in millimetres, then its angles a, b, c in degrees.
    """

    joints: tuple[MachineJoint, ...]
    motors: tuple[MachineJoint, ...]
    coordinates: str
    millimetres: float
    tilt: tuple[float, float]
    turning: tuple[float, ...]
    reach: float
    home: tuple[float, ...]

    @property
    def dof(self) -> int:
        """Number of joints."""
        return len(self.joints)


def machine_of(kernels: RobotPrograms, controller: Controller) -> Machine:
    """Return the arm as a controller sees it.

    Raises KinegenError if no such controller can move it.
    """
    robot = kernels.robot
    require_arm(robot, controller)
    # What an example begins at decides the tool's place there, the world's axes what it is counted in.
    home = home_of(robot)
    coordinates, tilt = _coordinates(kernels, controller)
    millimetres = MILLIMETRES[robot.units.length]
    pose = reference.pose(robot, [home])[0, 0]
    joints = tuple(map(_joint, robot.variables, home, [millimetres] * robot.dof))
    return Machine(
        joints=joints,
        motors=motors_of(robot, home, millimetres) or joints,
        coordinates=coordinates,
        millimetres=millimetres,
        tilt=tilt,
        turning=_turning(robot) if coordinates == "XYZC" else (),
        reach=reach(robot),
        home=(*(float(each) * millimetres for each in pose[:3, 3]), *map(math.degrees, angles(pose))),
    )


def require_arm(robot: Robot, controller: Controller, unsolved: Sequence[str] = ()) -> None:
    """Refuse what no package can move, before anything is derived.

    `unsolved`: why it has no closed-form inverse; nothing where it has one. Raises KinegenError with the reason, if it
    is known from the robot alone.
    """
    reason = ""
    if robot.is_tree:
        reason = f"it has {len(robot.tips)} tips, and the package moves one tool; give it a file with one of the chains"
    elif controller is Controller.GRBLHAL and len(robot.runtime_parameters) > _SETTINGS:
        number = len(robot.runtime_parameters)
        reason = f"it has {number} runtime parameters, and grblHAL has {_SETTINGS} settings for them"
    elif robot.redundancy and controller is Controller.MOVEIT2:
        reason = bundle.redundancy_refusal(robot)
    elif robot.redundancy:
        reason = f"its inverse is given {robot.redundancy} in addition to the pose, which nothing there sets"
    reason = reason or macro_clash(robot, controller)
    if unsolved and not reason:
        first, *others = unsolved
        more = f" (and {len(others)} more, which `kinegen inspect` lists)" if others else ""
        reason = f"it has no closed-form inverse, which the package calls: {first}{more}"
        if controller is Controller.MOVEIT2 and robot.dof > _POSE and not robot.redundancy:
            reason += "; with `redundancy:` in the robot file, a joint or arm_angle is given and the others are solved"
    if reason:
        raise KinegenError(f"no {controller.makers_name} package for {robot.name}: {reason}", robot.source)
    require_readings(robot, controller)


def require_readings(robot: Robot, controller: Controller) -> None:
    """Refuse actuators that are not one for each joint: their readings take the places of joints.

    Raises KinegenError with both numbers.
    """
    count = len(robot.actuators.readings)
    if count not in (0, robot.dof):
        reason = f"it has {count} readings of actuators for {robot.dof} joints"
        raise KinegenError(f"no {controller.makers_name} package for {robot.name}: {reason}", robot.source)


_POSE = 6
"""Numbers of a pose; with more joints some have to be given."""

_SETTINGS = 10
"""Settings that grblHAL has for kinematics, $640 to $649."""

_WORDS = {
    "XYZ": "3 joints for a position",
    "XYZC": "4 with a tool that only turns about the vertical",
    "XYZABC": "6 for a pose",
}
"""The arms that have each world."""


def _coordinates(kernels: RobotPrograms, controller: Controller) -> tuple[str, tuple[float, float]]:
    """Return the axes of the world that the arm moves, and the tilt that the tool keeps."""
    robot, branches = kernels.robot, branches_of(kernels)
    attitude = branches is not None and branches.reads_attitude
    found, tilt = "", (0.0, 0.0)
    if robot.dof == 3 and not attitude:
        found = "XYZ"
    elif robot.dof == 6 and attitude:
        found = "XYZABC"
    elif robot.dof == 4 and attitude:
        poses = np.array([reference.pose(robot, [q])[0, 0] for q in samples(robot)])
        if np.ptp(poses[:, 2, :3], axis=0).max() < _LEVEL:
            found, tilt = "XYZC", angles(poses[0])[:2]
    if found in controller.coordinates:
        if found == "XYZC":
            _require_lengths(robot, controller)
        return found, tilt
    if not controller.coordinates:
        return "", tilt
    words = "; ".join(_WORDS[each] for each in controller.coordinates)
    raise KinegenError(
        f"no {controller.makers_name} package for {robot.name}: it moves arms of {words}; this one has {robot.dof} "
        f"joints and is solved for the {'pose' if attitude else 'position'}",
        robot.source,
    )


def _require_lengths(robot: Robot, controller: Controller) -> None:
    """Refuse angles that are set at run time: angle c of the tool is a sum of joint values with fixed numbers."""
    for parameter in robot.runtime_parameters:
        if parameter.dimension is Dimension.ANGLE:
            raise KinegenError(
                f"no {controller.makers_name} package for {robot.name}: runtime parameter {parameter.name!r} is an "
                "angle, and the package of an arm with 4 joints takes lengths",
                robot.source,
                parameter.line,
            )


def _turning(robot: Robot) -> tuple[float, ...]:
    """Return the angle c as a sum of joint values: rotations about one line add up."""
    q = np.array(list(samples(robot)))
    rates = reference.Kinematics(robot, q).jacobian(TOOL)[0, 5]
    begin = angles(reference.pose(robot, q[:1])[0, 0])[2] - float(rates @ q[0])
    return (math.remainder(begin, 2 * math.pi), *map(float, rates))


def angles(pose: NDArray[np.float64]) -> tuple[float, float, float]:
    """Angles a, b, c in radians with R = Rz(c) Ry(b) Rx(a), from a (4, 4) pose; a is 0 where b is a quarter turn."""
    level = math.hypot(pose[0, 0], pose[1, 0])
    b = math.atan2(-pose[2, 0], level)
    if level < 1e-12:
        return 0.0, b, math.atan2(-pose[0, 1], pose[1, 1])
    return math.atan2(pose[2, 1], pose[2, 2]), b, math.atan2(pose[1, 0], pose[0, 0])


def machine_unit(dimension: Dimension, millimetres: float) -> tuple[str, float]:
    """Return the unit of a controller: `deg`, `mm` or `unit`, and how much in a kernel it is.

    `dimension`: what is measured. `millimetres`: millimetres in the file's length unit.
    """
    known = {Dimension.ANGLE: ("deg", math.pi / 180), Dimension.LENGTH: ("mm", 1 / millimetres)}
    return known.get(dimension, ("unit", 1.0))


def _joint(variable: JointVariable, home: float, millimetres: float) -> MachineJoint:
    turns = variable.type is JointType.REVOLUTE
    unit, scale = machine_unit(Dimension.ANGLE if turns else Dimension.LENGTH, millimetres)
    limits = [float(evaluate(each, {}, FLOAT64)) / scale for each in variable.limits or ()]
    low, high = limits or (None, None)
    return MachineJoint(variable.index, variable.name, turns, unit, scale, low, high, home=round(home / scale, 6))


def motors_of(robot: Robot, home: Sequence[float], millimetres: float) -> tuple[MachineJoint, ...]:
    """Return the readings of actuators at joint values; nothing for a robot that is driven at its joints."""
    if not robot.actuators.readings:
        return ()
    found = []
    for reading, value, ends in zip(
        robot.actuators.readings, reference.readings(robot, [home])[0], reading_ranges(robot), strict=True
    ):
        unit, scale = machine_unit(reading.dimension, millimetres)
        turns = reading.dimension is Dimension.ANGLE
        low, high = (end / scale if math.isfinite(end) else None for end in ends)
        at = round(float(value) / scale, 6)
        found.append(MachineJoint(reading.index, reading.name, turns, unit, scale, low, high, home=at))
    return tuple(found)
