"""The symbolic stage: a robot and a quantity in, expressions out."""

from __future__ import annotations

from functools import lru_cache

from kinegen.derive.expressions import Expressions
from kinegen.errors import KinegenError
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import BASE, Robot


@lru_cache(maxsize=256)
def derive(robot: Robot, quantity: Quantity) -> Expressions:
    """Derive one kinematic quantity; parameters that are not runtime parameters become exact numbers.

    Returns:
        Exact expressions in joint variables and runtime parameters.

    Raises:
        KinegenError: If the quantity names a frame that does not exist; the message lists those that do.
    """
    if quantity.frame.isdecimal() or quantity.seen_from.isdecimal():
        known = ", ".join(dict.fromkeys((BASE, *robot.frame_names)))
        raise KinegenError(f"{quantity}: functions are named after frames, not after their numbers (expected {known})")
    return _derived(robot, quantity)


def _derived(robot: Robot, quantity: Quantity) -> Expressions:
    """Import the module of a quantity when it is asked for: a pose needs no class of inverses."""
    match quantity.kind:
        case Kind.POSE:
            from kinegen.derive.pose import derive_pose

            return derive_pose(robot, quantity)
        case Kind.FRAMES:
            from kinegen.derive.frame_poses import derive_frames

            return derive_frames(robot)
        case Kind.POSITION:
            from kinegen.derive.pose import derive_position

            return derive_position(robot, quantity)
        case Kind.TWIST | Kind.BIAS_ACCELERATION | Kind.ACCELERATION:
            from kinegen.derive.velocity import derive_velocity

            return derive_velocity(robot, quantity)
        case Kind.JACOBIAN | Kind.FK_JACOBIAN:
            from kinegen.derive.jacobian import derive_jacobian

            return derive_jacobian(robot, quantity)
        case Kind.HESSIAN:
            from kinegen.derive.jacobian import derive_hessian

            return derive_hessian(robot, quantity)
        case Kind.PARAMETER_JACOBIAN:
            from kinegen.derive.jacobian import derive_parameter_jacobian

            return derive_parameter_jacobian(robot, quantity)
        case Kind.INVERSE_POSE | Kind.TRANSFORM_POINT | Kind.ADJOINT:
            from kinegen.derive.frame_poses import derive_se3

            return derive_se3(robot, quantity)
        case Kind.AXIS_INVERSE:
            from kinegen.derive.inverse.five_axis import derive_axis_inverse

            return derive_axis_inverse(robot, quantity)
        case Kind.INVERSE:
            from kinegen.derive.inverse.derive import derive_inverse

            return derive_inverse(robot, quantity)
        case Kind.ACTUATORS_TO_JOINTS | Kind.JOINTS_TO_ACTUATORS | Kind.FK_ACTUATORS | Kind.JACOBIAN_ACTUATORS:
            from kinegen.derive.actuators import derive_actuators

            return derive_actuators(robot, quantity)
        case _:
            from kinegen.derive import orientation

            if quantity.kind in orientation.FORMS:
                return orientation.derive_orientation(robot, quantity)
            if quantity.kind in orientation.JACOBIANS:
                return orientation.derive_orientation_jacobian(robot, quantity)
            raise KinegenError(f"'{quantity}' is not derived")
