"""The axes of the joints in the zero pose: all that the inverse needs to know of a table.

In: a robot. Out: for each joint variable a line in the base frame, with how far the joint goes for one unit of its
variable, and the pose of the tool; all at q = 0, exact. Then `base_T_tool(q)` is the product of the joints' motions
about these fixed lines, from the first to the last, times that pose (Brockett 1984). Conventions, base, tool and
offsets have no further part in it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import sympy as sp

from kinegen.robot.expressions import evaluate
from kinegen.robot.model import TOOL, JointType, JointVariable, Robot
from kinegen.symbolic.chain import transforms_between
from kinegen.symbolic.fold import NULL, Vector
from kinegen.symbolic.inverse.exact import (
    IDENTITY,
    Rotation,
    about,
    chained,
    columns,
    combined,
    minus,
    tidy,
    transposed,
    turned,
)
from kinegen.symbolic.transforms import EXACT, Elementary, Turn, symbols


@dataclass(frozen=True, slots=True)
class JointAxis:
    """One joint at q = 0.

    Attributes:
        name: Its name.
        number: Its place in the joint vector, from 1.
        turns: Whether it turns about the axis; otherwise it shifts along it.
        direction: Unit vector of the axis in the base frame, numbers.
        point: A point of the axis in the base frame, which may hold runtime lengths.
        rate: Radians or lengths for one unit of the variable, a number.
        limits: Bounds of the variable, or None.
    """

    name: str
    number: int
    turns: bool
    direction: Vector
    point: Vector
    rate: sp.Expr
    limits: tuple[sp.Expr, sp.Expr] | None

    def flipped(self) -> JointAxis:
        """The same joint with its axis the other way round."""
        return JointAxis(
            self.name,
            self.number,
            self.turns,
            combined((-1, self.direction)),
            self.point,
            -self.rate,
            self.limits,
        )


@dataclass(frozen=True, slots=True)
class Axes:
    """A chain at q = 0.

    Attributes:
        joints: In the order of the chain.
        rotation: Of the tool in the base frame.
        position: Of the tool in the base frame.
        defaults: The file's values of the runtime parameters, to choose between equal descriptions.
        is_reversed: Whether it goes from the tool to the base.
    """

    joints: tuple[JointAxis, ...]
    rotation: Rotation
    position: Vector
    defaults: tuple[tuple[sp.Symbol, sp.Expr], ...]
    is_reversed: bool = False

    @property
    def numbers(self) -> tuple[int, ...]:
        """The numbers of the joints, in the order of the chain; from the last to the first of a reversed one."""
        return tuple(joint.number for joint in self.joints)

    def reversed(self) -> Axes:
        """The same chain from the tool to the base: its pose is the inverse of this one's."""
        back = transposed(self.rotation)
        joints = tuple(
            replace(
                joint,
                direction=turned(back, joint.direction),
                point=turned(back, minus(joint.point, self.position)),
                rate=-joint.rate,
            )
            for joint in reversed(self.joints)
        )
        position = combined((-1, turned(back, self.position)))
        return Axes(joints, back, position, self.defaults, not self.is_reversed)

    def value(self, expression: sp.Expr) -> float:
        """An expression in runtime parameters at their values in the file."""
        return float(sp.N(expression.subs(dict(self.defaults))))


