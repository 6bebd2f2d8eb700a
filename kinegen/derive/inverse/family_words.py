"""A family in words: names and meanings of its branches, conditions on targets, and its constants."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import sympy as sp

from kinegen.derive.folding import Vector
from kinegen.derive.inverse.axes import Axes
from kinegen.derive.inverse.exact_geometry import dot, minus, tidy
from kinegen.derive.inverse.family import (
    Arm,
    ColumnArm,
    ElbowArm,
    Family,
    FlatArm,
    GantryArm,
    GimbalArm,
    PlainBuild,
    PointArm,
    SphericalArm,
    StrokeArm,
    TripleArm,
    WristArm,
)
from kinegen.derive.inverse.geometry import Planar, Waist, Wrist
from kinegen.derive.inverse.limit_conditions import is_followed
from kinegen.derive.inverse.wrists import is_limited
from kinegen.support.dataclass import dataclass

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
    SHOULDER: "{shoulder} left: the arm reaches forward, as in the zero pose; right: backward over joint {1}",
    ELBOW: "elbow up: axis {3} is above the line from axis {2} to the {end} when the arm points to the right",
    BEND: (
        "elbow left: with axis {3} towards the viewer, it is to the left of the line from where axes {1} and {2} "
        "meet to the {end}"
    ),
    STROKE: "stroke forward: the {end} is ahead of the axis about which the prismatic joint rotates; backward: behind",
    WRIST: "{wrist} no-flip: axis {6} is rotated by 0 to 180 deg about axis {5}, measured from the aligned {wrist}",
}
_TOOL = "the arm is analysed backwards, joints {1} to {6} from the tool, with base and tool exchanged"
_FLAT_ELBOW = "elbow up: the second axis is to the left of the line from the first axis to the tool"


def branch_names(build: PlainBuild, axes: Axes) -> tuple[str, ...]:
    """Name the solutions of an arm in the order of the results: the shoulder changes slowest, the wrist fastest."""
    choices = (_SEEN_FROM_TOOL.get(each, each) if axes.is_reversed else each for each in _choices(build))
    return tuple(", ".join(names) or "the only one" for names in product(*choices))


def meanings_of(build: PlainBuild, axes: Axes) -> tuple[str, ...]:
    """Explain the words in the names of an arm's branches, a sentence for each choice."""
    if isinstance(build, FlatArm):
        return (_FLAT_ELBOW,)
    shoulder, wrist = ("hand", "shoulder") if axes.is_reversed else ("shoulder", "wrist")
    # An arm that is solved from its tool has the words of shoulder and wrist exchanged.
    texts = [_TOOL] if axes.is_reversed else []
    texts += [_MEANINGS[choice] for choice in _choices(build)]
    end = "tool" if isinstance(build, PointArm) else wrist
    return tuple(each.format(*_numbered(axes), shoulder=shoulder, wrist=wrist, end=end) for each in texts)


def _numbered(axes: Axes) -> tuple[int, ...]:
    """Return the numbers of the joints by their places along the chain, from 1."""
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
_FREE = "for a point on axis {1}, joint {1} is set to 0 (or its limit nearest to 0)"
_KEPT = "; if that moves joint {4}, {5} or {6} outside its limits, to a value that keeps them inside"
_KEPT_ARM = "; if that moves a joint outside its limits, joints {2}, {3}, {4} and {6} get values that keep all inside"
_POSITION = "only the position of the target is used; its orientation is not read"
_PLANE = f"the target must lie in the plane of the tool, within {_NEAR} of the arm's size"
_UPRIGHT = f"the target must be the tool of the zero pose rotated only about the common axis, within {_NEAR} rad"
_APPROACH = (
    "the approach vector (axis {5}) must lie in the plane of the arm, at right angles to axis {2}, within "
    f"{_NEAR} rad"
)
_PARALLEL = (
    "where axes {4} and {6} are parallel, joint {6} is set to 0, or as near to it as reach allows, and joint {4} to "
    "the sum of both"
)


def conditions_of(build: PlainBuild, axes: Axes) -> tuple[str, ...]:
    """Say what a target must be besides within reach, and what is chosen where there is a choice; sentences."""
    return tuple(each.format(*_numbered(axes)) for each in _conditions(build))


def _conditions(build: PlainBuild) -> tuple[str, ...]:
    match build:
        case PointArm(arm):
            return (_POSITION, *_free_joints(arm))
        case WristArm(arm, wrist):
            kept = _KEPT if is_followed(wrist) else ""
            return (*(each + kept for each in _free_joints(arm)), aligned(wrist))
        case FlatArm(turns, lift):
            plane = () if lift else (_PLANE,)
            return (_UPRIGHT if len(turns) == 3 else _POSITION, *plane)
        case TripleArm(wrist=wrist):
            if wrist is None:
                return (_APPROACH, "a point on axis {1} is reached in the plane of the approach vector")
            kept = _KEPT_ARM if is_limited(build, wrist) else ""
            return (*_free_waist(build.depth), _PARALLEL + kept)


def aligned(wrist: Wrist) -> str:
    """Say what is chosen where the first and the last axis of a wrist coincide."""
    first, last = wrist.joints[0].number, wrist.joints[2].number
    narrow = f"; if its limits exclude that, to the nearest limit that keeps joint {first} inside its own"
    return (
        f"where axes {first} and {last} coincide, joint {first} is set to 0 (or its limit nearest to 0) and joint "
        f"{last} to the sum of both{narrow if wrist.joints[2].arc else ''}"
    )


