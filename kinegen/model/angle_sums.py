"""Angle sums and their short names: `23` for q2 + q3, `2m3` for q2 - q3, as textbooks write c23.

Joints ascend and are counted from 1 by their place in the joint vector; from ten joints on they are joined by `_`
(`1_12`, never `112`).
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import field
from fractions import Fraction

from kinegen.support.dataclass import dataclass

COMPACT_DOF = 9
"""Up to this many joints a number is one digit, and digits can stand side by side."""


@dataclass(frozen=True, slots=True)
class Angle:
    """A linear combination of joint variables, and what else stands in it.

    Attributes:
        terms: Joint numbers from 1, ascending, each with its coefficient.
        rest: Constants and runtime parameters as text; empty if there are none.
    """

    terms: tuple[tuple[int, Fraction], ...]
    rest: str = ""

    def plus(self, other: Angle, sign: int) -> Angle:
        """This angle plus or minus another one."""
        sums = dict(self.terms)
        for joint, coefficient in other.terms:
            sums[joint] = sums.get(joint, Fraction(0)) + sign * coefficient
        terms = tuple(sorted((joint, coefficient) for joint, coefficient in sums.items() if coefficient))
        return Angle(terms, _joined(self.rest, "+" if sign > 0 else "-", other.rest))

    def times(self, factor: Fraction) -> Angle:
        """This angle times a number."""
        terms = tuple((joint, coefficient * factor) for joint, coefficient in self.terms)
        return Angle(terms, f"{float(factor):.6g}*({self.rest})" if self.rest else "")

    def __str__(self) -> str:
        return self.text(lambda joint: f"q{joint}")

    def text(self, name: Callable[[int], str]) -> str:
        """As people write it, with a name for each variable by its number from 1."""
        text = ""
        for joint, coefficient in self.terms:
            size = "" if abs(coefficient) == 1 else f"{_short(abs(coefficient))}*"
            text = _joined(text, "-" if coefficient < 0 else "+", f"{size}{name(joint)}")
        return _joined(text, "+", self.rest) or "0"


def _short(ratio: Fraction) -> str:
    """Write `2/3` and `0.5` as people do, and a long fraction as a decimal."""
    decimal = f"{float(ratio):.6g}"
    return decimal if Fraction(decimal) == ratio or ratio.denominator > 999 else str(ratio)


def _joined(left: str, sign: str, right: str) -> str:
    if not right:
        return left
    if right.startswith("-"):
        sign, right = ("-" if sign == "+" else "+"), right[1:]
    if not left:
        return right if sign == "+" else f"-{right}"
    return f"{left} {sign} {right}"


def _is_numbered(label: str) -> bool:
    return label.startswith("u") and label[1:].isdecimal()


@dataclass(slots=True)
class AngleLabels:
    """Gives each angle of one robot a short name of its own."""

    dof: int
    _given: dict[Hashable, str] = field(default_factory=dict)

    def label(self, angle: Angle, identity: Hashable, name: str = "") -> str:
        """Return the short name of an angle; one that is no plain sum of joints is called `u1`, `u2`, ...

        `identity` is what tells it from all others, which its text may not; `name` is what it is called instead, unless
        another one has that name.
        """
        if identity not in self._given:
            label = name or self._plain(angle)
            if label is None or label in self._given.values():
                label = f"u{sum(map(_is_numbered, self._given.values())) + 1}"
            self._given[identity] = label
        return self._given[identity]

    def _plain(self, angle: Angle) -> str | None:
        if angle.rest or not angle.terms or any(abs(coefficient) != 1 for _, coefficient in angle.terms):
            return None
        separator = "" if self.dof <= COMPACT_DOF else "_"
        return separator.join(f"{'m' if coefficient < 0 else ''}{joint}" for joint, coefficient in angle.terms)
