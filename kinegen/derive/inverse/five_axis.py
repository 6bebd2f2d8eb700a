"""The inverse for a point and a direction of the tool: both joint vectors of a five-axis machine.

The direction alone decides the two joints that turn (the second problem of Paden and Kahan: two turns about axes that
are not parallel take one direction to another), then the point decides the three that shift, which is linear. Sines and
cosines of both turns are at hand before the angles are.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import lru_cache, partial

import sympy as sp

from kinegen.derive.expressions import Expressions, LetBindings, joint_array, parameter_symbols, signature
from kinegen.derive.folding import Vector
from kinegen.derive.inverse.axes import JointAxis
from kinegen.derive.inverse.exact_geometry import combined, tidy, transposed, turned
from kinegen.derive.inverse.five_axis_geometry import (
    Arrangement,
    FiveAxisMachine,
    machine_of,
    turned_parts,
)
from kinegen.derive.inverse.geometry import Planar, flat_frame
from kinegen.derive.inverse.joint_wrapping import Solution, branch_results, joint_values, turn_of, wrapped
from kinegen.derive.inverse.straight_line_operations import ONE, ZERO, Angle, OperationBuilder, fixed
from kinegen.derive.inverse.tolerances import ALIGNED, TARGET, Thresholds, plain_thresholds
from kinegen.derive.transforms import symbols
from kinegen.errors import KinegenError
from kinegen.model.joint_bounds import reach
from kinegen.model.outputs import Array, Quantity
from kinegen.model.robot import TOOL, Robot
from kinegen.support.dataclass import dataclass

_LONGEST = sp.Integer(10) ** 12

BRANCHES = ("tilt forward", "tilt backward")


@dataclass(frozen=True, slots=True)
class Aimed:
    """What a machine is solved for, in the frame of the workpiece: the tool tip, and a vector along the tool.

    The vector may have any length. `near` is a joint vector, for what is free.
    """

    point: Vector
    axis: Vector
    near: tuple[sp.Symbol, ...]


def machine_solutions(steps: OperationBuilder, machine: FiveAxisMachine, aimed: Aimed) -> Iterator[Solution]:
    """Solve for both branches: tilt forward, then backward."""
    square = steps.square(aimed.axis)
    sane = _sane(steps, machine, aimed, square)
    scale = steps.name(1 / steps.root(square))
    # The direction decides both turns: its component along the first axis gives the second.
    x, y, z = steps.turned(machine.frame, steps.scaled(aimed.axis, scale))
    off = steps.square((x, y))
    height, squared = _tilt(steps, machine, z, off)
    within = steps.select(-4 * TARGET, squared, ONE, ZERO)
    root = steps.root_of_positive(squared)
    # Along its own axis the first joint is free, and stays where it is.
    rest = steps.name(machine.first.rate * _kept(steps, machine.first, aimed.near[machine.first.number - 1]))
    stay = (steps.name(sp.cos(rest)), steps.name(sp.sin(rest)))
    start = fixed(sp.atan2(machine.sine, machine.cosine))
    swing = steps.argument((height, root))
    # Both signs of the root are the two ways to tilt the tool.
    for sign in (1, -1):
        second = _second(steps, machine, height, sign * root)
        usual = steps.back(_across(steps, machine, second), (x, y))
        size = steps.name(1 / steps.root(steps.square(usual)))
        first = (
            steps.select(off, ALIGNED, stay[0], steps.name(usual[0] * size)),
            steps.select(off, ALIGNED, stay[1], steps.name(usual[1] * size)),
        )
        angle = steps.argument(usual)
        turn = Angle(steps.select(off, ALIGNED, steps.argument(stay).value, angle.value), angle.low, angle.high)
        shifts = _shifts(steps, machine, aimed.point, first, second)
        tilt = start + (swing if sign > 0 else -swing)
        amounts = ((machine.first, turn), (machine.second, tilt), *zip(machine.shifts, shifts, strict=True))
        yield Solution(amounts, (sane, within))


def _kept(steps: OperationBuilder, joint: JointAxis, near: sp.Expr) -> sp.Expr:
    """Return a value of a joint that turns, or its nearer limit: whole turns bring others into limits of a turn."""
    if joint.limits is None or joint.arc is None:
        return near
    low, high = joint.limits
    return steps.select(near, low, low, steps.select(high, near, high, near))


def _sane(steps: OperationBuilder, machine: FiveAxisMachine, aimed: Aimed, square: sp.Expr) -> sp.Expr:
    """Return 1 for finite numbers and an axis that is not null; else 0."""
    lengths = (*aimed.point, *aimed.near, *(parameter for parameter, _ in machine.defaults))
    short = steps.select(square, _LONGEST, steps.finite(lengths), ZERO)
    return steps.select(1 / _LONGEST, square, short, ZERO)


def _tilt(steps: OperationBuilder, machine: FiveAxisMachine, along: sp.Expr, off: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """Return how high the tool points along the first axis, from the middle of its range, and the square of the rest.

    With r the radius the square is (r + m - z) (r - m + z) for z = u1 . a. Where a factor is 1 - z or 1 + z, which
    vanishes for a tool along the first axis, it is taken from the part across that axis, without a difference.
    """
    height = steps.name(along - machine.middle) if machine.middle != 0 else along
    if machine.is_square:
        return height, off
    above, below = tidy(machine.radius + machine.middle), tidy(machine.radius - machine.middle)
    upper, lower = steps.name(above - along), steps.name(below + along)
    if above == 1:
        upper = steps.select(ZERO, along, steps.name(off / steps.name(1 + along)), upper)
    if below == 1:
        lower = steps.select(along, ZERO, steps.name(off / steps.name(1 - along)), lower)
    return height, steps.name(upper * lower)


def _second(steps: OperationBuilder, machine: FiveAxisMachine, height: sp.Expr, root: sp.Expr) -> Planar:
    """Return cosine and sine of the second turn."""
    square = tidy(machine.cosine**2 + machine.sine**2)
    lead = (tidy(machine.cosine / square), tidy(machine.sine / square))
    return steps.times(lead, (height, root))


def _across(steps: OperationBuilder, machine: FiveAxisMachine, second: Planar) -> Planar:
    """Return the tool axis after the second turn, across the first axis."""
    parts = [turned(machine.frame, part) for part in turned_parts(machine.second, machine.pointing)]
    x, y = (steps.name(parts[0][i] + parts[1][i] * second[0] + parts[2][i] * second[1]) for i in range(2))
    return x, y


def _shifts(
    steps: OperationBuilder, machine: FiveAxisMachine, point: Vector, first: Planar, second: Planar
) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
    """Return how far the shifts go: the point turned back by what is before them, less the tool turned by the rest."""
    ahead, behind = point, machine.end
    # Joints in the table move the point back, joints in the head move the tool.
    if machine.arrangement is not Arrangement.HEAD:
        ahead = _moved(steps, machine.first, (first[0], -first[1]), ahead)
    if machine.arrangement is Arrangement.TABLE:
        ahead = _moved(steps, machine.second, (second[0], -second[1]), ahead)
    else:
        behind = _moved(steps, machine.second, second, behind)
    if machine.arrangement is Arrangement.HEAD:
        behind = _moved(steps, machine.first, first, behind)
    return steps.turned(machine.inverse, steps.minus(ahead, behind))


def _moved(steps: OperationBuilder, joint: JointAxis, turn: Planar, point: Vector) -> Vector:
    """Return a point turned about the axis of a joint, by a turn with this cosine and sine."""
    frame = flat_frame(joint)
    x, y, z = steps.turned(frame, steps.minus(point, joint.point))
    real, imaginary = steps.times(turn, (x, y))
    back = steps.turned(transposed(frame), (real, imaginary, z))
    return steps.plus(back, combined((1, joint.point)))


MOST_TURNS = 12
"""A joint with more room than so many turns is brought into the turn about 0, as one without limits is."""

_ROUNDING = 1e-12


def derive_axis_inverse(robot: Robot, quantity: Quantity) -> Expressions:
    """Derive both joint vectors that put the tool tip to a point, with the tool along a direction.

    Returns:
        `solutions` (2, dof), tilt forward and backward, and `valid` (2,): 1 where the direction is within reach, all
            numbers are finite and every joint is within its limits, else 0. Of joints that turn with room for a whole
            turn the value nearest to that in `q_near` is taken; the first one keeps its value there where the tool is
            along its axis.

    Raises:
        KinegenError: If it is no machine tool with five axes; the message says what fails.
    """
    machine = machine_for(robot, quantity)
    workpiece, tool = quantity.seen_from or "base", quantity.frame or "tool"
    point, axis = _symbols("p"), _symbols("z")
    near = tuple(sp.Dummy(f"near{place}", real=True) for place in range(robot.dof))
    bindings = LetBindings()
    steps = OperationBuilder(bindings, _value(machine), machine_thresholds(robot, quantity))
    nearest = partial(_nearest, near)
    solutions = machine_solutions(steps, machine, Aimed(point, axis, near))
    found = [joint_values(steps, each, turned=nearest) for each in solutions]
    inputs = (
        Array(f"{workpiece}_p_{tool}", (3,)),
        Array(f"{workpiece}_z_{tool}", (3,)),
        joint_array(robot, "q_near"),
    )
    results = (
        Array("solutions", (len(BRANCHES), robot.dof), per_branch=True),
        Array("valid", (len(BRANCHES),), is_truth=True),
    )
    return Expressions(
        signature=signature(robot, quantity, inputs, *results),
        variables=(*point, *axis, *near),
        parameters=parameter_symbols(robot, symbols(robot, keep_parameters=False)),
        ways=(branch_results(bindings, found),),
    )


@lru_cache(maxsize=32)
def machine_for(robot: Robot, quantity: Quantity) -> FiveAxisMachine:
    """Return the machine between the frames of a quantity; raise `KinegenError` if there is none."""
    machine = machine_of(robot, quantity.seen_from or robot.root, quantity.frame or TOOL)
    if isinstance(machine, FiveAxisMachine):
        return machine
    first, *others = machine
    more = f" (and {len(others)} more reasons)" if others else ""
    raise KinegenError(f"{robot.name} has no {quantity}: {first}{more}", robot.source)


def machine_thresholds(robot: Robot, quantity: Quantity) -> Thresholds:
    """Return the thresholds of a machine."""
    way = quantity.way
    return plain_thresholds(reach(robot, [way] if way else None))


def _symbols(name: str) -> Vector:
    x, y, z = (sp.Dummy(f"{name}{axis}", real=True) for axis in "xyz")
    return x, y, z


def _value(machine: FiveAxisMachine) -> Callable[[sp.Expr], float]:
    """Return an expression in runtime parameters at their values in the file."""
    return lambda expression: float(sp.N(expression.subs(dict(machine.defaults))))


def _nearest(q: tuple[sp.Symbol, ...], steps: OperationBuilder, joint: JointAxis, angle: Angle) -> sp.Expr:
    """Return the variable of a joint that turns, within its limits by whole turns and there nearest to a value."""
    turn, near = turn_of(joint), q[joint.number - 1]
    if joint.limits is None:
        return wrapped(steps, joint, angle)
    low, high = joint.limits
    # Just one turn has both its ends for one angle. As numbers, since limits in radians are rounded.
    if not float(turn) - _ROUNDING <= float(high - low) <= float(MOST_TURNS * turn):
        return wrapped(steps, joint, angle)
    value = steps.name(angle.value / joint.rate)
    bounds = sorted((angle.low / float(joint.rate), angle.high / float(joint.rate)))
    inside = steps.select(near, low, low, steps.select(high, near, high, near))
    for _ in range(math.ceil(float((high - bounds[0]) / turn) - 0.5)):
        value = steps.select(value, inside - turn / 2, value + turn, value)
    for _ in range(math.ceil(float((bounds[1] - low) / turn) - 0.5)):
        value = steps.select(inside + turn / 2, value, value - turn, value)
    room = steps.near.room(joint)
    value = steps.select(high + room, value, value - turn, value)
    return steps.select(value, low - room, value + turn, value)
