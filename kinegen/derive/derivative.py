"""How the ends of chains move with every symbol, and where they are, in one set of shared intermediate values.

In: chains of elementary transforms and symbols, be they joint variables or parameters. Out: one velocity for each chain
and symbol, and the poses where they are asked for. A few plans are evaluated and counted, the cheapest is kept: what
the rotation is made of decides what the velocities can share with it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from enum import Enum
from itertools import islice

import sympy as sp

from kinegen.derive.annotated_chain import Rates, flipped, mark, rates_by, reverse
from kinegen.derive.expressions import Definition, LetBindings, cost
from kinegen.derive.folding import IDENTITY_PERMUTATION, NULL, UNITS, AxisPermutation, Vector, fold
from kinegen.derive.jacobian_columns import ColumnTwist, Generator, angular, drawn, linear, moment, movers
from kinegen.derive.lever_arms import CostModel, FrameVectors
from kinegen.derive.pose import Plan, cheapest_plan, evaluate, pose_entries
from kinegen.derive.product_associations import is_inclined
from kinegen.derive.transforms import Elementary
from kinegen.model.outputs import Reference
from kinegen.support.dataclass import dataclass

_WORTH = 1.1
"""How many times as many operations as the best plan another may have to be handed on."""

_GUESSES = ((False, False), (True, False), (False, True), (True, True))
"""How the velocities are chosen where several ways are handed on: whether `alike` and whether `by_axes`. The last one
is for chains with fixed turns that are no quarter turns."""

Chain = tuple[Elementary, ...]
"""Elementary transforms from the base to a frame, left to right."""


class _Rotation(Enum):
    """The rotation of a chain that is computed first, and shared by what follows.

    It is built from the reference outwards, which gives the axes of all joints on the way; or as the pose alone would
    build it; or not at all.
    """

    OUTWARDS = "axes from the base outwards"
    AS_POSE = "rotation as the pose has it"
    NONE = "no rotation first"


@dataclass(frozen=True, slots=True)
class DifferentiatedChain:
    """A chain that changes.

    `rates`: how fast the angle or length of each transform grows with each of some symbols.
    """

    steps: Chain
    rates: Sequence[Rates]
    count: int


@dataclass(frozen=True, slots=True)
class Derivative:
    """Poses of some chains and their derivatives.

    Attributes:
        poses: Twelve entries for each chain, the upper three rows of its matrix; none where they are not asked for.
    """

    definitions: tuple[Definition, ...]
    poses: tuple[tuple[sp.Expr, ...], ...]
    motions: tuple[tuple[ColumnTwist, ...], ...]
    name: str

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

    `symbols`: joint variables or parameters; a chain need not depend on all of them.

    Returns:
        For each chain and symbol x, as vectors v and w for a column: with T the pose of the chain, the derivative of T
        by x has the skew-symmetric matrix of w times R as its rotation. In `local_world_aligned` v is the derivative
        of the position; in `world` v is that minus w x position; `local` has the same v and w as
        `local_world_aligned` in the axes of the chain's end.
    """
    driven = [DifferentiatedChain(chain, rates_by(chain, symbols), len(symbols)) for chain in chains]
    return derivative_of(driven, reference, with_poses)


def derivatives(
    chains: Sequence[Chain],
    symbols: Sequence[sp.Symbol],
    reference: Reference = Reference.LOCAL_WORLD_ALIGNED,
    with_poses: bool = False,
) -> Iterator[Derivative]:
    """Yield the same in several ways, the one with the least operations as they stand first; see `derivative`."""
    driven = [DifferentiatedChain(chain, rates_by(chain, symbols), len(symbols)) for chain in chains]
    guesses = _GUESSES if any(is_inclined(fold(chain).turns) for chain in chains) else _GUESSES[:-1]
    found = _attempts(driven, reference, with_poses, guesses=guesses)
    costs = [cost(each.definitions, each.entries) for each in found]
    for place in sorted(range(len(found)), key=costs.__getitem__):
        if costs[place] <= _WORTH * min(costs):
            yield found[place]


