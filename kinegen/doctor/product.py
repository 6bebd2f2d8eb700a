"""Poses of many variants of one table, by a plain product of elementary transforms.

In: a `Table`, a `Setting` and constants and signs of N variants. Out: the columns of N x K poses. A turn mixes two
columns, a shift adds to the last one, so no 4x4 matrix is multiplied.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kinegen.doctor.settings import Mount, Setting
from kinegen.doctor.table import FloatArray, Table

Frames = tuple[FloatArray, FloatArray, FloatArray, FloatArray]
"""The x, y and z axes and the origin, each of shape (3, N, K), in the axes of the base."""


@dataclass(frozen=True, slots=True)
class Batch:
    """Variants of a table.

    Attributes:
        constants: Constant of each slot, shape (N, slots); radians and the table's length unit.
        gains: Sign of the motion of each slot, shape (N, slots).
    """

    constants: FloatArray
    gains: FloatArray

    def __len__(self) -> int:
        """N."""
        return len(self.constants)

    def part(self, which: slice) -> Batch:
        """Some of them."""
        return Batch(self.constants[which], self.gains[which])


def motions(table: Table, setting: Setting, q: FloatArray) -> FloatArray:
    """The part of each slot that moves.

    Args:
        table: The table.
        setting: Decides the units.
        q: Joint values as they are written, shape (K, dof).

    Returns:
        Shape (slots, K), in radians and the length unit of the poses.
    """
    joints = np.where(table.prismatic, 1.0, np.pi / 180 if setting.joint_angle == "deg" else 1.0)
    # A length that follows an angle scales with the table, and so does, inversely, an angle that follows a length.
    factors = np.ones(table.coefficients.shape)
    turns = table.turns
    factors[np.ix_(~turns, ~table.prismatic)] = setting.scale
    factors[np.ix_(turns, table.prismatic)] = 1 / setting.scale
    found: FloatArray = (table.coefficients * factors) @ (q * joints).T
    return found


def poses(table: Table, setting: Setting, batch: Batch, q: FloatArray) -> Frames:
    """Poses of the measured frame for every variant and joint vector, in the length unit of the poses."""
    moving = motions(table, setting, q)
    shape = (3, len(batch), len(q))
    x, y, z = (np.broadcast_to(np.eye(3)[axis][:, None, None], shape) for axis in range(3))
    origin: FloatArray = np.zeros(shape)
    axes = [x, y, z]
    for place, sign in _sequence(table, setting):
        kind = table.slots[place].kind
        value = _values(batch, place, moving[place]) if kind.is_rotation else None
        if value is not None:
            _turn(axes, kind.axis, sign * value)
            continue
        length = _values(batch, place, moving[place], setting.scale)
        if length.any():
            origin = origin + axes[kind.axis] * (sign * length)
    return axes[0], axes[1], axes[2], origin


def _sequence(table: Table, setting: Setting) -> list[tuple[int, int]]:
    """The slots from left to right, with -1 for those of a transform that is reversed."""
    rows = [(place, 1) for row in table.rows for place in row.order(setting.convention)]
    return [*_mount(table.base, setting.base), *rows, *_mount(table.tail, setting.tail)]


def _mount(slots: tuple[int, ...], mount: Mount) -> list[tuple[int, int]]:
    match mount:
        case Mount.GIVEN:
            return [(place, 1) for place in slots]
        case Mount.REVERSED:
            return [(place, -1) for place in reversed(slots)]
        case _:
            return []


def _values(batch: Batch, place: int, moving: FloatArray, scale: float = 1.0) -> FloatArray:
    """The values of one slot, shape (N or 1, K or 1)."""
    constants, gains = batch.constants[:, place, None] * scale, batch.gains[:, place, None]
    if len(batch) and (constants == constants[0]).all():
        constants = constants[:1]
    if not moving.any():
        return constants
    if len(batch) and (gains == gains[0]).all():
        gains = gains[:1]
    return constants + gains * moving


def _turn(axes: list[FloatArray], axis: int, angle: FloatArray) -> None:
    """Turn about one of the own axes."""
    if not angle.any():
        return
    first, second = (axis + 1) % 3, (axis + 2) % 3
    c, s = np.cos(angle), np.sin(angle)
    axes[first], axes[second] = c * axes[first] + s * axes[second], c * axes[second] - s * axes[first]
