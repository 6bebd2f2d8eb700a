"""Actuators as their owner wrote them: readings, how each joint follows from them, and how a linkage closes.

Everything is in the units of the kernels, radians and the length unit of the file; a reading that is a bare number,
such as the count of an encoder, has no unit. Names in expressions are joint variables, actuators and parameters.
"""

from __future__ import annotations

import itertools
import math

from kinegen.model.expression_parser import Expression
from kinegen.model.expression_values import Dimension
from kinegen.support.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class Reading:
    """One entry of the actuator vector: what one motor reads.

    Attributes:
        index: Its place in the actuator vector, from 0.
        dimension: An angle (radians), a length, or a bare number.
        limits: Lower and upper bound, closed expressions in kernel units; None where the file has none.
    """

    name: str
    index: int
    dimension: Dimension
    limits: tuple[Expression, Expression] | None
    line: int


@dataclass(frozen=True, slots=True)
class Coupling:
    """Joints that are a matrix times readings, plus offsets: gears, belts, differentials.

    Attributes:
        actuators: Readings, one for each column; a gear has one.
        matrix: One row for each joint, closed but for parameters.
        offsets: One for each joint; earlier joints and parameters may stand in them.
    """

    joints: tuple[str, ...]
    actuators: tuple[str, ...]
    matrix: tuple[tuple[Expression, ...], ...]
    offsets: tuple[Expression, ...]
    line: int


@dataclass(frozen=True, slots=True)
class Triangle:
    """A joint turned by a linear actuator or a wire, the third side of a triangle.

    `joint = sign*angle + offset`, where `angle` in [0, pi] lies between the two fixed sides and
    `length**2 = a**2 + b**2 - 2*a*b*cos(angle)`.

    Attributes:
        sides: The two fixed sides a and b, both positive.
        length: `(factor, rest)`: the third side is `factor*reading + rest`.
        offset: Earlier joints and parameters may stand in it.
    """

    joint: str
    actuator: str
    sides: tuple[Expression, Expression]
    length: tuple[Expression, Expression]
    sign: int
    offset: Expression
    line: int

    @property
    def joints(self) -> tuple[str, ...]:
        """The joint it drives."""
        return (self.joint,)

    @property
    def actuators(self) -> tuple[str, ...]:
        """The reading it needs."""
        return (self.actuator,)


@dataclass(frozen=True, slots=True)
class FourBar:
    """A joint turned by the rocker of a four-bar linkage whose crank a motor turns.

    The crank turns about the origin, the rocker about the point (ground, 0); both angles are counted from the ground
    line, from the origin towards that point. `joint = sign*rocker angle + offset`.

    Attributes:
        bars: Ground, crank, coupler and rocker, closed and positive.
        angle: `(factor, rest)`: the crank stands at `factor*reading + rest`.
        crossed: Whether the rocker stands on the other side of the line from its pivot to the tip of the crank.
        parallelogram: Whether opposite bars are equal and not crossed, so that the rocker stands as the crank does.
        ahead: 1 if the crank stands ahead of the line from its pivot to the tip of the rocker over all its limits, -1
            if behind; the inverse needs it.
        turns: Whole turns to add, to the rocker's angle so that it lies between -pi and pi in the middle of the
            limits, and to the crank's so that the inverse gives back what the motor read.
        offset: Earlier joints and parameters may stand in it.
    """

    joint: str
    actuator: str
    bars: tuple[Expression, Expression, Expression, Expression]
    angle: tuple[Expression, Expression]
    crossed: bool
    parallelogram: bool
    ahead: int
    turns: tuple[int, int]
    sign: int
    offset: Expression
    line: int

    @property
    def joints(self) -> tuple[str, ...]:
        """The joint it drives."""
        return (self.joint,)

    @property
    def actuators(self) -> tuple[str, ...]:
        """The reading it needs."""
        return (self.actuator,)


@dataclass(frozen=True, slots=True)
class Formula:
    """A joint as a free expression of readings, earlier joints and parameters."""

    joint: str
    actuators: tuple[str, ...]
    value: Expression
    line: int

    @property
    def joints(self) -> tuple[str, ...]:
        """The joint it drives."""
        return (self.joint,)


Drive = Coupling | Triangle | FourBar | Formula


@dataclass(frozen=True, slots=True)
class Actuators:
    """All of `actuators`, in the order of the file; without any, the robot is driven at its joints.

    Attributes:
        readings: The actuator vector.
        drives: Together they drive every joint variable once.
        inverse: Readings as expressions of joint variables and parameters, where the file gives them.
    """

    readings: tuple[Reading, ...]
    drives: tuple[Drive, ...]
    inverse: tuple[tuple[str, Expression], ...]


