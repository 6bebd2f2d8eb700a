"""The arm with a spherical shoulder, an elbow and a spherical wrist: its conditions, its constants and its words."""

from __future__ import annotations

from itertools import product

from kinegen.robot.redundancy import ARM_ANGLE
from kinegen.symbolic.inverse.axes import Axes, JointAxis
from kinegen.symbolic.inverse.conditions import Conditions, Refusal
from kinegen.symbolic.inverse.exact import is_null, minus
from kinegen.symbolic.inverse.family import Aim, Family, SphericalArm
from kinegen.symbolic.inverse.geometry import Wrist, flat_frame, in_frame, wrist_of

_NAME = "S-R-S type: spherical shoulder, elbow and spherical wrist, arm angle given"
_CHOICES = (
    ("elbow left", "elbow right"),
    ("shoulder no-flip", "shoulder flip"),
    ("wrist no-flip", "wrist flip"),
)
_ELBOW = "elbow left: with axis 4 towards the viewer, it is to the left of the line from the shoulder to the wrist"
_MEANINGS = (
    _ELBOW,
    "shoulder no-flip: from where it is in line with axis 1, axis 3 is turned by 0 to 180 deg about axis 2",
    "wrist no-flip: from where it is in line with axis 5, axis 7 is turned by 0 to 180 deg about axis 6",
)
_ALIGNED = (
    "where axes {0} and {1} are in line, joint {0} is set to 0 (or its limit nearest to 0) and joint {1} takes the sum"
)
_NARROW = "; where its limits exclude that, it is at the nearest one, and joint {0} takes what is left"
_ARM_ANGLE = (
    "redundancy is the arm angle in rad: how far the elbow is turned about the line from the shoulder's centre to the "
    "wrist's, by the right-hand rule, from the half plane of that line which contains the direction of axis 1 (about "
    "which joint 1 turns); at 0 the elbow is above the line if axis 1 points up (Kreutz-Delgado, Long and Seraji 1992)"
)
_UPRIGHT = (
    "where that line is on axis 1, the half plane is that of a line which joint 2 leans a little by a positive turn, "
    "with joint 1 at 0 (or its limit nearest to 0)"
)


def spherical_arm(axes: Axes) -> Family:
    """Seven joints that turn: three axes meet in the shoulder, three in the wrist."""
    elbow = axes.joints[3]
    shoulder, wrist = _meeting(axes, 0), _meeting(axes, 4)
    frame = flat_frame(elbow)
    upper = in_frame(frame, minus(elbow.point, shoulder.centre))
    lower = in_frame(frame, minus(wrist.centre, elbow.point))
    if is_null(upper[:2]) or is_null(lower[:2]):
        raise Refusal(f"axis {elbow.number} passes through the centre of the shoulder or of the wrist")
    if upper[2] + lower[2] != 0:
        raise Refusal(f"the centres of shoulder and wrist are not in one plane square to axis {elbow.number}")
    build = SphericalArm(shoulder, elbow, wrist, frame, upper[:2], lower[:2])
    names = tuple(", ".join(each) for each in product(*_CHOICES))
    conditions = (_ARM_ANGLE, _UPRIGHT, *_aligned(shoulder), *_aligned(wrist))
    return Family(_NAME, build, axes, Aim.POSE, names, _MEANINGS, conditions, ARM_ANGLE)


def _meeting(axes: Axes, first: int) -> Wrist:
    """Three joints whose axes meet, neighbours at right angles."""
    joints: tuple[JointAxis, ...] = axes.joints[first : first + 3]
    one, two, three = (joints[0] if joints[0].rate > 0 else joints[0].flipped(), *joints[1:])
    conditions = Conditions(axes)
    conditions.square(one, two)
    conditions.square(two, three)
    conditions.check()
    centre = conditions.meet((one, two, three))
    conditions.check()
    return wrist_of(one, two, three, centre)


def _aligned(wrist: Wrist) -> tuple[str, ...]:
    first, _, last = (joint.number for joint in wrist.joints)
    return ((_ALIGNED + (_NARROW if wrist.flange_limits else "")).format(first, last),)
