"""Numbers and expressions of a robot file as text: what is written where a number changed."""

from __future__ import annotations

import math
import re
from decimal import Decimal

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\Z")
_TAIL = re.compile(r"(?P<head>.*[\w)])\s+(?P<sign>[+-])\s+(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\Z")


def places_for(resolution: float) -> int:
    """Decimal places that lose less than a hundredth of a resolution."""
    return max(0, 2 + math.ceil(-math.log10(max(resolution, 1e-30))))


def moved(text: str, change: float, places: int) -> str:
    """The text of a number or an expression after a change.

    Args:
        text: As in the file, such as `0.4318`, `a2` or `q - 90`.
        change: What is added to it.
        places: Decimal places to write.

    Returns:
        `0.4321`, `a2 + 0.0003` or `q - 89.98`; the text itself if the change is nothing.
    """
    step = round(Decimal(change), places)
    if not step:
        return text
    if _NUMBER.match(text):
        return plain(round(Decimal(text) + Decimal(change), places))
    tail = _TAIL.match(text)
    if tail:
        number = Decimal(tail["number"]) * (1 if tail["sign"] == "+" else -1)
        text, step = tail["head"], round(number + Decimal(change), places)
    return f"{text} {'-' if step < 0 else '+'} {plain(abs(step))}" if step else text


def summed(text: str, other: str, sign: int) -> str:
    """The text of a sum or difference of two texts."""
    if _NUMBER.match(text) and _NUMBER.match(other):
        return plain(Decimal(text) + sign * Decimal(other))
    if _NUMBER.match(other) and not Decimal(other):
        return text
    operator = "+" if sign > 0 else "-"
    return f"{text} {operator} ({other})"


def is_zero(text: str) -> bool:
    """Whether a text is the number zero."""
    return bool(_NUMBER.match(text)) and not Decimal(text)


def plain(number: Decimal) -> str:
    """A decimal without exponent and without zeros at its end."""
    text = f"{number:f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if text in ("-0", "") else text
