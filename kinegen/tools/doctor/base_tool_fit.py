"""An unknown base or tool, in closed form, for thousands of variants of a table at once.

In: frames that were predicted without the unknown transform, and the observed poses. Out: the transform for each
variant that fits them best, and the frames with it. A base is a rigid fit of point sets with directions (Kabsch), a
tool the same in the axes of the tip, and both together are A X = Y B (Park and Martin, 1994): rotation axes of relative
motions first, then linear equations.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from kinegen.support.dataclass import dataclass
from kinegen.tools.doctor import observed_poses
from kinegen.tools.doctor.numeric_table import BoolArray
from kinegen.tools.doctor.observed_poses import FloatArray
from kinegen.tools.doctor.residual import Allowed, Frames, Targets

_PAIRS_OF = 12
"""Poses of which all pairs are compared; more add nothing."""

_LEVEL = 1e-3
"""A cosine of the pitch below which roll and yaw turn about the same axis."""

_PARALLEL = 0.02
"""Axes of relative motions that deviate less than this from one direction do not determine a base and a tool."""

_SLACK = 4.0
"""How many bounds two poses may differ in what no base or tool changes."""


@dataclass(frozen=True, slots=True)
class Fit:
    """Transforms that were solved for, (N, 4, 4), None where one is not unknown, and the frames with them."""

    base: FloatArray | None
    tail: FloatArray | None
    frames: Frames

    @property
    def numbers(self) -> int:
        """Return how many numbers were fitted."""
        return 6 * ((self.base is not None) + (self.tail is not None))


def plausible(predicted: Frames, wanted: Targets, limits: Allowed, *, base: bool, tail: bool) -> BoolArray:
    """Return which variants agree with the poses in what the unknown transforms cannot change, shape (N,) of booleans.

    A base keeps distances between tips. Base and tool together keep the angles of relative rotations.
    """
    *axes, origin = predicted
    found = np.ones(origin.shape[1], dtype=bool)
    for i, j in combinations(range(min(origin.shape[2], _PAIRS_OF)), 2):
        # A tool changes distances between tips, a base does not.
        if base and not tail:
            apart = np.linalg.norm(origin[:, :, i] - origin[:, :, j], axis=0)
            seen = np.linalg.norm(wanted.positions[:, :, i] - wanted.positions[:, :, j], axis=0)
            found &= np.abs(apart - seen) <= _SLACK * limits.position_bound
        # Neither changes the angle of a relative rotation, which the trace of it shows.
        if wanted.turned[i] and wanted.turned[j]:
            ours = sum((axis[:, :, i] * axis[:, :, j]).sum(axis=0) for axis in axes)
            theirs = sum((axis[:, :, i] * axis[:, :, j]).sum(axis=0) for axis in wanted.rotations)
            found &= np.abs(ours - theirs) <= _SLACK * 2 * limits.rotation_bound
    return found


def turn_about_one_axis(wanted: Targets) -> bool:
    """Tell whether all observed orientations differ by turns about parallel axes, as those of a SCARA do.

    Base and tool together are then not determined by the orientations, and are not solved for.
    """
    seen = wanted.rotations.transpose(2, 3, 1, 0)
    sizes = np.linalg.svd(_relative(seen, _pairs(wanted.turned > 0))[0], compute_uv=False)
    return bool(sizes[1] < _PARALLEL * sizes[0] or sizes[0] < _PARALLEL)


def fit(predicted: Frames, wanted: Targets, limits: Allowed, *, base: bool, tail: bool) -> Fit:
    """Solve for the base, the tool, or both, from frames without them.

    Both unknown take orientations, and a tool gets none where no pose has one. The limits weigh positions against
    rotations.
    """
    rotation = np.stack(predicted[:3], axis=-1).transpose(1, 2, 0, 3)
    origin = predicted[3].transpose(1, 2, 0)
    seen = wanted.rotations.transpose(2, 3, 1, 0)
    places = wanted.positions.transpose(1, 2, 0)
    known = wanted.turned > 0
    # Each case has a solution in closed form of its own.
    left = right = None
    if base and tail:
        left, right = _both(rotation, origin, seen, places, known)
    elif base:
        left = _base(rotation, origin, seen, places, limits)
    else:
        right = _tail(rotation, origin, seen, places)
    return Fit(left, right, _mounted(rotation, origin, left, right))


def _base(
    rotation: FloatArray, origin: FloatArray, seen: FloatArray, places: FloatArray, limits: Allowed
) -> FloatArray:
    ours, theirs = origin.mean(axis=1), places.mean(axis=1)
    spread = np.einsum("nki,nkj->nij", np.broadcast_to(places - theirs[:, None], origin.shape), origin - ours[:, None])
    turns = np.einsum("mkil,nkjl->nij", seen, rotation)
    found = _nearest(spread / limits.position**2 + turns / (2 * limits.rotation**2))
    return _matrix(found, theirs - np.einsum("nij,nj->ni", found, ours))


def _tail(rotation: FloatArray, origin: FloatArray, seen: FloatArray, places: FloatArray) -> FloatArray:
    lever = np.einsum("nkji,nkj->ni", rotation, places - origin) / origin.shape[1]
    turns = np.einsum("nkji,mkjl->nil", rotation, seen)
    if not seen.any():
        turns = np.broadcast_to(np.eye(3), turns.shape)
    return _matrix(_nearest(turns), lever)


def _both(
    rotation: FloatArray, origin: FloatArray, seen: FloatArray, places: FloatArray, known: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """R_seen = R_base R R_tail: the axis of each relative motion is turned by the tail alone."""
    pairs = _pairs(known)
    tail = _nearest(np.einsum("npi,mpj->nij", _relative(rotation, pairs), _relative(seen, pairs)))
    turned = np.einsum("nkij,njl->nkil", rotation, tail)
    base = _nearest(np.einsum("mkil,nkjl->nij", seen, turned))
    # What remains is linear: places = base (R t + origin) + shift.
    levers = np.einsum("nij,nkjl->nkil", base, rotation)
    rest = places - np.einsum("nij,nkj->nki", base, origin)
    centred, rest_centred = levers - levers.mean(axis=1, keepdims=True), rest - rest.mean(axis=1, keepdims=True)
    normal = np.einsum("nkij,nkil->njl", centred, centred)
    right = np.einsum("nkij,nki->nj", centred, rest_centred)
    t = np.einsum("nij,nj->ni", np.linalg.pinv(normal, rcond=1e-9, hermitian=True), right)
    shift = rest.mean(axis=1) - np.einsum("nij,nj->ni", levers.mean(axis=1), t)
    return _matrix(base, shift), _matrix(tail, t)


def _pairs(known: BoolArray) -> NDArray[np.intp]:
    """Pairs of poses with orientation, shape (pairs, 2)."""
    return np.array(list(combinations(np.flatnonzero(known)[:_PAIRS_OF], 2)), dtype=np.intp).reshape(-1, 2)


def _relative(rotation: FloatArray, pairs: NDArray[np.intp]) -> FloatArray:
    """Return the axis of the motion between each pair of poses, in the axes of the first, shape (N, pairs, 3)."""
    return _axes(np.einsum("npji,npjl->npil", rotation[:, pairs[:, 0]], rotation[:, pairs[:, 1]]))


def _axes(rotation: FloatArray) -> FloatArray:
    """Return the axis of each rotation times twice the sine of its angle; it is smooth also at half a turn."""
    m = rotation
    parts = m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]
    return np.stack(parts, axis=-1)


def _nearest(matrix: FloatArray) -> FloatArray:
    """Return the rotation for which the trace of its transpose times the matrix is largest, shape (N, 3, 3)."""
    u, _, v = np.linalg.svd(matrix)
    sign = np.ones((*matrix.shape[:-2], 3))
    sign[..., 2] = np.linalg.det(u @ v)
    found: FloatArray = (u * sign[..., None, :]) @ v
    return found


def _matrix(rotation: FloatArray, shift: FloatArray) -> FloatArray:
    found = np.zeros((len(rotation), 4, 4))
    found[:, :3, :3], found[:, :3, 3], found[:, 3, 3] = rotation, shift, 1
    return found


def _mounted(rotation: FloatArray, origin: FloatArray, left: FloatArray | None, right: FloatArray | None) -> Frames:
    """Return the frames behind a base and in front of a tool."""
    if right is not None:
        origin = origin + np.einsum("nkij,nj->nki", rotation, right[:, :3, 3])
        rotation = np.einsum("nkij,njl->nkil", rotation, right[:, :3, :3])
    if left is not None:
        origin = np.einsum("nij,nkj->nki", left[:, :3, :3], origin) + left[:, None, :3, 3]
        rotation = np.einsum("nij,nkjl->nkil", left[:, :3, :3], rotation)
    x, y, z = (rotation[..., axis].transpose(2, 0, 1) for axis in range(3))
    return x, y, z, origin.transpose(2, 0, 1)


def mounted(predicted: Frames, left: FloatArray | None, right: FloatArray | None) -> Frames:
    """Return frames with a base and a tool, (N, 4, 4) or None, that were solved for."""
    rotation = np.stack(predicted[:3], axis=-1).transpose(1, 2, 0, 3)
    return _mounted(rotation, predicted[3].transpose(1, 2, 0), left, right)


def round_mount(matrix: FloatArray, degrees: float, length: float) -> FloatArray:
    """Return a transform, shape (4, 4), with roll, pitch, yaw and lengths rounded to multiples of these steps."""
    turned = matrix[None, :3, :3]
    if np.hypot(matrix[0, 0], matrix[1, 0]) < _LEVEL:
        # The pitch is a quarter turn, where only one combination of roll and yaw is determined: roll becomes 0.
        turn = -matrix[2, 0] * np.pi / 2
        yaw = np.arctan2(-matrix[0, 1], matrix[1, 1])
        turned = observed_poses.rotations("rpy", np.array([[0.0, turn, yaw]]))
    step = np.radians(degrees)
    rotation = observed_poses.rotations("rpy", np.round(observed_poses.numbers_of("rpy", turned) / step) * step)
    # A decimal step, so that the numbers are short.
    unit = 10.0 ** np.floor(np.log10(length))
    found: FloatArray = _matrix(rotation, np.round(matrix[None, :3, 3] / unit) * unit)[0]
    return found
