"""The signatures of the quantities: which arrays a kernel is given and gives, for one robot."""

from __future__ import annotations

import sympy as sp

from kinegen.outputs import Array, Kind, Quantity, Signature
from kinegen.robot.model import Robot
from kinegen.symbolic.transforms import Values

TIP = "tool"
"""What the arrays of a chain call its tip."""


def frames_of(robot: Robot, quantity: Quantity) -> tuple[str, ...]:
    """The frames for which a quantity is computed: one that is named, all, or the tips."""
    if quantity.frame:
        return (quantity.frame,)
    return robot.frame_names if quantity.kind is Kind.FRAMES else robot.tips


def start_of(robot: Robot, quantity: Quantity) -> str:
    """The frame in which the frames of a quantity are seen: the base, unless it names another."""
    return quantity.seen_from or robot.root


def joint_array(robot: Robot, name: str = "q") -> Array:
    """The joint vector, or its rates."""
    return Array(name, (robot.dof,))


def pose_array(robot: Robot, quantity: Quantity) -> Array:
    """The poses of the frames of a quantity in the base frame, or in the frame from which they are seen."""
    if per_frame(robot, quantity):
        return Array(f"base_T_{_plural(quantity)}", (len(frames_of(robot, quantity)), 4, 4), True, True)
    return Array(f"{quantity.seen_from or 'base'}_T_{quantity.frame or TIP}", (4, 4), True)


def point_array(robot: Robot, quantity: Quantity) -> Array:
    """The positions of the frames of a quantity in the base frame, or in the frame from which they are seen."""
    name = _plural(quantity) if per_frame(robot, quantity) else quantity.frame or TIP
    return frame_array(robot, quantity, f"{quantity.seen_from or 'base'}_p_{name}", (3,))


def frame_array(robot: Robot, quantity: Quantity, name: str, shape: tuple[int, ...]) -> Array:
    """An array of the same shape for each frame of a quantity; a single frame has no axis of its own."""
    if per_frame(robot, quantity):
        return Array(name, (len(frames_of(robot, quantity)), *shape), per_frame=True)
    return Array(name, shape)


def per_frame(robot: Robot, quantity: Quantity) -> bool:
    """Whether the results have an axis that counts frames."""
    return quantity.kind is Kind.FRAMES or (robot.is_tree and not quantity.frame)


def signature(robot: Robot, quantity: Quantity, inputs: tuple[Array, ...], *results: Array) -> Signature:
    """The signature of a quantity with these arrays."""
    return Signature(quantity, frames_of(robot, quantity), robot.dof, inputs, results)


def joint_symbols(robot: Robot, values: Values) -> tuple[sp.Symbol, ...]:
    """The symbols of the joint vector, in order."""
    return tuple(values[variable.name] for variable in robot.variables)


def parameter_symbols(robot: Robot, values: Values) -> tuple[sp.Symbol, ...]:
    """The symbols of the runtime parameters, in order."""
    return tuple(values[parameter.name] for parameter in robot.runtime_parameters)


def _plural(quantity: Quantity) -> str:
    return "frames" if quantity.kind is Kind.FRAMES else "tips"
