"""Decimal text -> exact numbers: which were meant to be something else, and how far that moves a tip.

A number is only as exact as it was printed. An angle is taken as the multiple of 15 degrees beside it if it is that
multiple rounded to its own last printed digit, with two or more decimals; or, with four or more, if it differs by at
most one unit of that digit, as truncated numbers do; or if both read as the same double. With two more decimals the
same is true of multiples of one degree. The tail of a float, as in 0.34000000000000002, becomes the shortest decimal
that reads as the same double. Everything else is kept; what is nearly special is reported with an upper bound on its
effect, by lengths along the chain.
"""

from __future__ import annotations

import math
import re
from fractions import Fraction

from kinegen.errors import quote
from kinegen.io.format import Finding
from kinegen.io.link_tree.records import Joint, LinkTree, Motion
from kinegen.io.link_tree.structure import Part
from kinegen.io.messages import fail
from kinegen.model.expression_parser import PI, Expression, Number, evaluate, multiply
from kinegen.model.expression_values import FLOAT64
from kinegen.model.robot import Step
from kinegen.support.dataclass import dataclass

_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?\Z")
_LONGEST = 60
_SMALLEST, _HUGEST = -64, 400
"""Powers of ten. Smaller numbers are zero in any kernel; a larger one is not even a double."""

LARGEST = Fraction(10**12)
_TAIL = 16
"""Significant digits from which on a float may have been printed with more than it holds."""

PI_DIGITS = Fraction("3.14159265358979323846264338327950288419716939937510582097494")
GRID = Fraction(1, 12)
"""15 degrees, as a share of pi."""

_FINE = Fraction(1, 180)
_COARSE_UNIT, _FINE_UNIT = Fraction(1, 100), Fraction(1, 10000)
"""The largest last digits for which a multiple of 15 degrees, or of one degree, is not a coincidence, if rounded."""

_TRUNCATED = Fraction(1, 100)
"""How much smaller they have to be for truncation: 3.1415 is half a turn, and 3.141 may be anything."""

NEAR_ANGLE = Fraction(1, 1000)
NEAR_LENGTH = Fraction(1, 10**6)
NOISE_LENGTH = Fraction(1, 10**9)


@dataclass(frozen=True, slots=True)
class Printed:
    """A number as it is printed.

    Attributes:
        value: Its exact value, without the tail of a float.
        unit: One unit of its last printed digit.
        tail: Whether a tail was taken off.
    """

    text: str
    value: Fraction
    unit: Fraction
    tail: bool = False


def printed(text: str, *, keep: bool = False, largest: Fraction | None = LARGEST) -> Printed:
    """Read decimal digits, perhaps with an exponent; `keep` keeps the tail of a float.

    Raises:
        RobotFileError: If it is not a finite number, or beyond `largest`.
    """
    if text.lower().lstrip("+-") in ("nan", "inf", "infinity"):
        fail(f"{quote(text)} is not a finite number")
    if _NUMBER.match(text) is None or len(text) > _LONGEST:
        fail(f"{quote(text)} is not a number")
    # Exponents are bounded before an exact number is made of them.
    power = int(text.lower().partition("e")[2] or "0")
    if power > _HUGEST:
        fail(f"the number {quote(text)} is out of bounds")
    if power < _SMALLEST:
        return Printed(text, Fraction(0), Fraction(1, 10**-_SMALLEST), tail=Fraction(text) != 0)
    exact = Fraction(text)
    if largest is not None and abs(exact) > largest:
        fail(f"the number {quote(text)} is too large (at most 1e12)")
    if abs(exact) > LARGEST:
        return Printed(text, exact, unit_of(text))
    # A float that was printed with more digits than it holds means the shortest decimal.
    shortest = repr(float(exact))
    if not keep and _digits(text) >= _TAIL and _digits(shortest) < _digits(text):
        return Printed(text, Fraction(shortest), unit_of(shortest), Fraction(shortest) != exact)
    return Printed(text, exact, unit_of(text))


