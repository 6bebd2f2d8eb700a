"""The determinant of the Jacobian and the places where it vanishes, as trees for printouts.

In: a robot and two frames. Out: products in the order of books, lengths before sines before brackets; long brackets
have names. What is computed is in `kinegen.derive.singularities`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fractions import Fraction

import sympy as sp

from kinegen.backends.textbook.closed_form import (
    ClosedForm,
    Factor,
    Power,
    Ratio,
    Reader,
    Sum,
    Symbol,
    Term,
    label_order,
    printed_chain,
)
from kinegen.backends.textbook.jacobian import jacobian_name
from kinegen.derive.singularities.loci import Factor as LociFactor
from kinegen.derive.singularities.loci import Loci, Minor, chain_screws, singular_loci
from kinegen.derive.singularities.singular_points import meanings
from kinegen.derive.singularities.trigonometric_polynomials import MOST_TERMS, operations
from kinegen.derive.transforms import FrameName
from kinegen.model.angle_sums import AngleLabels
from kinegen.model.outputs import Reference
from kinegen.model.robot import Robot, frame_label
from kinegen.support.dataclass import dataclass

_ROWS = 6
"""Rows of a Jacobian."""

LONG = 15
"""A bracket with more operations gets a name."""

_LONG_INTEGER = 10**9
"""Larger ones come of lengths with many decimals, whose common denominator was taken out."""

MOST_LISTED = 40
"""Of more minors only what all have in common is printed."""

MOST_SETS = 12
"""So many sets of factors that vanish together are printed at most."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a Jacobian is singular.

    `zeros`: expressions that vanish there together. `words`: what the arm looks like there; empty where that is not
    known.
    """

    zeros: tuple[Sum, ...]
    words: str


@dataclass(frozen=True, slots=True)
class LociForm:
    """Determinant and singular places of a Jacobian, for people.

    Attributes:
        name: The Jacobian, such as `base_J_tool`.
        rows: Which rows of it count, in words; empty for the determinant of all six.
        determinant: Its determinant, or of several minors what all of them share; None if it is too long.
        minors: What is left of each minor, with what the minor leaves out; none if there is one determinant.
        unlisted: How many minors there are, if these are too many, or one of them is too long, to be printed; else 0.
        long: Names of long brackets, and what they stand for.
        rank: Its rank away from these places.
        partial: Whether it is its rows that are singular there, because others are left out that do not vanish.
        places: Where it is singular.
        closing: What else there is to say about these places; empty if nothing.
        values: The determinant, or the minors in order, without names for brackets; None if it is too long.
        angles: Label and angle of every sine and cosine that occurs.
    """

    name: str
    rows: str
    determinant: Sum | None
    minors: tuple[tuple[str, Sum], ...]
    unlisted: int
    long: tuple[tuple[str, Sum], ...]
    rank: int
    partial: bool
    places: tuple[Place, ...]
    closing: str
    values: ClosedForm | None
    angles: tuple[tuple[str, Sum], ...]


def loci_form(robot: Robot, start: FrameName, end: FrameName, labels: AngleLabels | None = None) -> LociForm:
    """Factor the determinant of a Jacobian for a printout.

    Args:
        robot: The robot; its parameters stay symbols.
        start: The frame that counts as being at rest, by name or row number; usually the base.
        end: The frame that moves.
        labels: Names of angles, to be shared by forms that are printed together.

    Raises:
        KinegenError: If a frame does not exist, no joint moves it, or its Jacobian has too many minors.
    """
    loci = singular_loci(robot, start, end)
    writer = _Writer(robot, labels, printed_chain(robot, start, end).places)
    shared = loci.common.factors if loci.common else ()
    # Of too many minors, or too long ones, only what they share and where they vanish is told.
    sets, closing = _sets(loci)
    unlisted = loci.missing if loci.missing > 1 else len(loci.minors) if len(loci.minors) > MOST_LISTED else 0
    if unlisted and not loci.missing:
        beyond = "It is also singular" if any(len(some) == 1 for some in sets) else "It is singular"
        closing = f"Its {unlisted} minors are not printed. {beyond} where all of them vanish together."
    words = meanings(robot, chain_screws(robot, start, end), loci, sets, f"the origin of {_frame(end)}")
    determinant = None if loci.common is None else writer.product(loci.common.constant, shared)
    places = tuple(Place(tuple(map(writer.zero, some)), text) for some, text in zip(sets, words, strict=True))
    listed = () if unlisted else loci.minors
    minors = tuple((_left_out(robot, loci, each), writer.product(each.constant, each.factors)) for each in listed)
    return LociForm(
        name=jacobian_name(start, end, Reference.LOCAL_WORLD_ALIGNED),
        rows=_rows(robot, loci, start),
        determinant=determinant,
        minors=minors,
        unlisted=unlisted,
        long=tuple(writer.long.values()),
        rank=loci.rank,
        partial=loci.partial,
        places=places,
        closing=closing,
        values=_values(writer, f"{frame_label(start)}_D_{end}", loci),
        angles=writer.angles(),
    )


def _sets(loci: Loci) -> tuple[tuple[tuple[sp.Expr, ...], ...], str]:
    """Return the sets that are printed, and what is said of the others."""
    if loci.missing:
        what = "It" if loci.missing == 1 else f"One of its {loci.missing} minors"
        return (), f"{what} has a factor of more than {MOST_TERMS} terms, which is not printed."
    # More joints than directions are always dependent, which is no singular place.
    if loci.sets == () and loci.rank < min(_ROWS, len(loci.joints)):
        return (), f"Its rank is at most {loci.rank} everywhere, and nowhere less."
    if loci.sets == ():
        return (), "It is singular nowhere."
    known = tuple(sorted(loci.sets or (), key=lambda each: _order(each, loci.joints)))
    short = known if not loci.minors else tuple(each for each in known if all(operations(e) <= LONG for e in each))
    if loci.sets is None or len(short) < len(known) or len(short) > MOST_SETS:
        return short[:MOST_SETS], "It is singular where all minors vanish together."
    return short, ""


def _order(zeros: tuple[sp.Expr, ...], joints: tuple[str, ...]) -> tuple[int, int, list[int]]:
    """Order single factors first, short ones before long ones, then by joints."""
    found = [joints.index(each.name) for zero in zeros for each in zero.free_symbols if each.name in joints]
    return len(zeros), sum(map(operations, zeros)), sorted(found)


def _rows(robot: Robot, loci: Loci, start: FrameName) -> str:
    if loci.rank == _ROWS:
        return ""
    first = {"", str(start)} | ({"0", robot.root} if not robot.base else set())
    axes = "" if loci.axes in first else f" in the axes of {_frame(loci.axes)}"
    axes = axes if loci.axes else " in axes in which all others vanish"
    point = f", for the point of {_frame(loci.point)}" if len(loci.rows) > loci.rank and loci.point else ""
    return f"rows {', '.join(loci.rows)}{axes}{point}"


def _frame(name: FrameName) -> str:
    return f"frame {frame_label(name)}"


def _left_out(robot: Robot, loci: Loci, minor: Minor) -> str:
    """Return what a minor leaves out: joints by number, or rows."""
    numbers = {variable.name: f"q{variable.index + 1}" for variable in robot.variables}
    left = [numbers[joint] for joint in loci.joints if joint not in minor.joints]
    return ", ".join([*left, *(row for row in loci.rows if row not in minor.rows)])


def _values(writer: _Writer, name: str, loci: Loci) -> ClosedForm | None:
    """Return the determinant, or all minors, as a form with one column."""
    if loci.common is None or loci.missing:
        return None
    rows = [
        writer.product(loci.common.constant * each.constant, (*loci.common.factors, *each.factors), named=False)
        for each in loci.minors
    ]
    rows = rows or [writer.product(loci.common.constant, loci.common.factors, named=False)]
    return ClosedForm(
        name=name,
        entries=tuple((row,) for row in rows),
        angles=writer.angles(),
        joints=tuple(sorted(writer.reader.joints.items())),
        kind="D",
    )


class _Writer:
    """Writes products, and names long brackets."""

    def __init__(self, robot: Robot, labels: AngleLabels | None, places: Mapping[str, int]) -> None:
        self.reader = Reader(robot, labels, places)
        self.taken = {parameter.name for parameter in robot.parameters}
        self.long: dict[sp.Expr, tuple[str, Sum]] = {}

    def angles(self) -> tuple[tuple[str, Sum], ...]:
        """Return the label and angle of every sine and cosine so far."""
        return tuple(sorted(self.reader.angles.items(), key=lambda item: label_order(item[0])))

    def zero(self, expression: sp.Expr) -> Sum:
        """Return an expression that vanishes: its sign does not matter."""
        return self.product(sp.S.One, (LociFactor(expression, 1),), is_zero=True)

    def product(
        self, constant: sp.Rational, factors: Iterable[LociFactor], *, named: bool = True, is_zero: bool = False
    ) -> Sum:
        """Return a product in the order of books."""
        number = Fraction(int(constant.p), int(constant.q))
        sign, found = (-1 if number < 0 else 1), list[Factor]()
        number = abs(number)
        for each in factors:
            scale = _scale(each.expression)
            expression = sp.expand(each.expression / scale) if scale > 1 else each.expression
            number *= scale**each.power
            tree = self._named(expression) if named else self.reader.sum(expression)
            if len(tree.terms) > 1:
                turned = tree.terms[0].sign
                sign *= turned**each.power
                tree = Sum(tuple(Term(turned * term.sign, term.factors) for term in tree.terms))
                found.append(Power(tree, each.power) if each.power > 1 else tree)
                continue
            sign *= tree.terms[0].sign ** each.power
            for factor in tree.terms[0].factors:
                if isinstance(factor, Ratio):
                    number *= factor.value**each.power
                else:
                    found.append(Power(factor, each.power) if each.power > 1 else factor)
        if is_zero and len(found) == 1 and isinstance(found[0], Sum):
            return found[0]
        ratio = [Ratio(number)] if number != 1 and not is_zero else []
        return Sum((Term(1 if is_zero else sign, (*ratio, *sorted(found, key=_place))),))

    def _named(self, expression: sp.Expr) -> Sum:
        if operations(expression) <= LONG:
            return self.reader.sum(expression)
        if expression not in self.long:
            name = f"F{len(self.long) + 1}"
            while name in self.taken:
                name += "_"
            self.long[expression] = (name, self.reader.sum(expression))
        return Sum((Term(1, (Symbol(self.long[expression][0], "parameter"),)),))


def _scale(expression: sp.Expr) -> int:
    """Return the power of ten that takes integers of many digits to lengths; 1 where none are so long."""
    largest = max((abs(int(each)) for each in expression.atoms(sp.Integer)), default=1)
    return 10 ** (len(str(largest)) - 1) if largest >= _LONG_INTEGER else 1


def _place(factor: Factor) -> tuple[int, tuple[int, str]]:
    """Order lengths, joint variables, sines and cosines, then brackets; sums of angles after single ones."""
    base = factor.base if isinstance(factor, Power) else factor
    match base:
        case Symbol(name, "sine" | "cosine"):
            return 2, (len(name), name)
        case Symbol(name, "joint"):
            return 1, (len(name), name)
        case Symbol(name):
            return (4 if name.startswith("F") and name[1:].isdecimal() else 0), (0, name)
        case Sum():
            return 3, (len(base.terms), "")
    return 0, (0, "")
