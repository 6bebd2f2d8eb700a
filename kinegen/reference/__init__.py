"""The independent numeric reference: chain products straight from the robot, in floats and with 50 digits.

In: a `Robot` and joint vectors. Out: the poses of its frames, their derivatives, and orientations in every form. Every
kernel is held to this package, so it shares nothing with `symbolic/` and `ir/`.

    numbers      float64, the widest floats, and mpmath
    chain        each convention as the 4x4 matrix that its book prints, and their product
    poses        the transforms of all frames
    series       numbers that carry their derivatives
    seen         a frame as seen from another one that moves too
    velocity     Jacobians, twists, accelerations, and derivatives by parameters
    orientation  quaternions, angles and rotation vectors
    redundancy   the values of joints, or the arm angle, that an inverse is given besides the pose
    actuators    joints by readings of actuators; actuators_inverse leads back
"""

from kinegen.reference.actuators import Actuation
from kinegen.reference.actuators_inverse import readings
from kinegen.reference.numbers import DIGITS, WIDE, WIDE_UNIT
from kinegen.reference.orientation import Orientation, rotations
from kinegen.reference.poses import fk, frames, frames_mp, pose, pose_mp
from kinegen.reference.redundancy import redundancy
from kinegen.reference.velocity import Kinematics

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
