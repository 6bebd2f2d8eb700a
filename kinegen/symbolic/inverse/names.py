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

Choice = tuple[str, str]

SHOULDER: Choice = ("shoulder left", "shoulder right")
ELBOW: Choice = ("elbow up", "elbow down")
STROKE: Choice = ("stroke forward", "stroke backward")
WRIST: Choice = ("wrist no-flip", "wrist flip")

_MEANINGS: dict[Choice, str] = {
    SHOULDER: "shoulder left: the arm reaches to the side of the zero pose; right: backwards over its waist",
    ELBOW: "elbow up: axis 3 is above the line from axis 2 to what the arm carries, drawn to the right",
    STROKE: "stroke forward: what the arm carries is ahead of the axis that the stroke turns about; backward: behind",
    WRIST: "wrist no-flip: from where it is in line with axis 4, axis 6 is turned by 0 to 180 deg about axis 5",
}
_FLAT_ELBOW = "elbow up: the second axis is to the left of the line from the first one to what the arm carries"


def branch_names(build: Build) -> tuple[str, ...]:
    """The names of the solutions of an arm, in the order of the results.

    Args:
        build: How the arm is built.

    Returns:
        One name for each; the shoulder changes slowest, the wrist fastest.
    """
    return tuple(", ".join(names) or "the only one" for names in product(*_choices(build)))


def meanings_of(build: Build) -> tuple[str, ...]:
    """What the words in the names of an arm's branches mean, a sentence for each choice."""
    if isinstance(build, FlatArm):
        return (_FLAT_ELBOW,)
    return tuple(_MEANINGS[choice] for choice in _choices(build))


def _choices(build: Build) -> tuple[Choice, ...]:
    match build:
        case WristArm(arm):
            return (*_arm_choices(arm), WRIST)
        case PointArm(arm):
            return _arm_choices(arm)
        case FlatArm():
            return (ELBOW,)
        case TripleArm(wrist=None):
            return (SHOULDER, ELBOW)
        case TripleArm():
            return (SHOULDER, ELBOW, WRIST)


def _arm_choices(arm: ElbowArm | StrokeArm | ColumnArm | GantryArm) -> tuple[Choice, ...]:
    match arm:
        case ElbowArm():
            return (SHOULDER, ELBOW)
        case StrokeArm():
            return (SHOULDER, STROKE)
        case ColumnArm():
            return (STROKE,)
        case GantryArm():
            return ()


_NEAR = "1e-6 (single precision: 1e-5)"
_ALIGNED = "where axes 4 and 6 are in line, joint 4 is set to 0 (or its limit nearest to 0) and joint 6 takes the sum"
_POSITION = "only the position of the target is used; its orientation is not read"
_PLANE = f"the target must lie in the plane of the tool, within {_NEAR} of the arm's size"
_UPRIGHT = f"the target must be the tool of the zero pose turned about the common axis alone, within {_NEAR} rad"
_APPROACH = (
    f"the approach vector (axis 5) must lie in the plane of the arm, at right angles to axis 2, within {_NEAR} rad"
)
_PARALLEL = (
    "where axes 4 and 6 are parallel, joint 6 is set to 0, or as near to it as reach allows, and joint 4 takes the sum"
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
