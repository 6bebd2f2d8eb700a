"""Expressions of a robot file after a change of sign or a quarter turn, as a person would write them.

In: the text of an entry. Out: the text of the changed entry. Only the text is handled here; that it means what it
should is checked on the robot that is read from it.
"""

from __future__ import annotations

import re
from fractions import Fraction

_NUMBER = r"\d+(?:\.\d+)?"
_PI = r"(?:\d+\*)?pi(?:/\d+)?"


def negated(text: str) -> str:
    """The opposite of a constant."""
    bare = text.strip()
    inner = bare.removeprefix("-").strip()
    if re.fullmatch(rf"{_NUMBER}(?:[eE][+-]?\d+)?|\w+|[\w.*/]+", inner):
        return inner if bare.startswith("-") else f"-{inner}"
    if match := re.fullmatch(r"-\s*\(([^()]*)\)", bare):
        return match[1]
    return f"-({bare})"


def mirrored(text: str, names: tuple[str, ...]) -> str:
    """The same expression of a joint variable that runs the other way."""
    name = "|".join(map(re.escape, names))
    moving = rf"(?:[\w./]+\*)?(?:{name})"
    if match := re.fullmatch(rf"\s*(-?)\s*({moving})(\s*[+-].*)?\s*", text):
        return f"{'' if match[1] else '-'}{match[2]}{match[3] or ''}"
    if match := re.fullmatch(rf"(.*\S)\s*([+-])\s*({moving})\s*", text):
        return f"{match[1]} {'-' if match[2] == '+' else '+'} {match[3]}"
    return re.sub(rf"\b({name})\b", r"(-\1)", text)


def mirrored_constant(text: str, names: tuple[str, ...]) -> str:
    """The same expression with the opposite constant."""
    name = "|".join(map(re.escape, names))
    if match := re.fullmatch(rf"(\s*-?\s*(?:[\w./]+\*)?(?:{name}))\s*([+-])\s*([\w./*]+|\w+\([^()]*\))\s*", text):
        return f"{match[1]} {'-' if match[2] == '+' else '+'} {match[3]}"
    inner = re.sub(rf"\b({name})\b", r"(-\1)", text)
    return f"-({inner})"


def turned(text: str, quarters: int, unit: str) -> str:
    """An angle and some quarter turns more.

    Args:
        text: The angle.
        quarters: -1, 1 or 2.
        unit: `deg` or `rad`.
    """
    bare = text.strip()
    written = _NUMBER if unit == "deg" else rf"{_PI}|0"
    if match := re.fullmatch(rf"([+-]?)\s*({written})", bare):
        return _amount(_quarters(match[2], match[1], unit) + quarters, unit)
    if match := re.fullmatch(rf"(.*[\w)])\s*([+-])\s*({written})", bare):
        return f"{match[1]}{_added(_quarters(match[3], match[2], unit) + quarters, unit)}"
    if match := re.fullmatch(rf"(-?)\s*({written})\s*([+-])\s*(.*)", bare):
        total = _amount(_quarters(match[2], match[1], unit) + quarters, unit)
        if total == "0":
            return f"{match[3].replace('+', '')}{match[4]}"
        return f"{total} {match[3]} {match[4]}"
    return f"{bare}{_added(Fraction(quarters), unit)}"


def _quarters(number: str, sign: str, unit: str) -> Fraction:
    """A number of quarter turns, exactly."""
    if unit == "deg":
        value = Fraction(number) / 90
    elif number == "0":
        value = Fraction(0)
    else:
        factor, _, divisor = number.partition("pi")
        value = Fraction(int(factor.removesuffix("*") or 1), int(divisor.removeprefix("/") or 1)) * 2
    return -value if sign == "-" else value


def _amount(quarters: Fraction, unit: str) -> str:
    """A number of quarter turns within half a turn, as text."""
    quarters = (quarters + 2) % 4 - 2
    if quarters == -2:
        quarters = Fraction(2)
    if quarters == 0:
        return "0"
    if unit == "deg":
        return _decimal(quarters * 90)
    half = quarters / 2
    factor = {1: "", -1: "-"}.get(half.numerator, f"{half.numerator}*")
    return f"{factor}pi{'' if half.denominator == 1 else f'/{half.denominator}'}"


def _added(quarters: Fraction, unit: str) -> str:
    amount = _amount(quarters, unit)
    if amount == "0":
        return ""
    return f" - {amount[1:]}" if amount.startswith("-") else f" + {amount}"


def _decimal(value: Fraction) -> str:
    """A terminating decimal."""
    if value.denominator == 1:
        return str(value.numerator)
    digits = 0
    while (value * 10**digits).denominator != 1:
        digits += 1
    whole, rest = divmod(abs(value * 10**digits).numerator, 10**digits)
    return f"{'-' if value < 0 else ''}{whole}.{rest:0{digits}d}"
