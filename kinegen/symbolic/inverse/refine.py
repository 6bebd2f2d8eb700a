"""All solutions of an arm that is nearly of a family: those of the family's arm, led to the arm's own.

For each branch, first the target is moved: where the family's arm is solved for the pose T', the own arm reaches F, so
that T' F^-1 T is what the family's arm has to be solved for next. Each time the error becomes smaller by about the
size of the defect, also where two branches nearly meet, because the root in which they meet is taken anew. Then Newton
steps on the own arm's pose square what is left. Both are a fixed number, see `amounts`.

Joints are cosines and sines until the end, so that no arc tangent is needed on the way. A step turns a joint by
2 atan(d/2) instead of d (Cayley), which keeps their squares at a sum of 1 without a root.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import sympy as sp

from kinegen.symbolic.expressions import by_type
from kinegen.symbolic.fold import Vector
from kinegen.symbolic.inverse.axes import JointAxis
from kinegen.symbolic.inverse.defect import Defect
from kinegen.symbolic.inverse.exact import Rotation, columns, transposed, turned
from kinegen.symbolic.inverse.family import Family
from kinegen.symbolic.inverse.geometry import Planar
from kinegen.symbolic.inverse.newton import Reached, half_turns, reached, turn_left
from kinegen.symbolic.inverse.own_chain import OwnChain, own_chain
from kinegen.symbolic.inverse.solutions import Solution
from kinegen.symbolic.inverse.solve import solve
from kinegen.symbolic.inverse.steps import ONE, ZERO, Angle, Steps, fixed
from kinegen.symbolic.inverse.target import Target
from kinegen.symbolic.inverse.units import Units
from kinegen.symbolic.inverse.vectors import Vectors

RESIDUAL = by_type(sp.Rational(1, 2**40), sp.Rational(1, 2**16))
"""How far the pose of a valid solution may be from the target, as the kernel computes it: radians, or parts of the
reach."""

_FARTHEST = sp.Rational(1, 8)
"""How far Newton steps may go: half of the root of the sum of squares of all angles. Farther away is another branch."""

_SMALL = 3e-4
"""A defect for which the target is moved only once."""

_SMALL_OF_FOUR = 1e-6
"""The same where the family solves an equation of degree four."""


@dataclass(frozen=True, slots=True)
class Amounts:
    """How often the target is moved, and how many Newton steps follow."""

    moves: int
    newtons: int

    @property
    def text(self) -> str:
        """In words."""
        times = "once" if self.moves == 1 else "twice"
        return f"moving the target {times} and {self.newtons} Newton steps for each branch"


def amounts(defect: Defect, reach: float) -> Amounts:
    """How much it takes for a defect of some size.

    Found by trial at 10^5 targets of arms with such defects: all branches are right to `RESIDUAL` where the least
    singular value of the Jacobian is above `defect.singular_below(reach)`.

    Args:
        defect: The defect.
        reach: Of the arm.
    """
    small = _SMALL_OF_FOUR if defect.of_four else _SMALL
    return Amounts(1, 2) if defect.size(reach) < small else Amounts(2, 2)


def nearly_solved(steps: Steps, family: Family, defect: Defect, tool: Target) -> Iterator[Solution]:
    """Solve for all branches, in the order of `family.branches`.

    Args:
        steps: The tape.
        family: The nearest arm of a family.
        defect: What the arm is apart from that.
        tool: The pose of the tool; where a joint is given, the one that is left for the six others.

    Yields:
        The solutions, before the limits of the joints are seen to.
    """
    chain = own_chain(defect.axes)
    refiner = _Refiner(steps, family, defect, chain, _of_last_frame(steps, chain, tool))
    for branch, start in enumerate(list(solve(steps, family, refiner.aim(refiner.target)))):
        yield refiner.solution(branch, start)


def _of_last_frame(steps: Steps, chain: OwnChain, tool: Target) -> Target:
    """The target of the last frame, from that of the tool."""
    back = transposed(chain.hand_rotation)
    return _carried(
        steps, tool, back, turned(back, (-chain.hand_origin[0], -chain.hand_origin[1], -chain.hand_origin[2]))
    )


def _carried(steps: Steps, pose: Target, rotation: Rotation, origin: Vector) -> Target:
    """A pose times a constant one."""
    first, second, third = (steps.turned(transposed(rotation), row) for row in pose.rotation)
    x, y, z = (
        steps.name(entry + sp.Add(*(a * b for a, b in zip(row, origin, strict=True))))
        for row, entry in zip(pose.rotation, pose.position, strict=True)
    )
    return Target((first, second, third), (x, y, z))


@dataclass(frozen=True, slots=True)
class _Refiner:
    steps: Steps
    family: Family
    defect: Defect
    chain: OwnChain
    target: Target

    def aim(self, last: Target) -> Target:
        """What the family is solved for, from the pose of the last frame."""
        tool = _carried(self.steps, last, self.chain.hand_rotation, self.chain.hand_origin)
        return tool.inverse(self.steps) if self.family.is_reversed else tool

    def solution(self, branch: int, start: Solution) -> Solution:
        """A branch of the arm, from that of the family's."""
        sane, aimed, wanted = start.valid[0], self.target, columns(self.target.rotation)
        many, weight = amounts(self.defect, self.chain.reach), self._weight()
        for _ in range(many.moves):
            aimed = self._moved(aimed, self._reached(self._units(start)), wanted)
            start = next(itertools.islice(solve(self.steps, self.family, self.aim(aimed)), branch, None))
        units, gone = self._units(start), []
        for _ in range(many.newtons):
            halves = half_turns(self.steps, self._reached(units), wanted, self.target.position, weight)
            gone += [self.steps.name(half**2) for half in halves]
            units = [self._turned(unit, half) for unit, half in zip(units, halves, strict=True)]
        valid = self._valid(self._reached(units), wanted, self.steps.name(sp.Add(*gone)), weight)
        joints = sorted((joint for joint, _ in start.angles), key=lambda joint: joint.number)
        angles = [(joint, self._amount(joint, unit)) for joint, unit in zip(joints, units, strict=True)]
        return Solution(tuple(angles), (sane, valid))

    # Joints -----------------------------------------------------------------------------------------------------------

    def _sign(self, joint: JointAxis) -> int:
        """1 where the family's joint turns like the own chain's, else -1."""
        return 1 if (joint.rate > 0) == (self.defect.axes.joints[self._place(joint)].rate > 0) else -1

    def _place(self, joint: JointAxis) -> int:
        """Its place in the own chain, which begins with the second joint where the first one is given."""
        return joint.number - self.defect.axes.numbers[0]

    def _units(self, solution: Solution) -> list[Planar]:
        """Cosine and sine of each joint's angle in the own chain, from the first joint to the last."""
        units, found = Units(self.steps), dict[int, Planar]()
        for joint, angle in solution.angles:
            value = angle.value if isinstance(angle, Angle) else angle
            found[joint.number] = units.of(self._sign(joint) * value + self._lead(joint))
        return [found[number] for number in sorted(found)]

    def _lead(self, joint: JointAxis) -> sp.Expr:
        place = self._place(joint)
        return self.chain.links[place].lead if place < len(self.chain.links) else ZERO

    def _amount(self, joint: JointAxis, unit: Planar) -> Angle:
        angle = self.steps.argument(unit) - fixed(self._lead(joint))
        return angle if self._sign(joint) > 0 else -angle

    def _turned(self, unit: Planar, half: sp.Expr) -> Planar:
        """Turned by 2 atan(half)."""
        name = self.steps.name
        scale = name(2 / name(1 + name(half**2)))
        return self.steps.times(unit, (name(scale - 1), name(half * scale)))

    # Poses ------------------------------------------------------------------------------------------------------------

    def _reached(self, units: list[Planar]) -> Reached:
        return reached(self.steps, self.chain, units)

    def _moved(self, aimed: Target, found: Reached, wanted: Rotation) -> Target:
        """The pose that the family's arm has to be solved for next: `aimed found^-1 target`."""
        vectors = Vectors(self.steps)
        between = columns(
            (
                vectors.seen(wanted, found.columns[0]),
                vectors.seen(wanted, found.columns[1]),
                vectors.seen(wanted, found.columns[2]),
            )
        )
        shift = vectors.seen(found.columns, vectors.minus(self.target.position, found.place))
        first, second, third = (vectors.seen(between, row) for row in aimed.rotation)
        x, y, z = (
            self.steps.name(entry + vectors.dot(row, shift))
            for row, entry in zip(aimed.rotation, aimed.position, strict=True)
        )
        return Target((first, second, third), (x, y, z))

    def _weight(self) -> sp.Expr:
        """What lengths are multiplied by to be compared with angles: a power of two from 1 / reach on."""
        return sp.Integer(2) ** -math.floor(math.log2(self.chain.reach))

    def _valid(self, found: Reached, wanted: Rotation, gone: sp.Expr, weight: sp.Expr) -> sp.Expr:
        """1 where the pose is reached without going far, else 0."""
        name, select, vectors = self.steps.name, self.steps.select, Vectors(self.steps)
        apart = vectors.scaled(vectors.minus(self.target.position, found.place), weight)
        turn = vectors.scaled(turn_left(self.steps, found, wanted), sp.Rational(1, 2))
        off = name(self.steps.square(apart) + self.steps.square(turn))
        valid = select(gone, _FARTHEST**2, select(off, RESIDUAL**2, ONE, ZERO), ZERO)
        # The turn is small at half a turn, too.
        alike = name(sp.Add(*(vectors.dot(own, other) for own, other in zip(found.columns, wanted, strict=True))))
        return select(sp.Integer(2), alike, valid, ZERO)
