"""The angles of an orientation as formulas: arc tangents of the entries of the rotation that they take.

The formulas are those of books, for poses in which they are not singular; the kernels of the same names also hold
where they are. Entries that are short stand in the formulas, long ones are defined below.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from math import isqrt

from kinegen.backends.textbook.closed_form import (
    ClosedForm,
    Factor,
    Function,
    Pi,
    Power,
    Ratio,
    Root,
    Sum,
    Symbol,
    Term,
    closed_form,
)
from kinegen.backends.textbook.trees import symbols_in
from kinegen.derive.transforms import FrameName
from kinegen.model.angle_sums import AngleLabels
from kinegen.model.outputs import Kind
from kinegen.model.robot import Robot, frame_label

ANGLES = {
    Kind.RPY_ZYX: ("roll", "pitch", "yaw"),
    Kind.RPY_XYZ: ("roll", "pitch", "yaw"),
    Kind.EULER_ZYZ: ("phi", "theta", "psi"),
}
"""What the angles are called, in the order of the kernels."""

WORDS = {
    Kind.RPY_ZYX: "where the rotation is Rz(yaw) Ry(pitch) Rx(roll)",
    Kind.RPY_XYZ: "where the rotation is Rx(roll) Ry(pitch) Rz(yaw)",
    Kind.EULER_ZYZ: "where the rotation is Rz(phi) Ry(theta) Rz(psi)",
}
"""What the angles are."""

_SHORT = 2
"""An entry of one term with so many factors stands in the formula itself, if its brackets have so many terms."""

_ONE = Sum((Term(1, ()),))


def orientation_form(
    robot: Robot, start: FrameName, end: FrameName, kind: Kind, labels: AngleLabels | None = None
) -> ClosedForm:
    """Write the angles of the rotation between two frames.

    Args:
        robot: The robot; its parameters stay symbols.
        start: Frame of reference, by name or row number.
        end: Frame that is reached.
        kind: Which angles, a key of `ANGLES`.
        labels: Names of angles, to be shared by forms that are printed together.

    Raises:
        KinegenError: If a frame does not exist.
    """
    pose = closed_form(robot, start, end, labels)
    entries = _Entries(pose)
    values = _values(entries, kind)
    # A parameter that is called as an angle keeps its name.
    taken = {parameter.name for parameter in robot.parameters}
    names = {name: f"{name}_" if name in taken else name for name in ANGLES[kind]}
    met = {each.name for each in symbols_in((values, tuple(entries.long.items()))) if each.kind in ("sine", "cosine")}
    return replace(
        pose,
        name=f"{frame_label(start)}_A_{end}",
        entries=tuple((value,) for value in values),
        angles=tuple((label, angle) for label, angle in pose.angles if label in met),
        definitions=tuple(entries.long.items()),
        kind="A",
        names=tuple(names.values()),
        words=re.sub("|".join(names), lambda found: names[found[0]], WORDS[kind]),
    )


def _values(entries: _Entries, kind: Kind) -> tuple[Sum, Sum, Sum]:
    """The three angles; where two of them always turn about one axis, the one that the kernels set to zero is zero."""
    one, minus = entries.of, entries.negative
    match kind:
        case Kind.RPY_ZYX:
            middle = entries.latitude(minus(3, 1), (1, 1), (2, 1))
            if entries.vanish((1, 1), (2, 1)):
                return Sum(()), middle, _arc(minus(1, 2), one(2, 2))
            return _arc(one(3, 2), one(3, 3)), middle, _arc(one(2, 1), one(1, 1))
        case Kind.RPY_XYZ:
            middle = entries.latitude(one(1, 3), (1, 1), (1, 2))
            if entries.vanish((1, 1), (1, 2)):
                return _arc(one(3, 2), one(2, 2)), middle, Sum(())
            return _arc(minus(2, 3), one(3, 3)), middle, _arc(minus(1, 2), one(1, 1))
    is_level = entries.vanish((3, 3))
    middle = _arc(_ONE if is_level else entries.length((1, 3), (2, 3)), one(3, 3))
    if entries.vanish((1, 3), (2, 3)):
        return _arc(minus(1, 2), one(2, 2)), middle, Sum(())
    return _arc(one(2, 3), one(1, 3)), middle, _arc(one(3, 2), minus(3, 1))


class _Entries:
    """The entries of a rotation, by name where they are long."""

    def __init__(self, pose: ClosedForm) -> None:
        self.rows = pose.entries
        self.long: dict[str, Sum] = {}

    def of(self, row: int, column: int) -> Sum:
        value = self.rows[row - 1][column - 1]
        if len(value.terms) < 2 and all(map(_is_short, value.terms)):
            return value
        self.long[f"r{row}{column}"] = value
        return _single(Symbol(f"r{row}{column}", "parameter"))

    def vanish(self, *places: tuple[int, int]) -> bool:
        """Return whether some entries are zero in every pose."""
        return not any(self.rows[row - 1][column - 1].terms for row, column in places)

    def negative(self, row: int, column: int) -> Sum:
        return Sum(tuple(Term(-term.sign, term.factors) for term in self.of(row, column).terms))

    def latitude(self, height: Sum, *places: tuple[int, int]) -> Sum:
        """Return the angle of a unit vector above the plane of two entries; of one in the plane it is zero."""
        return _arc(height, self.length(*places)) if height.terms else Sum(())

    def length(self, *places: tuple[int, int]) -> Sum:
        """Return the root of the sum of two squares; of c*f and s*f the factor f alone."""
        shared = _shared([self.of(*place) for place in places])
        if shared is not None:
            product = Sum((Term(1, shared),))
            return product if _is_number(product) else _single(Function("abs", (product,)))
        return _root([term for place in places for term in map(_square, self.of(*place).terms)])


def _shared(values: Sequence[Sum]) -> tuple[Factor, ...] | None:
    """Return the factors f of two products c*f and s*f with the cosine and the sine of one angle; None for others."""
    if any(len(value.terms) != 1 for value in values):
        return None
    one, other = (value.terms[0].factors for value in values)
    left = [factor for factor in one if factor not in other] + [factor for factor in other if factor not in one]
    match left:
        case [Symbol(name, first), Symbol(again, second)] if name == again and {first, second} == {"sine", "cosine"}:
            return tuple(factor for factor in one if factor in other)
    return None


def _is_number(value: Sum) -> bool:
    """Return whether a value is one term of numbers alone."""
    if len(value.terms) != 1:
        return False
    factors = value.terms[0].factors
    return all(isinstance(factor, (Ratio, Root)) and not tuple(symbols_in(factor)) for factor in factors)


def _is_short(term: Term) -> bool:
    brackets = [factor for factor in term.factors if isinstance(factor, Sum)]
    return len(term.factors) <= _SHORT and all(
        len(each.terms) <= _SHORT and not any(isinstance(part, Sum) for inner in each.terms for part in inner.factors)
        for each in brackets
    )


def _square(term: Term) -> Term:
    """Return the square of a product; that of its numbers is one number."""
    number, powers = Fraction(1), list[Factor]()
    for factor in term.factors:
        match factor:
            case Ratio(value):
                number *= value**2
            case Root(Sum((Term(1, (Ratio(value),)),))):
                number *= value
            case _:
                powers.append(Power(factor, 2))
    return Term(1, (*([Ratio(number)] if number != 1 else []), *powers))


def _root(squares: Sequence[Term]) -> Sum:
    """Return the root of a sum of squares; of numbers it is a number."""
    factors = [factor for term in squares for factor in term.factors]
    numbers = [factor.value for factor in factors if isinstance(factor, Ratio)]
    if len(numbers) < len(factors):
        return _single(Root(Sum(tuple(squares))))
    # The square of 1 has no factor.
    total = sum(numbers, Fraction(sum(not term.factors for term in squares)))
    roots = Fraction(isqrt(total.numerator), isqrt(total.denominator))
    if total == 0:
        return Sum(())
    if roots**2 != total:
        return _single(Root(_single(Ratio(total))))
    return _single(Ratio(roots)) if roots != 1 else _ONE


def _arc(y: Sum, x: Sum) -> Sum:
    """Return the angle of a point; that of a point on an axis is a number where the entries say so."""
    if not y.terms and _is_number(x):
        return Sum(()) if x.terms[0].sign > 0 else _single(Pi())
    if not x.terms and _is_number(y):
        return Sum((Term(y.terms[0].sign, (Ratio(Fraction(1, 2)), Pi())),))
    return _single(Function("atan2", (y, x)))


def _single(factor: Factor) -> Sum:
    return Sum((Term(1, (factor,)),))
