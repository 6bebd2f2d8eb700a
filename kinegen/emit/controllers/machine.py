"""What a controller has to know of an arm: its joints in machine units, and the axes of its world.

In: a robot with its kernels. Out: a `Machine`, or a `KinegenError` with the reason why no controller can have this arm.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinegen import reference
from kinegen.emit.controllers.controller import Controller
from kinegen.emit.controllers.home import home_of, samples
from kinegen.emit.inverse import branches_of
from kinegen.emit.kernels import Kernels
from kinegen.errors import KinegenError
from kinegen.robot.expressions import evaluate
from kinegen.robot.extent import reach
from kinegen.robot.floats import FLOATS
from kinegen.robot.model import JointType, JointVariable, Robot

MILLIMETRES = {"m": 1000.0, "cm": 10.0, "mm": 1.0, "in": 25.4}
"""Millimetres in each length unit of robot files."""

_LEVEL = 1e-9
"""How far the tool's tilt may vary before it is one that the joints change."""


@dataclass(frozen=True, slots=True)
class MachineJoint:
    """One joint as a controller counts it.

    Attributes:
        index: Its place in the joint vector.
        name: Its name in the robot file.
        turns: Whether it turns; otherwise it shifts.
        unit: `deg` or `mm`.
        scale: Kernel units in one machine unit: radians in a degree, or the file's length unit in a millimetre.
        low: Lower limit in machine units; None without one.
        high: Upper limit likewise.
        home: Where an example begins, in machine units.
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

    Attributes:
        joints: Its joints.
        coordinates: Letters of the world's axes that it moves: XYZ, XYZC or XYZABC.
        millimetres: Millimetres in the file's length unit.
        tilt: Angles a and b of the tool in radians where no joint changes them, else zeros.
        reach: Upper bound on the reach, in the file's length unit.
        home: Position of the tool at home in millimetres, then its angles a, b, c in degrees.
    """

    joints: tuple[MachineJoint, ...]
    coordinates: str
    millimetres: float
    tilt: tuple[float, float]
    reach: float
    home: tuple[float, ...]

    @property
    def dof(self) -> int:
        """Number of joints."""
        return len(self.joints)


def machine_of(kernels: Kernels, controller: Controller) -> Machine:
    """The arm as a controller sees it.

    Args:
        kernels: The robot and its programs, a closed-form inverse among them.
        controller: Who moves it.

    Raises:
        KinegenError: If no such controller can move it.
    """
    robot = kernels.robot
    require_arm(robot, controller)
    home = home_of(robot)
    coordinates, tilt = _coordinates(kernels, controller)
    millimetres = MILLIMETRES[robot.units.length]
    pose = reference.pose(robot, [home])[0, 0]
    return Machine(
        joints=tuple(map(_joint, robot.variables, home, [millimetres] * robot.dof)),
        coordinates=coordinates,
        millimetres=millimetres,
        tilt=tilt,
        reach=reach(robot),
        home=(*(float(each) * millimetres for each in pose[:3, 3]), *map(math.degrees, angles(pose))),
    )


def require_arm(robot: Robot, controller: Controller, unsolved: Sequence[str] = ()) -> None:
    """Refuse what no package can move, before anything is derived.

    Args:
        robot: The robot.
        controller: Who is to move it.
        unsolved: Why it has no closed-form inverse; nothing where it has one.

    Raises:
        KinegenError: With the reason, if it is known from the robot alone.
    """
    reason = ""
    if robot.is_tree:
        reason = f"it has {len(robot.tips)} tips, and the package moves one tool; give it a file with one of the chains"
    elif robot.runtime_parameters:
        reason = f"parameter {robot.runtime_parameters[0].name!r} is a runtime parameter, which nothing there sets"
    elif robot.actuators.readings:
        reason = "it has `actuators:`, and the package moves joints; give it a file with one motor for each joint"
    elif unsolved:
        first, *others = unsolved
        more = f" (and {len(others)} more, which `kinegen inspect` lists)" if others else ""
        reason = f"it has no closed-form inverse, which the package calls: {first}{more}"
    if reason:
        raise KinegenError(f"no {controller.makers_name} package for {robot.name}: {reason}", robot.source)


_WORDS = {
    "XYZ": "3 joints for a position",
    "XYZC": "4 with a tool that only turns about the vertical",
    "XYZABC": "6 for a pose",
}
"""The arms that have each world."""


def _coordinates(kernels: Kernels, controller: Controller) -> tuple[str, tuple[float, float]]:
    """The axes of the world that the arm moves, and the tilt that the tool keeps."""
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
        return found, tilt
    words = "; ".join(_WORDS[each] for each in controller.coordinates)
    raise KinegenError(
        f"no {controller.makers_name} package for {robot.name}: it moves arms of {words}; this one has {robot.dof} "
        f"joints and is solved for the {'pose' if attitude else 'position'}",
        robot.source,
    )


def angles(pose: NDArray[np.float64]) -> tuple[float, float, float]:
    """Angles a, b, c in radians with R = Rz(c) Ry(b) Rx(a), from a (4, 4) pose; a is 0 where b is a quarter turn."""
    level = math.hypot(pose[0, 0], pose[1, 0])
    b = math.atan2(-pose[2, 0], level)
    if level < 1e-12:
        return 0.0, b, math.atan2(-pose[0, 1], pose[1, 1])
    return math.atan2(pose[2, 1], pose[2, 2]), b, math.atan2(pose[1, 0], pose[0, 0])


def _joint(variable: JointVariable, home: float, millimetres: float) -> MachineJoint:
    turns = variable.type is JointType.REVOLUTE
    scale = math.pi / 180 if turns else 1 / millimetres
    limits = [float(evaluate(each, {}, FLOATS)) / scale for each in variable.limits or ()]
    low, high = limits or (None, None)
    return MachineJoint(
        index=variable.index,
        name=variable.name,
        turns=turns,
        unit="deg" if turns else "mm",
        scale=scale,
        low=low,
        high=high,
        home=round(home / scale, 6),
    )