def derivative_of(
    chains: Sequence[DifferentiatedChain],
    reference: Reference = Reference.LOCAL_WORLD_ALIGNED,
    with_poses: bool = False,
    with_drawn: bool = False,
) -> Derivative:
    """Return the same for chains whose transforms grow at given rates, whatever these come from.

    With `with_drawn`, which is for `local_world_aligned`, there are second derivatives too.
    """
    found = _attempts(chains, reference, with_poses, with_drawn=with_drawn)
    return min(found, key=lambda each: cost(each.definitions, each.entries))


def _attempts(
    chains: Sequence[DifferentiatedChain],
    reference: Reference,
    with_poses: bool,
    *,
    with_drawn: bool = False,
    guesses: tuple[tuple[bool, bool], ...] = ((False, False),),
) -> list[Derivative]:
    """Return all plans, each with all guesses; of equal ones the first."""
    plans = [_Rotation.OUTWARDS, _Rotation.AS_POSE if with_poses else _Rotation.NONE]
    if not with_poses and all(chain.count >= len(chain.steps) for chain in chains):
        # Every axis on the way is the axis of some symbol, and only this plan gives them all.
        plans = [_Rotation.OUTWARDS]
    ways = (False, True) if any(_differ(chain, reference) for chain in chains) else (False,)
    # Plans that are handed on share names, so that equal ones are seen to be equal.
    names: dict[sp.Expr, sp.Symbol] = {}
    found = [
        _Attempt(
            CostModel(LetBindings(names=names if len(guesses) > 1 else {})),
            reference,
            plan,
            with_poses,
            with_drawn,
            apart,
            *guess,
        ).derive(chains)
        for apart in ways
        for plan in plans
        for guess in guesses
    ]
    different = {(each.definitions, each.entries): each for each in reversed(found)}
    return list(different.values())[::-1]


def _differ(chain: DifferentiatedChain, reference: Reference) -> bool:
    """Tell whether it matters that turns about one axis with others between them that cancel are not merged."""
    folded = reverse if reference is Reference.LOCAL else mark
    return folded(chain.steps, chain.rates).turns != folded(chain.steps, chain.rates, apart=True).turns