def grid_angle(number: Printed, snap: float | None) -> Fraction | None:
    """Return the share of pi that an angle in radians stands for, if its digits or `snap` say so."""
    value = number.value
    if not value:
        return None
    share = _nearest(value, GRID)
    gap = abs(value - share * PI_DIGITS)
    if snap is not None and gap <= Fraction(snap):
        return share
    if share and _is_meant(number, share, gap, _COARSE_UNIT):
        return share
    share = _nearest(value, _FINE)
    return share if share and _is_meant(number, share, abs(value - share * PI_DIGITS), _FINE_UNIT) else None


def near_angle(number: Printed) -> Fraction | None:
    """Return the multiple of 15 degrees, as a share of pi, that an angle in radians is suspiciously near to."""
    share = _nearest(number.value, GRID)
    gap = abs(number.value - share * PI_DIGITS)
    return share if number.value and 0 < gap < NEAR_ANGLE else None


def angle(share: Fraction) -> Expression:
    """Return a share of pi as an expression."""
    return multiply(Number(share), PI)


def angle_text(share: Fraction) -> str:
    """Return a share of pi for people: `pi/2`, `-2*pi/3`."""
    if not share:
        return "0"
    sign, top = "-" if share < 0 else "", abs(share.numerator)
    turn = "pi" if top == 1 else f"{top}*pi"
    return f"{sign}{turn}" if share.denominator == 1 else f"{sign}{turn}/{share.denominator}"


def decimal_text(value: Fraction) -> str:
    """Return a decimal fraction for people, all its digits."""
    shown = repr(float(value))
    return shown if Fraction(shown) == value else f"{float(value):.17g}"


def _nearest(value: Fraction, grid: Fraction) -> Fraction:
    return round(value / (grid * PI_DIGITS)) * grid


def _is_meant(number: Printed, share: Fraction, gap: Fraction, largest: Fraction) -> bool:
    if float(number.value) == float(share) * math.pi:
        return True
    rounded = number.unit <= largest and gap <= number.unit / 2
    return rounded or (number.unit <= largest * _TRUNCATED and gap <= number.unit)


def _digits(text: str) -> int:
    mantissa = text.lower().partition("e")[0].lstrip("+-0.")
    return len(mantissa.replace(".", ""))


def unit_of(text: str) -> Fraction:
    """Return one unit of the last digit of a number, as printed."""
    mantissa, _, exponent = text.lower().partition("e")
    return Fraction(10) ** (int(exponent or "0") - len(mantissa.partition(".")[2]))


def findings(tree: LinkTree, part: Part) -> tuple[Finding, ...]:
    """Return the findings about the joints of a part, in the order of the file."""
    arms = _arms(part)
    found = [suspect for suspect in tree.suspects if suspect.joint in arms]
    return tuple(
        Finding(
            suspect.line,
            suspect.where,
            suspect.text,
            suspect.exact,
            suspect.digits,
            # An axis that tilts moves what it turns twice: once before the turn, once after it.
            suspect.gap * (arms[suspect.joint] * (2 if "axis" in suspect.where else 1) if suspect.turns else 1.0),
            suspect.changed,
        )
        for suspect in sorted(found, key=lambda each: each.line)
    )


def _arms(part: Part) -> dict[str, float]:
    """Return an upper bound on the distance from each joint to the tips behind it, by name of the joint."""
    beyond: dict[str, float] = dict.fromkeys(part.links, 0.0)
    # A slide without limits moves as far as the robot is long, like in every proof.
    usual = sum(_length((*joint.origin, *joint.after)) for joint in part.joints) or 1.0
    arms: dict[str, float] = {}
    for joint in reversed(part.joints):
        arms[joint.name] = _stroke(joint, usual) + _length(joint.after) + beyond[joint.child]
        beyond[joint.parent] = max(beyond[joint.parent], arms[joint.name] + _length(joint.origin))
    return arms


def _length(steps: tuple[Step, ...]) -> float:
    return sum(abs(_float(step.value)) for step in steps if not step.kind.is_rotation)


def _stroke(joint: Joint, usual: float) -> float:
    if joint.motion is not Motion.PRISMATIC:
        return 0.0
    if joint.limits is None:
        return usual
    return max(abs(_float(limit)) for limit in joint.limits)


def _float(expression: Expression) -> float:
    return float(evaluate(expression, {}, FLOAT64))
