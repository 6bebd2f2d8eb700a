"""All solutions of an arm that is nearly of a family: those of the family's arm, led to the arm's own.

For each branch, first the target T is moved: with the joints that solve the family's arm, that arm reaches G and the
own arm F, so that G F^-1 T is what the family's arm has to be solved for next. G is T unless the target is beyond the
reach of the family's arm. If it is not beyond that of the own one, two branches are near to where they meet, and both
start there; the root that keeps them apart is taken anew for each target that was moved. Steps of second order on the
own arm's pose follow (`second_order_steps`); beside a root they converge from its own side. Where a joint has nearly no
effect they go far, so that not the way says whether a solution is that of its branch, but where it stands: the elbow
and the wrist have to be bent as the branch bends them, but for a band beside the places where branches meet.

Joints are cosines and sines until the end, so that no arc tangent is needed on the way. A step turns a joint by 2
atan(d/2) instead of d (Cayley), which keeps their squares at a sum of 1 without a root.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import sympy as sp

from kinegen.derive.expressions import by_type
from kinegen.derive.folding import Vector
from kinegen.derive.inverse.axes import JointAxis
from kinegen.derive.inverse.compact_chain import CompactChain, own_chain
from kinegen.derive.inverse.exact_geometry import Rotation, chained, combined, transposed, turned
from kinegen.derive.inverse.family import Family, GimbalArm, WristArm, elbow_of, wrist_of
from kinegen.derive.inverse.geometry import Planar
from kinegen.derive.inverse.joint_wrapping import Solution
from kinegen.derive.inverse.nearest_family import Defect
from kinegen.derive.inverse.second_order_steps import Reached, half_turns, reached, turn_left
from kinegen.derive.inverse.singular_configurations import alignments, boundaries
from kinegen.derive.inverse.solve import solve
from kinegen.derive.inverse.straight_line_operations import ONE, ZERO, Angle, OperationBuilder, Units, fixed
from kinegen.derive.inverse.target_pose import Target
from kinegen.support.dataclass import dataclass

RESIDUAL = by_type(sp.Rational(1, 2**40), sp.Rational(1, 2**16))
"""How far the pose of a valid solution may be from the target, as the kernel computes it: radians, or parts of the
reach."""

_ROUNDED = by_type(sp.Rational(1, 2**18), sp.Rational(1, 2**6))
"""What `RESIDUAL` may leave of a sine where two branches meet: four times its root."""

BAND = 16
"""How far an elbow or a wrist may be bent the other way than in its branch, as a sine, in defects, besides rounding.

The own arm's branches meet beside the places where those of the family's arm do: of a KR16 up to 16 defects away, of a
UR5 up to 20. A solution farther away on the other side is another branch's.
"""

MOVES = 2
"""How often the target is moved.