@dataclass(frozen=True, slots=True)
class _Attempt:
    """One plan.

    Attributes:
        with_drawn: Whether second derivatives by single turns are results.
        apart: Whether turns about one axis are not merged where others cancel between them.
        alike: Whether all velocities are computed the first way before any is chosen for itself.
        by_axes: Whether a vector along an axis may be a multiple of that axis, and levers are added up anew when the
            axes of all joints are known.
    """

    cost_model: CostModel
    reference: Reference
    plan: _Rotation
    with_poses: bool
    with_drawn: bool
    apart: bool
    alike: bool
    by_axes: bool

    @property
    def name(self) -> str:
        apart = ", turns about parallel axes apart" if self.apart else ""
        by_axes = ", levers by axes" if self.by_axes else ""
        return f"{self.plan.value}; {'columns alike at first' if self.alike else 'column by column'}{by_axes}{apart}"

    def derive(self, chains: Sequence[DifferentiatedChain]) -> Derivative:
        derived = [self._chain(chain) for chain in chains]
        result = Derivative(
            definitions=(),
            poses=tuple(pose for pose, _ in derived if pose),
            motions=tuple(motions for _, motions in derived),
            name=self.name,
        )
        wanted = (*result.entries, *(entry for motions in result.motions for each in motions for entry in each.drawn))
        return replace(result, definitions=self.cost_model.live(wanted))

    def _chain(self, chain: DifferentiatedChain) -> tuple[tuple[sp.Expr, ...], tuple[ColumnTwist, ...]]:
        route = FrameVectors(mark(chain.steps, chain.rates, self.apart), self.cost_model, self.by_axes)
        # In the axes of the end, vectors are seen from there; with the pose both share sines and cosines.
        seen, attitude = route, IDENTITY_PERMUTATION
        if self.reference is Reference.LOCAL and self.with_poses:
            seen, attitude = FrameVectors(flipped(route.marked), self.cost_model, self.by_axes), route.marked.attitude
        elif self.reference is Reference.LOCAL:
            seen = FrameVectors(reverse(chain.steps, chain.rates, self.apart), self.cost_model, self.by_axes)
        (rotation, last), end = self._rotation(chain.steps, seen, route.marked.attitude), NULL
        if self.with_poses:
            end = self.cost_model.choose(route.positions())
        elif self.reference is Reference.LOCAL_WORLD_ALIGNED:
            end = self.cost_model.cheapest(route.positions())
        motions = self._motions(seen, end, chain.count, () if self.with_poses else rotation)
        if self.reference is Reference.LOCAL:
            motions = tuple(motion.turned(attitude, -1) for motion in motions)
        if not self.with_poses:
            return (), motions
        return tuple(pose_entries(rotation, end, last)), motions

    def _motions(self, route: FrameVectors, end: Vector, count: int, lent: Sequence[Vector]) -> tuple[ColumnTwist, ...]:
        """Return the velocities, chosen from base to tip and once more on the way back, when all others are known.

        What is lent counts as paid for on the way there only.
        """
        # From the base to the tip: each velocity is chosen by what is computed so far.
        moving = [movers(route, index) for index in range(count)]
        order = sorted(range(count), key=lambda index: [mover.place for mover in moving[index]])
        choose = self.cost_model.choose
        first = 1 if self.alike else None
        turning = {index: choose(islice(angular(route, moving[index]), first)) for index in order}
        if self.by_axes:
            route.forget_reaches()
        shifting = {
            index: choose(islice(self._linear(route, moving[index], turning[index], end), first)) for index in order
        }
        # Back to the base: all others are known now, and what was lent is not paid any more.
        for vector in lent:
            self.cost_model.give_back(vector)
        if self.by_axes:
            route.forget_reaches()
        for index in reversed(order):
            turning[index] = choose(angular(route, moving[index]), turning[index])
            shifting[index] = choose(self._linear(route, moving[index], turning[index], end), shifting[index])
        motions = [ColumnTwist(shifting[index], turning[index]) for index in range(count)]
        return tuple(self._with_drawn(route, *each, end) for each in zip(motions, moving, strict=True))

    def _with_drawn(
        self, route: FrameVectors, motion: ColumnTwist, moving: Sequence[Generator], end: Vector
    ) -> ColumnTwist:
        if not self.with_drawn or len(moving) != 1 or not moving[0].mark.is_turn:
            return motion
        found = self.cost_model.choose(drawn(route, moving[0], motion, end))
        return replace(motion, drawn=found, mark=moving[0].mark, level=moving[0].place[0])

    def _linear(
        self, route: FrameVectors, moving: Sequence[Generator], turning: Vector, end: Vector
    ) -> Iterable[Vector]:
        if self.reference is Reference.LOCAL_WORLD_ALIGNED:
            return linear(route, moving, turning, end)
        return moment(route, moving, turning)

    def _rotation(
        self, steps: Chain, seen: FrameVectors, attitude: AxisPermutation
    ) -> tuple[tuple[Vector, Vector, Vector], AxisPermutation]:
        """Return the columns of the rotation before the constant attitude, as the plan builds them, and that attitude.

        The attitude is that of the marked chain; where the pose is folded by itself, it may leave another one.
        """
        columns = UNITS
        if self.plan is _Rotation.OUTWARDS:
            last = len(seen.marked.turns)
            x, y, z = columns = seen.column(last, 0), seen.column(last, 1), seen.column(last, 2)
            if self.reference is Reference.LOCAL:
                columns = ((x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2]))
        elif self.plan is _Rotation.AS_POSE:
            folded = fold(steps)
            columns, _ = evaluate(folded, Plan(cheapest_plan(folded).carried), self.cost_model.bindings)
            attitude = folded.attitude
        for column in columns:
            self.cost_model.choose([column])
        return columns, attitude
