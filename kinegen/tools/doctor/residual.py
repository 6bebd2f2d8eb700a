"""Predicts the poses of many variants of a table, and measures how far they are from observed ones.

A turn mixes two columns and a shift adds to the last one, so no 4x4 matrix is multiplied. Deviations are in units of
what the printed digits leave open: a root mean square, and the worst.
"""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np

from kinegen.support.dataclass import dataclass
from kinegen.tools.doctor import observed_poses
from kinegen.tools.doctor.numeric_table import BoolArray, Mount, Setting, Table
from kinegen.tools.doctor.observed_poses import FloatArray, Observations

Frames = tuple[FloatArray, FloatArray, FloatArray, FloatArray]
"""The x, y and z axes and the origin, each of shape (3, N, K), in the axes of the base."""


@dataclass(frozen=True, slots=True)
class Batch:
    """Variants of a table: constants and signs of motions of slots, (N, slots), in radians and the table's unit."""

    constants: FloatArray
    gains: FloatArray

    def __len__(self) -> int:
        """N."""
        return len(self.constants)

    def part(self, which: slice) -> Batch:
        """Return some of them."""
        return Batch(self.constants[which], self.gains[which])


def motions(table: Table, setting: Setting, q: FloatArray) -> FloatArray:
    """Return the part of each slot that moves, (slots, K), in radians and the length unit of the poses."""
    joints = np.where(table.prismatic, 1.0, np.pi / 180 if setting.joint_angle == "deg" else 1.0)
    # A length that follows an angle scales with the table, and so does, inversely, an angle that follows a length.
    factors = np.ones(table.coefficients.shape)
    turns = table.turns
    factors[np.ix_(~turns, ~table.prismatic)] = setting.scale
    factors[np.ix_(turns, table.prismatic)] = 1 / setting.scale
    found: FloatArray = (table.coefficients * factors) @ (q @ setting.matrix(len(joints)).T * joints).T
    return found


def predicted_poses(table: Table, setting: Setting, batch: Batch, q: FloatArray) -> Frames:
    """Return poses of the measured frame for every variant and joint vector, in the length unit of the poses."""
    moving = motions(table, setting, q)
    shape = (3, len(batch), len(q))
    x, y, z = (np.broadcast_to(np.eye(3)[axis][:, None, None], shape) for axis in range(3))
    origin: FloatArray = np.zeros(shape)
    axes = [x, y, z]
    # A turn mixes two of the axes, a shift adds one of them to the origin.
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
    """Return the slots from left to right, with -1 for those of a transform that is reversed."""
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
    """Return the values of one slot, shape (N or 1, K or 1)."""
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


_DEGREE = math.pi / 180
_LEAST_POSES = 5
"""Poses of which one may be wrong and the others still say something."""

_EXACT = 1e-9
"""What floats leave of a pose, relative to the reach."""


@dataclass(frozen=True, slots=True)
class Allowed:
    """Scales of errors of a right prediction, in the length unit of the poses and in radians.

    Attributes:
        position_bound: No right prediction is farther away.
        rotation_bound: The same for rotations.
    """

    position: float
    rotation: float
    position_bound: float
    rotation_bound: float


@dataclass(frozen=True, slots=True)
class Targets:
    """Observed poses as rotations, with positions of shape (3, 1, K).

    Attributes:
        rotations: Columns of the rotation, shape (3, 3, 1, K): the axis first, then its coordinate; 0 where unknown.
        turned: 1 where a pose has an orientation, else 0, shape (K,).
    """

    positions: FloatArray
    rotations: FloatArray
    turned: FloatArray

    @property
    def count(self) -> int:
        """Return how many independent numbers are observed."""
        return int(3 * self.turned.size + 3 * self.turned.sum())


@dataclass(frozen=True, slots=True)
class Residuals:
    """Deviations of N variants, each of shape (N,), in units of `Allowed` and as lengths and radians.

    Attributes:
        common: The same in units of what the file as it is leaves open, so that all readings can be compared.
        worst: The worst error in units of its bound; at most 1 fits.
        rest: The same without the few worst poses, as many as `strays` says; infinite where they are too few.
    """

    score: FloatArray
    common: FloatArray
    worst: FloatArray
    rest: FloatArray
    position: FloatArray
    position_rms: FloatArray
    rotation: FloatArray

    def of(self, variant: int) -> dict[str, float]:
        """Return the deviations of one variant by name, as a `Candidate` has them."""
        return {field.name: float(getattr(self, field.name)[variant]) for field in fields(self)}


