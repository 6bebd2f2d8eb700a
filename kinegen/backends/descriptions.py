"""What the quantities and the arrays of kernels are, in the words that headers and docstrings print."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType

from kinegen.model.outputs import Array, Kind, Quantity, Reference, Signature

_PLACES = (Kind.POSE, Kind.FRAMES, Kind.POSITION)
_ROWS = "rows linear velocity, then angular"

_BRIEF: Mapping[Kind, str] = MappingProxyType(
    {
        Kind.POSE: "Pose of {frame} in {base_frame}",
        Kind.FRAMES: "Poses of all links and named frames in the base frame",
        Kind.POSITION: "Position of {origin} in {base_frame}",
        Kind.JACOBIAN: f"Geometric Jacobian of {{frame}}, {_ROWS}, {{reference}}",
        Kind.FK_JACOBIAN: f"Pose of {{frame}} in {{base_frame}} and its geometric Jacobian, {_ROWS}, {{reference}}",
        Kind.TWIST: "Twist of {frame}, linear velocity, then angular, {reference}",
        Kind.BIAS_ACCELERATION: "Acceleration of {frame} without joint acceleration (dJ/dt qd), linear, then angular, "
        "{reference}",
        Kind.ACCELERATION: "Acceleration of {frame} (J qdd + dJ/dt qd), linear, then angular, {reference}",
        Kind.HESSIAN: "Derivative of the geometric Jacobian of {frame}: block k holds dJ/dq[k], " + _ROWS,
        Kind.QUATERNION_WXYZ: "Orientation of {frame} as a unit quaternion w, x, y, z with w >= 0",
        Kind.QUATERNION_XYZW: "Orientation of {frame} as a unit quaternion x, y, z, w with w >= 0",
        Kind.RPY_ZYX: "Orientation of {frame} as roll, pitch, yaw with R = Rz(yaw) Ry(pitch) Rx(roll)",
        Kind.RPY_XYZ: "Orientation of {frame} as roll, pitch, yaw with R = Rx(roll) Ry(pitch) Rz(yaw)",
        Kind.EULER_ZYZ: "Orientation of {frame} as angles phi, theta, psi with R = Rz(phi) Ry(theta) Rz(psi)",
        Kind.AXIS_ANGLE: "Orientation of {frame} as a rotation vector: its axis times the angle in 0 to pi",
        Kind.QUATERNION_WXYZ_JACOBIAN: "Derivative of the quaternion w, x, y, z of {frame} by the joint variables",
        Kind.QUATERNION_XYZW_JACOBIAN: "Derivative of the quaternion x, y, z, w of {frame} by the joint variables",
        Kind.RPY_ZYX_JACOBIAN: "Derivative of roll, pitch, yaw (Rz Ry Rx) of {frame} by the joint variables",
        Kind.RPY_XYZ_JACOBIAN: "Derivative of roll, pitch, yaw (Rx Ry Rz) of {frame} by the joint variables",
        Kind.EULER_ZYZ_JACOBIAN: "Derivative of the angles phi, theta, psi (zyz) of {frame} by the joint variables",
        Kind.AXIS_ANGLE_JACOBIAN: "Derivative of the rotation vector of {frame} by the joint variables",
        Kind.PARAMETER_JACOBIAN: f"Motion of {{frame}} for each parameter, {_ROWS}, {{reference}}",
        Kind.INVERSE_POSE: "Inverse of a pose",
        Kind.TRANSFORM_POINT: "A point of frame b, given the pose of b in a, as a point of frame a",
        Kind.ADJOINT: "Adjoint of a pose of b in a: it transforms twists, linear, then angular, from b to a",
        Kind.ACTUATORS_TO_JOINTS: "Joint vector for readings of the actuators",
        Kind.JOINTS_TO_ACTUATORS: "Readings of the actuators for a joint vector",
        Kind.FK_ACTUATORS: "Pose of {frame} in {base_frame} for readings of the actuators",
        Kind.JACOBIAN_ACTUATORS: f"Actuator Jacobian of {{frame}}, {_ROWS}, {{reference}}",
        Kind.AXIS_INVERSE: "Both joint vectors for a point and a direction of {frame} in {base_frame}, and which are "
        "solutions",
        Kind.INVERSE: "Joint values of all branches for a pose of {frame}, and which of them are solutions",
    }
)

_NAMED_BASE = (Kind.POSE, Kind.POSITION, Kind.FK_JACOBIAN, Kind.FK_ACTUATORS, Kind.AXIS_INVERSE, Kind.INVERSE)
"""Kinds whose sentence names the frame in which the result is."""

_REFERENCE: Mapping[Reference, str] = MappingProxyType(
    {
        Reference.LOCAL_WORLD_ALIGNED: "at its origin in the axes of {base}",
        Reference.LOCAL: "at its origin in its own axes",
        Reference.WORLD: "at the origin of {base} in the axes of {base}",
    }
)

_INPUT: Mapping[str, str] = MappingProxyType(
    {
        "q": "joint vector",
        "joints": "joint vector",
        "actuators": "readings of the actuators",
        "qd": "joint velocities, per second",
        "qdd": "joint accelerations, per second squared",
        "base_T_tool": "pose of the tool in the base frame, 4x4 matrix, row by row, its rotation orthonormal",
        "redundancy": "value of the joint that is given, or the arm angle",
        "q_near": "joint vector, to choose among whole turns and where a joint is free",
        "a_T_b": "pose of a frame b in a frame a, 4x4 matrix, row by row",
    }
)

_RESULT: Mapping[str, str] = MappingProxyType(
    {
        "twist": "linear velocity x, y, z, then angular",
        "bias_acceleration": "linear acceleration x, y, z, then angular",
        "acceleration": "linear acceleration x, y, z, then angular",
        "joints": "joint vector",
        "actuators": "readings of the actuators",
        "valid": "1 or 0 for each branch",
        "quaternion_wxyz": "w, x, y, z; w >= 0",
        "quaternion_xyzw": "x, y, z, w; w >= 0",
        "rpy_zyx": "roll, pitch, yaw; at pitch +-pi/2 roll is 0",
        "rpy_xyz": "roll, pitch, yaw; at pitch +-pi/2 yaw is 0",
        "euler_zyz": "phi, theta, psi; at theta 0 and pi psi is 0",
        "axis_angle": "x, y, z",
        "a_p": "x, y, z",
        "b_p": "x, y, z",
    }
)


def subject(quantities: Iterable[Quantity]) -> str:
    """Return what files of these quantities are about."""
    return "Forward kinematics" if all(quantity.kind in _PLACES for quantity in quantities) else "Kinematics"


def brief(signature: Signature) -> str:
    """Return what a kernel computes, in one sentence."""
    quantity = signature.quantity
    frame, origin = "the tool", "the tool's origin"
    if quantity.frame:
        frame, origin = f"frame {quantity.frame}", f"the origin of frame {quantity.frame}"
    elif any(array.per_frame for array in signature.results):
        frame, origin = "each tip", "the origin of each tip"
    base_frame = f"frame {quantity.seen_from}" if quantity.seen_from else "the base frame"
    if quantity.kind is Kind.INVERSE and quantity.frame:
        frame = f"{frame} in {base_frame}"
    reference = _REFERENCE[quantity.reference].format(base=base_frame if quantity.seen_from else "the base")
    text = _BRIEF[quantity.kind].format(frame=frame, origin=origin, reference=reference, base_frame=base_frame)
    if quantity.seen_from and quantity.kind not in _NAMED_BASE:
        text = f"{text}, seen from {base_frame}"
    return f"{text}."


_SUMMARY = 104
"""Characters of the first line of a docstring."""


def summary(text: str) -> tuple[str, ...]:
    """A sentence as the paragraphs of a docstring, whose first is a line: what is computed, then how it is arranged."""
    if len(text) <= _SUMMARY:
        return (text,)
    what, _, how = text.partition(", ")
    return (f"{what}.", how[0].upper() + how[1:])


def frames_text(is_tree: bool) -> str:
    """Return what matrices mean."""
    maps, owner = ("base_T_tool maps coordinates in frame tool", "tool")
    if is_tree:
        maps, owner = ("base_T_tips maps, for each tip, coordinates in the frame of the tip", "tip")
    return (
        f"Frames: {maps} to coordinates in frame base; its columns are the axes of the {owner} and its origin, all in "
        "base. Matrices are 4x4, row by row, with the last row 0 0 0 1."
    )


def input_text(array: Array) -> str:
    """Return what an input holds."""
    if "_z_" in array.name and array.shape == (3,):
        return "direction of the z axis, x, y, z, of any length"
    return array.words or _INPUT.get(array.name) or result_text(array)


def result_text(array: Array) -> str:
    """Return what a result holds for one frame."""
    if array.is_pose:
        return "4x4 matrix, row by row"
    shape = array.shape[1:] if array.per_frame else array.shape
    if array.is_point:
        return "x, y, z"
    if array.name in _RESULT:
        return _RESULT[array.name]
    if len(shape) == 1:
        return f"x, y, z of {shape[0] // 3} points" if "_p_" in array.name else f"{shape[0]} numbers"
    return f"{'x'.join(map(str, shape))} {'matrix' if len(shape) == 2 else 'array'}, row by row"