NO_ACTUATORS = Actuators((), (), ())


STEPS = 720
"""Crank angles that are looked at between the limits."""

_SLACK = 1e-9
"""Relative to the longest bar; a linkage may just reach a dead point of its rocker."""

Bars = tuple[float, float, float, float]
"""Ground, crank, coupler and rocker."""


class LinkageError(ValueError):
    """The linkage cannot do what is asked of it; `angle` is the crank angle at which it fails."""

    def __init__(self, message: str, angle: float) -> None:
        super().__init__(message)
        self.angle = angle


@dataclass(frozen=True, slots=True)
class Assembly:
    """The side and whole turns that stay the same between the limits; see `FourBar`."""

    ahead: int
    turns: tuple[int, int]


def assemble(bars: Bars, angles: tuple[float, float], *, crossed: bool) -> Assembly:
    """Follow a linkage from one limit of its crank to the other, in radians from the ground line.

    Nothing computed here enters a kernel but signs and whole turns.

    Raises:
        LinkageError: If the bars do not reach, or crank and coupler pass one line.
    """
    first, last = angles
    cranks = [first + (last - first) * step / STEPS for step in range(STEPS + 1)]
    rockers = [_rocker(bars, crank, crossed=crossed) for crank in cranks]
    slack = _SLACK * max(bars) ** 2
    sides = [(crank, _side(bars, crank, rocker)) for crank, rocker in zip(cranks, rockers, strict=True)]
    clear = [(crank, side > 0) for crank, side in sides if abs(side) > slack]
    for (_, before), (crank, after) in itertools.pairwise(clear):
        if before is not after:
            remedy = "keep the limits on one side of this dead centre"
            raise LinkageError(f"crank and coupler are aligned, where the rocker reverses; {remedy}", crank)
    ahead = 1 if clear and clear[0][1] else -1
    crank, rocker = cranks[STEPS // 2], rockers[STEPS // 2]
    natural = -round(rocker / math.tau)
    back = _crank(bars, rocker + natural * math.tau, ahead)
    return Assembly(ahead, (natural, round((crank - back) / math.tau)))


def _rocker(bars: Bars, crank: float, *, crossed: bool) -> float:
    """Return the rocker's angle, which does not jump where the crank moves on."""
    ground, a, b, c = bars
    x, y = a * math.cos(crank) - ground, a * math.sin(crank)
    diagonal = math.hypot(x, y)
    slack = _SLACK * max(bars)
    low, high = abs(b - c), b + c
    if diagonal <= slack or not low - slack <= diagonal <= high + slack:
        reach = f"coupler and rocker reach from {low:.4g} to {high:.4g}"
        beyond = max(low - diagonal, diagonal - high)
        off = f", {beyond:.2g} beyond" if beyond > 0 else ""
        raise LinkageError(f"the tip of the crank is {diagonal:.4g} from the rocker's pivot{off}, but {reach}", crank)
    if a > ground:
        direction = crank + math.atan2(ground * math.sin(crank), a - ground * math.cos(crank))
    else:
        direction = math.pi + math.atan2(-y, -x)
    return direction + (1 if crossed else -1) * _corner(diagonal, c, b)


def _crank(bars: Bars, rocker: float, ahead: int) -> float:
    """Return the crank's angle, which does not jump where the rocker moves on."""
    ground, a, b, c = bars
    x, y = ground + c * math.cos(rocker), c * math.sin(rocker)
    if c > ground:
        direction = rocker + math.atan2(-ground * math.sin(rocker), c + ground * math.cos(rocker))
    else:
        direction = math.atan2(y, x)
    return direction + ahead * _corner(math.hypot(x, y), a, b)


def _corner(diagonal: float, side: float, opposite: float) -> float:
    """Return the angle between a diagonal and a bar, opposite of another bar."""
    cosine = (diagonal**2 + side**2 - opposite**2) / (2 * diagonal * side)
    return math.acos(max(-1.0, min(1.0, cosine)))


def _side(bars: Bars, crank: float, rocker: float) -> float:
    """Return a positive number where the crank is ahead of the tip of the rocker, seen from its pivot."""
    ground, a, _, c = bars
    x, y = ground + c * math.cos(rocker), c * math.sin(rocker)
    return a * (x * math.sin(crank) - y * math.cos(crank))
