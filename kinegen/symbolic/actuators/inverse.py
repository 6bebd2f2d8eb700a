"""The readings of the actuators as expressions of the joints, where there is a closed form.

Entries are taken in the order of the file: a named form gives its readings by its own geometry, a free expression that
is linear in one reading, not yet known from an earlier entry, gives that one; for the others the file has `inverse`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import sympy as sp
from sympy.polys.matrices import DomainMatrix

from kinegen.errors import KinegenError
from kinegen.robot.actuators.model import Coupling, Formula, FourBar, Triangle
from kinegen.robot.expressions import Expression, evaluate
from kinegen.robot.model import Robot
from kinegen.symbolic.actuators.forms import crank, triangle_length
from kinegen.symbolic.actuators.joints import FREE, bars_of, readings_of
from kinegen.symbolic.actuators.write import write
from kinegen.symbolic.expressions import Tape
from kinegen.symbolic.transforms import symbols


@dataclass(slots=True)
class Solution:
    """The readings by the joints.

    Attributes:
        values: A sympy value for each joint and parameter of the file.
        readings: A symbol for each reading, which stands for one that is not solved yet.
        constants: The symbols of the runtime parameters.
        tape: Receives the intermediate values.
        solved: What is known so far, by name.
    """

    values: Mapping[str, sp.Expr]
    readings: Mapping[str, sp.Symbol]
    constants: frozenset[sp.Expr]
    tape: Tape = field(default_factory=Tape)
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
            self.solved.setdefault(name, self.tape.name(write(reading, self.tape)))

    def linkage(self, drive: Triangle | FourBar) -> None:
        """The reading of a linear actuator or of a four-bar linkage."""
        angle = drive.sign * (self.values[drive.joint] - write(self.value(drive.offset), self.tape))
        if isinstance(drive, Triangle):
            sides = self.value(drive.sides[0]), self.value(drive.sides[1])
            self._keep(drive.actuator, triangle_length(self.tape, sides, angle), drive.length)
        elif drive.parallelogram:
            self._keep(drive.actuator, angle, drive.angle)
        else:
            self._keep(drive.actuator, crank(self.tape, bars_of(drive, self.value), angle), drive.angle)

    def _keep(self, actuator: str, driven: sp.Expr, linear: tuple[Expression, Expression]) -> None:
        factor, rest = (self.value(part) for part in linear)
        self.solved.setdefault(actuator, (driven - rest) / factor)

    def formula(self, drive: Formula) -> None:
        """The only reading that is not known yet, if it stands in the expression linearly with a constant factor."""
        wanted = [name for name in drive.actuators if name not in self.solved]
        if len(wanted) != 1:
            return
        symbol = self.readings[wanted[0]]
        value = self.value(drive.value)
        factor = sp.diff(value, symbol)
        if factor.free_symbols - self.constants:
            return
        rest = value.subs(symbol, 0)
        self.solved[wanted[0]] = (self.values[drive.joint] - write(rest, self.tape)) / factor

    def value(self, expression: Expression) -> sp.Expr:
        """An expression of the file in joints, and in readings as far as they are known."""
        return evaluate(expression, {**self.values, **self.readings, **self.solved}, FREE)


def solve(robot: Robot) -> Solution:
    """Solve for the readings.

    Args:
        robot: The robot; parameters that are not runtime parameters become exact numbers.

    Raises:
        KinegenError: If the robot has no actuators, or the file has to say how a reading follows from the joints.
    """
    values = symbols(robot, keep_parameters=False)
    constants = frozenset(values[parameter.name] for parameter in robot.runtime_parameters)
    found = Solution(values, readings_of(robot), constants)
    given = dict(robot.actuators.inverse)
    for name, expression in given.items():
        found.solved[name] = write(found.value(expression), found.tape)
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
