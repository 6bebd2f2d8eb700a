"""Positions and Jacobians modulo a prime as the definitions have them, whatever they cost."""

from __future__ import annotations

from tests.operations.chain import Angle
from tests.operations.field import Number, Vector, cosine_sine, length, number
from tests.operations.tables import Mount, Row, Table

ZERO, ONE = Number(0, is_constant=True), Number(1, is_constant=True)


class Frame:
    """A frame in the base: the columns of its rotation, and where it is."""

    def __init__(self) -> None:
        self.columns: list[Vector] = [(ONE, ZERO, ZERO), (ZERO, ONE, ZERO), (ZERO, ZERO, ONE)]
        self.origin: Vector = (ZERO, ZERO, ZERO)

    def turn(self, axis: int, angle: Angle) -> None:
        """Turns the frame about an axis of its own."""
        c, s = cosine_sine(angle)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        a, b = self.columns[i], self.columns[j]
        self.columns[i] = _combined(c, a, s, b)
        self.columns[j] = _combined(-s, a, c, b)

    def shift(self, axis: int, size: Number) -> None:
        """Shifts the frame along an axis of its own."""
        self.origin = _combined(ONE, self.origin, size, self.columns[axis])

    def about_x(self, row: Row) -> None:
        """The twist and the length of a row, which commute."""
        self.turn(0, Angle((), float(row.alpha)))
        self.shift(0, length(row.a))

    def about_z(self, joint: int, row: Row) -> None:
        """The angle and the offset of a row, one of them with the joint variable."""
        self.turn(2, Angle(((joint, row.sign),) if row.is_turning else (), float(row.theta)))
        self.shift(2, length(row.d))
        if not row.is_turning:
            self.shift(2, number(f"q{joint}").times(row.sign))


def _combined(a: Number, x: Vector, b: Number, y: Vector) -> Vector:
    first, second, third = (a * p + b * q for p, q in zip(x, y, strict=True))
    return first, second, third


def jacobian(table: Table) -> list[tuple[Vector, Vector]]:
    """The linear and the angular part of each joint's column, in the axes of the base."""
    frame = Frame()
    joints = []
    for row in table.rows:
        if isinstance(row, Mount):
            for axis, size in enumerate(row.xyz):
                frame.shift(axis, length(size))
            for axis, angle in row.turns:
                frame.turn(axis, Angle((), float(angle)))
            continue
        joint = len(joints)
        if table.convention == "modified":
            frame.about_x(row)
        axis, origin = frame.columns[2], frame.origin
        joints.append((row, _combined(ONE.times(row.sign), axis, ZERO, axis), origin))
        frame.about_z(joint, row)
        if table.convention == "standard":
            frame.about_x(row)
    for axis, size in enumerate(table.tool):
        frame.shift(axis, length(size))
    columns = []
    for row, axis, origin in joints:
        x, y, z = _combined(ONE, frame.origin, -ONE, origin)
        a, b, c = axis
        moment = (b * z + -(c * y), c * x + -(a * z), a * y + -(b * x))
        columns.append((moment, axis) if row.is_turning else (axis, (ZERO, ZERO, ZERO)))
    return columns
