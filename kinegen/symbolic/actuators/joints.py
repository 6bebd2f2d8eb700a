"""The joints as expressions of the actuators' readings, with what is needed to differentiate them.

In: a robot with actuators. Out: every joint variable as a sum: readings and angles of linkages, each times a constant,
and a constant. What two entries of the file add and take away again cancels exactly, so that a motor which does not
move a link does not occur in its pose.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import sympy as sp

from kinegen.errors import KinegenError
from kinegen.older import assert_never
from kinegen.robot.actuators.model import Coupling, Drive, Formula, FourBar, Triangle
from kinegen.robot.expressions import Arithmetic, Expression, evaluate
from kinegen.robot.model import Robot
from kinegen.symbolic.actuators.forms import Bars, Turned, rocker, triangle
from kinegen.symbolic.actuators.write import write
from kinegen.symbolic.expressions import Tape
from kinegen.symbolic.transforms import EXACT, symbols

FREE = Arithmetic(
    number=EXACT.number,
    pi=EXACT.pi,
    functions={**EXACT.functions, "sin": sp.sin, "cos": sp.cos},
)
"""Exact sympy numbers, with every function that an actuator may need."""


@dataclass(frozen=True, slots=True)
class Part:
    """Something that is no plain sum of readings, under a name of its own.

    Attributes:
        symbol: Its name.
        cosine: Its cosine where that needs no trigonometric function of the part itself, else None.
        sine: Its sine.
        rates: Its derivatives by readings and earlier parts.
    """

    symbol: sp.Symbol
    cosine: sp.Expr | None
    sine: sp.Expr | None
    rates: Mapping[sp.Symbol, sp.Expr]


@dataclass(slots=True)
class Drivetrain:
    """The joints of a robot by the readings of its actuators.

    Attributes:
        robot: The robot.
        tape: Receives the intermediate values.
        values: A sympy value for each name of the file; that of a joint is an expanded sum.
        parts: The parts in those sums, in order.
    """

    robot: Robot
    tape: Tape
    values: dict[str, sp.Expr]
    parts: dict[sp.Symbol, Part] = field(default_factory=dict)

    @property
    def readings(self) -> tuple[sp.Symbol, ...]:
        """The symbols of the actuator vector."""
        return tuple(self.values[reading.name] for reading in self.robot.actuators.readings)

    def drive(self, drive: Drive) -> None:
        """Work one entry of the file out."""
        match drive:
            case Coupling():
                for joint, row, offset in zip(drive.joints, drive.matrix, drive.offsets, strict=True):
                    terms = (
                        self.value(entry) * self.values[name] for entry, name in zip(row, drive.actuators, strict=True)
                    )
                    self._set(joint, sum(terms, self.value(offset)))
            case Triangle():
                sides = self.value(drive.sides[0]), self.value(drive.sides[1])
                length, rate = self._driven(drive.actuator, drive.length)
                self._turn(drive, self._angle(triangle(self.tape, sides, length), drive.actuator, rate))
            case FourBar():
                angle, rate = self._driven(drive.actuator, drive.angle)
                found = angle
                if not drive.parallelogram:
                    found = self._angle(rocker(self.tape, bars_of(drive, self.value), angle), drive.actuator, rate)
                self._turn(drive, found)
            case Formula():
                self._set(drive.joint, self.value(drive.value))
            case _:
                assert_never(drive)

    def value(self, expression: Expression) -> sp.Expr:
        """An expression of the file in readings and parts."""
        return evaluate(expression, self.values, FREE)

    def _driven(self, actuator: str, linear: tuple[Expression, Expression]) -> tuple[sp.Expr, sp.Expr]:
        """What a linkage is driven by, and how fast that grows with the reading."""
        factor = self.value(linear[0])
        return sp.expand(factor * self.values[actuator] + self.value(linear[1])), factor

    def _angle(self, turned: Turned, actuator: str, rate: sp.Expr) -> sp.Expr:
        rates = {self.values[actuator]: self.tape.name(turned.rate * rate)}
        return self._keep(turned.angle, turned.cosine, turned.sine, rates)

    def _keep(
        self, value: sp.Expr, cosine: sp.Expr | None, sine: sp.Expr | None, rates: Mapping[sp.Symbol, sp.Expr]
    ) -> sp.Symbol:
        """Make a part; unlike the tape's names, that of a part never has a sign in front."""
        symbol = sp.Dummy(f"part{len(self.parts)}", real=True)
        self.tape.definitions.append((symbol, value))
        self.parts[symbol] = Part(symbol, cosine, sine, rates)
        return symbol

    def _turn(self, drive: Triangle | FourBar, angle: sp.Expr) -> None:
        self._set(drive.joint, drive.sign * angle + self.value(drive.offset))

    def _set(self, joint: str, value: sp.Expr) -> None:
        """Take a value apart: what is linear stays, every other term becomes a part."""
        moving = {*self.readings, *self.parts}
        terms = []
        for term in sp.Add.make_args(value):
            # A slope without readings in it tells what is linear; a power of a sum is never multiplied out.
            if not any(sp.diff(term, symbol).free_symbols & moving for symbol in moving & term.free_symbols):
                terms.append(sp.expand(term))
                continue
            factor, core = term.as_coeff_Mul()
            terms.append(factor * self._part(core))
        self.values[joint] = sp.Add(*terms)

    def _part(self, core: sp.Expr) -> sp.Expr:
        """Give a term that is not linear a name."""
        inside = sorted(core.free_symbols & {*self.readings, *self.parts}, key=[*self.readings, *self.parts].index)
        rates = {symbol: self._written(sp.diff(core, symbol)) for symbol in inside}
        value = write(core, self.tape)
        cosine = sine = None
        match core:
            case sp.acos():
                cosine, sine = self._halves(core.args[0])
            case sp.asin():
                sine, cosine = self._halves(core.args[0])
            case sp.atan2():
                y, x = (self._written(argument) for argument in core.args)
                distance = self.tape.name(sp.sqrt(self.tape.name(x**2 + y**2)))
                cosine, sine = self.tape.name(x / distance), self.tape.name(y / distance)
        return self._keep(value, cosine, sine, rates)

    def _halves(self, value: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
        """A cosine and its sine, by half the angle, so that both are NaN where the cosine is none."""
        cosine = self._written(value)
        near, far = (self.tape.name(sp.sqrt(self.tape.name(square))) for square in (1 + cosine, 1 - cosine))
        return self.tape.name((near**2 - far**2) / 2), self.tape.name(near * far)

    def _written(self, expression: sp.Expr) -> sp.Expr:
        return self.tape.name(write(expression, self.tape))

    def rate(self, value: sp.Symbol, reading: sp.Symbol) -> sp.Expr:
        """The derivative of a reading or a part by a reading."""
        if value not in self.parts:
            return sp.S.One if value == reading else sp.S.Zero
        inner = (rate * self.rate(symbol, reading) for symbol, rate in self.parts[value].rates.items())
        return self.tape.name(sum(inner, sp.S.Zero))


def bars_of(drive: FourBar, value: Callable[[Expression], sp.Expr]) -> Bars:
    """The bars of a linkage with exact numbers."""
    ground, crank, coupler, rocker = (value(bar) for bar in drive.bars)
    return Bars(ground, crank, coupler, rocker, drive.crossed, drive.ahead, drive.turns)


def readings_of(robot: Robot) -> dict[str, sp.Symbol]:
    """A symbol for each reading.

    Raises:
        KinegenError: If the robot has no actuators.
    """
    if not robot.actuators.readings:
        raise KinegenError(f"{robot.name} has no actuators; its file says under 'actuators' what drives the joints")
    return {reading.name: sp.Symbol(reading.name, real=True) for reading in robot.actuators.readings}


def drivetrain(robot: Robot) -> Drivetrain:
    """Work out every joint of a robot from the readings of its actuators.

    Args:
        robot: The robot; parameters that are not runtime parameters become exact numbers.

    Raises:
        KinegenError: If the robot has no actuators.
    """
    readings = readings_of(robot)
    found = Drivetrain(robot, Tape(), symbols(robot, keep_parameters=False) | readings)
    for drive in robot.actuators.drives:
        found.drive(drive)
    return found
