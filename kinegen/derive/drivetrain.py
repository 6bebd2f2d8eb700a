"""The joints as expressions of the readings of the actuators, and the readings as expressions of the joints.

Every joint variable is a sum: readings and angles of linkages, each times a constant, and a constant. What two entries
of the file add and take away again cancels exactly, so that a motor which does not move a link is not in its pose.
The other way, entries are taken in the order of the file: a named form gives its readings by its own geometry, a free
expression that is linear in one unknown reading gives that one; for the others the file has `inverse`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field

import sympy as sp
from sympy.polys.matrices import DomainMatrix

from kinegen.derive.expressions import LetBindings
from kinegen.derive.linkages import Bars, Turned, crank, rocker, triangle, triangle_length, write
from kinegen.derive.transforms import SYMPY, symbols
from kinegen.errors import KinegenError
from kinegen.model.actuators import Coupling, Drive, Formula, FourBar, Triangle
from kinegen.model.expression_parser import Arithmetic, Expression, evaluate
from kinegen.model.robot import Robot
from kinegen.support.compat import assert_never
from kinegen.support.dataclass import dataclass

FREE = Arithmetic(
    number=SYMPY.number,
    pi=SYMPY.pi,
    functions={**SYMPY.functions, "sin": sp.sin, "cos": sp.cos},
)
"""Exact sympy numbers, with every function that an actuator may need."""


@dataclass(frozen=True, slots=True)
class Part:
    """Something that is no plain sum of readings, under a name of its own.

    `cosine`: its cosine where that needs no trigonometric function of the part itself, else None. `rates`: its
    derivatives by readings and earlier parts.
    """

    symbol: sp.Symbol
    cosine: sp.Expr | None
    sine: sp.Expr | None
    rates: Mapping[sp.Symbol, sp.Expr]


@dataclass(slots=True)
class Drivetrain:
    """The joints of a robot by the readings of its actuators.

    `values`: a sympy value for each name of the file; that of a joint is an expanded sum.
    """

    robot: Robot
    bindings: LetBindings
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
                self._turn(drive, self._angle(triangle(self.bindings, sides, length), drive.actuator, rate))
            case FourBar():
                angle, rate = self._driven(drive.actuator, drive.angle)
                found = angle
                if not drive.parallelogram:
                    found = self._angle(rocker(self.bindings, bars_of(drive, self.value), angle), drive.actuator, rate)
                self._turn(drive, found)
            case Formula():
                self._set(drive.joint, self.value(drive.value))
            case _:
                assert_never(drive)

    def value(self, expression: Expression) -> sp.Expr:
        """Return an expression of the file in readings and parts."""
        return evaluate(expression, self.values, FREE)

    def _driven(self, actuator: str, linear: tuple[Expression, Expression]) -> tuple[sp.Expr, sp.Expr]:
        """Return what a linkage is driven by, and how fast that grows with the reading."""
        factor = self.value(linear[0])
        return sp.expand(factor * self.values[actuator] + self.value(linear[1])), factor

    def _angle(self, turned: Turned, actuator: str, rate: sp.Expr) -> sp.Expr:
        rates = {self.values[actuator]: self.bindings.name(turned.rate * rate)}
        return self._keep(turned.angle, turned.cosine, turned.sine, rates)

    def _keep(
        self, value: sp.Expr, cosine: sp.Expr | None, sine: sp.Expr | None, rates: Mapping[sp.Symbol, sp.Expr]
    ) -> sp.Symbol:
        """Make a part; unlike names of the bindings, that of a part never has a sign in front."""
        symbol = sp.Dummy(f"part{len(self.parts)}", real=True)
        self.bindings.definitions.append((symbol, value))
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
        # The rates are taken before the value is rewritten, of which sympy knows no derivative.
        inside = sorted(core.free_symbols & {*self.readings, *self.parts}, key=[*self.readings, *self.parts].index)
        rates = {symbol: self._written(sp.diff(core, symbol)) for symbol in inside}
        value = write(core, self.bindings)
        cosine = sine = None
        match core:
            case sp.acos():
                cosine, sine = self._halves(core.args[0])
            case sp.asin():
                sine, cosine = self._halves(core.args[0])
            case sp.atan2():
                y, x = (self._written(argument) for argument in core.args)
                distance = self.bindings.name(sp.sqrt(self.bindings.name(x**2 + y**2)))
                cosine, sine = self.bindings.name(x / distance), self.bindings.name(y / distance)
        return self._keep(value, cosine, sine, rates)

    def _halves(self, value: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
        """Return a cosine and its sine, by half the angle, so that both are NaN where the cosine is none."""
        cosine = self._written(value)
        near, far = (self.bindings.name(sp.sqrt(self.bindings.name(square))) for square in (1 + cosine, 1 - cosine))
        return self.bindings.name((near**2 - far**2) / 2), self.bindings.name(near * far)

    def _written(self, expression: sp.Expr) -> sp.Expr:
        return self.bindings.name(write(expression, self.bindings))

    def rate(self, value: sp.Symbol, reading: sp.Symbol) -> sp.Expr:
        """Return the derivative of a reading or a part by a reading."""
        if value not in self.parts:
            return sp.S.One if value == reading else sp.S.Zero
        inner = (rate * self.rate(symbol, reading) for symbol, rate in self.parts[value].rates.items())
        return self.bindings.name(sum(inner, sp.S.Zero))


def bars_of(drive: FourBar, value: Callable[[Expression], sp.Expr]) -> Bars:
    """Return the bars of a linkage with exact numbers."""
    ground, crank, coupler, rocker = (value(bar) for bar in drive.bars)
    return Bars(ground, crank, coupler, rocker, drive.crossed, drive.ahead, drive.turns)


def readings_of(robot: Robot) -> dict[str, sp.Symbol]:
    """Return a symbol for each reading.

    Raises KinegenError if the robot has no actuators.
    """
    if not robot.actuators.readings:
        raise KinegenError(f"{robot.name} has no actuators; its file says under 'actuators' what drives the joints")
    return {reading.name: sp.Symbol(reading.name, real=True) for reading in robot.actuators.readings}


def drivetrain(robot: Robot) -> Drivetrain:
    """Work out every joint of a robot from the readings of its actuators."""
    readings = readings_of(robot)
    found = Drivetrain(robot, LetBindings(), symbols(robot, keep_parameters=False) | readings)
    for drive in robot.actuators.drives:
        found.drive(drive)
    return found


@dataclass(slots=True)
class Solution:
    """The readings by the joints.

    `readings`: a symbol for each reading, which stands for one that is not solved yet.
    """

    values: Mapping[str, sp.Expr]
    readings: Mapping[str, sp.Symbol]
    constants: frozenset[sp.Expr]
    bindings: LetBindings = field(default_factory=LetBindings)
    solved: dict[str, sp.Expr] = field(default_factory=dict)

    def coupling(self, drive: Coupling) -> None:
        """Readings by the exact inverse of the matrix."""
        if all(name in self.solved for name in drive.actuators):
            return
        matrix = sp.Matrix([[self.value(entry) for entry in row] for row in drive.matrix])
        joints = [
            self.values[joint] - self.value(offset) for joint, offset in zip(drive.joints, drive.offsets, strict=True)
        ]
        inverse = DomainMatrix.from_Matrix(matrix).to_field().inv().to_Matrix()
        for name, reading in zip(drive.actuators, inverse * sp.Matrix(joints), strict=True):
            self.solved.setdefault(name, self.bindings.name(write(reading, self.bindings)))

    def linkage(self, drive: Triangle | FourBar) -> None:
        """Solve for the reading of a linear actuator or of a four-bar linkage."""
        angle = drive.sign * (self.values[drive.joint] - write(self.value(drive.offset), self.bindings))
        if isinstance(drive, Triangle):
            sides = self.value(drive.sides[0]), self.value(drive.sides[1])
            self._keep(drive.actuator, triangle_length(self.bindings, sides, angle), drive.length)
        elif drive.parallelogram:
            self._keep(drive.actuator, angle, drive.angle)
        else:
            self._keep(drive.actuator, crank(self.bindings, bars_of(drive, self.value), angle), drive.angle)

    def _keep(self, actuator: str, driven: sp.Expr, linear: tuple[Expression, Expression]) -> None:
        factor, rest = (self.value(part) for part in linear)
        self.solved.setdefault(actuator, (driven - rest) / factor)

    def formula(self, drive: Formula) -> None:
        """Solve for the only unknown reading, if the expression is linear in it with a constant factor."""
        wanted = [name for name in drive.actuators if name not in self.solved]
        if len(wanted) != 1:
            return
        symbol = self.readings[wanted[0]]
        value = self.value(drive.value)
        factor = sp.diff(value, symbol)
        if factor.free_symbols - self.constants:
            return
        rest = value.subs(symbol, 0)
        self.solved[wanted[0]] = (self.values[drive.joint] - write(rest, self.bindings)) / factor

    def value(self, expression: Expression) -> sp.Expr:
        """Return an expression of the file in joints, and in readings as far as they are known."""
        return evaluate(expression, {**self.values, **self.readings, **self.solved}, FREE)


def solve(robot: Robot) -> Solution:
    """Solve for the readings.

    Raises KinegenError if the robot has no actuators, or the file has to say how a reading follows from the joints.
    """
    values = symbols(robot, keep_parameters=False)
    constants = frozenset(values[parameter.name] for parameter in robot.runtime_parameters)
    found = Solution(values, readings_of(robot), constants)
    # What the file gives comes first; each entry then finds what the ones before it left open.
    given = dict(robot.actuators.inverse)
    for name, expression in given.items():
        found.solved[name] = write(found.value(expression), found.bindings)
    for drive in robot.actuators.drives:
        match drive:
            case Coupling():
                found.coupling(drive)
            case Triangle() | FourBar():
                found.linkage(drive)
            case Formula():
                found.formula(drive)
    missing = [reading.name for reading in robot.actuators.readings if reading.name not in found.solved]
    if missing:
        names = ", ".join(f"'{name}'" for name in missing)
        raise KinegenError(
            f"how {names} follows from the joints is not derived from free expressions; "
            f"give it under actuators, as in inverse: {{{missing[0]}: ...}}"
        )
    return found
