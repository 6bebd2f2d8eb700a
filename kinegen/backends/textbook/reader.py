"""Reads exact expressions as the ordered trees of a printed form.

A factor or term has its place by what it is, never by sympy's ordering. Factors: numbers, lengths, sines and cosines,
brackets. Terms: a sum of lengths goes along the chain, from the base outwards; any other has brackets first.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from fractions import Fraction

import sympy as sp

from kinegen.backends.textbook.products import Base, Bracket, Product, Reading, Terms, Wave, cost, times
from kinegen.backends.textbook.simplification import met, shared, shortened
from kinegen.backends.textbook.trees import (
    Factor,
    Function,
    Pi,
    Power,
    Ratio,
    Root,
    Sum,
    Symbol,
    Term,
    angle_name,
    factor_key,
    names_of,
    printed_name,
    term_key,
)
from kinegen.model.angle_sums import Angle, AngleLabels
from kinegen.model.robot import Robot

_FAR = 10**6
"""The place of what is no length: behind all lengths."""


class Reader:
    """Turns sympy expressions into ordered trees, and notes which angles and joint variables it met.

    `angles`: angle by the label of its sine and cosine. `joints`: joint name by number.
    """

    def __init__(
        self, robot: Robot, labels: AngleLabels | None = None, places: Mapping[str, int] | None = None
    ) -> None:
        """Start with nothing read.

        `labels`: names of angles, to be shared by forms that are printed together. `places`: where along the chain each
        name that makes a length stands first.
        """
        self.robot = robot
        self.labels = labels or AngleLabels(robot.dof)
        self.places = places or {}
        self.angles: dict[str, Sum] = {}
        self.joints: dict[int, str] = {}
        self._brackets: dict[tuple[Terms, int], tuple[int, Sum]] = {}
        self._labels: dict[Wave, str] = {}
        numbers = {variable.name: variable.index + 1 for variable in robot.variables}
        self._short = Reading(numbers, shortened)
        self._plain = Reading(numbers)

    def sum(self, *same: sp.Expr) -> Sum:
        """Return the shortest of equal expressions as a sum in order, a positive term in front if there is one."""
        return self._sum(shared(met(min((self._short.terms(expression) for expression in same), key=cost))))

    def name_angles(self, expressions: Iterable[sp.Expr]) -> None:
        """Give the angles of some expressions their labels, in the order of joints, before they are read."""
        waves = {wave for expression in expressions for wave in expression.atoms(sp.sin, sp.cos) if wave.free_symbols}
        bases = {self._plain.product(wave).factors[0][0] for wave in waves}
        found = [base for base in bases if isinstance(base, Wave)]
        for wave in sorted(found, key=lambda each: (each.joints or (_FAR,), str(each.angle))):
            self._given(wave)

    def angle(self, expression: sp.Expr) -> Sum:
        """Return an angle as a sum: joint variables by their numbers, then parameters, then what is constant."""

        def place(term: Term) -> tuple[int, tuple[object, ...]]:
            joints = [int(name[1:]) for name in names_of(term.factors, ("joint",))]
            parameters = names_of(term.factors, ("parameter",))
            return (0, tuple(joints)) if joints else (1, parameters) if parameters else (2, ())

        return Sum(tuple(sorted(self._flat(expression).terms, key=place)))

    def _flat(self, expression: sp.Expr) -> Sum:
        """Return a sum as it stands."""
        return self._sum(self._plain.terms(expression))

    def _sum(self, terms: Terms) -> Sum:
        return Sum(tuple(_led(self._ordered(terms))))

    def _ordered(self, terms: Terms) -> list[Term]:
        placed = [(self._place(product), self._term(product)) for term in terms for product in _numbers(term)]
        return [term for _, term in sorted(placed, key=lambda each: (each[0], term_key(each[1])))]

    def _place(self, product: Product) -> int:
        """Return where along the chain the first length of a term stands."""
        found = [_FAR if product.place is None else product.place]
        for base, _ in product.factors:
            if isinstance(base, Bracket):
                found += map(self._place, base.terms)
            elif isinstance(base, sp.Expr):
                found += [self.places[symbol.name] for symbol in base.free_symbols if symbol.name in self.places]
        return min(found)

    def _term(self, product: Product) -> Term:
        """Return a product; a bracket that would begin with a minus sign gives it to the product."""
        sign = 1
        factors: list[Factor] = []
        for part in sp.Mul.make_args(product.number):
            if part.is_Rational:
                sign = -sign if part < 0 else sign
                value = abs(Fraction(int(part.p), int(part.q)))
                factors += [] if value == 1 else [Ratio(value, product.place is not None)]
            elif part.is_Add:
                turned, bracket = self._bracket(self._plain.terms(part))
                sign *= turned
                factors.append(bracket)
            else:
                factors.append(self._number(part))
        for base, exponent in product.factors:
            turned, factor = self._factor(base, exponent, sign)
            sign *= turned
            factors.append(factor)
        return Term(sign, tuple(sorted(factors, key=factor_key)))

    def _bracket(self, terms: Terms, wanted: int = 1) -> tuple[int, Sum]:
        """A sum that stands in a product, and the sign taken out of it: the wanted one where there is a choice."""
        key = (terms, wanted)
        if key not in self._brackets:
            sign, ordered = wanted, self._led(self._signed(terms, wanted), is_short=len(terms) == 2)
            if ordered[0].sign < 0:
                sign, ordered = -wanted, self._led(self._signed(terms, -wanted), is_short=len(terms) == 2)
            self._brackets[key] = sign, Sum(tuple(ordered))
        return self._brackets[key]

    def _signed(self, terms: Terms, sign: int) -> list[Term]:
        return self._ordered(tuple(times(Product(sp.Integer(sign)), term) for term in terms))

    def _led(self, ordered: list[Term], *, is_short: bool) -> list[Term]:
        """Return a positive term in front of `1 - c2`; elsewhere a bracket begins with the first of its terms."""
        is_number = any(all(isinstance(factor, Ratio) for factor in term.factors) for term in ordered)
        return _led(ordered) if is_short and is_number else ordered

    def _factor(self, base: Base, exponent: sp.Rational, sign: int) -> tuple[int, Factor]:
        """Return a factor to a power, and the sign taken out of it; of what stands before it, the sign is known."""
        if isinstance(base, Wave):
            factor: Factor = Symbol(self._label(base), "sine" if base.is_sine else "cosine")
            turned = 1
        elif isinstance(base, Bracket):
            turned, factor = self._bracket(base.terms, sign)
        else:
            return 1, self._number(base**exponent)
        if exponent == 1:
            return turned, factor
        return turned ** int(exponent), Power(factor, int(exponent))

    def _number(self, expression: sp.Expr) -> Factor:
        """Return a factor that is neither a sum nor a sine or cosine of a variable."""
        if expression.is_Symbol:
            numbers = self._plain.numbers
            if expression.name in numbers:
                return self._joint(numbers[expression.name])
            return Symbol(printed_name(expression.name), "parameter")
        if expression is sp.pi:
            return Pi()
        if expression.is_Add:
            return self._flat(expression)
        if expression.is_Rational:
            return Ratio(Fraction(int(expression.p), int(expression.q)))
        if expression.is_Function:
            return Function(expression.func.__name__.lower(), tuple(map(self._flat, expression.args)))
        return self._power(expression.base, expression.exp)

    def _power(self, base: sp.Expr, exponent: sp.Rational) -> Factor:
        """Return a power; the language of robot files has square roots only, so a fraction is a root of roots."""
        if exponent.is_Integer:
            return Power(self._number(base), int(exponent))
        if exponent < 0:
            return Power(self._number(base**-exponent), -1)
        return Root(self._flat(base ** (2 * exponent)))

    def _joint(self, number: int) -> Symbol:
        self.joints[number] = self.robot.variables[number - 1].name
        return Symbol(f"q{number}", "joint")

    def _label(self, wave: Wave) -> str:
        if wave not in self._labels:
            self._labels[wave] = self._given(wave)
            self.angles[self._labels[wave]] = self.angle(wave.angle)
        return self._labels[wave]

    def _given(self, wave: Wave) -> str:
        """Return the label of an angle: from the joints in it, the name of a parameter, or a number."""
        coefficients = self._plain.joints(wave.angle)
        parts = [part for part in sp.Add.make_args(wave.angle) if not self._plain.joints(part)]
        rest = sp.Add(*parts)
        angle = Angle(tuple(coefficients.items()), "" if rest == 0 else str(rest))
        return self.labels.label(angle, identity=wave.angle, name=angle_name(wave.angle, self.robot))


def _numbers(term: Product) -> Terms:
    """Return a number that is a sum as its parts."""
    if term.factors or not term.number.is_Add:
        return (term,)
    return tuple(Product(part, (), term.place) for part in term.number.args)


def _led(ordered: list[Term]) -> list[Term]:
    """Return terms with a positive one in front, if there is one."""
    lead = next((term for term in ordered if term.sign > 0), None)
    if lead is None or ordered[0].sign > 0:
        return ordered
    return [lead, *(term for term in ordered if term is not lead)]