def targets(observed: Observations, setting: Setting) -> Targets:
    """Read the observed poses in the way of a setting."""
    positions: FloatArray = observed.positions.T[:, None]
    if not setting.form:
        return Targets(positions, np.zeros((3, 3, 1, len(observed))), np.zeros(len(observed)))
    known: BoolArray = np.asarray(~np.isnan(observed.orientations).any(axis=1))
    numbers = observed.orientations[known]
    if setting.form in observed_poses.THREE and setting.pose_angle == "deg":
        numbers = numbers * _DEGREE
    rotation = np.zeros((len(observed), 3, 3))
    rotation[known] = observed_poses.rotations(setting.form, numbers)
    return Targets(positions, rotation.transpose(2, 1, 0)[:, :, None], known.astype(np.float64))


@dataclass(frozen=True, slots=True)
class Tolerance:
    """Allowances for observed poses, in their unit of length; None for what their digits say.

    Attributes:
        angle: Of orientations, in radians; where only `length` is stated, the angle that moves the reach as far.
    """

    length: float | None = None
    angle: float | None = None


EXACT = Tolerance()
"""Poses are as exact as their digits say."""


def allowed(table: Table, observed: Observations, setting: Setting, tolerance: Tolerance) -> Allowed:
    """Return what rounding explains; the reach of the table is the lever of every angle."""
    reach = table.reach * setting.scale
    position = max(observed.position_digit, _EXACT * reach)
    rotation = max(_rotation_digit(observed, setting), _EXACT)
    # Digits bound what nobody states; a stated tolerance is never made smaller than they are.
    if tolerance.length is not None:
        position = max(position, tolerance.length)
    if tolerance.angle is not None:
        rotation = max(rotation, tolerance.angle)
    elif tolerance.length is not None:
        rotation = max(rotation, tolerance.length / reach)
    # Rounded joint values turn the whole arm, whose reach is the lever.
    unit = np.where(table.prismatic, 1.0, _DEGREE if setting.joint_angle == "deg" else 1.0)
    digits = np.abs(setting.matrix(len(unit))) @ observed.joint_digit
    steps = digits * unit * (np.abs(table.coefficients).max(axis=0, initial=0.0) > 0)
    turned, moved = float(steps[~table.prismatic].sum()), float(steps[table.prismatic].sum())
    return Allowed(position, rotation, math.sqrt(3) * position + turned * reach + moved, 3 * rotation + turned)


def _rotation_digit(observed: Observations, setting: Setting) -> float:
    """Half a unit of the last digit of an orientation, in radians."""
    digit = observed.orientation_digit
    if setting.form in observed_poses.FOUR:
        return 2 * digit
    return digit * _DEGREE if setting.pose_angle == "deg" else digit


def angles(chord: FloatArray) -> FloatArray:
    """Angles of rotations from the Frobenius norms of what they differ from the identity by, over sqrt(2)."""
    half: FloatArray = np.minimum(chord / 2, 1.0)
    return 2 * np.arcsin(half)


def deviations(predicted: Frames, wanted: Targets) -> tuple[FloatArray, FloatArray]:
    """Distances and angles between predicted and observed poses, each of shape (N, K); no angle where none is known."""
    *axes, origin = predicted
    shift: FloatArray = np.sqrt(((origin - wanted.positions) ** 2).sum(axis=0))
    turn: FloatArray = np.zeros_like(shift)
    for axis, seen in zip(axes, wanted.rotations, strict=True):
        turn += ((axis - seen) ** 2).sum(axis=0)
    return shift, angles(np.sqrt(turn / 2)) * wanted.turned


def strays(count: int) -> int:
    """Return how many of some poses may disagree while the others count: one of five, or a tenth; none of fewer."""
    return max(1, count // 10) if count >= _LEAST_POSES else 0


def residuals(
    predicted: Frames, wanted: Targets, limits: Allowed, *, common: Allowed | None = None, fitted: int = 0
) -> Residuals:
    """Compare N variants with the observed poses.

    The scales `common` compare variants that are read in different ways; by default they are `limits`. `fitted` numbers
    were fitted to the poses.
    """
    shift, turn = deviations(predicted, wanted)
    squares = (shift**2).sum(axis=1), (turn**2).sum(axis=1)
    free = max(wanted.count - fitted, 1)
    # Variants that are read in other units are compared in the scales of the file as it is.
    score, alike = (
        np.sqrt((squares[0] / each.position**2 + squares[1] / each.rotation**2) / free)
        for each in (limits, common or limits)
    )
    # A pose fits by its worst deviation; a few may be strays.
    ratios = np.maximum(shift / limits.position_bound, turn / limits.rotation_bound)
    left_out = strays(shift.shape[1])
    rest = np.partition(ratios, -1 - left_out, axis=1)[:, -1 - left_out] if left_out else np.full(len(shift), np.inf)
    mean = np.sqrt(np.asarray((shift**2).mean(axis=1)))
    return Residuals(score, alike, ratios.max(axis=1), rest, shift.max(axis=1), mean, turn.max(axis=1))
