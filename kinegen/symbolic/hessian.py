"""The manipulator Hessian: the derivative of the Jacobian by every joint variable.

For two transforms of a chain, the one nearer to the base turns the velocity that the other gives: the derivative of the
later column by the earlier variable is the cross product of the earlier axis with both halves of the column. For the
linear half the two may change places, and the later one does not turn the earlier axis (J. Haviland and P. Corke,
Manipulator differential kinematics, part 2, IEEE Robotics and Automation Magazine 31(4), 2024; `hessian0` of the
Robotics Toolbox for Python). Joints that drive several transforms add up by the chain rule.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import reduce

import sympy as sp

from kinegen.outputs import Quantity
from kinegen.robot.model import Robot
from kinegen.symbolic.chain import transforms_between
from kinegen.symbolic.columns import Motion
from kinegen.symbolic.derivative import Chain, Driven, derivative_of
from kinegen.symbolic.expressions import Expressions, Tape
from kinegen.symbolic.fold import NULL, Vector, total
from kinegen.symbolic.marks import Rates, rates_by
from kinegen.symbolic.route import cross, scaled
from kinegen.symbolic.signatures import (
    frame_array,
    frames_of,
    joint_array,
    joint_symbols,
    parameter_symbols,
    signature,
    start_of,
)
from kinegen.symbolic.transforms import symbols


def derive_hessian(robot: Robot, quantity: Quantity) -> Expressions:
    """The derivative of the Jacobian of every tip, or of one frame, in the axes of the base (`local_world_aligned`).

    Args:
        robot: The robot; parameters that are not runtime parameters become exact numbers.
        quantity: The Hessian, and of which frame.

    Returns:
        n x 6 x n entries for each frame: entry (k, i, j) is the derivative of row i, column j of the Jacobian by joint
        variable k. Rows 0 to 2 are linear, 3 to 5 angular.

    Raises:
        KinegenError: If there is no such frame.
    """
    values = symbols(robot, keep_parameters=False)
    joints = joint_symbols(robot, values)
    chains = [
        transforms_between(robot, start_of(robot, quantity), frame, values) for frame in frames_of(robot, quantity)
    ]
    rates = [_moving(rates_by(chain, joints)) for chain in chains]
    found = derivative_of([_one_by_one(chain, each) for chain, each in zip(chains, rates, strict=True)])
    tape = Tape(list(found.definitions))
    entries: list[sp.Expr] = []
    for motions, each in zip(found.motions, rates, strict=True):
        entries += _hessian(motions, list(each.values()), len(joints), tape)
    result = frame_array(robot, quantity, "hessian", (robot.dof, 6, robot.dof))
    return Expressions(
        signature=signature(robot, quantity, (joint_array(robot),), result),
        variables=joints,
        parameters=parameter_symbols(robot, values),
        definitions=tuple(tape.definitions),
        entries=tuple(entries),
    )


def _moving(rates: Sequence[Rates]) -> dict[int, Rates]:
    """The rates of the transforms that depend on some joint, by their place in the chain."""
    return {place: each for place, each in enumerate(rates) if any(rate != 0 for rate in each)}


def _one_by_one(chain: Chain, moving: Iterable[int]) -> Driven:
    """A chain of which every moving transform has a symbol of its own."""
    places = list(moving)
    rates = [tuple(sp.Integer(place == step) for place in places) for step in range(len(chain))]
    return Driven(chain, rates, len(places))


@dataclass(frozen=True, slots=True)
class _Share:
    """What one transform contributes to the column of one joint.

    Attributes:
        place: Its place in the chain.
        linear: Linear velocity of the end.
        angular: Angular velocity.
    """

    place: int
    linear: Vector
    angular: Vector


def _hessian(motions: Sequence[Motion], rates: Sequence[Rates], joints: int, tape: Tape) -> list[sp.Expr]:
    """The entries for one chain, from the velocities that its transforms give one by one."""
    shares = [
        [
            _Share(place, tape.vector(scaled(rate, motion.linear)), tape.vector(scaled(rate, motion.angular)))
            for place, (motion, rate) in enumerate(zip(motions, (each[joint] for each in rates), strict=True))
            if rate != 0
        ]
        for joint in range(joints)
    ]
    entries: list[sp.Expr] = []
    for by in range(joints):
        columns = [
            (
                *_linear(shares[min(by, column)], shares[max(by, column)], tape),
                *_angular(shares[by], shares[column], tape),
            )
            for column in range(joints)
        ]
        entries += [column[row] for row in range(6) for column in columns]
    return entries


def _linear(left: Sequence[_Share], right: Sequence[_Share], tape: Tape) -> Vector:
    """The second derivative of the position by two joints, in either order."""
    result = NULL
    for share in left:
        carried = _sum((other.linear for other in right if other.place >= share.place), tape)
        result = total(result, cross(share.angular, carried))
    for share in right:
        carried = _sum((other.linear for other in left if other.place > share.place), tape)
        result = total(result, cross(share.angular, carried))
    return tape.vector(result)


def _angular(by: Sequence[_Share], column: Sequence[_Share], tape: Tape) -> Vector:
    """The derivative of an angular velocity by one joint: only what stands nearer to the base turns an axis."""
    result = NULL
    for share in by:
        carried = _sum((other.angular for other in column if other.place > share.place), tape)
        result = total(result, cross(share.angular, carried))
    return tape.vector(result)


def _sum(vectors: Iterable[Vector], tape: Tape) -> Vector:
    return tape.vector(reduce(total, vectors, NULL))
