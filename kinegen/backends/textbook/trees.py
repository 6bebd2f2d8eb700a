"""The ordered trees of printed forms: sums of terms of factors, their names, and their order in print."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import fields, is_dataclass
from fractions import Fraction
from typing import Any

import sympy as sp

from kinegen.derive.transforms import FrameName
from kinegen.model.expression_values import Dimension
from kinegen.model.robot import Robot, frame_label
from kinegen.support.dataclass import dataclass

_LONGEST = 12
"""Places of a decimal that is better than a fraction, however short that is."""

_PLACES = 60
"""The most places of a decimal that is better than a fraction which is as long."""


def finite_decimal(value: Fraction) -> str:
    """Return a number as a decimal; nothing if it is an integer, or shorter as a fraction and has many places."""
    denominator = value.denominator
    places = next((n for n in range(1, _PLACES + 1) if 10**n % denominator == 0), 0)
    if not places or denominator == 1:
        return ""
    whole, rest = divmod(abs(value.numerator) * 10**places // denominator, 10**places)
    digits = f"{'-' if value < 0 else ''}{whole}.{rest:0{places}}"
    return digits if places <= _LONGEST or len(digits) <= len(str(value)) else ""


def is_small_part(value: Fraction) -> bool:
    """Return whether a number is made of a few halves or quarters, such as 3/2, or is a fifth."""
    return (value.denominator in (2, 4) and abs(value.numerator) < 10) or value == Fraction(1, 5)


@dataclass(frozen=True, slots=True)
class Symbol:
    """A name with its kind: `parameter`, `joint` (q3), `sine` or `cosine` (of an angle label)."""

    name: str
    kind: str


@dataclass(frozen=True, slots=True)
class Ratio:
    """A positive rational number.

    `value`: the number. `is_length`: whether it is a length of the table, or of several rows of it, and is printed as a
    decimal.
    """

    value: Fraction
    is_length: bool = False


@dataclass(frozen=True, slots=True)
class Pi:
    """The number pi."""


@dataclass(frozen=True, slots=True)
class Root:
    """A square root."""

    inside: Sum


@dataclass(frozen=True, slots=True)
class Power:
    """A factor to an integer power other than 0 and 1."""

    base: Factor
    exponent: int


@dataclass(frozen=True, slots=True)
class Function:
    """A function of constants that has no shorter form, such as `cos(pi/7)` or `atan2(1, 2)`, or an absolute value."""

    name: str
    arguments: tuple[Sum, ...]


@dataclass(frozen=True, slots=True)
class Term:
    """A product with a sign; no factors mean 1."""

    sign: int
    factors: tuple[Factor, ...]


@dataclass(frozen=True, slots=True)
class Sum:
    """Terms in order; none mean 0."""

    terms: tuple[Term, ...]


Factor = Symbol | Ratio | Pi | Root | Power | Function | Sum


_TAKEN = re.compile(r"[cs]_?[um]?\d+(_?m?\d+)*|q_?\d+|r[123]{2}|p[xyz]")
"""What a printout calls sines, cosines, joint variables and entries, with or without the underscore of an index."""

_JOINTS = re.compile(r"[um]?\d+(_?m?\d+)*")
"""The label of an angle that has joint variables in it, or a number of its own."""

_LETTERS = re.compile(r"(?:alpha|beta|gamma)(?![a-z])")
"""Angles that books shorten to one letter: `ca1` is the cosine of alpha1."""


def printed_name(name: str) -> str:
    """Return what a printout calls a parameter: its name, or `s23_` where `s23` would be taken for a sine.

    No file can spell such a name, so it is still the parameter's own.
    """
    return f"{name}_" if _TAKEN.fullmatch(name) else name


def transform_name(start: FrameName, end: FrameName) -> str:
    """Return `base_T_tool`, or `3T6` between rows."""
    numeric = str(start).isdecimal() and str(end).isdecimal()
    return f"{start}T{end}" if numeric else f"{frame_label(start)}_T_{frame_label(end)}"


def short_angle(name: str) -> str:
    """Return what stands behind the c or s of a parameter that is an angle: `a1` for `alpha1`."""
    return _LETTERS.sub(lambda match: match[0][0], name, count=1)


def is_parameter(label: str) -> bool:
    """Return whether the label of an angle is the name of a parameter."""
    return _JOINTS.fullmatch(label) is None


def angle_name(angle: sp.Expr, robot: Robot) -> str:
    """The name of an angle that is a parameter, for its sine and cosine; empty where they would not be unmistakable."""
    names = [parameter.name for parameter in robot.parameters]
    angles = [parameter.name for parameter in robot.parameters if parameter.dimension is Dimension.ANGLE]
    if not angle.is_Symbol or angle.name not in names:
        return ""
    short = short_angle(angle.name)
    pair = {f"c{short}", f"s{short}"}
    others = [short_angle(name) for name in angles if name != angle.name]
    is_clear = pair.isdisjoint(names) and short not in others and not any(map(_TAKEN.fullmatch, pair))
    return str(angle.name) if is_clear else ""


def label_order(label: str) -> tuple[bool, bool, int, str]:
    """Return the order in which angles are listed: single joints, short sums, long sums, others, and parameters."""
    return is_parameter(label), label.startswith("u"), len(label), label


def names_of(factors: Iterable[Factor], kinds: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names of some kinds among factors."""
    return tuple(factor.name for factor in factors if isinstance(factor, Symbol) and factor.kind in kinds)


def symbols_in(record: Any) -> Iterator[Symbol]:
    """Yield the symbols of a tree, or of a tuple of trees."""
    if isinstance(record, Symbol):
        yield record
    elif isinstance(record, tuple):
        for each in record:
            yield from symbols_in(each)
    elif is_dataclass(record):
        for field in fields(record):
            yield from symbols_in(getattr(record, field.name))


def factor_key(factor: Factor) -> tuple[int, tuple[tuple[int, ...], str], int]:
    """Order numbers, then lengths and joint variables, then sines and cosines by joint, then brackets."""
    match factor:
        case Symbol(name, "sine" | "cosine"):
            return 4, _joint_order(name), factor.kind == "sine"
        case Symbol(name, "joint"):
            return 3, ((int(name[1:]),), name), 0
        case Symbol(name):
            return 2, ((), name), 0
        case Sum():
            return 6, ((), str(factor)), 0
        case Power(base, exponent):
            rank, place, _ = factor_key(base)
            return rank, place, exponent
        case Ratio():
            return 0, ((), ""), 0
    return 1, ((), str(factor)), 0


def term_key(term: Term) -> tuple[object, ...]:
    """Order brackets first, then many sines and cosines before few, then by names; the sign does not count."""
    trigonometric = [f for f in term.factors if isinstance(f, Symbol) and f.kind in ("sine", "cosine")]
    brackets = sum(isinstance(factor, Sum) for factor in term.factors)
    angles = tuple((*_joint_order(symbol.name), symbol.kind == "sine") for symbol in trigonometric)
    return (
        -brackets,
        -len(trigonometric),
        names_of(term.factors, ("parameter", "joint")),
        tuple(symbol.kind == "sine" for symbol in trigonometric),
        angles,
        str(term.factors),
    )


def _joint_order(label: str) -> tuple[tuple[int, ...], str]:
    """Return the joints in an angle; none in one that is a parameter."""
    if is_parameter(label):
        return (), label
    digits = label.replace("m", "").replace("u", "").split("_")
    return tuple(int(part) for part in (digits if len(digits) > 1 else digits[0])), label
