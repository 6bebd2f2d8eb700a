"""What the solutions are called, in their order, and what each family asks of a target."""

from __future__ import annotations

from itertools import product

import sympy as sp

from kinegen.symbolic.inverse.axes import Axes
from kinegen.symbolic.inverse.family import (
    Arm,
    ColumnArm,
    ElbowArm,
    FlatArm,
    GantryArm,
    GimbalArm,
    PlainBuild,
    PointArm,
    StrokeArm,
    TripleArm,
    WristArm,
)

Choice = tuple[str, str]

SHOULDER: Choice = ("shoulder left", "shoulder right")
ELBOW: Choice = ("elbow up", "elbow down")
BEND: Choice = ("elbow left", "elbow right")
STROKE: Choice = ("stroke forward", "stroke backward")
WRIST: Choice = ("wrist no-flip", "wrist flip")

_SEEN_FROM_TOOL: dict[Choice, Choice] = {
    SHOULDER: ("hand left", "hand right"),
    WRIST: ("shoulder no-flip", "shoulder flip"),
}
"""What the words are called where the arm is solved from its tool: the waist is the last joint then."""

_MEANINGS: dict[Choice, str] = {
    SHOULDER: "{shoulder} left: the arm reaches to the side of the zero pose; right: backwards over joint {1}",
    ELBOW: "elbow up: axis {3} is above the line from axis {2} to what the arm carries, drawn to the right",
    BEND: (
        "elbow left: with axis {3} towards the viewer, it is to the left of the line from where axes {1} and {2} "
        "meet to what the arm carries"
    ),
    STROKE: "stroke forward: what the arm carries is ahead of the axis that the stroke turns about; backward: behind",
    WRIST: "{wrist} no-flip: from where it is in line with axis {4}, axis {6} is turned by 0 to 180 deg about axis {5}",
}
_TOOL = "joints {1} to {6} are seen from the tool here, which holds still while the base moves"
_FLAT_ELBOW = "elbow up: the second axis is to the left of the line from the first one to what the arm carries"


def branch_names(build: PlainBuild, axes: Axes) -> tuple[str, ...]:
    """The names of the solutions of an arm, in the order of the results.

    Args:
        build: How the arm is built.
        axes: Its chain.

    Returns:
        One name for each; the shoulder changes slowest, the wrist fastest.
    """
    choices = (_SEEN_FROM_TOOL.get(each, each) if axes.is_reversed else each for each in _choices(build))
    return tuple(", ".join(names) or "the only one" for names in product(*choices))


def meanings_of(build: PlainBuild, axes: Axes) -> tuple[str, ...]:
    """What the words in the names of an arm's branches mean, a sentence for each choice."""
    if isinstance(build, FlatArm):
        return (_FLAT_ELBOW,)
    shoulder, wrist = ("hand", "shoulder") if axes.is_reversed else ("shoulder", "wrist")
    texts = [_TOOL] if axes.is_reversed else []
    texts += [_MEANINGS[choice] for choice in _choices(build)]
    return tuple(each.format(*_numbered(axes), shoulder=shoulder, wrist=wrist) for each in texts)


def _numbered(axes: Axes) -> tuple[int, ...]:
    """The numbers of the joints by their places along the chain, from 1."""
    return (0, *axes.numbers)


def _choices(build: PlainBuild) -> tuple[Choice, ...]:
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


def _arm_choices(arm: Arm) -> tuple[Choice, ...]:
    match arm:
        case ElbowArm():
            return (SHOULDER, ELBOW)
        case GimbalArm():
            return (SHOULDER, BEND)
        case StrokeArm():
            return (SHOULDER, STROKE)
        case ColumnArm():
            return (STROKE,)
        case GantryArm():
            return ()


_NEAR = "1e-6 (single precision: 1e-5)"
_ALIGNED = (
    "where axes {4} and {6} are in line, joint {4} is set to 0 (or its limit nearest to 0) and joint {6} takes the sum"
)
_NARROW = "; where its limits exclude that, it is at the nearest one, and joint {4} takes what is left"
_FREE = "a point on axis {1} is reached with joint {1} at 0 (or its limit nearest to 0)"
_POSITION = "only the position of the target is used; its orientation is not read"
_PLANE = f"the target must lie in the plane of the tool, within {_NEAR} of the arm's size"
_UPRIGHT = f"the target must be the tool of the zero pose turned about the common axis alone, within {_NEAR} rad"
_APPROACH = (
    "the approach vector (axis {5}) must lie in the plane of the arm, at right angles to axis {2}, within "
    f"{_NEAR} rad"
)
_PARALLEL = (
    "where axes {4} and {6} are parallel, joint {6} is set to 0, or as near to it as reach allows, and joint {4} takes "
    "the sum"
)


def conditions_of(build: PlainBuild, axes: Axes) -> tuple[str, ...]:
    """What a target must be besides within reach, and what is chosen where there is a choice.

    Args:
        build: How the arm is built.
        axes: Its chain.

    Returns:
        Sentences.
    """
    return tuple(each.format(*_numbered(axes)) for each in _conditions(build))


def _conditions(build: PlainBuild) -> tuple[str, ...]:
    match build:
        case PointArm(arm):
            return (_POSITION, *_free_joints(arm))
        case WristArm(arm, wrist):
            return (*_free_joints(arm), _ALIGNED + (_NARROW if wrist.flange_limits else ""))
        case FlatArm(turns, lift):
            plane = () if lift else (_PLANE,)
            return (_UPRIGHT if len(turns) == 3 else _POSITION, *plane)
        case TripleArm(wrist=None):
            return (_APPROACH, "a point on axis {1} is reached in the plane of the approach vector")
        case TripleArm():
            return (*_free_waist(build.depth), _PARALLEL)


def _free_joints(arm: Arm) -> tuple[str, ...]:
    match arm:
        case ElbowArm() | StrokeArm():
            return _free_waist(arm.depth)
        case GimbalArm():
            return _FREE, "a point on axis {2} is reached with joint {2} at 0 (or its limit nearest to 0)"
        case ColumnArm(turn):
            return (
                f"a point on axis {turn.number} is reached with joint {turn.number} at 0 (or its limit nearest to 0)",
            )
        case GantryArm():
            return ()


def _free_waist(depth: sp.Expr) -> tuple[str, ...]:
    """An arm beside its waist does not reach the axis of the waist."""
    return (_FREE,) if not depth.is_number or depth == 0 else ()
