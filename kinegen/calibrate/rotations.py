"""Rotations (N, 3, 3) and what they are written as; R = Rz(yaw) Ry(pitch) Rx(roll)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_SMALL = 1e-4


def cross(vectors: Floats) -> Floats:
    """The matrices [v]x, (N, 3, 3), of vectors (N, 3)."""
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)


def from_vector(vectors: Floats) -> Floats:
    """Rotations by rotation vectors (N, 3), in radians."""
    angle = np.linalg.norm(vectors, axis=1)[:, None, None]
    k = cross(vectors)
    found: Floats = np.eye(3) + np.sinc(angle / np.pi) * k + np.sinc(angle / 2 / np.pi) ** 2 / 2 * k @ k
    return found


def from_quaternion(quaternions: Floats) -> Floats:
    """Rotations by quaternions w, x, y, z (N, 4), of any length but zero."""
    w, x, y, z = (quaternions / np.linalg.norm(quaternions, axis=1)[:, None]).T
    rows = [
        1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
        2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
        2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
    ]  # fmt: skip
    return np.stack(rows, axis=1).reshape(-1, 3, 3)


def from_rpy(angles: Floats) -> Floats:
    """Rotations by roll, pitch and yaw (N, 3), in radians, about the fixed axes x, y and z in this order."""
    turns = []
    for axis in range(3):
        vectors = np.zeros_like(angles)
        vectors[:, axis] = angles[:, axis]
        turns.append(from_vector(vectors))
    return turns[2] @ turns[1] @ turns[0]


def to_rpy(rotation: Floats) -> tuple[float, float, float]:
    """Roll, pitch and yaw of one rotation (3, 3), in radians; yaw is 0 where only a sum of roll and yaw is defined."""
    pitch = float(np.arctan2(-rotation[2, 0], np.hypot(rotation[0, 0], rotation[1, 0])))
    if np.hypot(rotation[0, 0], rotation[1, 0]) < 1e-9:
        return float(np.arctan2(-rotation[1, 2], rotation[1, 1])), pitch, 0.0
    roll = float(np.arctan2(rotation[2, 1], rotation[2, 2]))
    return roll, pitch, float(np.arctan2(rotation[1, 0], rotation[0, 0]))


def to_vector(rotations: Floats) -> Floats:
    """Rotation vectors (N, 3) of rotations, of length up to pi."""
    skew = np.stack([rotations[:, i, j] - rotations[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))], axis=1) / 2
    sine = np.linalg.norm(skew, axis=1)
    cosine = (np.trace(rotations, axis1=1, axis2=2) - 1) / 2
    angle = np.arctan2(sine, cosine)
    with np.errstate(divide="ignore", invalid="ignore"):
        found = skew * np.where(sine > 1e-8, angle / sine, 1.0)[:, None]
    # Near half a turn the axis is the column of R + I with the largest diagonal.
    for row in np.flatnonzero((sine < 1e-5) & (cosine < 0)):
        column = int(np.argmax(np.diagonal(rotations[row])))
        axis = rotations[row][:, column] + np.eye(3)[column]
        axis /= np.linalg.norm(axis)
        found[row] = axis * angle[row] * (1.0 if axis @ skew[row] >= 0 else -1.0)
    return np.asarray(found)


def left_jacobian(vector: Floats) -> Floats:
    """The matrix J (3, 3) with Exp(v + dv) = Exp(J dv) Exp(v), of one rotation vector."""
    angle = float(np.linalg.norm(vector))
    k = cross(vector[None])[0]
    third = 1 / 6 if angle < _SMALL else (angle - np.sin(angle)) / angle**3
    found: Floats = np.eye(3) + np.sinc(angle / 2 / np.pi) ** 2 / 2 * k + third * k @ k
    return found


def right_jacobian_inverse(vectors: Floats) -> Floats:
    """The matrices (N, 3, 3) with log(Exp(v) Exp(d)) = v + J d to first order."""
    angle = np.linalg.norm(vectors, axis=1)
    k = cross(vectors)
    safe = np.where(angle < _SMALL, 1.0, angle)
    third = np.where(angle < _SMALL, 1 / 12, 1 / safe**2 - (1 + np.cos(safe)) / (2 * safe * np.sin(safe)))
    return np.asarray(np.eye(3) + k / 2 + third[:, None, None] * k @ k)
