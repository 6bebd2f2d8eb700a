"""Twist and acceleration of frames at given joint rates, without a Jacobian.

The folded chain is walked from its end to its start (`motion_by_level.py`), in several ways that give the same; the
cheapest is kept. So every joint costs a few operations, however many others there are. Where fixed turns that are no
quarter turns are between the joints, the walk from the start outwards pays: a short vector has few operations on its
way, and few others need it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import reduce

import sympy as sp

from kinegen.derive.annotated_chain import AnnotatedChain, JointScrew, mark, rates_by, reverse
from kinegen.derive.chain_forms import forms, without_last_turns
from kinegen.derive.expressions import (
    Candidate,
    Definition,
    Expressions,
    LetBindings,
    chains_of,
    cost,
    frame_array,
    joint_array,
    joint_symbols,
    parameter_symbols,
    signature,
)
from kinegen.derive.folding import NULL, Vector, cross, scaled, total
from kinegen.derive.lever_arms import LONG
from kinegen.derive.motion_by_level import Form, Link, Spin, Sums, Walk, links_of
from kinegen.derive.product_associations import is_inclined
from kinegen.derive.transforms import symbols
from kinegen.model.outputs import Kind, Quantity, Reference
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass


def twist_outwards(
    marked: AnnotatedChain, levels: Sequence[tuple[Sequence[Link], Spin]], rates: Sums, bindings: LetBindings
) -> tuple[Vector, Vector]:
    """Return the linear and angular velocity of the end of a chain, in the axes of the start."""

    def placed(level: int, vector: Vector) -> Vector:
        return reduce(
            lambda known, turn: bindings.turned(turn, known), reversed(marked.turns[:level]), bindings.vector(vector)
        )

    def plus(one: Vector, other: Vector) -> Vector:
        return bindings.vector(total(one, other))

    velocity = turning = reach = NULL
    for level, (links, whole) in enumerate(levels):
        before = turning
        for link in map(Link.brought, links):
            now = plus(before, placed(level, rates.vector(link.spin)))
            if now != turning:  # what has been passed so far moved with the angular velocity so far
                velocity = plus(velocity, bindings.vector(cross(turning, reach)))
                turning, reach = now, NULL
            reach = plus(reach, placed(level, link.piece))
            for rate, axis in link.slides:
                velocity = plus(velocity, placed(level, scaled(rates.of(rate), axis)))
        now = plus(before, placed(level, rates.vector(whole)))
        if now != turning:
            velocity = plus(velocity, bindings.vector(cross(turning, reach)))
            turning, reach = now, NULL
    return plus(velocity, bindings.vector(cross(turning, reach))), turning


_KEPT = 3
"""How many of the forms that were tried are handed on, the cheapest first as their operations stand."""

_NEAR = 4
"""How many levels with joints, from the start on, are tried as those whose turns are added early."""

_Found = tuple[tuple[Definition, ...], tuple[sp.Expr, ...]]


def derive_velocity(robot: Robot, quantity: Quantity) -> Expressions:
    """Return the twist of every tip, or of one frame, or its derivative by time; linear, then angular.

    With J the Jacobian in the same reference, `twist` is J qd, `bias_acceleration` is Jdot qd and `acceleration` is
    J qdd + Jdot qd, the derivative by time of the six numbers of the twist. That is

    - in `local_world_aligned`: the acceleration of the frame's origin as a point (called classical), and the angular
      acceleration, in the axes of the base;
    - in `local` and `world`: the spatial acceleration (Featherstone, Rigid Body Dynamics Algorithms, 2008, section
      2.10) of the frame's body, in the axes and at the origin of the frame or of the base.

    Returns:
        Six entries for each frame, in terms of q, qd and, for `acceleration`, qdd.
    """
    values = symbols(robot, keep_parameters=False)
    joints = joint_symbols(robot, values)
    # Joint rates are inputs of the kernel; without accelerations these are zeros, which cost nothing.
    rates, accelerations = (_derivatives(joints, dots) for dots in ("d", "dd"))
    inputs, variables = [joint_array(robot), joint_array(robot, "qd")], [*joints, *rates]
    if quantity.kind is Kind.ACCELERATION:
        inputs.append(joint_array(robot, "qdd"))
        variables += accelerations
    else:
        accelerations = (sp.S.Zero,) * len(joints)
    # In the axes of the frame, the chain is walked from the other end.
    folded = reverse if quantity.reference is Reference.LOCAL else mark
    chains = chains_of(robot, quantity, values)
    if quantity.reference is not Reference.LOCAL:
        chains = [without_last_turns(chain) for chain in chains]
    ways: list[Candidate] = []
    for number, variant in enumerate(forms(chains)):
        marked = [folded(steps, rates_by(steps, joints), apart=True) for steps in variant]
        levels = [[links_of(items, len(joints)) for items in chain.nested] for chain in marked]
        found = _ways(_Motion(marked, levels, rates, accelerations, quantity))
        ways += (replace(way, form=number) for way in found)
    result = frame_array(robot, quantity, quantity.kind.value, (6,))
    return Expressions(
        signature=signature(robot, quantity, tuple(inputs), result),
        variables=tuple(variables),
        parameters=parameter_symbols(robot, values),
        ways=tuple(ways),
    )


def _derivatives(joints: tuple[sp.Symbol, ...], dots: str) -> tuple[sp.Symbol, ...]:
    return tuple(sp.Dummy(f"{joint.name}_{dots}", real=True) for joint in joints)


@dataclass(frozen=True, slots=True)
class _Motion:
    """Chains whose ends move.

    `chains`: the chains, folded from where the velocity is seen.
    """

    chains: Sequence[AnnotatedChain]
    levels: Sequence[Sequence[tuple[Sequence[Link], Spin]]]
    rates: tuple[sp.Symbol, ...]
    accelerations: tuple[sp.Expr, ...]
    quantity: Quantity

    def entries(self, form: Form) -> _Found:
        bindings = LetBindings()
        rates, accelerations = Sums(bindings, self.rates), Sums(bindings, self.accelerations)
        of_end = self.quantity.reference is Reference.LOCAL_WORLD_ALIGNED
        sign = -1 if self.quantity.reference is Reference.LOCAL else 1  # a chain from its end moves the other way
        entries: list[sp.Expr] = []
        for chain, levels in zip(self.chains, self.levels, strict=True):
            walk = Walk(bindings, rates, accelerations, of_end, form)
            walk.inwards(chain, levels)
            twist, change = (*walk.velocity, *walk.omega), (*walk.acceleration, *walk.alpha)
            entries += (sign * entry for entry in (twist if self.quantity.kind is Kind.TWIST else change))
        return tuple(bindings.definitions), tuple(entries)

    def outwards(self) -> Iterator[Candidate]:
        """Yield the twists of the ends from the base outwards, for short chains with inclined axes."""
        is_twist = self.quantity.kind is Kind.TWIST and self.quantity.reference is Reference.LOCAL_WORLD_ALIGNED
        turns = [turn for chain in self.chains for turn in chain.turns]
        if not is_twist or not is_inclined(turns) or len(turns) > LONG:
            return
        bindings = LetBindings()
        rates = Sums(bindings, self.rates)
        entries: list[sp.Expr] = []
        for chain, levels in zip(self.chains, self.levels, strict=True):
            for vector in twist_outwards(chain, levels, rates, bindings):
                entries += vector
        yield bindings.way(entries, "from the base outwards")


def _ways(motion: _Motion) -> tuple[Candidate, ...]:
    """Try one choice after the other, and keep each that costs less; the cheapest ones, and those outwards."""
    form = Form()
    found = [(form, motion.entries(form))]
    least = cost(*found[0][1])
    for change in _changes(motion):
        other = change(form)
        found.append((other, motion.entries(other)))
        price = cost(*found[-1][1])
        if price < least:
            form, least = other, price
    found.sort(key=lambda each: cost(*each[1]))
    ways = [Candidate(str(each), *result) for each, result in found[:_KEPT]]
    return (*ways, *motion.outwards())


def _changes(motion: _Motion) -> Iterator[Callable[[Form], Form]]:
    """Yield what is tried, from the base outwards."""
    is_twist = motion.quantity.kind is Kind.TWIST
    if not is_twist or motion.quantity.reference is Reference.LOCAL_WORLD_ALIGNED:
        turning = {
            level
            for chain in motion.chains
            for level, items in enumerate(chain.levels[:-1])
            if any(isinstance(item, JointScrew) and item.is_turn for item in items)
        }
        for level in sorted(turning)[: 1 if len(turning) > LONG else _NEAR]:
            yield lambda form, level=level: replace(form, early=form.early | {level})  # type: ignore[misc]
    if not is_twist:
        yield lambda form: replace(form, squared=True)
    yield lambda form: replace(form, inside=True)
    if not is_twist and motion.quantity.reference is not Reference.LOCAL_WORLD_ALIGNED:
        yield lambda form: replace(form, singly=True)
