"""Limits of joints that follow a free turn, and the turn with which a wrist keeps them.

The solutions of a pose that leaves a turn t free are a curve. Where a joint that follows is at a limit, a form
`constant + cosine * cos(t) + sine * sin(t)` is zero, which has two roots; within the limits it has a sign. So a set of
angles within the limits of several joints is a union of arcs, and where it is neither empty nor the whole circle, it
begins at a root of one of the forms. To try the roots of all forms is to miss nothing (Shimizu et al. 2008 do so with
the arm angle).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import sympy as sp

from kinegen.derive.folding import Vector
from kinegen.derive.inverse.axes import JointAxis
from kinegen.derive.inverse.exact_geometry import Rotation, tidy
from kinegen.derive.inverse.geometry import Planar, Wrist
from kinegen.derive.inverse.joint_wrapping import rest_angle
from kinegen.derive.inverse.straight_line_operations import ONE, ZERO, Angle, OperationBuilder
from kinegen.derive.inverse.tolerances import ROUNDING
from kinegen.support.dataclass import dataclass

Arc = tuple[sp.Expr, sp.Expr]
"""The angle at which an arc begins, and the one at which it ends, less than a turn later."""

Signs = tuple[tuple[tuple[int, int], ...], ...]
"""A union of intersections: what is within the limits, by places of forms and the signs that they must have."""

_AMPLE = sp.Integer(4)
"""More than any joint is ever within its limits."""


@dataclass(frozen=True, slots=True)
class Form:
    """A number that depends on the free turn."""

    constant: sp.Expr
    cosine: sp.Expr
    sine: sp.Expr

    def at(self, steps: OperationBuilder, turn: Planar) -> sp.Expr:
        """Return its value for one turn."""
        if turn == (ONE, ZERO):
            return steps.name(self.constant + self.cosine)
        return steps.name(self.constant + steps.dot((self.cosine, self.sine), turn))

    def roots(self, steps: OperationBuilder) -> tuple[Planar, Planar]:
        """Return the turns at which it is zero; where there are none, the one at which it is nearest to zero."""
        square = steps.square((self.cosine, self.sine))
        rest = steps.name(square - self.constant**2)
        root = steps.root_of_positive(rest)
        scale = steps.name(1 / steps.root(square * steps.square((self.constant, root))))
        middle = (steps.name(-self.constant * self.cosine), steps.name(-self.constant * self.sine))
        aside = (steps.name(root * self.sine), steps.name(root * self.cosine))
        first, second = (
            (
                steps.name(steps.name(middle[0] - sign * aside[0]) * scale),
                steps.name(steps.name(middle[1] + sign * aside[1]) * scale),
            )
            for sign in (1, -1)
        )
        return first, second


@dataclass(frozen=True, slots=True)
class Bound:
    """The limits of one joint.

    Attributes:
        forms: Numbers of which one is zero where the joint is at a limit.
        within: Which signs they have within the limits, for each way to hold the wrist; nothing where no turn will do.
        turns: The turns at which the joint is at a limit, where these are known; else the roots of the forms.
    """

    forms: tuple[Form, ...]
    within: tuple[Signs, Signs]
    turns: tuple[Planar, ...] = ()

    def candidates(self, steps: OperationBuilder) -> Iterator[Planar]:
        """Yield the turns at which the joint is at a limit."""
        if self.turns:
            yield from self.turns
        else:
            for form in self.forms:
                yield from form.roots(steps)

    def margin(self, steps: OperationBuilder, turn: Planar, way: int) -> sp.Expr | None:
        """Return how far the joint is within its limits for a turn and a way to hold the wrist; None if it never is."""
        if not self.within[way]:
            return None
        values = [form.at(steps, turn) for form in self.forms]
        return most(steps, [least(steps, [sign * values[place] for place, sign in part]) for part in self.within[way]])


def least(steps: OperationBuilder, values: Sequence[sp.Expr]) -> sp.Expr:
    """Return the least of some numbers."""
    found = _AMPLE
    for value in values:
        if value != _AMPLE:
            found = value if found == _AMPLE else steps.select(value, found, value, found)
    return found


def most(steps: OperationBuilder, values: Sequence[sp.Expr]) -> sp.Expr:
    """Return the greatest of some numbers."""
    return -least(steps, [-value for value in values])


def turning(arc: Arc, vector: tuple[Form, Form], steps: OperationBuilder) -> Bound:
    """Return the limits of a joint that is turned along a vector, or along its opposite where the wrist is flipped."""
    low, high = (steps.unit(end) for end in arc)
    forms = (_combined(steps, vector, (-low[1], low[0])), _combined(steps, vector, (high[1], -high[0])))
    return Bound(forms, (_between(arc, 1), _between(arc, -1)))


def turned_itself(arc: Arc, steps: OperationBuilder) -> Bound:
    """Return the limits of the joint that is free."""
    (low, high), middle = (steps.unit(end) for end in arc), steps.unit((arc[0] + arc[1]) / 2)
    within: Signs = (((0, 1),),)
    return Bound((Form(-steps.unit((arc[1] - arc[0]) / 2)[0], *middle),), (within, within), (low, high))


def tilting(arc: Arc, cosine: Form, steps: OperationBuilder) -> Bound:
    """Return the limits of a joint that is turned by the angle of a cosine, or by its opposite for a flipped wrist."""
    ends: list[sp.Expr] = []
    ways = []
    # A flipped wrist is turned by the opposite angle.
    for low, high in (arc, (-arc[1], -arc[0])):
        parts = []
        for start, end in _within_half_turn(low, high):
            part = []
            for angle, sign, is_open in ((start, -1, start == 0), (end, 1, end == sp.pi)):
                if not is_open:
                    value = steps.unit(angle)[0]
                    ends.extend([value] * (value not in ends))
                    part.append((ends.index(value), sign))
            parts.append(tuple(part))
        ways.append(tuple(parts))
    forms = tuple(Form(steps.name(cosine.constant - end), cosine.cosine, cosine.sine) for end in ends)
    return Bound(forms, (ways[0], ways[1]))


def _combined(steps: OperationBuilder, vector: tuple[Form, Form], factors: Planar) -> Form:
    """Return a constant vector times one of forms."""
    constant, cosine, sine = (
        steps.name(factors[0] * getattr(vector[0], part) + factors[1] * getattr(vector[1], part))
        for part in ("constant", "cosine", "sine")
    )
    return Form(constant, cosine, sine)


def _between(arc: Arc, sign: int) -> Signs:
    """Counted from the beginning of an arc forward and from its end backward: both, or either if it is a wide one."""
    first, second = (0, sign), (1, sign)
    return ((first, second),) if float(arc[1] - arc[0]) < math.pi else ((first,), (second,))


def _within_half_turn(low: sp.Expr, high: sp.Expr) -> Iterator[Arc]:
    """Yield the parts of an arc that are between 0 and half a turn, but for whole turns."""
    first = math.floor((float(low) + 2 * math.pi) / (2 * math.pi)) - 1
    for turns in range(first, first + 4):
        start, end = tidy(low - 2 * sp.pi * turns), tidy(high - 2 * sp.pi * turns)
        start = start if float(start) > 0 else ZERO
        end = end if float(end) < math.pi else sp.pi
        if float(start) <= float(end):
            yield start, end


def best_turn(steps: OperationBuilder, bounds: Sequence[Bound]) -> Planar:
    """Return the free turn that leaves all joints within their limits: none if that will do, else the best candidate.

    It is any turn where none will do.
    """
    none, bounds = (ONE, ZERO), _that_matter(bounds)
    # Where it is not turned at all, the free joint is within its own limits.
    if all(bound.turns for bound in bounds):
        return none
    turns = (none, *(turn for bound in bounds for turn in bound.candidates(steps)))
    return best_of(steps, [(turn, _margin(steps, bounds, turn)) for turn in turns])


def best_of(steps: OperationBuilder, candidates: Sequence[tuple[Planar, sp.Expr]]) -> Planar:
    """Return the first of some turns if it is within the limits, else the one farthest within, or least outside.

    Each candidate has how far it is within the limits; rounding makes that of a turn at a limit less than zero.
    """
    (chosen, margin), *others = candidates
    best = steps.select(-ROUNDING, margin, _AMPLE, margin)
    for turn, margin in others:
        chosen = steps.choose(best, margin, turn, chosen)
        best = steps.select(best, margin, margin, best)
    return chosen


def _that_matter(bounds: Sequence[Bound]) -> Sequence[Bound]:
    """Return the limits that can exclude a turn: one joint alone that has half a turn is within them in either way."""
    flipped = [bound for bound in bounds if bound.within[0] != bound.within[1]]
    signs = {part for bound in flipped for way in bound.within for part in way}
    if len(flipped) == 1 and all(((place, sign),) in signs for place in (0, 1) for sign in (1, -1)):
        return [bound for bound in bounds if bound is not flipped[0]]
    return bounds


def _margin(steps: OperationBuilder, bounds: Sequence[Bound], turn: Planar) -> sp.Expr:
    """Return how far all joints are within their limits, in the better one of both ways to hold the wrist."""
    margins = [[bound.margin(steps, turn, way) for bound in bounds] for way in (0, 1)]
    both = [one for one, other in zip(*margins, strict=True) if one is not None and one == other]
    ways = []
    for found in margins:
        known = [margin for margin in found if margin is not None]
        if len(known) == len(found):
            # What is the same in both ways is looked at once.
            ways.append([margin for margin in known if margin not in both])
    if not ways:
        return -ONE
    parts = [] if [] in ways else [most(steps, [least(steps, each) for each in ways])]
    return least(steps, [*both, *parts])


@dataclass(frozen=True, slots=True)
class FreeTurn:
    """A joint that may be turned anywhere, for targets whose point has a squared distance below `near` from its axis.

    It is at rest for such a target. `square` is that distance, and `axis` is in the axes in which the arm leaves
    vectors.
    """

    joint: JointAxis
    square: sp.Expr
    near: sp.Expr
    axis: Vector


def is_followed(wrist: Wrist) -> bool:
    """Tell whether a joint of a wrist can be outside its limits."""
    return any(joint.arc is not None for joint in wrist.joints)


def turn_within_limits(
    steps: OperationBuilder, free: FreeTurn, wrist: Wrist, axis: Vector, angle: Angle, left: Rotation
) -> tuple[Angle, Rotation]:
    """Turn a joint, where the point on its axis leaves it free, so that the wrist, which follows it, keeps its limits.

    The wrist's joints take what every angle of the joint leaves of the attitude.

    Args:
        steps: The let bindings.
        free: The joint.
        axis: The axis of the joint, in the wrist's frame.
        angle: How far the joint is turned, at rest where it is free.
        left: Rotation of the rotation that this leaves to the wrist, in its frame.

    Returns:
        The angle and the columns; the given ones where the joint is not free.
    """
    # Each column of what is left is a form in the free turn, and limits of the wrist are read off them.
    turned = [_turned_about(steps, axis, column) for column in left]
    turn = best_turn(steps, _bounds(steps, free.joint, wrist, turned))
    if turn == (ONE, ZERO):
        return angle, left

    def chosen(other: sp.Expr, usual: sp.Expr) -> sp.Expr:
        return steps.select(free.square, free.near, other, usual)

    lead = steps.times(steps.unit(rest_angle(free.joint)), turn)
    other = steps.argument(lead)
    value = Angle(chosen(other.value, angle.value), min(other.low, angle.low), max(other.high, angle.high))
    columns = [
        tuple(chosen(form.at(steps, turn), entry) for form, entry in zip(forms, column, strict=True))
        for forms, column in zip(turned, left, strict=True)
    ]
    first, second, third = ((x, y, z) for x, y, z in columns)
    return value, (first, second, third)


def _turned_about(steps: OperationBuilder, axis: Vector, vector: Vector) -> tuple[Form, Form, Form]:
    """Return a vector turned back about an axis by a free angle (Rodrigues)."""
    along = steps.dot(axis, vector)
    forms = []
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        constant = steps.name(along * axis[i])
        across = steps.name(steps.name(axis[k] * vector[j]) - steps.name(axis[j] * vector[k]))
        forms.append(Form(constant, steps.name(vector[i] - constant), across))
    return forms[0], forms[1], forms[2]


def _bounds(
    steps: OperationBuilder, joint: JointAxis, wrist: Wrist, turned: list[tuple[Form, Form, Form]]
) -> list[Bound]:
    """Return the limits of the free joint and of the wrist, from how the wrist's columns follow."""
    first, second, third = turned
    roll, bend, flange = wrist.joints
    bounds = []
    if joint.arc is not None:
        rest = rest_angle(joint)
        bounds.append(turned_itself((tidy(joint.arc[0] - rest), tidy(joint.arc[1] - rest)), steps))
    if roll.arc is not None:
        bounds.append(turning(roll.arc, (third[0], third[1]), steps))
    if flange.arc is not None:
        back = Form(*(steps.name(-part) for part in (first[2].constant, first[2].cosine, first[2].sine)))
        bounds.append(turning(flange.arc, (back, second[2]), steps))
    if bend.arc is not None:
        low, high = (tidy(end + wrist.skew) for end in bend.arc)
        bounds.append(tilting((low, high), third[2], steps))
    return bounds
