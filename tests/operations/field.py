"""Numbers modulo a prime, in which formulas are told apart."""

from __future__ import annotations

import random
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tests.operations.chain import Angle

P = 2305843009213693487
"""A prime that is 23 modulo 24, so that 2 and 3 have square roots, and 3 modulo 4, so that these are powers."""


@dataclass(frozen=True)
class Number:
    """A number of the field, and whether it is known before the joint variables are."""

    value: int
    is_constant: bool = False

    @property
    def is_unit(self) -> bool:
        """Whether it is 0, 1 or -1."""
        return self.value in (0, 1, P - 1)

    @property
    def size(self) -> int:
        """The same for a number and its negative."""
        return min(self.value, P - self.value)

    def __add__(self, other: Number) -> Number:
        return Number((self.value + other.value) % P, self.is_constant and other.is_constant)

    def __mul__(self, other: Number) -> Number:
        value = self.value * other.value % P
        return Number(value, not value or (self.is_constant and other.is_constant))

    def __neg__(self) -> Number:
        return Number(-self.value % P, self.is_constant)

    def times(self, sign: int) -> Number:
        """The same or its negative."""
        return self if sign > 0 else -self


Vector = tuple[Number, Number, Number]


@cache
def number(name: str) -> Number:
    """What a name stands for."""
    return Number(random.Random(name).randrange(2, P))


@cache
def length(text: str) -> Number:
    """A length; equal ones are equal, and no two others have a relation."""
    size = abs(float(text))
    found = Number(random.Random(f"length {size}").randrange(2, P) if size else 0, is_constant=True)
    return found if float(text) > 0 else -found


def _root(value: int) -> int:
    return pow(value, (P + 1) // 4, P)


_HALF = pow(2, -1, P)
_KNOWN = {
    0.0: (1, 0),
    30.0: (_root(3) * _HALF % P, _HALF),
    45.0: (_root(2) * _HALF % P, _root(2) * _HALF % P),
    60.0: (_HALF, _root(3) * _HALF % P),
}


@cache
def _circle(name: str) -> tuple[Number, Number]:
    """A random point of the unit circle."""
    t = random.Random(name).randrange(2, P)
    scale = pow(1 + t * t, -1, P)
    return Number((1 - t * t) * scale % P), Number(2 * t * scale % P)


def _constant(degrees: float) -> tuple[Number, Number]:
    quarters, rest = divmod(degrees % 360, 90)
    rest = round(rest, 9)
    if rest in _KNOWN:
        c, s = _KNOWN[rest]
        found = (Number(c, is_constant=True), Number(s, is_constant=True))
    else:
        acute = rest if rest <= 45 else 90 - rest
        x, y = _circle(f"degrees {acute:.9f}")
        found = (Number(x.value, is_constant=True), Number(y.value, is_constant=True))
        found = found if rest <= 45 else (found[1], found[0])
    for _ in range(int(quarters)):
        found = (-found[1], found[0])
    return found


@cache
def cosine_sine(angle: Angle) -> tuple[Number, Number]:
    """The cosine and sine of an angle, by the theorem of addition."""
    c, s = _constant(angle.degrees)
    for joint, sign in angle.joints:
        x, y = _circle(f"joint {joint}")
        y = y.times(sign)
        c, s = c * x + -(s * y), s * x + c * y
    return c, s
