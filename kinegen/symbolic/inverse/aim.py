"""The inverse for a point and a direction of the tool, as a kernel: both joint vectors of a five-axis machine."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

import sympy as sp

from kinegen.errors import KinegenError
from kinegen.outputs import Array, Quantity
from kinegen.robot.extent import reach
from kinegen.robot.model import Robot
from kinegen.symbolic.expressions import Expressions, Tape
from kinegen.symbolic.fold import Vector
from kinegen.symbolic.inverse.axes import JointAxis
from kinegen.symbolic.inverse.machine import Machine, machine_of, way_of
from kinegen.symbolic.inverse.solutions import Solution, limited, turn_of, wrapped
from kinegen.symbolic.inverse.solve_machine import BRANCHES, Aimed, machine_solutions
from kinegen.symbolic.inverse.steps import Angle, Steps
from kinegen.symbolic.inverse.thresholds import Thresholds, plain_thresholds
from kinegen.symbolic.signatures import joint_array, parameter_symbols, signature
from kinegen.symbolic.transforms import symbols

MOST_TURNS = 12
"""A joint with more room than so many turns is brought into the turn about 0, as one without limits is."""


def derive_axis_inverse(robot: Robot, quantity: Quantity) -> Expressions:
    """Both joint vectors that put the tool tip to a point, with the tool along a direction.

    Args:
        robot: The robot.
        quantity: The quantity, with the frames of tool and workpiece.

    Returns:
        `solutions` (2, dof), tilt forward and backward, and `valid` (2,): 1 where the direction is within reach, all
        numbers are finite and every joint is within its limits, else 0. Of joints that turn with room for several turns
        the value nearest to that in `q_near` is taken; the first one keeps its value there where the tool is along its
        axis.

    Raises:
        KinegenError: If it is no machine tool with five axes; the message says what fails.
    """
    machine = machine_for(robot, quantity)
    workpiece, tool = quantity.seen_from or "base", quantity.frame or "tool"
    point, axis = _symbols("p"), _symbols("z")
    near = tuple(sp.Dummy(f"near{place}", real=True) for place in range(robot.dof))
    tape = Tape()
    steps = Steps(tape, _value(machine), machine_thresholds(robot, quantity))
    found = [_joint_values(steps, each, near) for each in machine_solutions(steps, machine, Aimed(point, axis, near))]
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
        definitions=tuple(tape.definitions),
        entries=(*(value for values, _ in found for value in values), *(valid for _, valid in found)),
    )


@lru_cache(maxsize=32)
def machine_for(robot: Robot, quantity: Quantity) -> Machine:
    """The machine between the frames of a quantity.

    Raises:
        KinegenError: If there is none.
    """
    machine = machine_of(robot, *way_of(robot, quantity.frame, quantity.seen_from))
    if isinstance(machine, Machine):
        return machine
    first, *others = machine
    more = f" (and {len(others)} more reasons)" if others else ""
    raise KinegenError(f"{robot.name} has no {quantity}: {first}{more}", robot.source)


def machine_thresholds(robot: Robot, quantity: Quantity) -> Thresholds:
    """The thresholds of a machine."""
    way = quantity.way
    return plain_thresholds(reach(robot, [way] if way else None))


def _symbols(name: str) -> Vector:
    x, y, z = (sp.Dummy(f"{name}{axis}", real=True) for axis in "xyz")
    return x, y, z


def _value(machine: Machine) -> Callable[[sp.Expr], float]:
    """An expression in runtime parameters at their values in the file."""
    return lambda expression: float(sp.N(expression.subs(dict(machine.defaults))))


def _joint_values(steps: Steps, solution: Solution, near: tuple[sp.Symbol, ...]) -> tuple[tuple[sp.Expr, ...], sp.Expr]:
    """The joint vector of a branch, and whether it holds."""
    valid = steps.name(sp.Mul(*solution.valid))
    values: dict[int, sp.Expr] = {}
    for joint, amount in solution.angles:
        if isinstance(amount, Angle):
            value = _nearest(steps, joint, amount, near[joint.number - 1])
        else:
            value = steps.name(amount / joint.rate)
        values[joint.number] = value
        valid = limited(steps, joint, value, valid)
    return tuple(values[number] for number in sorted(values)), valid


def _nearest(steps: Steps, joint: JointAxis, angle: Angle, near: sp.Symbol) -> sp.Expr:
    """The variable of a joint that turns, within its limits by whole turns and there nearest to a value."""
    turn = turn_of(joint)
    if joint.limits is None or not turn < joint.limits[1] - joint.limits[0] <= MOST_TURNS * turn:
        return wrapped(steps, joint, angle)
    low, high = joint.limits
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
