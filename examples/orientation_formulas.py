"""Where the formulas for roll, pitch and yaw that lecture notes print fail, and what the kernels give instead.

    kinegen build examples/gimbal.yaml -o build/examples --outputs pose,rpy_zyx,rpy_zyx_jacobian,quaternion_wxyz
    PYTHONPATH=build/examples python examples/orientation_formulas.py

docs/orientation.md explains what it prints.
"""

from __future__ import annotations

import gimbal  # type: ignore[import-not-found]  # made by the command above
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

CASES = (
    (np.array([0.4, -0.9, 1.2]), "all within a quarter turn"),
    (np.array([-1.5, 1.1, -0.3]), "all within a quarter turn"),
    (np.array([2 * np.pi / 3, np.pi / 9, 0.2]), "yaw beyond"),
    (np.array([0.2, np.pi / 9, -5 * np.pi / 6]), "roll beyond"),
    (np.array([2.5, -0.4, 3.0]), "both beyond"),
)
"""Yaw, pitch and roll, and what is special."""


def rotation(q: Floats) -> Floats:
    """The rotation of the last frame, (..., 3, 3)."""
    found: Floats = gimbal.fk(q)[..., :3, :3]
    return found


BASE = rotation(np.zeros(3))
"""With all joints at zero, only the base turns."""


def turned(angles: Floats) -> Floats:
    """Rz(yaw) Ry(pitch) Rx(roll), (..., 3, 3): what the gimbal does without its base."""
    found: Floats = BASE.T @ rotation(angles)
    return found


def reaching(angles: Floats) -> Floats:
    """Joint vectors at which the last frame has this yaw, pitch and roll."""
    return independent(BASE.T @ turned(angles))


def printed(R: Floats) -> Floats:
    """Yaw, pitch and roll as the notes have it: three arcsines, of which two divide by the cosine of the pitch."""
    pitch = -np.arcsin(np.clip(R[..., 2, 0], -1, 1))  # rounding may go beyond 1
    with np.errstate(invalid="ignore", divide="ignore"):
        yaw, roll = np.arcsin(R[..., 1, 0] / np.cos(pitch)), np.arcsin(R[..., 2, 1] / np.cos(pitch))
    return np.stack([yaw, pitch, roll], axis=-1)


def independent(R: Floats) -> Floats:
    """Three arc tangents, each on its own, as better books have it."""
    yaw, roll = np.arctan2(R[..., 1, 0], R[..., 0, 0]), np.arctan2(R[..., 2, 1], R[..., 2, 2])
    return np.stack([yaw, np.arctan2(-R[..., 2, 0], np.hypot(R[..., 0, 0], R[..., 1, 0])), roll], axis=-1)


def emitted(q: Floats) -> Floats:
    """What the kernel says, in the same order."""
    angles: Floats = gimbal.rpy_zyx(q)[..., ::-1]
    return angles


def naive_quaternion(R: Floats) -> Floats:
    """The formula that starts from the trace, whatever the rotation is."""
    w = np.sqrt(max(0.0, 1 + np.trace(R))) / 2
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.array([w, *(np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / (4 * w))])


def of_quaternion(q: Floats) -> Floats:
    """The rotation of a quaternion w, x, y, z of unit length."""
    w, x, y, z = q
    cross: Floats = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    with np.errstate(invalid="ignore"):
        found: Floats = np.eye(3) + 2 * w * cross + 2 * cross @ cross
    return found


def off(found: Floats, R: Floats) -> str:
    """The largest difference of an entry; wrong where it is large, or where there is no result."""
    error = np.max(np.abs(found - R))
    return "rounding" if error < 1e-13 else f"{error:.0e}" if error < 1e-4 else "wrong"


def degrees(angles: Floats) -> str:
    """Three angles."""
    return " ".join(f"{angle:7.1f}" for angle in np.degrees(angles))


def print_share() -> None:
    """How often the formulas are right, over a grid of all rotations."""
    steps = (np.arange(36) + 0.5) / 36
    yaw, pitch, roll = np.meshgrid(2 * steps - 1, steps - 0.5, 2 * steps - 1, indexing="ij")
    q = reaching(np.pi * np.stack([yaw, pitch, roll], axis=-1).reshape(-1, 3))
    R = rotation(q)
    for name, angles in (("three arcsines", printed(R)), ("rpy_zyx", emitted(q))):
        right = np.max(np.abs(turned(angles) - R), axis=(1, 2)) < 1e-9
        print(f"{name:15} gives the rotation back for {right.mean():7.2%} of {len(q)} rotations")


def print_cases() -> None:
    """Five rotations."""
    print("yaw, pitch, roll           three arcsines             rpy_zyx                    arcsines off by")
    for angles, what in CASES:
        q = reaching(angles)
        wrong = printed(rotation(q))
        texts = (degrees(angles), degrees(wrong), degrees(emitted(q)))
        print(f"{'    '.join(texts)}    {off(turned(wrong), rotation(q)):8}  {what}")


def print_singular() -> None:
    """Closer and closer to pitch 90 degrees."""
    print("90 deg - pitch  three arcsines  three arctangents  rpy_zyx   largest entry of its Jacobian")
    for gap in (1e-1, 1e-3, 1e-5, 1e-7, 1e-9, 1e-12):
        q = reaching(np.array([0.7, np.pi / 2 - gap, -1.2]))
        R = rotation(q)
        errors = [off(turned(angles), R) for angles in (printed(R), independent(R), emitted(q))]
        largest = np.max(np.abs(gimbal.rpy_zyx_jacobian(q)))
        print(f"{gap:10.0e} rad  {errors[0]:14}  {errors[1]:17}  {errors[2]:8}  {largest:.0e}")


def print_half_turns() -> None:
    """Closer and closer to half a turn, about an axis between x and y."""
    print("180 deg - roll  from the trace  quaternion_wxyz")
    for gap in (1e-1, 1e-3, 1e-5, 1e-7, 1e-9, 1e-12):
        q = reaching(np.array([0.3, 0.0, np.pi - gap]))
        R = rotation(q)
        errors = [off(of_quaternion(found), R) for found in (naive_quaternion(R), gimbal.quaternion_wxyz(q))]
        print(f"{gap:10.0e} rad  {errors[0]:14}  {errors[1]}")


if __name__ == "__main__":
    print_share()
    print()
    print_cases()
    print()
    print_singular()
    print()
    print_half_turns()
