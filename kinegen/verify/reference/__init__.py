"""The independent numeric reference: chain products straight from the robot, in floats and with 50 digits.

In: a `Robot` and joint vectors. Out: the poses of its frames, their derivatives, and orientations in every form. Every
kernel is held to this package, so it shares nothing with `derive/` and `ir/`.

    exact_numbers      what the chain product asks of numbers, and mpmath
    chain              each convention as the 4x4 matrix that its book prints, their product, the poses of all frames
    number_types       float64, the widest floats, sums of two of them, and mpmath in arrays
    poses              poses in float64
    series             numbers that carry their derivatives
    velocity           Jacobians, twists, accelerations, derivatives by parameters, frames seen from others, differences
    orientation        quaternions, angles and rotation vectors
    redundancy_values  the values of joints, or the arm angle, that an inverse is given besides the pose
    actuators          joints by readings of actuators, and back

The first two need no NumPy, and the names below are imported when they are used: readers and writers of files ask for
poses with 50 digits where there is no NumPy, too.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from kinegen.verify.reference.actuators import Actuation, readings
    from kinegen.verify.reference.chain import frames_mp, pose_mp
    from kinegen.verify.reference.exact_numbers import DIGITS
    from kinegen.verify.reference.number_types import WIDE, WIDE_UNIT
    from kinegen.verify.reference.orientation import Orientation, rotations
    from kinegen.verify.reference.poses import fk, frames, pose
    from kinegen.verify.reference.redundancy_values import redundancy
    from kinegen.verify.reference.velocity import Kinematics

_PLACES = {
    "DIGITS": "exact_numbers",
    "WIDE": "number_types",
    "WIDE_UNIT": "number_types",
    "Actuation": "actuators",
    "Kinematics": "velocity",
    "Orientation": "orientation",
    "fk": "poses",
    "frames": "poses",
    "frames_mp": "chain",
    "pose": "poses",
    "pose_mp": "chain",
    "readings": "actuators",
    "redundancy": "redundancy_values",
    "rotations": "orientation",
}
"""The module of each name; no module has the name itself, since importing it would replace what is meant."""

__all__ = [
    "DIGITS",
    "WIDE",
    "WIDE_UNIT",
    "Actuation",
    "Kinematics",
    "Orientation",
    "fk",
    "frames",
    "frames_mp",
    "pose",
    "pose_mp",
    "readings",
    "redundancy",
    "rotations",
]


def __getattr__(name: str) -> object:
    """Import a name when it is used for the first time (PEP 562)."""
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = getattr(import_module(f"{__name__}.{_PLACES[name]}"), name)
    globals()[name] = found
    return found