def _free_joints(arm: Arm) -> tuple[str, ...]:
    match arm:
        case ElbowArm() | StrokeArm():
            return _free_waist(arm.depth)
        case GimbalArm():
            return _FREE, "for a point on axis {2}, joint {2} is set to 0 (or its limit nearest to 0)"
        case ColumnArm(turn):
            return (f"for a point on axis {turn.number}, joint {turn.number} is set to 0 (or its limit nearest to 0)",)
        case GantryArm():
            return ()


def _free_waist(depth: sp.Expr) -> tuple[str, ...]:
    """Say that the waist may be free; an arm beside its waist does not reach the axis of the waist."""
    return (_FREE,) if not depth.is_number or depth == 0 else ()


@dataclass(frozen=True, slots=True)
class Constant:
    """One constant in words, with its value in degrees or the file's length unit.

    The value is that for the file's values of runtime parameters; `runtime` names those that it depends on.
    """

    text: str
    value: float
    is_angle: bool
    runtime: tuple[str, ...]


def constants(family: Family) -> tuple[Constant, ...]:
    """List the lengths and angles between the axes of a family, in the order from base to tool."""
    return tuple(_constant(family, text, value, text.startswith("angle")) for text, value in _described(family))


def _described(family: Family) -> Iterator[tuple[str, sp.Expr]]:
    numbers = (0, *family.axes.numbers)
    match family.build:
        case PointArm(arm):
            yield from _of_arm(arm, "the tool", numbers)
        case WristArm(arm, wrist):
            centre = f"the {'shoulder' if family.is_reversed else 'wrist'}'s centre"
            yield from _of_arm(arm, centre, numbers)
            yield f"from {centre} to the {'base' if family.is_reversed else 'tool'}", _distance(family, wrist.centre)
            yield f"angle of axes {numbers[4]} and {numbers[6]} in the zero pose", wrist.skew
        case FlatArm(turns, _, _, upper, lower, end):
            first, second = turns[0].number, turns[1].number
            yield f"from axis {first} to axis {second}", _length(upper)
            yield (
                f"from axis {second} to {f'axis {turns[2].number}' if len(turns) == 3 else 'the tool'}",
                _length(lower),
            )
            if len(turns) == 3:
                yield f"from axis {turns[2].number} to the tool, across", _across(family, end, turns[2].direction)
        case SphericalArm(shoulder, _, wrist, _, upper, lower):
            yield "from the shoulder's centre to axis 4", _length(upper)
            yield "from axis 4 to the wrist's centre", _length(lower)
            yield "from the wrist's centre to the tool", _distance(family, wrist.centre)
            yield f"angle of axes {numbers[1]} and {numbers[3]} in the zero pose", shoulder.skew
            yield f"angle of axes {numbers[5]} and {numbers[7]} in the zero pose", wrist.skew
        case TripleArm(waist, _, upper, lower, hand, depth, end):
            _, _, second, third, fourth, fifth, *_ = numbers
            yield from _of_waist(waist, numbers)
            yield f"from axis {second} to axis {third}", _length(upper)
            yield f"from axis {third} to axis {fourth}", _length(lower)
            yield f"from axis {fourth} to axis {fifth}", _length(hand)
            yield f"shift along axes {second}, {third}, {fourth}", depth
            yield f"from axis {fifth} to the {'base' if family.is_reversed else 'tool'}", _distance(family, end)


def _of_waist(waist: Waist, numbers: tuple[int, ...]) -> Iterator[tuple[str, sp.Expr]]:
    _, first, second, *_ = numbers
    yield f"from axis {first} to axis {second}", waist.offset
    yield f"angle of axes {first} and {second}", sp.atan2(waist.sine, waist.cosine)


def _of_arm(arm: Arm, end: str, numbers: tuple[int, ...]) -> Iterator[tuple[str, sp.Expr]]:
    _, first, second, third, *_ = numbers
    match arm:
        case ElbowArm():
            yield from _of_waist(arm.waist, numbers)
            yield f"from axis {second} to axis {third}", _length(arm.upper)
            yield f"from axis {third} to {end}", _length(arm.lower)
            yield f"shift along axis {second} to {end}", arm.depth
        case GimbalArm():
            yield f"angle of axes {first} and {second}", sp.atan2(arm.waist.sine, arm.waist.cosine)
            yield f"from where they meet to axis {third}", _length(arm.upper)
            yield f"from axis {third} to {end}", _length(arm.lower)
            yield f"shift along axis {third} to {end}", arm.depth
        case StrokeArm():
            yield from _of_waist(arm.waist, numbers)
            yield f"from axis {second} to the line of {end}", _aside(arm.heading, arm.start)
            yield f"shift along axis {second} to {end}", arm.depth
        case ColumnArm():
            yield f"from axis {arm.turn.number} to the line of {end}", _aside(arm.heading, arm.start)


def _constant(family: Family, text: str, value: sp.Expr, is_angle: bool) -> Constant:
    number = family.axes.value(value * 180 / sp.pi if is_angle else value)
    return Constant(text, number, is_angle, tuple(sorted(str(symbol) for symbol in value.free_symbols)))


def _length(vector: Planar) -> sp.Expr:
    return sp.sqrt(tidy(vector[0] ** 2 + vector[1] ** 2))


def _aside(heading: Planar, start: Planar | Vector) -> sp.Expr:
    return tidy(heading[0] * start[1] - heading[1] * start[0])


def _distance(family: Family, point: Vector) -> sp.Expr:
    offset = minus(family.axes.position, point)
    return sp.sqrt(dot(offset, offset))


def _across(family: Family, point: Vector, axis: Vector) -> sp.Expr:
    offset = minus(family.axes.position, point)
    return sp.sqrt(tidy(dot(offset, offset) - dot(offset, axis) ** 2))
