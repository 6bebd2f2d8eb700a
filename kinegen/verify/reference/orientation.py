"""Orientations in other forms than matrices, both ways, and how these forms change while a rotation turns.

| form | numbers | the rotation is | ranges | at the singularity |
| --- | --- | --- | --- | --- |
| `quaternion_wxyz` | w, x, y, z | of the unit quaternion | w >= 0 | none; w = 0: first of x, y, z but zeros > 0 |
| `quaternion_xyzw` | x, y, z, w | the same | the same | the same |
| `rpy_zyx` | roll, pitch, yaw | Rz(yaw) Ry(pitch) Rx(roll) | pitch within a quarter turn | pitch = +-pi/2: roll = 0 |
| `rpy_xyz` | roll, pitch, yaw | Rx(roll) Ry(pitch) Rz(yaw) | pitch within a quarter turn | pitch = +-pi/2: yaw = 0 |
| `euler_zyz` | phi, theta, psi | Rz(phi) Ry(theta) Rz(psi) | 0 <= theta <= pi | theta = 0 or pi: psi = 0 |
| `axis_angle` | x, y, z | by the vector's length about it | length <= pi | pi: the sign as of the quaternion |

Where three angles are singular, the first factor takes the whole turn; in their derivatives, the rate that they cannot
show is left out.
"""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from kinegen.model.outputs import Kind
from kinegen.support.dataclass import dataclass
from kinegen.verify.reference.exact_numbers import DIGITS

Numbers = NDArray[Any]

_NEGLIGIBLE = 1e-40
"""What 50 digits leave of a zero is zero; floats are taken as they are."""


@dataclass(frozen=True, slots=True)
class _Turns:
    """Three turns about axes 0, 1 or 2, the first factor first; `order` lists them as they are returned."""

    axes: tuple[int, int, int]
    order: tuple[int, int, int]


_TURNS = {
    Kind.RPY_ZYX: _Turns((2, 1, 0), (2, 1, 0)),
    Kind.RPY_XYZ: _Turns((0, 1, 2), (0, 1, 2)),
    Kind.EULER_ZYZ: _Turns((2, 1, 2), (0, 1, 2)),
}


