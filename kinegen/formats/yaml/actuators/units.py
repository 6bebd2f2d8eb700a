"""The expressions of `actuators` in the units of the kernels, exactly.

In a file in degrees everything counts in degrees where an angle or a bare number is wanted: the value of a revolute
joint, of a reading that is no length, and what sine and cosine take; there `asin`, `acos`, `atan` and `atan2` give
degrees, and `pi` is half a turn. Where a length is wanted, as in the table, and inside of other functions, angles are
in radians, as the kernels have them.
"""

from __future__ import annotations

from dataclasses import dataclass

from kinegen.robot.dimension import Dimension
from kinegen.robot.expressions import (
    Atan2,
    Call,
    Expression,
    Name,
    Pi,
    Power,
    Product,
    Sum,
    add,
    is_arc,
    multiply,
    power,
)
from kinegen.robot.units import DEGREE, HALF_TURN, RADIAN

TURNED = frozenset({"sin", "cos"})
"""Functions of an angle."""


@dataclass(frozen=True, slots=True)
class Degrees:
    """Converts the expressions of a file in degrees; one in radians needs none of it.

    Attributes:
        angles: Every name whose value is an angle: joints, readings and parameters, in radians.
    """

    angles: frozenset[str]

    def convert(self, expression: Expression, dimension: Dimension) -> Expression:
        """Convert an expression whose value has some dimension."""
        match dimension:
            case Dimension.ANGLE:
                return _scaled(self._in_degrees(expression))
            case Dimension.NUMBER:
                return self._in_degrees(expression)
            case _:
                return self._plain(expression)

    def _in_degrees(self, expression: Expression) -> Expression:
        """The same number of degrees, with every name in radians."""
        match expression:
            case Name(name) if name in self.angles:
                return multiply(RADIAN, expression)
            case Pi():
                return HALF_TURN
            case Call() | Atan2() if is_arc(expression):
                return multiply(RADIAN, self._plain(expression))
            case Sum(parts):
                return add(*(self._in_degrees(part) for part in parts))
            case Product(parts):
                return multiply(*(self._in_degrees(part) for part in parts))
            case Power(base, exponent):
                return power(self._in_degrees(base), exponent)
            case Call(function, argument) if function not in TURNED:
                return Call(function, self._in_degrees(argument))
        return self._plain(expression)

    def _plain(self, expression: Expression) -> Expression:
        """The same number; only what sine and cosine take is converted."""
        match expression:
            case Call(function, argument) if function in TURNED:
                return Call(function, self.convert(argument, Dimension.ANGLE))
            case Call(function, argument):
                return Call(function, self._plain(argument))
            case Atan2(y, x):
                return Atan2(self._plain(y), self._plain(x))
            case Sum(parts):
                return add(*(self._plain(part) for part in parts))
            case Product(parts):
                return multiply(*(self._plain(part) for part in parts))
            case Power(base, exponent):
                return power(self._plain(base), exponent)
        return expression


def _scaled(expression: Expression) -> Expression:
    """Degrees to radians, term by term, so that what was multiplied by `RADIAN` is left as it was."""
    match expression:
        case Sum(terms):
            return add(*(_scaled(term) for term in terms))
        case Product(factors) if inner := [factor for factor in factors if isinstance(factor, Sum)]:
            rest = list(factors)
            rest.remove(inner[0])
            return multiply(*rest, _scaled(inner[0]))
    return multiply(DEGREE, expression)
