"""Derivatives of whatever the reference computes: Taylor series in several variables, cut off after the second order.

In: any kind of numbers. Out: a kind whose numbers are series over these. A chain product in series is the chain product
and its derivatives, exact but for the rounding of the numbers themselves; there is no step to choose, and no formula
for the derivative of a kinematic chain.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from kinegen.model.expression_parser import Arithmetic
from kinegen.support.dataclass import dataclass
from kinegen.verify.reference.exact_numbers import Kind, Rows

Monomial = tuple[int, ...]
"""The variables of a product, ascending: () is 1, (0, 2) is x0 x2, (1, 1) is x1 squared."""


@dataclass(frozen=True, slots=True)
class Series:
    """A sum of coefficients times monomials in small variables.

    Attributes:
        parts: The coefficients: numbers, arrays or matrices. What is missing is zero.
        order: Degree of the monomials that are kept.
    """

    parts: Mapping[Monomial, Any]
    order: int

    __array_ufunc__ = None  # an array does not take a series for one of its entries

    def derivative(self, variable: int) -> Series:
        """Returns the derivative with respect to one variable, with one order less."""
        parts = {}
        for monomial, part in self.parts.items():
            if variable in monomial:
                rest = list(monomial)
                rest.remove(variable)
                parts[tuple(rest)] = monomial.count(variable) * part
        return Series(parts, self.order - 1)

    def map(self, function: Callable[[Any], Any]) -> Series:
        """Returns the same linear function of every coefficient."""
        return Series({monomial: function(part) for monomial, part in self.parts.items()}, self.order)

    def __neg__(self) -> Series:
        return self.map(lambda part: -part)

    def __add__(self, other: Any) -> Series:
        parts = dict(self.parts)
        for monomial, part in _parts(other):
            parts[monomial] = parts[monomial] + part if monomial in parts else part
        return Series(parts, _order(self, other))

    __radd__ = __add__

    def __sub__(self, other: Any) -> Series:
        return self.__add__(-other)

    def __rsub__(self, other: Any) -> Series:
        return (-self).__add__(other)

    def __mul__(self, other: Any) -> Series:
        return product(self, other, operator.mul)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Series:
        return product(self, 1 / other, operator.mul)

    def __rtruediv__(self, other: Any) -> Series:
        inverse = 1 / self.parts[()]
        reciprocal: Series = _compose(self, (inverse, -(inverse**2), 2 * inverse**3))
        return product(reciprocal, other, operator.mul)

    def __pow__(self, exponent: int) -> Series:
        return self if exponent == 1 else self * self.__pow__(exponent - 1)


def product(left: Any, right: Any, times: Callable[[Any, Any], Any]) -> Series:
    """Returns the product of two series, or of a series and a number, of at most the order that both have.

    `times`: multiplies two coefficients.
    """
    order = _order(left, right)
    parts: dict[Monomial, Any] = {}
    for one, a in _parts(left):
        for other, b in _parts(right):
            if len(one) + len(other) <= order:
                monomial = tuple(sorted(one + other))
                found = times(a, b)
                parts[monomial] = parts[monomial] + found if monomial in parts else found
    return Series(parts, order)


def in_series(kind: Kind, order: int) -> Kind:
    """Returns the kind of numbers whose coefficients are of another kind. `kind`: the coefficients; `order`: 1 or 2."""
    functions = _Functions(kind)
    by_name: dict[str, Callable[..., Any]] = {
        "sqrt": functions.sqrt,
        "sin": functions.sin,
        "cos": functions.cos,
        "asin": functions.asin,
        "acos": functions.acos,
        "atan": functions.atan,
        "atan2": functions.atan2,
    }

    def matrix(rows: Rows) -> Series:
        filled = [[dict(_parts(entry)) for entry in row] for row in rows]
        monomials = sorted({monomial for row in filled for entry in row for monomial in entry})
        parts = {
            key: kind.matrix(
                tuple((a.get(key, 0), b.get(key, 0), c.get(key, 0), d.get(key, 0)) for a, b, c, d in filled)
            )
            for key in monomials
        }
        return Series(parts, order)

    return Kind(
        arithmetic=Arithmetic(number=kind.arithmetic.number, pi=kind.arithmetic.pi, functions=by_name),
        sin=functions.sin,
        cos=functions.cos,
        matrix=matrix,
        multiply=lambda left, right: product(left, right, kind.multiply),
    )


@dataclass(frozen=True, slots=True)
class _Functions:
    """Functions of series, by their values and derivatives at the constant part."""

    kind: Kind

    def sin(self, angle: Any) -> Any:
        s, c = self.kind.sin(constant(angle)), self.kind.cos(constant(angle))
        return _compose(angle, (s, c, -s))

    def cos(self, angle: Any) -> Any:
        s, c = self.kind.sin(constant(angle)), self.kind.cos(constant(angle))
        return _compose(angle, (c, -s, -c))

    def sqrt(self, value: Any) -> Any:
        if not isinstance(value, Series):  # of a constant no slope is wanted, which there is none of at zero
            return self._of("sqrt", value)
        found = self._of("sqrt", constant(value))
        return _compose(value, (found, 1 / (2 * found), -1 / (4 * found * constant(value))))

    def asin(self, value: Any) -> Any:
        if not isinstance(value, Series):
            return self._of("asin", value)
        slope = 1 / self._of("sqrt", 1 - constant(value) ** 2)
        return _compose(value, (self._of("asin", constant(value)), slope, constant(value) * slope**3))

    def acos(self, value: Any) -> Any:
        if not isinstance(value, Series):
            return self._of("acos", value)
        slope = -1 / self._of("sqrt", 1 - constant(value) ** 2)
        return _compose(value, (self._of("acos", constant(value)), slope, constant(value) * slope**3))

    def atan(self, value: Any) -> Any:
        slope = 1 / (1 + constant(value) ** 2)
        return _compose(value, (self._of("atan", constant(value)), slope, -2 * constant(value) * slope**2))

    def atan2(self, y: Any, x: Any) -> Any:
        b, a = constant(y), constant(x)
        turned = (y * a - x * b) / (x * a + y * b)  # the tangent of the small angle by which the point moves
        return self._of("atan2", b, a) + turned

    def _of(self, name: str, *values: Any) -> Any:
        return self.kind.arithmetic.functions[name](*values)


def constant(value: Any) -> Any:
    """Returns what is left where all variables are zero."""
    return value.parts.get((), 0) if isinstance(value, Series) else value


def _compose(value: Any, derivatives: tuple[Any, Any, Any]) -> Any:
    """Returns a function of a series, from its value and derivatives at the constant part."""
    if not isinstance(value, Series):
        return derivatives[0]
    small = Series({monomial: part for monomial, part in value.parts.items() if monomial}, value.order)
    return derivatives[0] + small * derivatives[1] + small * small * (derivatives[2] / 2)


def _parts(value: Any) -> Iterator[tuple[Monomial, Any]]:
    return iter(value.parts.items() if isinstance(value, Series) else (((), value),))


def _order(*values: Any) -> int:
    """Returns the lowest order of series among numbers."""
    return min(value.order for value in values if isinstance(value, Series))