@dataclass(slots=True)
class _Walker:
    """The pose reached so far, and the axes met on the way."""

    moves: dict[sp.Symbol, int]
    rotation: Rotation = IDENTITY
    position: Vector = NULL
    found: dict[sp.Symbol, tuple[bool, Vector, Vector, sp.Expr]] = field(default_factory=dict)
    failures: list[str] = field(default_factory=list)

    def step(self, step: Elementary) -> None:
        amount = step.angle if isinstance(step, Turn) else step.length
        moving = [symbol for symbol in self.moves if symbol in amount.free_symbols]
        axis = columns(self.rotation)[step.axis]
        for symbol in moving:
            self._meet(symbol, isinstance(step, Turn), axis, amount)
        rest = amount.subs(dict.fromkeys(moving, 0))
        if isinstance(step, Turn):
            self.rotation = chained(self.rotation, about(step.axis, rest))
        else:
            self.position = combined((1, self.position), (rest, axis))

    def _meet(self, symbol: sp.Symbol, turns: bool, axis: Vector, amount: sp.Expr) -> None:
        rate = sp.diff(amount, symbol)
        name = f"joint {self.moves[symbol]} ({symbol})"
        if symbol in self.found:
            self.failures.append(f"{name} moves more than one row: it is a screw, or another row follows it")
        elif rate.free_symbols:
            self.failures.append(f"{name}: its motion depends on {_named(rate)}")
        elif any(entry.free_symbols for entry in axis):
            self.failures.append(f"{name}: its direction depends on the runtime parameter {_named(*axis)}")
        self.found[symbol] = (turns, axis, self.position, tidy(rate))


def _named(*expressions: sp.Expr) -> str:
    return ", ".join(sorted({str(symbol) for expression in expressions for symbol in expression.free_symbols}))


def joint_axes(robot: Robot) -> Axes | tuple[str, ...]:
    """Find the axes of all joints of a chain in the zero pose.

    Args:
        robot: The robot; parameters that are not runtime parameters become numbers. Joints whose values are given need
            not move the tool.

    Returns:
        The axes; or, where they do not tell the whole motion, the reasons, one line each.
    """
    if robot.is_tree:
        return (f"it has {len(robot.tips)} tips, not one: {', '.join(robot.tips)}",)
    if not robot.dof:
        return ("it has no joint variable",)
    return axes_between(robot, robot.root, TOOL, robot.given)


def still_axis(variable: JointVariable) -> JointAxis:
    """The axis of a joint that does not move the tool; where it is does not matter."""
    turns = variable.type is not JointType.PRISMATIC
    return JointAxis(
        variable.name, variable.index + 1, turns, (sp.S.Zero, sp.S.Zero, sp.S.One), NULL, sp.S.One, _limits(variable)
    )


def axes_between(robot: Robot, start: str, end: str, given: tuple[str, ...] = ()) -> Axes | tuple[str, ...]:
    """Find the axes of all joints on the way from one frame to another in the zero pose.

    Args:
        robot: The robot; parameters that are not runtime parameters become numbers.
        start: The frame in which the axes are.
        end: The frame whose pose they change.
        given: Joints that may be beside the way; the others must be on it.

    Returns:
        The axes, joints in the order of the way; or, where they do not tell the whole motion, the reasons.
    """
    values = symbols(robot, keep_parameters=False)
    moves = {values[variable.name]: variable.index + 1 for variable in robot.variables}
    walker = _Walker(moves)
    for step in transforms_between(robot, start, end, values):
        walker.step(step)
    still = [
        f"joint {number} ({symbol}) moves nothing"
        for symbol, number in moves.items()
        if symbol not in walker.found and str(symbol) not in given
    ]
    if walker.failures or still:
        return (*walker.failures, *still)
    joints = []
    order = list(walker.found)
    moving = [variable for variable in robot.variables if values[variable.name] in order]
    for variable in sorted(moving, key=lambda variable: order.index(values[variable.name])):
        turns, direction, point, rate = walker.found[values[variable.name]]
        if turns != (variable.type is not JointType.PRISMATIC):
            return (f"joint {variable.index + 1} ({variable.name}) is a screw",)
        joints.append(JointAxis(variable.name, variable.index + 1, turns, direction, point, rate, _limits(variable)))
    defaults = tuple(
        (values[parameter.name], tidy(evaluate(parameter.value, {}, EXACT))) for parameter in robot.runtime_parameters
    )
    return Axes(tuple(joints), walker.rotation, walker.position, defaults)


def _limits(variable: JointVariable) -> tuple[sp.Expr, sp.Expr] | None:
    if variable.limits is None:
        return None
    low, high = (tidy(evaluate(end, {}, EXACT)) for end in variable.limits)
    return low, high
