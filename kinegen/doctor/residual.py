"""How far predicted poses are from observed ones, in units of what the printed digits leave open.

In: `Observations` read in some way, and predicted frames. Out: for each variant the root mean square and the worst
deviation, and whether it is within the rounding of the numbers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from kinegen.doctor import readings
from kinegen.doctor.poses import Observations
from kinegen.doctor.product import Frames
from kinegen.doctor.settings import Setting
from kinegen.doctor.table import BoolArray, FloatArray, Table

_DEGREE = math.pi / 180
_EXACT = 1e-9
"""What floats leave of a pose, relative to the reach."""


@dataclass(frozen=True, slots=True)
class Allowed:
    """How far a right prediction may be from what is written.

    Attributes:
        position: The scale of position errors, in the length unit of the poses.
        rotation: The scale of rotation errors, in radians.
        position_bound: No right prediction is farther away.
        rotation_bound: The same for rotations.
    """

    position: float
    rotation: float
    position_bound: float
    rotation_bound: float


@dataclass(frozen=True, slots=True)
class Targets:
    """Observed poses as rotations.

    Attributes:
        positions: Shape (3, 1, K).
        rotations: Columns of the rotation, shape (3, 3, 1, K): the axis first, then its coordinate; 0 where unknown.
        turned: 1 where a pose has an orientation, else 0, shape (K,).
    """

    positions: FloatArray
    rotations: FloatArray
    turned: FloatArray

    @property
    def count(self) -> int:
        """How many independent numbers are observed."""
        return int(3 * self.turned.size + 3 * self.turned.sum())


@dataclass(frozen=True, slots=True)
class Residuals:
    """Deviations of N variants, each of shape (N,).

    Attributes:
        score: Root mean square of all errors, in units of `Allowed`.
        worst: The worst error in units of its bound; at most 1 fits.
        position: The worst position error, in the length unit of the poses.
        position_rms: The root mean square of the position errors.
        rotation: The worst rotation error, in radians.
    """

    score: FloatArray
    worst: FloatArray
    position: FloatArray
    position_rms: FloatArray
    rotation: FloatArray


def targets(observed: Observations, setting: Setting) -> Targets:
    """Read the observed poses in the way of a setting."""
    positions: FloatArray = observed.positions.T[:, None]
    if not setting.form:
        return Targets(positions, np.zeros((3, 3, 1, len(observed))), np.zeros(len(observed)))
    known: BoolArray = np.asarray(~np.isnan(observed.orientations).any(axis=1))
    numbers = observed.orientations[known]
    if setting.form in readings.THREE and setting.pose_angle == "deg":
        numbers = numbers * _DEGREE
    rotation = np.zeros((len(observed), 3, 3))
    rotation[known] = readings.rotations(setting.form, numbers)
    return Targets(positions, rotation.transpose(2, 1, 0)[:, :, None], known.astype(np.float64))


def allowed(table: Table, observed: Observations, setting: Setting, tolerance: float | None) -> Allowed:
    """What rounding explains.

    Args:
        table: Its reach is the lever of every angle.
        observed: Decides the digits.
        setting: Decides the units.
        tolerance: How far the observed positions may be off, in their unit; None for what the digits say.
    """
    reach = table.reach * setting.scale
    position = max(observed.position_digit, _EXACT * reach)
    rotation = max(_rotation_digit(observed, setting), _EXACT)
    if tolerance is not None:
        position, rotation = max(position, tolerance), max(rotation, tolerance / reach)
    unit = np.where(table.prismatic, 1.0, _DEGREE if setting.joint_angle == "deg" else 1.0)
    steps = observed.joint_digit * unit * (np.abs(table.coefficients).max(axis=0, initial=0.0) > 0)
    turned, moved = float(steps[~table.prismatic].sum()), float(steps[table.prismatic].sum())
    return Allowed(position, rotation, math.sqrt(3) * position + turned * reach + moved, 3 * rotation + turned)


def _rotation_digit(observed: Observations, setting: Setting) -> float:
    """Half a unit of the last digit of an orientation, in radians."""
    digit = observed.orientation_digit
    if setting.form in readings.FOUR:
        return 2 * digit
    return digit * _DEGREE if setting.pose_angle == "deg" else digit


def residuals(predicted: Frames, wanted: Targets, limits: Allowed, *, fitted: int = 0) -> Residuals:
    """Compare.

    Args:
        predicted: Frames of N variants.
        wanted: The observed poses.
        limits: The scales.
        fitted: How many numbers were fitted to the poses.
    """
    *axes, origin = predicted
    shift = ((origin - wanted.positions) ** 2).sum(axis=0)
    turn: FloatArray = np.zeros_like(shift)
    for axis, seen in zip(axes, wanted.rotations, strict=True):
        turn += ((axis - seen) ** 2).sum(axis=0)
    # The Frobenius norm of a small difference of rotations is sqrt(2) times its angle.
    turn *= wanted.turned / 2
    free = max(wanted.count - fitted, 1)
    score = np.sqrt((shift.sum(axis=1) / limits.position**2 + turn.sum(axis=1) / limits.rotation**2) / free)
    position, rotation = np.sqrt(shift.max(axis=1)), np.sqrt(turn.max(axis=1))
    worst = np.maximum(position / limits.position_bound, rotation / limits.rotation_bound)
    return Residuals(score, worst, position, np.sqrt(np.asarray(shift.mean(axis=1))), rotation)