class Orientation:
    """Rotations and their forms.

    Args:
        rotation: Rotation matrices, shape (N, 3, 3), of floats or of mpmath numbers (see `Kinematics.pose`).
    """

    def __init__(self, rotation: Numbers) -> None:
        self._rotation = rotation
        self._is_exact = rotation.dtype == object

    def numbers(self, form: Kind) -> Numbers:
        """Returns the rotations in a form, shape (N, 3), or (N, 4) for quaternions."""
        with mpmath.workdps(DIGITS):
            if form in _TURNS:
                angles = self._angles(_TURNS[form])
                return np.stack([angles[at] for at in _TURNS[form].order], axis=1)
            quaternion = self._quaternion()
            if form is Kind.AXIS_ANGLE:
                sine, angle = self._half(quaternion)
                return quaternion[:, 1:] * _quotient(angle, sine, 2)[:, None]
            return np.roll(quaternion, -1, axis=1) if form is Kind.QUATERNION_XYZW else quaternion

    def jacobian(self, form: Kind, angular: Numbers) -> Numbers:
        """Returns how fast these numbers change.

        `angular`: angular velocities in the axes of the base, shape (N, 3, n). Shape (N, 3, n), or (N, 4, n) for
        quaternions.
        """
        with mpmath.workdps(DIGITS):
            velocities = angular.swapaxes(1, 2)
            if form in _TURNS:
                return self._angle_rates(_TURNS[form], velocities).swapaxes(1, 2)
            quaternion = self._quaternion()
            turning = _skew(velocities) @ self._rotation[:, None]
            rates = (_outer(turning, 0) @ quaternion[:, None, :, None])[..., 0] / 4
            if form is Kind.AXIS_ANGLE:
                rates = self._vector_rates(quaternion, rates)
            elif form is Kind.QUATERNION_XYZW:
                rates = np.roll(rates, -1, axis=2)
            return rates.swapaxes(1, 2)

    def margin(self, form: Kind) -> Numbers:
        """Returns how far the numbers are from a singularity or a change of sign, shape (N,), at most 1.

        It is the cosine of the pitch, the sine of theta, or the w of the quaternion.
        """
        with mpmath.workdps(DIGITS):
            found: Numbers = self._angles(_TURNS[form])[3] if form in _TURNS else self._quaternion()[:, 0]
            return found

    def _quaternion(self) -> Numbers:
        """As w, x, y, z, by way of the largest of them (Shepperd, Quaternion from rotation matrix, 1978)."""
        outer = _outer(self._rotation, 1)
        every = np.arange(len(outer))
        largest = np.argmax(outer[:, range(4), range(4)], axis=1)
        found = self._clean(outer[every, largest] / (2 * self._sqrt(outer[every, largest, largest]))[:, None])
        leading = found[every, np.argmax(found != 0, axis=1)]
        chosen: Numbers = np.where((leading < 0)[:, None], -found, found)
        return chosen

    def _half(self, quaternion: Numbers) -> tuple[Numbers, Numbers]:
        """Returns the sine of half the angle of a rotation, and the angle."""
        sine = self._sqrt((quaternion[:, 1:] ** 2).sum(axis=1))
        return sine, 2 * self._atan2(sine, quaternion[:, 0])

    def _vector_rates(self, quaternion: Numbers, rates: Numbers) -> Numbers:
        """The derivative of the rotation vector, which is the vector part times angle / sine of half the angle."""
        sine, angle = self._half(quaternion)
        factor = _quotient(angle, sine, 2)
        axis = quaternion[:, 1:] * _quotient(1, sine, 0)[:, None]
        growth = (rates[..., 1:] * axis[:, None]).sum(axis=2)
        opening = 2 * (quaternion[:, :1] * growth - sine[:, None] * rates[..., 0])
        along = (opening - factor[:, None] * growth)[..., None] * axis[:, None]
        found: Numbers = factor[:, None, None] * rates[..., 1:] + along
        return found

    def _angles(self, turns: _Turns) -> tuple[Numbers, Numbers, Numbers, Numbers]:
        """Returns the three angles, and what vanishes at the singularity."""
        i, j, k = turns.axes
        r, m = self._rotation, 3 - i - j
        sign = 1 if (j - i) % 3 == 1 else -1
        if i == k:
            sine, cosine = self._clean(r[:, i, j]), self._clean(sign * r[:, i, m])
            size = self._sqrt(sine**2 + cosine**2)
            second = self._atan2(size, r[:, i, i])
        else:
            sine, cosine = self._clean(-sign * r[:, i, j]), self._clean(r[:, i, i])
            size = self._sqrt(sine**2 + cosine**2)
            second = self._atan2(sign * r[:, i, k], size)
        third = np.where(size == 0, 0 * size, self._atan2(sine, cosine))
        # Without the third turn, the first one alone has turned axis j.
        turned = self._clean((r @ self._turn(k, -third))[:, :, j])
        first = self._atan2(sign * turned[:, m], turned[:, j])
        return first, second, third, size

    def _angle_rates(self, turns: _Turns, velocities: Numbers) -> Numbers:
        """Take angular velocities apart along the three axes, of which the first two are at right angles."""
        i, j, k = turns.axes
        angle, _, _, size = self._angles(turns)
        first, second, third = np.eye(3)[i], self._turn(i, angle)[:, :, j], self._rotation[:, :, k]
        normal = (_skew(second) @ -first)[:, None]
        height = np.where(size == 0, 0 * size, (normal[:, 0] * third).sum(axis=1))
        last = (velocities * normal).sum(axis=2) * _quotient(1, height, 0)[:, None]
        rates = (
            velocities[..., i] - last * third[:, None, i],
            (velocities * second[:, None]).sum(axis=2),
            last,
        )
        return np.stack([rates[at] for at in turns.order], axis=2)

    def _turn(self, axis: int, angle: Numbers) -> Numbers:
        """Returns a turn about one axis, shape (N, 3, 3)."""
        if self._is_exact:
            return _turn(axis, np.frompyfunc(mpmath.sin, 1, 1)(angle), np.frompyfunc(mpmath.cos, 1, 1)(angle))
        return _turn(axis, np.sin(angle), np.cos(angle))

    def _clean(self, values: Numbers) -> Numbers:
        return np.where(np.abs(values) < _NEGLIGIBLE, 0 * values, values) if self._is_exact else values

    def _sqrt(self, values: Numbers) -> Numbers:
        found: Numbers = np.frompyfunc(mpmath.sqrt, 1, 1)(values) if self._is_exact else np.sqrt(values)
        return found

    def _atan2(self, y: Numbers, x: Numbers) -> Numbers:
        found: Numbers = np.frompyfunc(mpmath.atan2, 2, 1)(y, x) if self._is_exact else np.arctan2(y, x)
        return found


