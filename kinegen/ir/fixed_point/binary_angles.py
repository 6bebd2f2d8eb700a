"""Angles in integers: the statements that make sums and multiples of binary angles, and what each angle is off."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from fractions import Fraction

from kinegen.ir.fixed_point.program import (
    LARGEST,
    FixedOperand,
    FixedStatement,
    Integer,
    Operation,
    above,
    nearest_integer,
)
from kinegen.ir.fixed_point.value_classes import refuse
from kinegen.ir.program import Constant, Operand, Operator, RuntimeParameter, Statement, Temporary, Variable
from kinegen.model.expression_parser import FUNCTIONS, Arithmetic, Expression, evaluate
from kinegen.model.expression_values import FLOAT64
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass

TURN = 2**32
"""Binary angles of one turn."""

PI = Fraction("3.14159265358979323846264338327950288419716939937510582097494459230781640628620899862803482534211706798")


def _of_floats(name: str) -> Callable[..., Fraction]:
    return lambda *values: Fraction(FLOAT64.functions[name](*map(float, values)))


EXACT = Arithmetic(number=Fraction, pi=PI, functions={name: _of_floats(name) for name in FUNCTIONS})
"""Fractions; roots and arcs alone are floats."""

_FINEST_PART = 30


def binary_angle(radians: Fraction) -> int:
    """Return the nearest binary angle, without its whole turns."""
    return nearest_integer(radians * TURN / (2 * PI)) % TURN


@dataclass(slots=True)
class Turns:
    """Writes the statements of angles.

    `errors`: bound on the error of each angle temporary, in binary angles.
    """

    robot: Robot
    errors: dict[str, float] = field(default_factory=dict)

    def error(self, operand: Operand) -> float:
        """Bound on the error of an angle in radians; inputs are exact as they are given."""
        found = self.errors[operand.name] if isinstance(operand, Temporary) else 0.0
        return found * above(2 * PI / TURN)

    def statement(self, statement: Statement) -> FixedStatement:
        """Return an operation on angles as an operation on binary angles."""
        match statement.operator:
            case Operator.ADD:
                return self._sum(statement, Operation.TURN_ADD)
            case Operator.SUB:
                return self._sum(statement, Operation.TURN_SUBTRACT)
            case Operator.NEG:
                return self._sum(statement, Operation.TURN_NEGATE)
            case Operator.MUL:
                return self._multiple(statement)
            case _:
                raise TypeError(f"binary angles have no form for the operator {statement.operator!r}")

    def _sum(self, statement: Statement, operation: Operation) -> FixedStatement:
        operands = [self._operand(operand) for operand in statement.operands]
        self.errors[statement.name] = sum(error for _, error in operands)
        return FixedStatement(statement.results, operation, tuple(operand for operand, _ in operands))

    def _operand(self, operand: Operand) -> tuple[FixedOperand, float]:
        """Return an operand with the bound on its error, in binary angles."""
        if isinstance(operand, Constant):
            exact = operand.value * TURN / (2 * PI)
            return Integer(binary_angle(operand.value)), above(abs(exact - nearest_integer(exact)))
        return operand, self.errors[operand.name] if isinstance(operand, Temporary) else 0.0

    def _multiple(self, statement: Statement) -> FixedStatement:
        factors = [operand.value for operand in statement.operands if isinstance(operand, Constant)]
        others = [operand for operand in statement.operands if not isinstance(operand, Constant)]
        if len(factors) != 1:
            raise refuse(self.robot, "an angle is multiplied by a runtime parameter")
        factor, other = factors[0], others[0]
        operand, error = self._operand(other)
        if factor.denominator == 1:
            self.errors[statement.name] = abs(int(factor)) * error
            times = Integer(int(factor) % TURN)
            return FixedStatement(statement.results, Operation.TURN_TIMES, (operand, times))
        self._check_part(other, factor)
        shift = next(s for s in range(_FINEST_PART, -1, -1) if abs(nearest_integer(factor * 2**s)) <= LARGEST)
        part = nearest_integer(factor * 2**shift)
        self.errors[statement.name] = 0.5 + above(abs(factor - Fraction(part, 2**shift)) * (TURN // 2))
        return FixedStatement(statement.results, Operation.TURN_PART, (operand, Integer(part)), shift)

    def _check_part(self, operand: Operand, factor: Fraction) -> None:
        """Part of an angle is clear only if the angle is never meant a turn more or less."""
        ends: tuple[Expression, ...] = ()
        if isinstance(operand, Variable):
            variable = self.robot.variables[operand.index]
            what, line, ends = f"joint '{variable.name}'", variable.line, variable.limits or ()
        elif isinstance(operand, RuntimeParameter):
            parameter = next(each for each in self.robot.runtime_parameters if each.name == operand.name)
            what, line, ends = f"runtime parameter '{parameter.name}'", parameter.line, (parameter.value,)
        else:
            raise refuse(self.robot, f"{factor} times a sum of angles is not clear in binary angles")
        angles = [nearest_integer(evaluate(end, {}, EXACT) * TURN / (2 * PI)) for end in ends]
        if not angles or min(angles) < -TURN // 2 or max(angles) >= TURN // 2:
            needed = "limits within half a turn to either side" if isinstance(operand, Variable) else "a smaller value"
            raise refuse(
                self.robot, f"{factor} of the angle of {what} is not clear in binary angles; give it {needed}", line
            )
