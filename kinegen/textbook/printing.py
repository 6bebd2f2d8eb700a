"""How ordered trees are printed, in whatever notation: sums, signs, brackets, products and quotients.

`notation` has the notations themselves.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from fractions import Fraction

from kinegen.textbook.closed_form import Factor, Function, Pi, Power, Ratio, Root, Sum, Symbol, Term

_LONGEST_DECIMAL = 12


class Notation(ABC):
    """How expressions are printed.

    Attributes:
        times: Stands between factors.
        plus: Stands before a term that is added.
        minus: Stands before a term that is taken away.
        negative: Stands before a first term that is taken away.
        comma: Stands between the arguments of a function.
        quarters: Whether small halves and quarters, such as 3/2, stay fractions where they stand alone.
    """

    times = "*"
    plus, minus = " + ", " - "
    negative = "-"
    comma = ", "
    quarters = True

    def entry(self, expression: Sum) -> str:
        """A whole entry."""
        return "".join(self.terms(expression))

    def terms(self, expression: Sum) -> tuple[str, ...]:
        """The terms of an entry, each with its sign, so that a long one can be broken between them."""
        if not expression.terms:
            return (self.ratio(Fraction(0)),)
        texts = []
        for index, term in enumerate(expression.terms):
            added = self.plus if index else ""
            taken = self.minus if index else self.negative
            text = self._constant(term) if len(expression.terms) > 1 else ""
            texts.append((taken if term.sign < 0 else added) + (text or self.product(term)))
        return tuple(texts)

    def _constant(self, term: Term) -> str:
        """A number that is added to something, such as a length of 0.5, as a decimal; nothing for any other term."""
        (first, *others) = term.factors or (None,)
        return _finite(first.value) if isinstance(first, Ratio) and not others else ""

    def product(self, term: Term) -> str:
        """The factors of a term, without its sign."""
        if not term.factors:
            return self.ratio(Fraction(1))
        over = [factor for factor in term.factors if not _is_under(factor)]
        under = [_inverted(factor) for factor in term.factors if _is_under(factor)]
        ratios = [factor for factor in over if isinstance(factor, Ratio)]
        if ratios and ratios[0].value.denominator != 1 and not self.decimal(ratios[0].value, term):
            over.remove(ratios[0])
            over += [Ratio(Fraction(ratios[0].value.numerator))] if ratios[0].value.numerator != 1 else []
            over.sort(key=lambda factor: not isinstance(factor, Ratio))
            under.insert(0, Ratio(Fraction(ratios[0].value.denominator)))
        top = self.times.join(self.factor(factor, len(over) + len(under) > 1) for factor in over)
        if not under:
            return top
        bottom = self.times.join(self.factor(factor, True) for factor in under)
        return self.fraction(top or self.ratio(Fraction(1)), self.divisor(bottom) if len(under) > 1 else bottom)

    def factor(self, factor: Factor, in_product: bool) -> str:
        """One factor, in brackets if it is a sum in a product."""
        match factor:
            case Symbol(name, kind):
                return self.symbol(name, kind)
            case Ratio(value):
                return self.ratio(value)
            case Pi():
                return self.pi()
            case Root(inside):
                return self.root(self.entry(inside))
            case Power(base, exponent):
                return self.power(self.factor(base, True), exponent)
            case Function(name, arguments):
                return self.function(name, self.comma.join(map(self.entry, arguments)))
            case Sum():
                return self.brackets(self.entry(factor)) if in_product else self.entry(factor)

    def decimal(self, value: Fraction, term: Term | None = None) -> str:
        """A finite decimal, or nothing for a number that is better written as an integer or a fraction.

        Args:
            value: The number.
            term: The product in which it stands, if it does not stand alone.
        """
        denominator = value.denominator
        small = denominator in (2, 4) and abs(value.numerator) < 10
        if denominator == 1 or (small and (self.quarters or (term is not None and len(term.factors) > 1))):
            return ""
        return _finite(value)

    @abstractmethod
    def symbol(self, name: str, kind: str) -> str:
        """A name; for a sine or cosine, `name` is the label of its angle."""

    @abstractmethod
    def ratio(self, value: Fraction) -> str:
        """A rational number."""

    @abstractmethod
    def fraction(self, top: str, bottom: str) -> str:
        """A quotient."""

    def divisor(self, product: str) -> str:
        """A product that something is divided by."""
        return product

    def pi(self) -> str:
        """The number pi."""
        return "pi"

    def root(self, inside: str) -> str:
        """A square root."""
        return f"sqrt({inside})"

    def power(self, base: str, exponent: int) -> str:
        """A power."""
        return f"{base}**{exponent}"

    def function(self, name: str, inside: str) -> str:
        """A function: `cos(pi/7)`, `atan2(1, 2)`."""
        return f"{name}({inside})"

    def brackets(self, inside: str) -> str:
        """A sum in brackets."""
        return f"({inside})"


def _is_under(factor: Factor) -> bool:
    return isinstance(factor, Power) and factor.exponent < 0


def _inverted(factor: Factor) -> Factor:
    if not isinstance(factor, Power):
        return factor
    return factor.base if factor.exponent == -1 else Power(factor.base, -factor.exponent)


def _finite(value: Fraction) -> str:
    """A number as a decimal of few places; nothing if it is an integer or has more of them."""
    denominator = value.denominator
    places = next((n for n in range(1, _LONGEST_DECIMAL + 1) if 10**n % denominator == 0), 0)
    if not places or denominator == 1:
        return ""
    whole, rest = divmod(abs(value.numerator) * 10**places // denominator, 10**places)
    return f"{'-' if value < 0 else ''}{whole}.{rest:0{places}}"