def rotations(form: Kind, numbers: Numbers) -> Numbers:
    """Returns the rotations that numbers in a form describe.

    Args:
        numbers: Floats, shape (N, 3), or (N, 4) for quaternions.

    Returns:
        Shape (N, 3, 3); no rotations where a quaternion is not of unit length.
    """
    if form in _TURNS:
        turns = _TURNS[form]
        found = np.broadcast_to(np.eye(3), (len(numbers), 3, 3))
        for axis, place in zip(turns.axes, np.argsort(turns.order)):
            found = found @ _turn(axis, np.sin(numbers[:, place]), np.cos(numbers[:, place]))
        return found
    if form is Kind.AXIS_ANGLE:
        angle = np.linalg.norm(numbers, axis=1)
        cross = _skew(numbers * _quotient(1, angle, 0)[:, None])
        s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
        turned: Numbers = np.eye(3) + s * cross + (1 - c) * (cross @ cross)
        return turned
    w, x, y, z = (np.roll(numbers, 1, axis=1) if form is Kind.QUATERNION_XYZW else numbers).T
    rows = (
        (w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z),
    )
    return np.moveaxis(np.array(rows), 2, 0)


def _outer(r: Numbers, one: int) -> Numbers:
    """Four times the products of the entries of a quaternion, of its rotation; shape (..., 4, 4)."""
    diagonal = r[..., range(3), range(3)]
    trace = diagonal.sum(axis=-1)
    found = np.zeros((*r.shape[:-2], 4, 4), dtype=r.dtype)
    found[..., 0, 0] = one + trace
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        found[..., 1 + i, 1 + i] = one + 2 * diagonal[..., i] - trace
        found[..., 0, 1 + i] = found[..., 1 + i, 0] = r[..., k, j] - r[..., j, k]
        found[..., 1 + i, 1 + j] = found[..., 1 + j, 1 + i] = r[..., i, j] + r[..., j, i]
    return found


def _turn(axis: int, sine: Numbers, cosine: Numbers) -> Numbers:
    """Returns a turn about one axis, shape (N, 3, 3)."""
    j, k = (axis + 1) % 3, (axis + 2) % 3
    found = np.zeros((*np.shape(sine), 3, 3), dtype=np.asarray(sine).dtype)
    found[..., axis, axis] = 1
    found[..., j, j] = found[..., k, k] = cosine
    found[..., k, j], found[..., j, k] = sine, -sine
    return found


def _skew(vectors: Numbers) -> Numbers:
    """Returns the matrices that multiply from the left as a cross product does, shape (..., 3, 3)."""
    found = np.zeros((*vectors.shape, 3), dtype=vectors.dtype)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        found[..., k, j], found[..., j, k] = vectors[..., i], -vectors[..., i]
    return found


def _quotient(numerator: Any, denominator: Numbers, otherwise: int) -> Numbers:
    """Returns a quotient, or another number where one cannot divide."""
    impossible = denominator == 0
    return np.where(impossible, otherwise, numerator / np.where(impossible, 1, denominator))
