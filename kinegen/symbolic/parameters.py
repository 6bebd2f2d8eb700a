"""The derivative of the pose by parameters, as calibrations take it."""

from __future__ import annotations

from kinegen.errors import KinegenError
from kinegen.outputs import Quantity
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
    signature,
    start_of,
)
from kinegen.symbolic.transforms import symbols


def derive_parameter_jacobian(robot: Robot, quantity: Quantity) -> Expressions:
    """The derivative of the pose of every tip, or of one frame, by `robot.varied_parameters`.

    Rows 0 to 2 are linear, 3 to 5 angular, in the axes of the base: column j holds the derivative of the position by
    parameter j, and the vector w of the derivative of the rotation, dR/dp = [w]x R. It is the velocity of the frame
    while the parameter alone grows at unit rate, so a joint variable and the offset beside it have the same column.

    Args:
        robot: The robot; parameters that are not runtime parameters become exact numbers.
        quantity: Of which frame.

    Returns:
        6 p entries for each frame, row by row.

    Raises:
        KinegenError: If there is no such frame, or no parameter to differentiate by.
    """
    varied = robot.varied_parameters
    if not varied:
        raise KinegenError(
            f"{quantity} takes parameters that stay arguments of the kernels: name some with --wrt "
            "(as in --wrt dh), or write runtime: true in the file"
        )
    values = symbols(robot, keep_parameters=False)
    chains = [
        transforms_between(robot, start_of(robot, quantity), frame, values) for frame in frames_of(robot, quantity)
    ]
    found = derivative(chains, [values[parameter.name] for parameter in varied], quantity.reference)
    jacobian = frame_array(robot, quantity, "jacobian", (6, len(varied)))
    return Expressions(
        signature=signature(robot, quantity, (joint_array(robot),), jacobian),
        variables=joint_symbols(robot, values),
        parameters=parameter_symbols(robot, values),
        definitions=found.definitions,
        entries=found.entries,
    )
