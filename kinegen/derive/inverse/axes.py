"""The axes of the joints in the zero pose: all that the inverse needs to know of a table.

For each joint variable: a line in the base frame, and how far the joint goes for one unit of its variable; and the pose
of the tool, all at q = 0, exact. `base_T_tool(q)` is the product of the joints' motions about these fixed lines, from
the first to the last, times that pose (Brockett 1984), so that conventions, base, tool and offsets play no further
part.
"""

from __future__ import annotations

import math
from dataclasses import field, replace

import sympy as sp

from kinegen.derive.folding import NULL, Vector
from kinegen.derive.inverse.exact_geometry import (
    IDENTITY,
    Rotation,
    about,
    chained,
    combined,
    minus,
    tidy,
    transposed,
    turned,
)
from kinegen.derive.transforms import SYMPY, Elementary, Turn, symbols, transforms_between
from kinegen.model.expression_parser import evaluate
from kinegen.model.robot import TOOL, JointType, JointVariable, Robot
from kinegen.support.dataclass import dataclass

_INSIDE = sp.Rational(1, 10**5)
"""How far within strict limits a joint is turned that may be turned anywhere, in radians."""


@dataclass(frozen=True, slots=True)
class JointAxis:
    """One joint at q = 0.

    Attributes:
        number: Its place in the joint vector, from 1.
        turns: Whether it turns about the axis; otherwise it shifts along it.
        direction: Unit vector of the axis in the base frame, numbers.
        point: A point of the axis in the base frame, which may hold runtime lengths.
        rate: Radians or lengths for one unit of the variable, a number.
        limits: Bounds of the variable, or None.
        strict: Whether these hold without room for rounding.
    """

    name: str
    number: int
    turns: bool
    direction: Vector
    point: Vector
    rate: sp.Expr
    limits: tuple[sp.Expr, sp.Expr] | None
    strict: bool = False

    @property
    def inner(self) -> tuple[sp.Expr, sp.Expr]:
        """The limits between which a value is chosen that may be any: strict ones less what rounding may add."""
        if self.limits is None:
            return -sp.oo, sp.oo
        low, high = self.limits
        if not (self.strict and self.turns) or high - low < 4 * _INSIDE / abs(self.rate):
            return low, high
        return low + _INSIDE / abs(self.rate), high - _INSIDE / abs(self.rate)

    @property
    def arc(self) -> tuple[sp.Expr, sp.Expr] | None:
        """How far the axis may be turned, from and to; None where that is a whole turn or more, or no turn at all."""
        if self.limits is None or not self.turns:
            return None
        # As numbers, since SymPy cannot compare ends that are rounded to many digits with a whole turn of 2 pi.
        if float((self.limits[1] - self.limits[0]) * abs(self.rate)) >= 2 * math.pi:
            return None
        low, high = sorted(tidy(end * self.rate) for end in self.inner)
        return low, high

    @property
    def forward(self) -> JointAxis:
        """The same joint with its axis the way about which its variable grows."""
        return self if self.rate > 0 else self.flipped()

    def flipped(self) -> JointAxis:
        """Return the same joint with its axis the other way round."""
        return replace(self, direction=combined((-1, self.direction)), rate=-self.rate)


@dataclass(frozen=True, slots=True)
class Axes:
    """A chain at q = 0: its joints in order, and the pose of the tool in the base frame.

    Attributes:
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
        """Return the same chain from the tool to the base: its pose is the inverse of this one's."""
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
        """Evaluate an expression in runtime parameters at their values in the file."""
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
        axis = transposed(self.rotation)[step.axis]
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
            self.failures.append(
                f"{name} moves more than one row: it is a screw, or another row follows it; if motors are coupled, "
                "keep the rows independent and describe the motors in actuators:"
            )
        elif rate.free_symbols:
            self.failures.append(f"{name}: its motion depends on {_named(rate)}")
        # Runtime lengths move points alone; angles among them would turn axes, on whose directions families rest.
        elif any(entry.free_symbols for entry in axis):
            self.failures.append(f"{name}: its direction depends on the runtime parameter {_named(*axis)}")
        self.found[symbol] = (turns, axis, self.position, tidy(rate))


def _named(*expressions: sp.Expr) -> str:
    return ", ".join(sorted({str(symbol) for expression in expressions for symbol in expression.free_symbols}))


def joint_axes(robot: Robot) -> Axes | tuple[str, ...]:
    """Find the axes of all joints of a chain in the zero pose, or the reasons why they do not tell the motion.

    Parameters that are not runtime parameters become numbers. Joints whose values are given need not move the tool.
    """
    if robot.is_tree:
        links = {frame: f"{frame} (link {link})" for link, frame in robot.links if link != frame}
        return (f"it has {len(robot.tips)} tips, not one: {', '.join(links.get(tip, tip) for tip in robot.tips)}",)
    if not robot.dof:
        return ("it has no joint variable",)
    return axes_between(robot, robot.root, TOOL, robot.given)


def still_axis(robot: Robot, variable: JointVariable) -> JointAxis:
    """Return an axis for a joint that does not move the tool; where it is does not matter."""
    turns = variable.type is not JointType.PRISMATIC
    return _axis(robot, variable, turns, (sp.S.Zero, sp.S.Zero, sp.S.One), NULL, sp.S.One)


def _axis(
    robot: Robot, variable: JointVariable, turns: bool, direction: Vector, point: Vector, rate: sp.Expr
) -> JointAxis:
    """Return the axis of a joint with its name, its place and its limits."""
    number, strict = variable.index + 1, robot.strict_limits
    return JointAxis(variable.name, number, turns, direction, point, rate, _limits(variable), strict)


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
    # Elementary transforms are walked with every variable at 0, so that axes are seen in the zero pose.
    walker = _Walker(moves)
    for step in transforms_between(robot, start, end, values):
        walker.step(step)
    # A joint that moves nothing would leave the inverse without a value for it.
    still = [
        f"joint {number} ({symbol}) moves nothing"
        for symbol, number in moves.items()
        if symbol not in walker.found and str(symbol) not in given
    ]
    if walker.failures or still:
        return (*walker.failures, *still)
    joints = []
    # Variables may be listed in another order than that of the chain.
    order = list(walker.found)
    moving = [variable for variable in robot.variables if values[variable.name] in order]
    for variable in sorted(moving, key=lambda variable: order.index(values[variable.name])):
        turns, direction, point, rate = walker.found[values[variable.name]]
        if turns != (variable.type is not JointType.PRISMATIC):
            return (f"joint {variable.index + 1} ({variable.name}) is a screw",)
        joints.append(_axis(robot, variable, turns, direction, point, rate))
    defaults = tuple(
        (values[parameter.name], tidy(evaluate(parameter.value, {}, SYMPY))) for parameter in robot.runtime_parameters
    )
    return Axes(tuple(joints), walker.rotation, walker.position, defaults)


def _limits(variable: JointVariable) -> tuple[sp.Expr, sp.Expr] | None:
    if variable.limits is None:
        return None
    low, high = (tidy(evaluate(end, {}, SYMPY)) for end in variable.limits)
    return low, high
