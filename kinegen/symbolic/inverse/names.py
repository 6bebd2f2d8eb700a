"""What the solutions are called, in their order, and what each family asks of a target."""

from __future__ import annotations

from itertools import product

import sympy as sp

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
_POSITION = "the position of the tool decides; the attitude of the target is not read"
_PLANE = "the target must lie in the plane of the tool, within 1e-6 of the arm's size"
_UPRIGHT = "the target must be the tool of the zero pose turned about the common axis alone, within 1e-6 rad"
_APPROACH = "the approach vector (axis 5) must lie in the plane of the arm, at right angles to axis 2, within 1e-6 rad"
_PARALLEL = (
    "where axes 4 and 6 are parallel, joint 6 stands at 0, or as near to it as reach allows, and joint 4 takes the sum"
)


def conditions_of(build: Build) -> tuple[str, ...]:
    """What a target must be besides within reach, and what is chosen where there is a choice.

    Args:
        build: How the arm is built.

    Returns:
        Sentences.
    """
    match build:
        case PointArm(arm):
            return (_POSITION, *_free_joints(arm))
        case WristArm(arm):
            return (*_free_joints(arm), _ALIGNED)
        case FlatArm(turns, lift):
            plane = () if lift else (_PLANE,)
            return (_UPRIGHT if len(turns) == 3 else _POSITION, *plane)
        case TripleArm(wrist=None):
            return (_APPROACH, "a point on axis 1 is reached in the plane of the approach vector")
        case TripleArm():
            return (*_free_waist(build.depth), _PARALLEL)


def _free_joints(arm: ElbowArm | StrokeArm | ColumnArm | GantryArm) -> tuple[str, ...]:
    match arm:
        case ElbowArm() | StrokeArm():
            return _free_waist(arm.depth)
        case ColumnArm(turn):
            return (_free(turn.number),)
        case GantryArm():
            return ()


def _free_waist(depth: sp.Expr) -> tuple[str, ...]:
    """An arm beside its waist does not reach the axis of the waist."""
    return (_free(1),) if not depth.is_number or depth == 0 else ()


def _free(number: int) -> str:
    return f"a point on axis {number} is reached with joint {number} at 0 (or its limit nearest to 0)"
