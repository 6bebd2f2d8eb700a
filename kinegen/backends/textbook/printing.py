"""How ordered trees are printed, in whatever notation: sums, signs, brackets, products and quotients.

`notation` has the notations themselves.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from fractions import Fraction

from kinegen.backends.textbook.trees import (
    Factor,
    Function,
    Pi,
    Power,
    Ratio,
    Root,
    Sum,
    Symbol,
    Term,
    finite_decimal,
    is_small_part,
)

_PARTS_OF_PI = 360
"""With a larger denominator a part of pi is a decimal, as other numbers are."""


class Notation(ABC):
    """Holds how expressions are printed.

    `times`: stands between factors. `plus`: stands before a term that is added. `minus`: stands before a term that is
    taken away. `negative`: stands before a first term that is taken away. `comma`: stands between the arguments of a
    function. `stacked`: whether a quotient is printed with its divisor below it. `quarters`: whether small halves and
    quarters, such as 3/2, stay fractions where they stand alone.
    """

    times = "*"
    plus, minus = " + ", " - "
    negative = "-"
    comma = ", "
    stacked = False
    quarters = True

    def entry(self, expression: Sum) -> str:
        """Return a whole entry."""
        return "".join(self.terms(expression))

    def terms(self, expression: Sum) -> tuple[str, ...]:
        """Return the terms of an entry, each with its sign, so that a long one can be broken between them."""
        if not expression.terms:
            return (self.ratio(Fraction(0)),)
        texts = []
        for index, term in enumerate(expression.terms):
            added = self.plus if index else ""
            taken = self.minus if index else self.negative
            texts.append((taken if term.sign < 0 else added) + self.product(term))
        return tuple(texts)

    def product(self, term: Term) -> str:
        """Return the factors of a term, without its sign."""
        if not term.factors:
            return self.ratio(Fraction(1))
        over = [factor for factor in term.factors if not _is_under(factor)]
        under = [_inverted(factor) for factor in term.factors if _is_under(factor)]
        ratios = [factor for factor in over if isinstance(factor, Ratio)]
        if ratios and ratios[0].value.denominator != 1 and not self.decimal(ratios[0], term):
            over.remove(ratios[0])
            over += [Ratio(Fraction(ratios[0].value.numerator))] if ratios[0].value.numerator != 1 else []
            over.sort(key=lambda factor: not isinstance(factor, Ratio))
            under.insert(0, Ratio(Fraction(ratios[0].value.denominator)))
        # A sum that is the only factor needs brackets, too, where a minus stands before it.
        is_bracketed = len(over) + len(under) > 1 or term.sign < 0
        top = self.times.join(self.factor(factor, is_bracketed) for factor in over)
        if not under:
            return top
        bottom = self.times.join(self.factor(factor, True) for factor in under)
        if self.stacked and any(isinstance(factor, Sum) for factor in over):
            return self._beside_fraction(over, bottom)
        return self.fraction(top or self.ratio(Fraction(1)), self.divisor(bottom) if len(under) > 1 else bottom)

    def _beside_fraction(self, over: list[Factor], bottom: str) -> str:
        """A quotient whose brackets stand beside its numbers, so that its line can be broken; a short one as it is."""
        (first, *others) = over
        if isinstance(first, Sum) and not others and _is_short(first):
            return self.fraction(self.entry(first), bottom)
        numbers = [factor for factor in over if isinstance(factor, (Ratio, Root, Pi))]
        top = self.times.join(self.factor(factor, len(numbers) > 1) for factor in numbers)
        rest = [self.factor(factor, True) for factor in over if factor not in numbers]
        return self.times.join((self.fraction(top or self.ratio(Fraction(1)), bottom), *rest))

    def factor(self, factor: Factor, in_product: bool) -> str:
        """Return one factor, in brackets if it is a sum in a product."""
        match factor:
            case Symbol(name, kind):
                return self.symbol(name, kind)
            case Ratio(value):
                digits = self.decimal(factor)
                return self.number(digits) if digits else self.ratio(value)
            case Pi():
                return self.pi()
            case Root(inside):
                return self.root(self.entry(inside))
            case Power(Ratio(value) as base, exponent) if value.denominator != 1:
                return self.power(self.brackets(self.factor(base, True)), exponent)
            case Power(base, exponent):
                return self.power(self.factor(base, True), exponent)
            case Function(name, arguments):
                return self.function(name, self.comma.join(map(self.entry, arguments)))
            case Sum():
                return self.brackets(self.entry(factor)) if in_product else self.entry(factor)

    def decimal(self, ratio: Ratio, term: Term | None = None) -> str:
        """Return a finite decimal, or nothing for a number that is better written as an integer or a fraction.

        `ratio`: the number; a length is a decimal wherever it can be. `term`: the product in which it stands, if it
        does not stand alone.
        """
        others = term.factors if term is not None else ()
        is_fraction = (
            any(isinstance(each, Root) for each in others)
            or (any(isinstance(each, Pi) for each in others) and ratio.value.denominator <= _PARTS_OF_PI)
            or (is_small_part(ratio.value) and (self.quarters or len(others) > 1))
        )
        return "" if is_fraction and not ratio.is_length else finite_decimal(ratio.value)

    @abstractmethod
    def symbol(self, name: str, kind: str) -> str:
        """Return a name; for a sine or cosine, `name` is the label of its angle."""

    def number(self, digits: str) -> str:
        """Return an integer or a finite decimal."""
        return digits

    @abstractmethod
    def ratio(self, value: Fraction) -> str:
        """Return a rational number."""

    @abstractmethod
    def fraction(self, top: str, bottom: str) -> str:
        """Return a quotient."""

    def divisor(self, product: str) -> str:
        """Return a product that something is divided by."""
        return product

    def pi(self) -> str:
        """Return the number pi."""
        return "pi"

    def root(self, inside: str) -> str:
        """Return a square root."""
        return f"sqrt({inside})"

    def power(self, base: str, exponent: int) -> str:
        """Return a power."""
        return f"{base}**{exponent}"

    def function(self, name: str, inside: str) -> str:
        """Return a function: `cos(pi/7)`, `atan2(1, 2)`."""
        return f"{name}({inside})"

    def brackets(self, inside: str) -> str:
        """Return a sum in brackets."""
        return f"({inside})"


def _is_under(factor: Factor) -> bool:
    return isinstance(factor, Power) and factor.exponent < 0


def _inverted(factor: Factor) -> Factor:
    if not isinstance(factor, Power):
        return factor
    return factor.base if factor.exponent == -1 else Power(factor.base, -factor.exponent)


def _is_short(bracket: Sum) -> bool:
    """Return whether a sum has two terms without brackets."""
    return len(bracket.terms) <= 2 and not any(
        isinstance(factor, Sum) for term in bracket.terms for factor in term.factors
    )
