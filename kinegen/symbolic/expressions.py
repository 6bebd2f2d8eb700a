"""What the symbolic stage hands on: named intermediate expressions and the entries made of them."""

from __future__ import annotations

from dataclasses import dataclass, field

import sympy as sp
from sympy.core.exprtools import decompose_power
from sympy.core.sorting import default_sort_key

from kinegen.outputs import Signature
from kinegen.symbolic.fold import Vector, rotate
from kinegen.symbolic.transforms import Turn

IN_SINGLE = sp.Dummy("in_single", nonnegative=True)
"""0 in double precision and 1 in single precision; what is made of it and of numbers becomes a constant."""

Definition = tuple[sp.Symbol, sp.Expr]


@dataclass(frozen=True, slots=True)
class Expressions:
    """One kinematic quantity in terms of the numbers it is given and of runtime parameters.

    Attributes:
        signature: What is computed, for which frames, from what.
        variables: The symbols of all numbers of the inputs, one input after the other.
        parameters: The symbols of the runtime parameters, in order.
        definitions: Intermediate values, each in terms of the symbols above and earlier definitions.
        entries: The numbers of the results, one result after the other, each row by row.
    """

    signature: Signature
    variables: tuple[sp.Symbol, ...]
    parameters: tuple[sp.Symbol, ...]
    definitions: tuple[Definition, ...]
    entries: tuple[sp.Expr, ...]


@dataclass(slots=True)
class Tape:
    """Collects definitions while a quantity is evaluated; equal expressions get one name."""

    definitions: list[Definition] = field(default_factory=list)
    _named: dict[sp.Expr, sp.Symbol] = field(default_factory=dict)

    def name(self, expression: sp.Expr) -> sp.Expr:
        """Give an expression a name, unless it is a number, a symbol, a sine or a cosine (or minus one)."""
        if is_atom(expression):
            return expression
        negative = has_minus_sign(expression)
        core = -expression if negative else expression
        return -self._define(core) if negative else self._define(core)

    def vector(self, vector: Vector) -> Vector:
        """Name the three entries of a vector."""
        return self.name(vector[0]), self.name(vector[1]), self.name(vector[2])

    def turned(self, turn: Turn, vector: Vector) -> Vector:
        """Name the entries of a vector that is turned about a coordinate axis."""
        return self.vector(rotate(turn.axis, turn.angle, vector))

    def _define(self, expression: sp.Expr) -> sp.Symbol:
        if expression not in self._named:
            symbol = sp.Dummy(f"v{len(self.definitions)}", real=True)
            self._named[expression] = symbol
            self.definitions.append((symbol, expression))
        return self._named[expression]


def by_type(double: sp.Expr, single: sp.Expr) -> sp.Expr:
    """A number that depends on the number type, such as a tolerance."""
    return double + IN_SINGLE * (single - double)


def number_of(expression: sp.Expr, *, single: bool) -> float:
    """The value of such a number, or of any other one, in a number type."""
    return float(sp.N(expression.subs(IN_SINGLE, int(single))))


def has_minus_sign(expression: sp.Expr) -> bool:
    """Whether the negative of an expression gets a name in its place; never true of both.

    The answer is that of sympy's `could_extract_minus_sign`: most terms of a sum decide, and where as many are
    negative as not, the first term in lexical order. sympy finds that order with the values of all constants, whose
    evaluation would take most of the time of a long chain; they matter only for terms without variables, and for terms
    that have the same ones.
    """
    if not expression.is_Add:
        return bool(expression.could_extract_minus_sign())
    minus = sum(_is_negative(term) for term in expression.args)
    if 2 * minus != len(expression.args):
        return 2 * minus > len(expression.args)
    powers = [_powers(term) for term in expression.args]
    bases = sorted(set().union(*powers), key=default_sort_key)
    orders = [tuple(each.get(base, 0) for base in bases) for each in powers]
    first = max(orders)
    if orders.count(first) > 1 or not all(powers):
        return bool(expression.could_extract_minus_sign())
    return bool(expression.args[orders.index(first)].as_coeff_Mul()[0].is_negative)


def _is_negative(term: sp.Expr) -> bool:
    if term.is_Mul:
        return bool(term.args[0].is_Number and term.args[0].is_negative)
    return bool(term.could_extract_minus_sign())


def _powers(term: sp.Expr) -> dict[sp.Expr, int]:
    """The exponents of the factors of a term that are not numbers."""
    return dict(decompose_power(factor) for factor in sp.Mul.make_args(term) if not factor.is_number)


def is_atom(expression: sp.Expr) -> bool:
    """Whether an expression costs nothing: a number, a symbol, a sine or a cosine, or minus one of these."""
    # Asking sympy whether a sum has a minus sign in front takes long, and a sum is never an atom.
    return _is_positive_atom(expression) or bool(
        expression.is_Mul
        and len(expression.args) == 2
        and expression.args[0] is sp.S.NegativeOne
        and _is_positive_atom(expression.args[1])
    )


def _is_positive_atom(core: sp.Expr) -> bool:
    return bool(core.is_Symbol or core.is_number or isinstance(core, (sp.sin, sp.cos)))


def cost(definitions: tuple[Definition, ...], entries: tuple[sp.Expr, ...]) -> int:
    """Multiplications and additions in the definitions that the entries need, and in the entries."""
    by_symbol = dict(definitions)
    pending = list(entries)
    seen: set[sp.Symbol] = set()
    operations = 0
    while pending:
        expression = pending.pop()
        operations += _operations(expression)
        for symbol in expression.free_symbols:
            if symbol in by_symbol and symbol not in seen:
                seen.add(symbol)
                pending.append(by_symbol[symbol])
    return operations


def _operations(expression: sp.Expr) -> int:
    if is_atom(expression):
        return 0
    arguments = [argument for argument in expression.args if argument != sp.S.NegativeOne]
    return len(arguments) - 1 + sum(_operations(argument) for argument in arguments)
