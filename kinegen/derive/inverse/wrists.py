"""The spherical wrist, and the hand of a UR type where axes 4 and 6 are parallel.

A wrist has three angles from what is left of the attitude after the arm. Parallel axes 4 and 6 leave open where the
hand points in the plane of the arm: axis 4 is where that puts it, two links follow, and joint 6 takes what is left. A
limit of joints 2, 3, 4 and 6 is a distance between two points of the plane, so that it is reached where a form in the
direction of the hand is zero.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import sympy as sp

from kinegen.derive.inverse.axes import JointAxis
from kinegen.derive.inverse.exact_geometry import Rotation, tidy
from kinegen.derive.inverse.family import TripleArm
from kinegen.derive.inverse.geometry import Planar, Wrist, arm_size
from kinegen.derive.inverse.joint_wrapping import rest_angle
from kinegen.derive.inverse.limit_conditions import Arc, Form, best_of, least, most
from kinegen.derive.inverse.straight_line_operations import HALF_TURN, ONE, ZERO, Angle, OperationBuilder, fixed
from kinegen.derive.inverse.tolerances import ALIGNED, ROUNDING
from kinegen.support.dataclass import dataclass

Flip = tuple[Angle, Angle, Angle]
"""One of the two ways to hold a wrist: how far the axes of its three joints are turned."""


def flips(steps: OperationBuilder, wrist: Wrist, left: Rotation, start: Planar) -> tuple[Flip, Flip]:
    """Solve `left = Rz(t4) Ry(t5 + skew) Rz(t6)` in both ways: with t5 + skew from 0 to 180 deg, then flipped.

    `left` has the columns of the rotation that is left to the wrist, in the wrist's frame and the hand's. `start` is
    the direction of t4 where axes 4 and 6 are in line, unless t6 would break its limits.
    """
    r13, r23, _ = left[2]
    square = steps.square((r13, r23))
    start = _within_limits(steps, wrist, left, start)
    lead = steps.choose(square, ALIGNED, start, (r13, r23))
    roll, tilt, flange = held(steps, left, lead)
    skew = fixed(wrist.skew)
    return (roll, tilt - skew, flange), (roll + HALF_TURN, -tilt - skew, flange + HALF_TURN)


def _within_limits(steps: OperationBuilder, wrist: Wrist, left: Rotation, start: Planar) -> Planar:
    """Return the direction of t4 where axes 4 and 6 are in line: the given one, or one with t6 at one of its limits.

    The second column then has the sum t4 + t6, or their difference where the axes point against each other.
    """
    roll, _, flange = wrist.joints
    (_, _, _), (r12, r22, _), (_, _, r33) = left

    def one_way(vector: Planar) -> Planar:
        return vector[0], steps.select(r33, ZERO, -vector[1], vector[1])

    return shared_out(steps, (roll, flange), (r22, steps.name(-r12)), start, one_way)


def shared_out(
    steps: OperationBuilder,
    joints: tuple[JointAxis, JointAxis],
    total: Planar,
    start: Planar,
    one_way: Callable[[Planar], Planar] = lambda vector: vector,
) -> Planar:
    """Return the direction of the first of two joints that turn about one line, within the limits of both.

    It is the start, or the direction that leaves the other joint at one of its limits. Directions know no whole turns,
    so that limits beyond half a turn are no special case.

    Args:
        steps: The let bindings.
        joints: The two.
        total: The direction of the sum of their angles.
        start: The direction of the first one at rest, which it has if the other one then keeps its limits.
        one_way: Mirrors a direction where the joints turn against each other, so that the total is their difference.
    """
    first, last = joints
    if last.arc is None:
        return start
    low, high = last.arc
    # The last one as it would be, from the middle of its limits.
    middle, end = steps.unit((low + high) / 2), steps.unit((high - low) / 2)
    cosine, sine = steps.back(middle, one_way(steps.back(start, total)))
    # Half of the range on, at the end that is nearer; turned back from the sum or the difference, the first is left.
    side = steps.select(sine, ZERO, -end[1], end[1])
    lead = steps.back(one_way(steps.times(middle, (end[0], side))), total)
    if first.arc is not None and _may_need_other_end(first.arc, rest_angle(first), high - low):
        # The end that leaves the first nearer to the middle of its own limits: if either is within them, this one is.
        other = steps.back(one_way(steps.times(middle, (end[0], -side))), total)
        own = steps.unit(sp.Add(*first.arc) / 2)
        along, beside = (steps.dot(own, each) for each in (lead, other))
        lead = steps.choose(along, beside, other, lead)
    return steps.choose(cosine, end[0], lead, start)


def _may_need_other_end(first: tuple[sp.Expr, sp.Expr], start: sp.Expr, last: sp.Expr) -> bool:
    """Tell whether the first of two joints can be outside its limits with the last one only at its nearer limit.

    The angles of the first from one of these limits to the other without which the last one is outside its own add up
    to a gap that contains the start. Half of it at most is on the side of the nearer end, half at least on the other.
    """
    shorter, longer = sorted(abs(float(end - start)) for end in first)
    return shorter < math.pi - float(last) / 2 <= longer


def held(steps: OperationBuilder, left: Rotation, lead: Planar) -> Flip:
    """Return the angles t4, t5 + skew without flip, and t6, for a given direction of t4.

    t6 comes from what turning back by t4 leaves of the first columns, so that the two fit together however near to each
    other axes 4 and 6 are.
    """
    tilt = Angle(steps.name(sp.atan2(sine_of(steps, left), left[2][2], evaluate=False)), 0.0, math.pi)
    flange = _flange_direction(steps, left, lead)
    return steps.argument(lead), tilt, steps.argument(flange)


def _flange_direction(steps: OperationBuilder, left: Rotation, lead: Planar) -> Planar:
    """Return the direction of t6 for that of t4."""
    (r11, r21, _), (r12, r22, _), _ = left
    sine = steps.name(steps.name(r21 * lead[0]) - steps.name(r11 * lead[1]))
    return steps.name(steps.name(r22 * lead[0]) - steps.name(r12 * lead[1])), sine


def sine_of(steps: OperationBuilder, left: Rotation) -> sp.Expr:
    """Return the sine of the angle between axes 4 and 6, not negative."""
    return steps.root(steps.square(left[2][:2]))


def hand_direction(steps: OperationBuilder, left: Rotation) -> Planar:
    """Return the direction of t4 without flip as a complex number of length 1, for an arm that goes on from there.

    Where axes 4 and 6 are in line, the one that leaves t6 = 0: what the other columns say is then the turn t4.
    """
    (_, _, _), (r12, r22, _), (r13, r23, _) = left
    square = steps.square((r13, r23))
    inverse = steps.name(1 / steps.select(square, ALIGNED, ONE, steps.root(square)))
    return (
        steps.name(steps.select(square, ALIGNED, r22, r13) * inverse),
        steps.name(steps.select(square, ALIGNED, -r12, r23) * inverse),
    )


@dataclass(frozen=True, slots=True)
class Side:
    """What a waist leaves to the joints after it, for one of both ways to turn it.

    `across` is the point that the hand leads to, as seen from axis 2, across it; `left` has the columns of the rotation
    that is left to the wrist, in its frame.
    """

    across: Planar
    left: Rotation

    def aligned(self, steps: OperationBuilder, other: sp.Expr, usual: sp.Expr) -> sp.Expr:
        """Return one expression where axes 4 and 6 are parallel, else another one."""
        return steps.select(steps.square(self.left[2][:2]), ALIGNED, other, usual)


def is_limited(build: TripleArm, wrist: Wrist) -> bool:
    """Tell whether a joint that the hand moves can be outside its limits."""
    return any(joint.arc is not None for joint in (*build.turns, wrist.joints[2]))


def that_is_aligned(steps: OperationBuilder, one: Side, other: Side) -> Side:
    """Choose of two sides the one that has axes 4 and 6 parallel, which at most one can have, else any."""

    def of_one(left: sp.Expr, right: sp.Expr) -> sp.Expr:
        return one.aligned(steps, left, right)

    across = (of_one(one.across[0], other.across[0]), of_one(one.across[1], other.across[1]))
    (a, b, _), (c, d, _), (_, _, e) = (
        tuple(of_one(*pair) for pair in zip(*columns, strict=True))
        for columns in zip(one.left, other.left, strict=True)
    )
    return Side(across, ((a, b, ZERO), (c, d, ZERO), (ZERO, ZERO, e)))


def hand_within_limits(steps: OperationBuilder, build: TripleArm, wrist: Wrist, side: Side, start: Planar) -> Planar:
    """Return the direction of the hand, of length 1, with which all joints keep their limits; any if none will do.

    `side` is what the waist leaves to the other joints, with axes 4 and 6 parallel. The hand points to `start`, which
    is within reach, if that will do.
    """
    arm = _Arm(steps, build, wrist, side)
    directions = [start, *arm.mirrored(start), *arm.at_limits()]
    return best_of(steps, [(direction, arm.margin(direction)) for direction in directions])


@dataclass(frozen=True, slots=True)
class _Arm:
    """The two links and the hand for one side, where axes 4 and 6 are parallel."""

    steps: OperationBuilder
    build: TripleArm
    wrist: Wrist
    side: Side

    @property
    def _lengths(self) -> Planar:
        return self.steps.length(self.build.upper), self.steps.length(self.build.lower)

    def mirrored(self, direction: Planar) -> Iterator[Planar]:
        """Yield the direction with which axis 4 is as far from axis 2, on the other side of the line to the point.

        Only a hand longer than one of the links can have two separate ranges of directions within reach.
        """
        hand = self.steps.length(self.build.hand)
        if all(length.is_number for length in (hand, *self._lengths)) and hand <= min(self._lengths):
            return
        steps, point = self.steps, self.side.across
        line = steps.times(point, point)
        turned = steps.back(steps.times(self.build.hand, self.build.hand), line)
        mirror = steps.back(direction, turned)
        yield steps.scaled(mirror, steps.name(1 / steps.root(steps.square(mirror))))

    def at_limits(self) -> Iterator[Planar]:
        """Yield the directions with which a joint is at a limit."""
        upper, lower, hand = self.build.upper, self.build.lower, self.build.hand
        first, second, third = self.build.turns
        # Joint 6 has what the hand leaves, joint 4 the angle between hand and second link.
        for end in _ends(self.wrist.joints[2]):
            yield self._with_flange(end)
        for end in _ends(third):
            yield from self._apart(self.side.across, _sum(hand, _turned(self.steps, lower, -end)), upper)
        if hand == (ZERO, ZERO):
            return
        for end in _ends(first):
            elbow = _turned(self.steps, upper, end)
            point = (self.steps.name(self.side.across[0] - elbow[0]), self.steps.name(self.side.across[1] - elbow[1]))
            yield from self._apart(point, hand, lower)
        # Equal spans at both limits of the elbow give the same directions.
        tried: list[sp.Expr] = []
        for end in _ends(second):
            span = _sum(upper, _turned(self.steps, lower, end))
            size = tidy(span[0] ** 2 + span[1] ** 2)
            if size not in tried:
                tried.append(size)
                yield from self._apart(self.side.across, hand, span)

    def _apart(self, point: Planar, carried: Planar, span: Planar) -> tuple[Planar, Planar]:
        """Return the directions that turn a vector so that its tip is as far from a point as a vector is long."""
        steps, size = self.steps, arm_size(*self.build.upper, *self.build.lower, *self.build.hand)
        real, imaginary = steps.back(point, carried)
        both = steps.name(steps.square(point) + tidy(carried[0] ** 2 + carried[1] ** 2 - span[0] ** 2 - span[1] ** 2))
        form = Form(steps.name(both / size), steps.name(-2 * real / size), steps.name(2 * imaginary / size))
        return form.roots(steps)

    def _with_flange(self, end: sp.Expr) -> Planar:
        """Return the direction that leaves joint 6 turned by an angle."""
        steps, (_, (r12, r22, _), (_, _, r33)) = self.steps, self.side.left
        limit = steps.unit(end)
        return steps.back((limit[0], steps.select(r33, ZERO, -limit[1], limit[1])), (r22, steps.name(-r12)))

    def margin(self, direction: Planar) -> sp.Expr:
        """Return how far all joints are within their limits, in the better one of both ways to bend the elbow."""
        steps, (first, second) = self.steps, self._lengths
        begin = steps.times(direction, self.build.hand)
        point = (steps.name(self.side.across[0] - begin[0]), steps.name(self.side.across[1] - begin[1]))
        # The cosine rule, for both ways to bend the elbow.
        square, scale = steps.square(point), tidy(1 / (2 * first * second))
        cosine = steps.name((square - first**2 - second**2) * scale)
        beyond = steps.name(1 - cosine**2)
        sine = steps.root_of_positive(beyond)
        # What rounding puts outside the reach is left to the elbow, which has a tolerance for it.
        reached = steps.select(beyond, -ROUNDING * steps.near.condition, beyond, ONE)
        shared = [reached, *self._flange(direction)]
        ways = []
        for bent in ((cosine, sine), (cosine, -sine)):
            own = (
                *self._shoulder(point, square, bent),
                *self._elbow(bent),
                *self._hand(direction, point, square, bent),
            )
            ways.append(least(steps, own))
        return least(steps, [*shared, most(steps, ways)])

    def _flange(self, direction: Planar) -> Iterator[sp.Expr]:
        arc = self.wrist.joints[2].arc
        if arc is not None:
            yield _within(self.steps, arc, _flange_direction(self.steps, self.side.left, direction), ONE)

    def _elbow(self, bent: Planar) -> Iterator[sp.Expr]:
        """Yield the elbow, from the angle between both links."""
        arc = self.build.turns[1].arc
        if arc is not None:
            upper, lower = self.steps.polar(self.build.upper)[1], self.steps.polar(self.build.lower)[1]
            yield _within(self.steps, _moved(arc, lower - upper), bent, ONE)

    def _shoulder(self, point: Planar, square: sp.Expr, bent: Planar) -> Iterator[sp.Expr]:
        arc, steps, (first, second) = self.build.turns[0].arc, self.steps, self._lengths
        if arc is not None:
            span = (steps.name(first + second * bent[0]), steps.name(second * bent[1]))
            yield _within(steps, _moved(arc, steps.polar(self.build.upper)[1]), steps.back(span, point), square)

    def _hand(self, direction: Planar, point: Planar, square: sp.Expr, bent: Planar) -> Iterator[sp.Expr]:
        arc, steps, (first, second) = self.build.turns[2].arc, self.steps, self._lengths
        if arc is not None:
            span = (steps.name(second + first * bent[0]), steps.name(-first * bent[1]))
            turned = steps.times(steps.back(point, direction), span)
            yield _within(steps, _moved(arc, -steps.polar(self.build.lower)[1]), turned, square)


def _within(steps: OperationBuilder, arc: Arc, vector: Planar, length: sp.Expr) -> sp.Expr:
    """Return how far the direction of a vector of a length is within an arc."""
    x, y = steps.unit(sp.Add(*arc) / 2)
    along = steps.dot((x, y), vector)
    return steps.name(along - steps.unit((arc[1] - arc[0]) / 2)[0] * length)


def _ends(joint: JointAxis) -> Arc | tuple[()]:
    return joint.arc or ()


def _moved(arc: Arc, angle: sp.Expr) -> Arc:
    return tidy(arc[0] + angle), tidy(arc[1] + angle)


def _turned(steps: OperationBuilder, vector: Planar, angle: sp.Expr) -> Planar:
    """Return a constant vector turned by a constant angle."""
    (x, y), (cosine, sine) = vector, steps.unit(angle)
    return tidy(x * cosine - y * sine), tidy(y * cosine + x * sine)


def _sum(left: Planar, right: Planar) -> Planar:
    return tidy(left[0] + right[0]), tidy(left[1] + right[1])
