"""A Denavit-Hartenberg table as programs for URDF want it: a fixed placement before each turn about z."""

from __future__ import annotations

import math

import numpy as np

from benchmarks.speed.arm import Arm, Array, Link


def placements(arm: Arm) -> tuple[list[Array], Array]:
    """The fixed transforms of a chain.

    Args:
        arm: The robot.

    Returns:
        The transform before the turn of each joint, and the one after the last turn; 4x4 matrices.
    """
    before: list[Array] = []
    fixed = np.eye(4)
    for link in arm.links:
        left, right = _halves(link)
        if link.joint is None:
            fixed = fixed @ left @ right
        else:
            before.append(fixed @ left)
            fixed = right
    return before, fixed


def urdf(arm: Arm) -> str:
    """The chain as URDF text, from the link `base` to the link `tool`."""
    before, tail = placements(arm)
    lines = ['<robot name="arm">', '<link name="base"/>']
    parent = "base"
    for number, matrix in enumerate([*before, tail]):
        child = f"link{number}" if number < len(before) else "tool"
        kind = "continuous" if number < len(before) else "fixed"
        lines += [
            f'<link name="{child}"/>',
            f'<joint name="joint{number}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>',
            f'{_origin(matrix)}<axis xyz="0 0 1"/></joint>',
        ]
        parent = child
    return "\n".join([*lines, "</robot>"])


def _halves(link: Link) -> tuple[Array, Array]:
    """What stands left and right of the turn about z by the joint variable; the constant angle goes to the left."""
    a, d = float(link.a), float(link.d)
    twist = _turn(0, float(link.alpha)) @ _shift(a, 0.0) if not link.standard else np.eye(4)
    after = _shift(a, d) @ _turn(0, float(link.alpha)) if link.standard else _shift(0.0, d)
    return twist @ _turn(2, float(link.theta)), after


def _shift(x: float, z: float) -> Array:
    matrix = np.eye(4)
    matrix[0, 3], matrix[2, 3] = x, z
    return matrix


def _turn(axis: int, angle: float) -> Array:
    matrix = np.eye(4)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix[i, i] = matrix[j, j] = math.cos(angle)
    matrix[j, i] = math.sin(angle)
    matrix[i, j] = -matrix[j, i]
    return matrix


def _origin(matrix: Array) -> str:
    """URDF's origin: the angles about fixed x, y and z."""
    pitch = math.atan2(-matrix[2, 0], math.hypot(matrix[0, 0], matrix[1, 0]))
    if math.cos(pitch) > 1e-9:
        roll = math.atan2(matrix[2, 1], matrix[2, 2])
        yaw = math.atan2(matrix[1, 0], matrix[0, 0])
    else:
        roll, yaw = 0.0, math.atan2(-matrix[0, 1], matrix[1, 1])
    numbers = [" ".join(f"{value!r}" for value in values) for values in (matrix[:3, 3].tolist(), (roll, pitch, yaw))]
    return f'<origin xyz="{numbers[0]}" rpy="{numbers[1]}"/>'
