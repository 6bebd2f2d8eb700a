"""The geometric Jacobian, the one of parameters as calibrations take it, and the manipulator Hessian.

Of two transforms of a chain, the one nearer to the base turns the velocity that the other gives: the derivative of the
later column by the earlier variable is the cross product of the earlier axis with both halves of the column. For the
linear half the two may change places, and the later one does not turn the earlier axis (J. Haviland and P. Corke,
Manipulator differential kinematics, part 2, IEEE Robotics and Automation Magazine 31(4), 2024; `hessian0` of the
Robotics Toolbox for Python). Joints that drive several transforms add up by the chain rule.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import reduce

import sympy as sp

from kinegen.derive.annotated_chain import JointScrew, Rates, mark, rates_by
from kinegen.derive.chain_forms import forms, without_last_turns
from kinegen.derive.derivative import Chain, DifferentiatedChain, derivative, derivative_of, derivatives
from kinegen.derive.expressions import (
    Candidate,
    Expressions,
    LetBindings,
    by_joints,
    chains_of,
    frame_array,
    joint_symbols,
    pose_array,
)
from kinegen.derive.folding import NULL, Vector, cross, dot, scaled, total
from kinegen.derive.jacobian_columns import ColumnTwist
from kinegen.derive.transforms import Turn, symbols
from kinegen.errors import KinegenError
from kinegen.model.outputs import Kind, Quantity, Reference
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass


def derive_jacobian(robot: Robot, quantity: Quantity) -> Expressions:
    """Return the Jacobian of every tip, or of one frame, and its pose where the quantity is `fk_jacobian`.

    Rows 0 to 2 are linear, 3 to 5 angular; column j is the velocity for joint rate j alone (Siciliano et al., Robotics,
    2009, eq. 3.30; Craig, Introduction to Robotics, 3rd ed., section 5.7). A joint that others follow moves them too.

    - `local_world_aligned`: linear velocity of the frame's origin, and angular velocity, in the axes of the base (0J);
    - `local`: both in the axes of the frame;
    - `world`: linear velocity of the point of the frame's body that passes through the origin of the base, in the axes
      of the base.

    Returns:
        Twelve entries for each frame where the pose is asked for, then 6 n entries for each frame.
    """
    values = symbols(robot, keep_parameters=False)
    joints = joint_symbols(robot, values)
    with_poses = quantity.kind is Kind.FK_JACOBIAN
    chains = chains_of(robot, quantity, values)
    if not with_poses and quantity.reference is not Reference.LOCAL:
        chains = [without_last_turns(chain) for chain in chains]
    ways = [
        Candidate(each.name, each.definitions, each.entries, form)
        for form, variant in enumerate(forms(chains))
        for each in derivatives(variant, joints, quantity.reference, with_poses)
    ]
    jacobian = frame_array(robot, quantity, "jacobian", (6, robot.dof))
    results = (pose_array(robot, quantity), jacobian) if with_poses else (jacobian,)
    return by_joints(robot, quantity, values, tuple(ways), *results)


def derive_parameter_jacobian(robot: Robot, quantity: Quantity) -> Expressions:
    """Return the derivative of the pose of every tip, or of one frame, by `robot.varied_parameters`.

    Rows 0 to 2 are linear, 3 to 5 angular, in the axes of the base: column j holds the derivative of the position by
    parameter j, and the vector w of the derivative of the rotation, dR/dp = [w]x R. It is the velocity of the frame
    while the parameter alone grows at unit rate, so a joint variable and the offset beside it have the same column.
    Returns 6 p entries for each frame, row by row.

    Raises:
        KinegenError: If there is no such frame, or no parameter to differentiate by.
    """
    varied = robot.varied_parameters
    if not varied:
        raise KinegenError(
            f"{quantity} takes parameters that stay arguments of the kernels: name some with --wrt "
            "(as in --wrt dh), or write runtime: true in the file"
        )
    values = symbols(robot, keep_parameters=False)
    chains = chains_of(robot, quantity, values)
    found = derivative(chains, [values[parameter.name] for parameter in varied], quantity.reference)
    jacobian = frame_array(robot, quantity, "jacobian", (6, len(varied)))
    return by_joints(robot, quantity, values, (Candidate("", found.definitions, found.entries),), jacobian)


def derive_hessian(robot: Robot, quantity: Quantity) -> Expressions:
    """Derive the derivative of the Jacobian of every tip, or of one frame, in `local_world_aligned`.

    Returns:
        n x 6 x n entries for each frame: entry (k, i, j) is the derivative of row i, column j of the Jacobian by joint
        variable k. Rows 0 to 2 are linear, 3 to 5 angular.
    """
    values = symbols(robot, keep_parameters=False)
    joints = joint_symbols(robot, values)
    chains = chains_of(robot, quantity, values)
    driven = [_driver(chain, joints) for chain in chains]
    found = derivative_of([each.one_by_one(end) for each in driven for end in each.ends], with_drawn=True)
    bindings, motions = LetBindings(list(found.definitions)), iter(found.motions)
    entries: list[sp.Expr] = []
    for each in driven:
        entries += _hessian(each, {end: each.shares(end, next(motions), bindings) for end in each.ends}, bindings)
    result = frame_array(robot, quantity, "hessian", (robot.dof, 6, robot.dof))
    return by_joints(robot, quantity, values, (bindings.way(entries),), result)


@dataclass(frozen=True, slots=True)
class _Share:
    """What one transform contributes to the column of one joint.

    `rate`: how fast the transform grows with the joint. `motion`: what the transform gives by itself.
    """

    place: int
    linear: Vector
    angular: Vector
    rate: sp.Expr
    motion: ColumnTwist


_Shares = list[list[_Share]]
"""Of every joint."""


@dataclass(frozen=True, slots=True)
class _Driver:
    """A chain, and where each joint ceases to turn it.

    `stops`: for each joint the number of transforms behind which nothing is turned by it: all, unless followers cancel
    it. What is behind them is moved and not turned: it has no second derivative by this joint.
    """

    chain: Chain
    rates: Sequence[Rates]
    stops: tuple[int, ...]

    @property
    def ends(self) -> tuple[int, ...]:
        """Return where the chain is cut: at its end, and where a joint ceases to turn it."""
        return tuple(dict.fromkeys((len(self.chain), *self.stops)))

    def places(self, end: int) -> list[int]:
        """Return the transforms in front of a cut that change with joints whose turning goes so far."""
        joints = [joint for joint, stop in enumerate(self.stops) if stop >= end]
        return [place for place in range(end) if any(self.rates[place][joint] != 0 for joint in joints)]

    def one_by_one(self, end: int) -> DifferentiatedChain:
        """Return the chain in front of a cut, of which every moving transform has a symbol of its own."""
        places = self.places(end)
        rates = [tuple(sp.Integer(place == step) for place in places) for step in range(end)]
        return DifferentiatedChain(self.chain[:end], rates, len(places))

    def shares(self, end: int, motions: Sequence[ColumnTwist], bindings: LetBindings) -> _Shares:
        """Return what the transforms in front of a cut contribute to the columns."""
        return [
            [
                _Share(
                    place,
                    bindings.vector(scaled(rate, motion.linear)),
                    bindings.vector(scaled(rate, motion.angular)),
                    rate,
                    motion,
                )
                for place, motion in zip(self.places(end), motions, strict=True)
                if (rate := self.rates[place][joint]) != 0
            ]
            for joint in range(len(self.stops))
        ]


def _driver(chain: Chain, joints: Sequence[sp.Symbol]) -> _Driver:
    rates = rates_by(chain, joints)
    levels = mark(chain, rates, apart=True).levels
    stops = []
    for joint in range(len(joints)):
        turns = [
            [scaled(item.rates[joint], item.axis) for item in items if isinstance(item, JointScrew) and item.is_turn]
            for items in levels
        ]
        cancels = all(reduce(total, each, NULL) == NULL for each in turns)
        last = max((place for place, each in enumerate(rates) if each[joint] != 0), default=None)
        # A slide behind turns that have cancelled is turned by others.
        cancels = cancels and last is not None and isinstance(chain[last], Turn)
        stops.append(last if cancels and last is not None else len(chain))
    return _Driver(chain, rates, tuple(stops))


def _hessian(driver: _Driver, shares: Mapping[int, _Shares], bindings: LetBindings) -> list[sp.Expr]:
    """Return the entries for one chain, from the velocities that its transforms give one by one."""
    entries: list[sp.Expr] = []
    for by, stop in enumerate(driver.stops):
        columns = []
        for column, other in enumerate(driver.stops):
            found = shares[min(stop, other)]
            linear = _linear(found[min(by, column)], found[max(by, column)], bindings)
            turns = min(stop, other) == len(driver.chain)
            columns.append((*linear, *(_angular(found[by], found[column], bindings) if turns else NULL)))
        entries += [column[row] for row in range(6) for column in columns]
    return entries


def _linear(left: Sequence[_Share], right: Sequence[_Share], bindings: LetBindings) -> Vector:
    """Return the second derivative of the position by two joints, in either order."""
    result = NULL
    for share in left:
        result = total(result, _turned(share, [other for other in right if other.place >= share.place], bindings))
    for share in right:
        result = total(result, _turned(share, [other for other in left if other.place > share.place], bindings))
    return bindings.vector(result)


def _turned(share: _Share, carried: Sequence[_Share], bindings: LetBindings) -> Vector:
    """Return how a turn changes the velocities by transforms after it; parallel turns of a level have their own."""
    others = [other for other in carried if not _is_parallel(share.motion, other.motion)]
    result = cross(share.angular, _sum((other.linear for other in others), bindings))
    for other in carried:
        if share.motion.mark and other.motion.mark and other not in others:
            sign = dot(share.motion.mark.axis, other.motion.mark.axis)
            result = total(result, scaled(sign * share.rate * other.rate, other.motion.drawn))
    return result


def _is_parallel(first: ColumnTwist, second: ColumnTwist) -> bool:
    if first.mark is None or second.mark is None or first.level != second.level:
        return False
    return cross(first.mark.axis, second.mark.axis) == NULL and all(entry.is_number for entry in first.mark.axis)


def _angular(by: Sequence[_Share], column: Sequence[_Share], bindings: LetBindings) -> Vector:
    """Return the derivative of an angular velocity by one joint: only what stands nearer to the base turns an axis."""
    result = NULL
    for share in by:
        carried = _sum((other.angular for other in column if other.place > share.place), bindings)
        result = total(result, cross(share.angular, carried))
    return bindings.vector(result)


def _sum(vectors: Iterable[Vector], bindings: LetBindings) -> Vector:
    return bindings.vector(reduce(total, vectors, NULL))
