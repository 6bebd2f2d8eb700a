"""How the ends of chains move with every symbol, and where they are, in one set of shared intermediate values.

In: chains of elementary transforms and symbols, be they joint variables or parameters. Out: one velocity for each chain
and symbol, and the poses where they are asked for. A few plans are evaluated and counted, the cheapest is kept: what
the rotation is made of decides what the velocities can share with it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum, auto

import sympy as sp

from kinegen.outputs import Reference
from kinegen.symbolic.columns import Motion, Mover, angular, linear, moment, movers
from kinegen.symbolic.expressions import Definition, cost
from kinegen.symbolic.fold import NULL, UPRIGHT, Vector, fold
from kinegen.symbolic.ledger import Ledger
from kinegen.symbolic.marks import Rates, flipped, mark, rates_by, reverse
from kinegen.symbolic.pose import UNITS, Plan, cheapest_plan, evaluate, pose_entries
from kinegen.symbolic.route import Route
from kinegen.symbolic.transforms import Elementary

Chain = tuple[Elementary, ...]
"""Elementary transforms from the base to a frame, left to right."""


class _Rotation(Enum):
    """The rotation of a chain that is computed first, and shared by what follows.

    It is built from the reference outwards, which gives the axes of all joints on the way; or as the pose alone would
    build it; or not at all.
    """

    OUTWARDS = auto()
    AS_POSE = auto()
    NONE = auto()


@dataclass(frozen=True, slots=True)
class Driven:
    """A chain that changes.

    Attributes:
        steps: The chain.
        rates: How fast the angle or length of each transform grows with each of some symbols.
        count: Number of these symbols.
    """

    steps: Chain
    rates: Sequence[Rates]
    count: int


@dataclass(frozen=True, slots=True)
class Derivative:
    """Poses of some chains and their derivatives.

    Attributes:
        definitions: Intermediate values.
        poses: Twelve entries for each chain, the upper three rows of its matrix; none where they are not asked for.
        motions: For each chain one velocity for each symbol.
    """

    definitions: tuple[Definition, ...]
    poses: tuple[tuple[sp.Expr, ...], ...]
    motions: tuple[tuple[Motion, ...], ...]

    @property
    def entries(self) -> tuple[sp.Expr, ...]:
        """The poses, then for each chain a matrix of six rows with a column for each symbol, row by row."""
        jacobians = [motion for motions in self.motions for motion in zip(*(m.entries for m in motions), strict=True)]
        return (*(entry for pose in self.poses for entry in pose), *(entry for row in jacobians for entry in row))


def derivative(
    chains: Sequence[Chain],
    symbols: Sequence[sp.Symbol],
    reference: Reference = Reference.LOCAL_WORLD_ALIGNED,
    with_poses: bool = False,
) -> Derivative:
    """Derive chains by symbols.

    Args:
        chains: The chains; intermediate values are shared between them.
        symbols: Joint variables or parameters; a chain need not depend on all of them.
        reference: The axes and the point of the velocities.
        with_poses: Whether the poses are wanted too.

    Returns:
        For each chain and symbol x, as vectors v and w for a column: with T the pose of the chain, the derivative of T
        by x has the skew-symmetric matrix of w times R as its rotation. In `local_world_aligned` v is the derivative
        of the position; in `world` v is that minus w x position; `local` has the same v and w as
        `local_world_aligned` in the axes of the chain's end.
    """
    driven = [Driven(chain, rates_by(chain, symbols), len(symbols)) for chain in chains]
    return derivative_of(driven, reference, with_poses)


def derivative_of(
    chains: Sequence[Driven], reference: Reference = Reference.LOCAL_WORLD_ALIGNED, with_poses: bool = False
) -> Derivative:
    """The same for chains whose transforms grow at given rates, whatever these come from."""
    plans = [_Rotation.OUTWARDS, _Rotation.AS_POSE if with_poses else _Rotation.NONE]
    if not with_poses and all(chain.count >= len(chain.steps) for chain in chains):
        # Every axis on the way is the axis of some symbol, and only this plan gives them all.
        plans = [_Rotation.OUTWARDS]
    found = [_Attempt(Ledger(), reference, plan, with_poses).derive(chains) for plan in plans]
    return min(found, key=lambda each: cost(each.definitions, each.entries))


@dataclass(frozen=True, slots=True)
class _Attempt:
    """One plan.

    Attributes:
        ledger: Knows what is computed already.
        reference: The axes and the point.
        plan: The rotation that is computed first.
        with_poses: Whether the poses are results.
    """

    ledger: Ledger
    reference: Reference
    plan: _Rotation
    with_poses: bool

    def derive(self, chains: Sequence[Driven]) -> Derivative:
        """Evaluate all chains."""
        derived = [self._chain(chain) for chain in chains]
        result = Derivative(
            definitions=(),
            poses=tuple(pose for pose, _ in derived if pose),
            motions=tuple(motions for _, motions in derived),
        )
        return Derivative(self.ledger.live(result.entries), result.poses, result.motions)

    def _chain(self, chain: Driven) -> tuple[tuple[sp.Expr, ...], tuple[Motion, ...]]:
        route = Route(mark(chain.steps, chain.rates), self.ledger)
        seen, attitude = route, UPRIGHT
        if self.reference is Reference.LOCAL and self.with_poses:
            seen, attitude = Route(flipped(route.marked), self.ledger), route.marked.attitude
        elif self.reference is Reference.LOCAL:
            seen = Route(reverse(chain.steps, chain.rates), self.ledger)
        rotation, end = self._rotation(chain.steps, seen), NULL
        if self.with_poses:
            end = self.ledger.choose(route.positions())
        elif self.reference is Reference.LOCAL_WORLD_ALIGNED:
            end = self.ledger.cheapest(route.positions())
        motions = self._motions(seen, end, chain.count, () if self.with_poses else rotation)
        if self.reference is Reference.LOCAL:
            motions = tuple(motion.turned(attitude, -1) for motion in motions)
        if not self.with_poses:
            return (), motions
        return tuple(pose_entries(rotation, end, route.marked.attitude)), motions

    def _motions(self, route: Route, end: Vector, count: int, lent: Sequence[Vector]) -> tuple[Motion, ...]:
        """The velocities, chosen from the base to the tip and once more on the way back, when all others are known.

        What is lent counts as paid for on the way there only.
        """
        moving = [movers(route, index) for index in range(count)]
        order = sorted(range(count), key=lambda index: [mover.place for mover in moving[index]])
        choose = self.ledger.choose
        turning = {index: choose(angular(route, moving[index])) for index in order}
        shifting = {index: choose(self._linear(route, moving[index], turning[index], end)) for index in order}
        for vector in lent:
            self.ledger.give_back(vector)
        for index in reversed(order):
            turning[index] = choose(angular(route, moving[index]), turning[index])
            shifting[index] = choose(self._linear(route, moving[index], turning[index], end), shifting[index])
        return tuple(Motion(shifting[index], turning[index]) for index in range(count))

    def _linear(self, route: Route, moving: Sequence[Mover], turning: Vector, end: Vector) -> Iterable[Vector]:
        if self.reference is Reference.LOCAL_WORLD_ALIGNED:
            return linear(route, moving, turning, end)
        return moment(route, moving, turning)

    def _rotation(self, steps: Chain, seen: Route) -> tuple[Vector, Vector, Vector]:
        """The columns of the rotation before the constant attitude, as the plan builds them."""
        columns = UNITS
        if self.plan is _Rotation.OUTWARDS:
            last = len(seen.marked.turns)
            x, y, z = columns = seen.column(last, 0), seen.column(last, 1), seen.column(last, 2)
            if self.reference is Reference.LOCAL:
                columns = ((x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2]))
        elif self.plan is _Rotation.AS_POSE:
            folded = fold(steps)
            columns, _ = evaluate(folded, Plan(cheapest_plan(folded).carried), self.ledger.tape)
        for column in columns:
            self.ledger.choose([column])
        return columns
