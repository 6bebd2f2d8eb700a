"""The symbolic stage: a robot and a quantity in, expressions out."""

from __future__ import annotations

from functools import lru_cache

from kinegen.errors import KinegenError
from kinegen.outputs import Kind, Quantity
from kinegen.robot.model import BASE, Robot
from kinegen.symbolic.actuators import kernels as actuators_kernels
from kinegen.symbolic.expressions import Expressions
from kinegen.symbolic.forward import derive_frames
from kinegen.symbolic.hessian import derive_hessian
from kinegen.symbolic.inverse.aim import derive_axis_inverse
from kinegen.symbolic.inverse.derive import derive_inverse
from kinegen.symbolic.jacobian import derive_jacobian
from kinegen.symbolic.orientation import FORMS, JACOBIANS, derive_orientation, derive_orientation_jacobian
from kinegen.symbolic.parameters import derive_parameter_jacobian
from kinegen.symbolic.pose import derive_pose
from kinegen.symbolic.position import derive_position
from kinegen.symbolic.se3 import derive_se3
from kinegen.symbolic.velocity import derive_velocity


@lru_cache(maxsize=256)
def derive(robot: Robot, quantity: Quantity) -> Expressions:
    """Derive one kinematic quantity; a build and its proof ask for the same ones.

    Args:
        robot: The robot.
        quantity: What to derive.

    Returns:
        Exact expressions in joint variables and runtime parameters.

    Raises:
        KinegenError: If the quantity names a frame that does not exist; the message lists those that do.
    """
    if quantity.frame.isdecimal() or quantity.seen_from.isdecimal():
        known = ", ".join(dict.fromkeys((BASE, *robot.frame_names)))
        raise KinegenError(f"{quantity}: functions are named after frames, not after their numbers (expected {known})")
    match quantity.kind:
        case Kind.POSE:
            return derive_pose(robot, quantity)
        case Kind.FRAMES:
            return derive_frames(robot)
        case Kind.POSITION:
            return derive_position(robot, quantity)
        case Kind.JACOBIAN | Kind.FK_JACOBIAN:
            return derive_jacobian(robot, quantity)
        case Kind.TWIST | Kind.BIAS_ACCELERATION | Kind.ACCELERATION:
            return derive_velocity(robot, quantity)
        case Kind.HESSIAN:
            return derive_hessian(robot, quantity)
        case Kind.PARAMETER_JACOBIAN:
            return derive_parameter_jacobian(robot, quantity)
        case Kind.INVERSE_POSE | Kind.TRANSFORM_POINT | Kind.ADJOINT:
            return derive_se3(robot, quantity)
        case Kind.AXIS_INVERSE:
            return derive_axis_inverse(robot, quantity)
        case Kind.INVERSE:
            return derive_inverse(robot, quantity)
        case kind if kind in actuators_kernels.KINDS:
            return actuators_kernels.derive_actuators(robot, quantity)
        case kind if kind in FORMS:
            return derive_orientation(robot, quantity)
        case kind if kind in JACOBIANS:
            return derive_orientation_jacobian(robot, quantity)
        case _:
            raise KinegenError(f"'{quantity}' is not derived")
