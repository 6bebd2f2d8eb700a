"""Actuators as their owner wrote them: readings, and how each joint follows from them, exactly and in order.

Everything is in the units of the kernels, radians and the length unit of the file; a reading that is a bare number,
such as the count of an encoder, has no unit. Names in expressions are joint variables, actuators and parameters.
"""

from __future__ import annotations

from dataclasses import dataclass

from kinegen.robot.dimension import Dimension
from kinegen.robot.expressions import Expression


@dataclass(frozen=True, slots=True)
class Reading:
    """One entry of the actuator vector: what one motor reads.

    Attributes:
        name: As written.
        index: Its place in the actuator vector, from 0.
        dimension: An angle (radians), a length, or a bare number.
        limits: Lower and upper bound, closed expressions in kernel units; None where the file has none.
        line: Line of the file.
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
        joints: The joints it drives.
        actuators: Readings, one for each column; a gear has one.
        matrix: One row for each joint, closed but for parameters.
        offsets: One for each joint; earlier joints and parameters may stand in them.
        line: Line of the file.
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
        joint: The joint it drives.
        actuator: Its reading.
        sides: The two fixed sides a and b, both positive.
        length: `(factor, rest)`: the third side is `factor*reading + rest`.
        sign: 1 or -1.
        offset: Earlier joints and parameters may stand in it.
        line: Line of the file.
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
        joint: The joint it drives.
        actuator: The reading of the motor.
        bars: Ground, crank, coupler and rocker, closed and positive.
        angle: `(factor, rest)`: the crank stands at `factor*reading + rest`.
        crossed: Whether the rocker stands on the other side of the line from its pivot to the tip of the crank.
        parallelogram: Whether opposite bars are equal and not crossed, so that the rocker stands as the crank does.
        ahead: 1 if the crank stands ahead of the line from its pivot to the tip of the rocker over all its limits, -1
            if behind; the inverse needs it.
        turns: Whole turns to add, to the rocker's angle so that it lies between -pi and pi in the middle of the
            limits, and to the crank's so that the inverse gives back what the motor read.
        sign: 1 or -1.
        offset: Earlier joints and parameters may stand in it.
        line: Line of the file.
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
    """A joint as a free expression of readings, earlier joints and parameters.

    Attributes:
        joint: The joint it drives.
        actuators: The readings that stand in it.
        value: The expression.
        line: Line of the file.
    """

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
    """All of `actuators`; without any, the robot is driven at its joints.

    Attributes:
        readings: In the order of the file; the actuator vector.
        drives: In the order of the file; together they drive every joint variable once.
        inverse: Readings as expressions of joint variables and parameters, where the file gives them.
    """

    readings: tuple[Reading, ...]
    drives: tuple[Drive, ...]
    inverse: tuple[tuple[str, Expression], ...]


NO_ACTUATORS = Actuators((), (), ())