Where two branches of the family's arm meet, a defect d leaves the root between them off by the root of d. A move takes
it to the power 3/4 of d, a second one to 7/8, and the arm's own branches meet within d of there.
"""

_SMALL = 3e-4
"""A defect for which one step less will do."""


def newton_steps(defect: Defect, reach: float) -> int:
    """Return how many steps it takes after the target was moved, for a defect and the reach of an arm.

    Found by trial at 10^5 targets of arms with such defects, and at as many beside the places where branches meet: with
    one step less, all branches are right to `RESIDUAL` where the least singular value of the Jacobian is above
    `defect.singular_below`. Within a defect of axis 1 the waist starts anywhere, and without the last step no branch
    of some targets was at `RESIDUAL` yet.
    """
    return 4 if defect.size(reach) < _SMALL else 5


def nearly_solved(steps: OperationBuilder, family: Family, defect: Defect, tool: Target) -> Iterator[Solution]:
    """Solve for all branches, in the order of `family.branches`, before the limits of the joints are seen to.

    `family` is that of the nearest arm. `tool` is the pose of the tool; where a joint is given, that left for the
    others.
    """
    axes = family.axes.reversed() if family.is_reversed else family.axes
    own, special = own_chain(defect.axes), own_chain(axes)
    refiner = _Refiner(steps, family, defect, own, special, _of_last_frame(steps, own, tool))
    for branch, start in enumerate(list(solve(steps, family, refiner.aim(tool)))):
        yield refiner.solution(branch, start)


def _of_last_frame(steps: OperationBuilder, chain: CompactChain, tool: Target) -> Target:
    """Return the target of the last frame in the first one, from that of the tool."""
    seen = _placed(steps, *_back(chain.rotation, chain.origin), tool)
    return _carried(steps, seen, *_back(chain.hand_rotation, chain.hand_origin))


def _back(rotation: Rotation, origin: Vector) -> tuple[Rotation, Vector]:
    """Return the inverse of a constant pose."""
    back = transposed(rotation)
    return back, turned(back, combined((-1, origin)))


def _placed(steps: OperationBuilder, rotation: Rotation, origin: Vector, pose: Target) -> Target:
    """Return a constant pose times another one."""
    first, second, third = (steps.turned(rotation, column) for column in transposed(pose.rotation))
    return Target(transposed((first, second, third)), steps.plus(steps.turned(rotation, pose.position), origin))


def _carried(steps: OperationBuilder, pose: Target, rotation: Rotation, origin: Vector) -> Target:
    """Return a pose times a constant one."""
    first, second, third = (steps.turned(transposed(rotation), row) for row in pose.rotation)
    return Target((first, second, third), pose.carried(steps, origin))


@dataclass(frozen=True, slots=True)
class _Refiner:
    """What all branches share: the own chain, that of the family's arm, and the target of the own last frame.

    The target is in the first frame of the own chain; the chain of the family's arm goes from the base to the tool.
    """

    steps: OperationBuilder
    family: Family
    defect: Defect
    chain: CompactChain
    special: CompactChain
    target: Target

    def aim(self, tool: Target) -> Target:
        """Return what the family is solved for, from the pose of the tool."""
        return tool.inverse(self.steps) if self.family.is_reversed else tool

    def solution(self, branch: int, start: Solution) -> Solution:
        """Lead a branch from that of the family's arm to the arm's own."""
        sane, wanted, weight = start.valid[0], transposed(self.target.rotation), self._weight()
        # The first corrections are those of the closed form, which keeps branches apart at a root.
        for _ in range(MOVES):
            aimed = self.aim(self._moved(start))
            start = next(itertools.islice(solve(self.steps, self.family, aimed), branch, None))
        # Steps more than square what is left.
        units = self._units(start, self.chain)
        for _ in range(newton_steps(self.defect, self.chain.reach)):
            halves = half_turns(self.steps, self._reached(units), wanted, self.target.position, weight)
            units = [self._turned(unit, half) for unit, half in zip(units, halves, strict=True)]
        valid = self._own(branch, units, self._valid(self._reached(units), wanted, weight))
        joints = sorted((joint for joint, _ in start.angles), key=lambda joint: joint.number)
        angles = [(joint, self._amount(joint, unit)) for joint, unit in zip(joints, units, strict=True)]
        return Solution(tuple(angles), (sane, valid))

    # Joints -----------------------------------------------------------------------------------------------------------

    def _sign(self, joint: JointAxis) -> int:
        """Return 1 where the family's joint turns like the own chain's, else -1."""
        return 1 if (joint.rate > 0) == (self.defect.axes.joints[self._place(joint)].rate > 0) else -1

    def _place(self, joint: JointAxis) -> int:
        """Its place in the own chain, which begins with the second joint where the first one is given."""
        return joint.number - self.defect.axes.numbers[0]

    def _units(self, solution: Solution, chain: CompactChain) -> list[Planar]:
        """Return cosine and sine of each joint's angle in a chain, from the first joint to the last."""
        units, found = Units(self.steps), dict[int, Planar]()
        for joint, angle in solution.angles:
            value = angle.value if isinstance(angle, Angle) else angle
            found[joint.number] = units.of(self._sign(joint) * value + self._lead(joint, chain))
        return [found[number] for number in sorted(found)]

    def _lead(self, joint: JointAxis, chain: CompactChain) -> sp.Expr:
        place = self._place(joint)
        return chain.links[place].lead if place < len(chain.links) else ZERO

    def _amount(self, joint: JointAxis, unit: Planar) -> Angle:
        angle = self.steps.argument(unit) - fixed(self._lead(joint, self.chain))
        return angle if self._sign(joint) > 0 else -angle

    def _turned(self, unit: Planar, half: sp.Expr) -> Planar:
        """Turn a unit by 2 atan(half)."""
        name = self.steps.name
        scale = name(2 / name(1 + name(half**2)))
        return self.steps.times(unit, (name(scale - 1), name(half * scale)))

    # Branches ---------------------------------------------------------------------------------------------------------

    def _own(self, branch: int, units: list[Planar], valid: sp.Expr) -> sp.Expr:
        """Return `valid` where elbow and wrist are bent as in a branch, else 0."""
        name, least = self.steps.name, -(sp.Rational(BAND * self.defect.size(self.chain.reach)) + _ROUNDED)
        for joint, straight, is_ahead in self._bends(branch):
            turn = float(self._sign(joint) * joint.rate) * straight + float(self._lead(joint, self.chain))
            sign = self._sign(joint) if is_ahead else -self._sign(joint)
            cosine, sine = (sp.Rational(sign * function(turn)) for function in (math.cos, math.sin))
            unit = units[self._place(joint)]
            bent = name(name(cosine * unit[1]) - name(sine * unit[0]))
            valid = self.steps.select(least, bent, valid, ZERO)
        return valid

    def _bends(self, branch: int) -> Iterator[tuple[JointAxis, float, bool]]:
        """Yield the joints of elbow and wrist, their values where they are straight, and whether they go beyond."""
        right, second, flipped = branch // 4 % 2 == 1, branch // 2 % 2 == 1, branch % 2 == 1
        elbow, wrist = elbow_of(self.family.build), wrist_of(self.family.build)
        if elbow is None or wrist is None:
            return
        # Behind the waist the elbow is seen in a mirror, unless it is solved first.
        match self.family.build:
            case WristArm(GimbalArm()):
                goes_on = second
            case _:
                goes_on = second != right
        ((_, (straight, _)),) = boundaries(self.family)
        yield elbow[0], straight, goes_on
        ((_, (straight, _)),) = alignments(self.family)
        yield wrist.joints[1], straight, not flipped

    # Poses ------------------------------------------------------------------------------------------------------------

    def _reached(self, units: list[Planar]) -> Reached:
        return reached(self.steps, self.chain, units)

    def _moved(self, start: Solution) -> Target:
        """Return the pose of the tool that the family's arm has to be solved for next: `G F^-1 target`."""
        steps, chain, special = self.steps, self.chain, self.special
        # What the family's arm reaches may differ from the target beyond its reach.
        exact = reached(steps, special, self._units(start, special))
        left = self._left(self._reached(self._units(start, chain)))
        # From the last frame of one chain to that of the other, through the tool.
        back, off = _back(chain.hand_rotation, chain.hand_origin)
        between = chained(special.hand_rotation, back)
        shift = combined((1, turned(special.hand_rotation, off)), (1, special.hand_origin))
        pose = _carried(steps, Target(transposed(exact.columns), exact.place), between, shift)
        hand = _carried(steps, left, chain.hand_rotation, chain.hand_origin)
        return _placed(steps, special.rotation, special.origin, self._product(pose, hand))

    def _left(self, found: Reached) -> Target:
        """Return the pose of the last frame that is wanted, in that which is reached."""
        steps, wanted = self.steps, transposed(self.target.rotation)
        first, second, third = (steps.seen(found.columns, column) for column in wanted)
        away = steps.minus(self.target.position, found.place)
        return Target(transposed((first, second, third)), steps.seen(found.columns, away))

    def _product(self, left: Target, right: Target) -> Target:
        """Return one pose times another one."""
        steps = self.steps
        first, second, third = (steps.seen(left.rotation, column) for column in transposed(right.rotation))
        shift = steps.seen(left.rotation, right.position)
        return Target(transposed((first, second, third)), steps.plus(shift, left.position))

    def _weight(self) -> sp.Expr:
        """Return what lengths are multiplied by to be compared with angles: a power of two from 1 / reach on."""
        return sp.Integer(2) ** -math.floor(math.log2(self.chain.reach))

    def _valid(self, found: Reached, wanted: Rotation, weight: sp.Expr) -> sp.Expr:
        """Return 1 where the pose is reached, else 0."""
        steps, select = self.steps, self.steps.select
        apart = steps.scaled(steps.minus(self.target.position, found.place), weight)
        turn = steps.scaled(turn_left(steps, found, wanted), sp.Rational(1, 2))
        off = steps.name(steps.square(apart) + steps.square(turn))
        valid = select(off, RESIDUAL**2, ONE, ZERO)
        # The turn is small at half a turn, too.
        alike = steps.name(sp.Add(*(steps.dot(own, other) for own, other in zip(found.columns, wanted, strict=True))))
        return select(sp.Integer(2), alike, valid, ZERO)
