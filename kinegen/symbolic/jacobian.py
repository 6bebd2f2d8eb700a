"""The geometric Jacobian, alone and together with the pose."""

from __future__ import annotations

from kinegen.outputs import Kind, Quantity
from kinegen.robot.model import Robot
from kinegen.symbolic.chain import transforms_between
from kinegen.symbolic.derivative import derivative
from kinegen.symbolic.expressions import Expressions
from kinegen.symbolic.signatures import (
    frame_array,
    frames_of,
    joint_array,
    joint_symbols,
    parameter_symbols,
    pose_array,
    signature,
    start_of,
)
from kinegen.symbolic.transforms import symbols


def derive_jacobian(robot: Robot, quantity: Quantity) -> Expressions:
    """The Jacobian of every tip, or of one frame, and its pose where the quantity is `fk_jacobian`.

    Rows 0 to 2 are linear, 3 to 5 angular; column j is the velocity for joint rate j alone (Siciliano et al., Robotics,
    2009, eq. 3.30; Craig, Introduction to Robotics, 3rd ed., section 5.7). A joint that others follow moves them too.

    - `local_world_aligned`: linear velocity of the frame's origin, and angular velocity, in the axes of the base (0J);
    - `local`: both in the axes of the frame;
    - `world`: linear velocity of the point of the frame's body that passes through the origin of the base, in the axes
      of the base.

    Args:
        robot: The robot; parameters that are not runtime parameters become exact numbers.
        quantity: A Jacobian or a pose with its Jacobian, in which reference and of which frame.

    Returns:
        Twelve entries for each frame where the pose is asked for, then 6 n entries for each frame.

    Raises:
        KinegenError: If there is no such frame.
    """
    values = symbols(robot, keep_parameters=False)
    joints = joint_symbols(robot, values)
    with_poses = quantity.kind is Kind.FK_JACOBIAN
    chains = [
        transforms_between(robot, start_of(robot, quantity), frame, values) for frame in frames_of(robot, quantity)
    ]
    found = derivative(chains, joints, quantity.reference, with_poses)
    jacobian = frame_array(robot, quantity, "jacobian", (6, robot.dof))
    results = (pose_array(robot, quantity), jacobian) if with_poses else (jacobian,)
    return Expressions(
        signature=signature(robot, quantity, (joint_array(robot),), *results),
        variables=joints,
        parameters=parameter_symbols(robot, values),
        definitions=found.definitions,
        entries=found.entries,
    )
