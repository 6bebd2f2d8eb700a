"""What the solutions are called, in their order, and what each family asks of a target."""

from __future__ import annotations

from itertools import product

from kinegen.symbolic.inverse.family import (
    Build,
    ColumnArm,
    ElbowArm,
    FlatArm,
    GantryArm,
    PointArm,
    StrokeArm,
    TripleArm,
    WristArm,
)

SHOULDER = ("shoulder left", "shoulder right")
"""Left: what the arm carries is in front of the waist, on the side of the zero pose; right: the arm reaches back."""

ELBOW = ("elbow up", "elbow down")
"""Up: seen with what the arm carries to the right of the shoulder, axis 3 lies above the line between them."""

STROKE = ("stroke forward", "stroke backward")
WRIST = ("wrist no-flip", "wrist flip")
"""No-flip: the middle joint of the wrist stands from 0 to 180 deg on from where its neighbours are in line."""


def branch_names(build: Build) -> tuple[str, ...]:
    """The names of the solutions of an arm, in the order of the results.

    Args:
        build: How the arm is built.

    Returns:
        One name for each; the shoulder changes slowest, the wrist fastest.
    """
    match build:
        case WristArm(arm):
            choices = (*_arm_choices(arm), WRIST)
        case PointArm(arm):
            choices = _arm_choices(arm)
        case FlatArm():
            choices = (ELBOW,)
        case TripleArm(wrist=None):
            choices = (SHOULDER, ELBOW)
        case TripleArm():
            choices = (SHOULDER, ELBOW, WRIST)
    return tuple(", ".join(names) or "the only one" for names in product(*choices))


def _arm_choices(arm: ElbowArm | StrokeArm | ColumnArm | GantryArm) -> tuple[tuple[str, str], ...]:
    match arm:
        case ElbowArm():
            return (SHOULDER, ELBOW)
        case StrokeArm():
            return (SHOULDER, STROKE)
        case ColumnArm():
            return (STROKE,)
        case GantryArm():
            return ()


_ALIGNED = "where axes 4 and 6 are in line, joint 4 stands at 0 (or its limit nearest to 0) and joint 6 takes the sum"
_SHOULDER = "a point on the axis of joint 1 is reached with joint 1 at 0 (or its limit nearest to 0)"
_POSITION = "the position of the tool decides; the attitude of the target is not read"
_PLANE = "the target must lie in the plane of the tool, within 1e-9 of the arm's size"
_UPRIGHT = "the target must be the tool of the zero pose turned about the common axis alone, within 1e-9 rad"

CONDITIONS: dict[object, tuple[str, ...]] = {
    PointArm: (_POSITION, _SHOULDER),
    WristArm: (_SHOULDER, _ALIGNED),
    (FlatArm, 2, False): (
        "the position of the tool in the plane decides; the attitude of the target is not read",
        _PLANE,
    ),
    (FlatArm, 2, True): (_POSITION,),
    (FlatArm, 3, False): (_UPRIGHT, _PLANE),
    (FlatArm, 3, True): (_UPRIGHT,),
    (TripleArm, 5): (
        "the approach vector (axis 5) must lie in the plane of the arm, at right angles to axis 2, within 1e-9 rad",
        "a point on the axis of joint 1 is reached in the plane of the approach vector",
    ),
    (TripleArm, 6): (_SHOULDER, "where axes 4 and 6 are parallel, joint 6 stands at 0, or as near to it as the reach allows, and joint 4 takes the sum"),
}
