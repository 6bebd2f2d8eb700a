"""Exact expressions as text that reads back as the same tree."""

from __future__ import annotations

from fractions import Fraction

from kinegen.robot.expressions import Atan2, Call, Expression, Name, Number, Pi, Power, Product, Sum

_LONGEST_DECIMAL = 40
"""Digits of a decimal; what is longer is written as a fraction, or with an exponent."""


def spell(expression: Expression) -> str:
    """Write an expression so that `parse` gives the same tree.

    Args:
        expression: A tree as `parse` and the functions of `algebra` make it: numbers folded, sums and products flat.
    """
    match expression:
        case Number(value):
            return spell_number(value)
        case Pi():
            return "pi"
        case Name(name):
            return name
        case Sum(terms):
            return spell(terms[0]) + "".join(_further(term) for term in terms[1:])
        case Product(factors):
            return _product(factors)
        case Power():
            return _product((expression,))
        case Call(function, argument):
            return f"{function}({spell(argument)})"
        case Atan2(y, x):
            return f"atan2({spell(y)}, {spell(x)})"


def spell_number(value: Fraction) -> str:
    """A number as a decimal where it has one, else as a fraction."""
    decimal = _decimal(value)
    return decimal if decimal is not None else f"{value.numerator}/{value.denominator}"


def _decimal(value: Fraction) -> str | None:
    """A number as a decimal, exactly; None where it has none, or only a long one."""
    rest, twos, fives = value.denominator, 0, 0
    while rest % 2 == 0:
        rest, twos = rest // 2, twos + 1
    while rest % 5 == 0:
        rest, fives = rest // 5, fives + 1
    places = max(twos, fives)
    if rest != 1:
        return None
    digits = str(abs(value.numerator) * 10**places // value.denominator)
    sign = "-" * (value < 0)
    if places > len(digits) + 4:
        return f"{sign}{digits}e-{places}" if len(digits) <= _LONGEST_DECIMAL and places <= 64 else None
    if len(digits) > _LONGEST_DECIMAL:
        return None
    digits = digits.rjust(places + 1, "0")
    return sign + (f"{digits[:-places]}.{digits[-places:]}" if places else digits)


def _further(term: Expression) -> str:
    """A term of a sum after the first, with its sign."""
    text = spell(term)
    # Minus before brackets would be carried into them; `-1*(a + b)` is kept as it is.
    return f" - {text[1:]}" if text.startswith("-") and not text.startswith("-1*(") else f" + {text}"


def _product(factors: tuple[Expression, ...]) -> str:
    """Factors and divisors in their order, a number first."""
    number, rest = (factors[0].value, factors[1:]) if isinstance(factors[0], Number) else (Fraction(1), factors)
    divisor = ""
    # pi/2 and 2*pi/3 read better than 0.5*pi; the same for what has no decimal.
    if number.denominator != 1 and (_decimal(number) is None or (Pi() in rest and number.denominator <= 360)):
        number, divisor = Fraction(number.numerator), f"/{number.denominator}"
    text = ""
    if number != 1:
        text = "-" if number == -1 and _is_plain(rest[0]) else f"{spell_number(number)}*"
    for place, factor in enumerate(rest):
        if isinstance(factor, Power) and factor.exponent < 0:
            text = text[:-1] if text.endswith("*") else f"{text}1" if place == 0 else text
            text += f"/{_raised(factor.base, -factor.exponent)}"
        else:
            text += f"{'*' if place else ''}{_raised(factor, 1)}"
    return text + divisor


def _is_plain(factor: Expression) -> bool:
    """Whether a minus sign can stand before a factor."""
    return not isinstance(factor, Sum) and not (isinstance(factor, Power) and isinstance(factor.base, Sum))


def _raised(base: Expression, exponent: int) -> str:
    match base:
        case Power(inner, further):
            return _raised(inner, further * exponent)
        case Sum() | Product() | Number():
            text = f"({spell(base)})"
        case _:
            text = spell(base)
    return text if exponent == 1 else f"{text}**{exponent}"
