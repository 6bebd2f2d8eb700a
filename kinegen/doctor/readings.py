"""Orientations as other programs write them, to rotation matrices and back.

| form | numbers | the rotation is |
| --- | --- | --- |
| `rpy` | roll, pitch, yaw | Rz(yaw) Ry(pitch) Rx(roll) |
| `ypr` | yaw, pitch, roll | Rz(yaw) Ry(pitch) Rx(roll) |
| `rpy_xyz` | roll, pitch, yaw | Rx(roll) Ry(pitch) Rz(yaw) |
| `rotation_vector` | x, y, z | by the length of the vector about it, in radians |
| `wxyz` | w, x, y, z | of the unit quaternion |
| `xyzw` | x, y, z, w | of the unit quaternion |
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kinegen import reference
from kinegen.outputs import Kind

FloatArray = NDArray[np.float64]

_KINDS = {
    "rpy": Kind.RPY_ZYX,
    "ypr": Kind.RPY_ZYX,
    "rpy_xyz": Kind.RPY_XYZ,
    "rotation_vector": Kind.AXIS_ANGLE,
    "wxyz": Kind.QUATERNION_WXYZ,
    "xyzw": Kind.QUATERNION_XYZW,
}
"""The form of each name, whose numbers `ypr` has in the other order."""

ANGLES = ("rpy", "ypr", "rpy_xyz")
THREE = (*ANGLES, "rotation_vector")
FOUR = ("wxyz", "xyzw")
FORMS = (*THREE, *FOUR)

WORDS = {
    "rpy": "roll, pitch, yaw of Rz(yaw) Ry(pitch) Rx(roll)",
    "ypr": "yaw, pitch, roll of Rz(yaw) Ry(pitch) Rx(roll)",
    "rpy_xyz": "roll, pitch, yaw of Rx(roll) Ry(pitch) Rz(yaw)",
    "rotation_vector": "rotation vectors",
    "wxyz": "quaternions w, x, y, z",
    "xyzw": "quaternions x, y, z, w",
}
"""What messages call each form."""


def others(form: str) -> tuple[str, ...]:
    """The forms that the same numbers could have."""
    return tuple(name for name in (THREE if form in THREE else FOUR) if name != form)


def rotations(form: str, numbers: FloatArray) -> FloatArray:
    """Rotation matrices of some numbers.

    Args:
        form: The form.
        numbers: Shape (N, 3) in radians, or (N, 4).

    Returns:
        Shape (N, 3, 3).
    """
    if form in FOUR:
        numbers = numbers / np.linalg.norm(numbers, axis=1, keepdims=True)
    found: FloatArray = reference.rotations(_KINDS[form], numbers[:, ::-1] if form == "ypr" else numbers)
    return found


def numbers_of(form: str, rotation: FloatArray) -> FloatArray:
    """The numbers of some rotations, shape (N, 3, 3): the inverse of `rotations`."""
    found: FloatArray = reference.Orientation(rotation).numbers(_KINDS[form])
    return found[:, ::-1] if form == "ypr" else found
