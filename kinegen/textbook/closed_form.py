"""The readable closed form, factored as textbooks print it: `c1*(a2*c2 + a3*c23) - d3*s1`. It feeds no kernel.

In: a robot and two frames. Out: the entries of the transform as ordered trees, which `notation` prints. A factor or
term has its place by what it is, never by sympy's ordering: lengths before sines and cosines before brackets,
brackets first in a sum, and a positive term leads where there is one.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction

import sympy as sp

from kinegen.angles import Angle, AngleLabels
from kinegen.robot.model import Robot, frame_label
from kinegen.symbolic.chain import FrameName
from kinegen.symbolic.pose import transform

_TAKEN = re.compile(r"[cs]_?[um]?\d+(_?m?\d+)*|q_?\d+|r[123]{2}|p[xyz]")
"""What a printout calls sines, cosines, joint variables and entries, with or without the underscore of an index."""


@dataclass(frozen=True, slots=True)
class Symbol:
    """A name with its kind: `parameter`, `joint` (q3), `sine` or `cosine` (of an angle label)."""

    name: str
    kind: str


@dataclass(frozen=True, slots=True)
class Ratio:
    """A positive rational number."""

    value: Fraction


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


@dataclass(frozen=True, slots=True)
class ClosedForm:
    """A transform, or a Jacobian, for people.

    Attributes:
        name: Such as `base_T_tool`, `1T3` or `base_J_tool`.
        entries: Three rows of four entries; or six rows, one column for each joint variable.
        angles: Label and angle of every sine and cosine that occurs.
        joints: Number and joint name of every joint variable that occurs.
    """

    name: str
    entries: tuple[tuple[Sum, ...], ...]
    angles: tuple[tuple[str, Sum], ...]
    joints: tuple[tuple[int, str], ...]

    @property
    def is_transform(self) -> bool:
        """Whether the row 0 0 0 1 belongs below."""
        return len(self.entries) == 3


def closed_form(robot: Robot, start: FrameName, end: FrameName, labels: AngleLabels | None = None) -> ClosedForm:
    """Write a transform between two frames as a textbook would.

    Args:
        robot: The robot; its parameters stay symbols.
        start: Frame of reference, by name or row number.
        end: Frame that is reached.
        labels: Names of angles, to be shared by forms that are printed together.

    Returns:
        The entries of `start_T_end`, factored.

    Raises:
        KinegenError: If a frame does not exist.
    """
    matrix = transform(robot, start, end)
    reader = Reader(robot, labels)
    entries = tuple(tuple(reader.sum(matrix[row, column]) for column in range(4)) for row in range(3))
    return ClosedForm(
        name=transform_name(start, end),
        entries=entries,
        angles=tuple(sorted(reader.angles.items(), key=lambda item: label_order(item[0]))),
        joints=tuple(sorted(reader.joints.items())),
    )


def printed_name(name: str) -> str:
    """What a printout calls a parameter: its name, or `s23_` where `s23` would be taken for a sine.

    No file can spell such a name, so it is still the parameter's own.
    """
    return f"{name}_" if _TAKEN.fullmatch(name) else name


def transform_name(start: FrameName, end: FrameName) -> str:
    """`base_T_tool`, or `3T6` between rows."""
    numeric = str(start).isdecimal() and str(end).isdecimal()
    return f"{start}T{end}" if numeric else f"{frame_label(start)}_T_{frame_label(end)}"


def label_order(label: str) -> tuple[bool, int, str]:
    """The order in which angles are listed: single joints, then short sums, long sums, and angles without a name."""
    return label.startswith("u"), len(label), label


class Reader:
    """Turns sympy expressions into ordered trees, and notes which angles and joint variables it met.

    Attributes:
        angles: Angle by the label of its sine and cosine.
        joints: Joint name by number.
    """

    def __init__(self, robot: Robot, labels: AngleLabels | None = None) -> None:
        self.numbers = {variable.name: variable.index + 1 for variable in robot.variables}
        self.labels = labels or AngleLabels(robot.dof)
        self.angles: dict[str, Sum] = {}
        self.joints: dict[int, str] = {}

    def sum(self, expression: sp.Expr) -> Sum:
        """An expression as a sum in order, a positive term in front if there is one."""
        terms = sorted((self.term(part) for part in sp.Add.make_args(expression)), key=_term_key)
        terms = [term for term in terms if Ratio(Fraction(0)) not in term.factors]
        lead = next((term for term in terms if term.sign > 0), None)
        if lead is not None and terms[0].sign < 0:
            terms.remove(lead)
            terms.insert(0, lead)
        return Sum(tuple(terms))

    def term(self, expression: sp.Expr) -> Term:
        """A product; a bracket that would begin with a minus sign gives it to the product."""
        sign = 1
        factors: list[Factor] = []
        for part in sp.Mul.make_args(expression):
            if part.is_Rational:
                sign = -sign if part < 0 else sign
                value = abs(Fraction(int(part.p), int(part.q)))
                factors += [] if value == 1 else [Ratio(value)]
            elif part.is_Add:
                turned, bracket = self.bracket(part)
                sign *= turned
                factors.append(bracket)
            else:
                factors.append(self.factor(part))
        return Term(sign, tuple(sorted(factors, key=_factor_key)))

    def bracket(self, expression: sp.Expr) -> tuple[int, Sum]:
        """A sum that stands in a product, and the sign taken out of it."""
        terms = sorted((self.term(part) for part in sp.Add.make_args(expression)), key=_term_key)
        sign = terms[0].sign
        return sign, Sum(tuple(Term(sign * term.sign, term.factors) for term in terms))

    def factor(self, expression: sp.Expr) -> Factor:
        """A single factor."""
        if expression.is_Symbol:
            if expression.name in self.numbers:
                return self._joint(self.numbers[expression.name], expression.name)
            return Symbol(printed_name(expression.name), "parameter")
        if isinstance(expression, (sp.sin, sp.cos)) and expression.free_symbols:
            kind = "sine" if isinstance(expression, sp.sin) else "cosine"
            return Symbol(self._label(expression.args[0]), kind)
        if expression is sp.pi:
            return Pi()
        if expression.is_Add:
            return self.sum(expression)
        if expression.is_Function:
            return Function(expression.func.__name__.lower(), tuple(map(self.sum, expression.args)))
        return self.power(expression.base, expression.exp)

    def power(self, base: sp.Expr, exponent: sp.Rational) -> Factor:
        """A power; the language of robot files has square roots only, so a fraction is a root of roots."""
        if exponent.is_Integer:
            return Power(self.factor(base), int(exponent))
        if exponent < 0:
            return Power(self.factor(base**-exponent), -1)
        return Root(self.sum(base ** (2 * exponent)))

    def _joint(self, number: int, name: str) -> Symbol:
        self.joints[number] = name
        return Symbol(f"q{number}", "joint")

    def _label(self, angle: sp.Expr) -> str:
        terms: list[tuple[int, Fraction]] = []
        rest = sp.S.Zero
        for part in sp.Add.make_args(angle):
            coefficient, symbol = part.as_coeff_Mul()
            if symbol.is_Symbol and symbol.name in self.numbers:
                self._joint(self.numbers[symbol.name], symbol.name)
                terms.append((self.numbers[symbol.name], Fraction(int(coefficient.p), int(coefficient.q))))
            else:
                rest += part
        label = self.labels.label(Angle(tuple(sorted(terms)), "" if rest == 0 else str(rest)), identity=angle)
        self.angles[label] = self.angle(angle)
        return label

    def angle(self, expression: sp.Expr) -> Sum:
        """An angle as a sum: joint variables by their numbers, then parameters, then what is constant."""

        def place(term: Term) -> tuple[int, tuple[object, ...]]:
            joints = [int(name[1:]) for name in _names(term.factors, ("joint",))]
            parameters = _names(term.factors, ("parameter",))
            return (0, tuple(joints)) if joints else (1, parameters) if parameters else (2, ())

        return Sum(tuple(sorted(self.sum(expression).terms, key=place)))


def _names(factors: Iterable[Factor], kinds: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(factor.name for factor in factors if isinstance(factor, Symbol) and factor.kind in kinds)


def _joint_order(label: str) -> tuple[tuple[int, ...], str]:
    digits = label.replace("m", "").replace("u", "").split("_")
    return tuple(int(part) for part in (digits if len(digits) > 1 else digits[0])), label


def _factor_key(factor: Factor) -> tuple[int, tuple[tuple[int, ...], str], int]:
    """Numbers, then lengths and joint variables, then sines and cosines by joint, then brackets."""
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
            rank, place, _ = _factor_key(base)
            return rank, place, exponent
        case Ratio():
            return 0, ((), ""), 0
    return 1, ((), str(factor)), 0


def _term_key(term: Term) -> tuple[object, ...]:
    """Brackets first, then many sines and cosines before few, then by names; the sign does not count."""
    trigonometric = [f for f in term.factors if isinstance(f, Symbol) and f.kind in ("sine", "cosine")]
    brackets = sum(isinstance(factor, Sum) for factor in term.factors)
    angles = tuple((*_joint_order(symbol.name), symbol.kind == "sine") for symbol in trigonometric)
    return (
        -brackets,
        -len(trigonometric),
        _names(term.factors, ("parameter", "joint")),
        tuple(symbol.kind == "sine" for symbol in trigonometric),
        angles,
        str(term.factors),
    )
