"""The independent numeric reference: chain products straight from the robot, in floats and with 50 digits.

In: a `Robot` and joint vectors. Out: the poses of its frames, their derivatives, and orientations in every form. Every
kernel is held to this package, so it shares nothing with `derive/` and `ir/`.

    number_types float64, the widest floats, sums of two of them, and mpmath
    chain        each convention as the 4x4 matrix that its book prints, their product, and the poses of all frames
    series       numbers that carry their derivatives
    velocity     Jacobians, twists, accelerations, derivatives by parameters, frames seen from others, differences
    orientation  quaternions, angles and rotation vectors
    redundancy   the values of joints, or the arm angle, that an inverse is given besides the pose
    actuators    joints by readings of actuators, and back
"""

from kinegen.verify.reference.actuators import Actuation, readings
from kinegen.verify.reference.chain import fk, frames, frames_mp, pose, pose_mp
from kinegen.verify.reference.number_types import DIGITS, WIDE, WIDE_UNIT
from kinegen.verify.reference.orientation import Orientation, rotations
from kinegen.verify.reference.redundancy import redundancy
from kinegen.verify.reference.velocity import Kinematics

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
