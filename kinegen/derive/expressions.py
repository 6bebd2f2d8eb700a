"""What the symbolic stage hands on: named expressions, the arrays of a kernel, and the exact values of constants.

A constant becomes a fraction, of which kernels take what their type holds. sympy evaluates each constant from its
beginning, though those of a chain are products of the same sines and cosines; here each part is evaluated once.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import field
from fractions import Fraction
from functools import lru_cache

import mpmath
import sympy as sp
from mpmath.libmp import dps_to_prec, from_rational, mpf_pos, round_nearest, to_str
from sympy.core.exprtools import decompose_power
from sympy.core.sorting import default_sort_key

from kinegen.derive.folding import Vector, rotate
from kinegen.derive.transforms import Elementary, Turn, Values, transforms_between
from kinegen.model.outputs import Array, Kind, Quantity, Signature
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass

DIGITS = 150
_WORKING = 200
"""Digits of what a constant is made of."""

_CANCELLED = mpmath.mpf(10) ** (DIGITS + 10 - _WORKING)
"""A sum that is so much smaller than its largest term is left to sympy, which takes more digits then."""

_NEGLIGIBLE = Fraction(1, 10**120)


class _LostError(ArithmeticError):
    """A value has not enough digits, or is made by a function that is not evaluated here."""


@lru_cache(maxsize=4096)
def exact_number(expression: sp.Expr) -> Fraction:
    """Return the value of a constant expression: exact if rational, else to 150 digits."""
    if expression.is_Rational:
        return Fraction(int(expression.p), int(expression.q))
    try:
        with mpmath.workdps(_WORKING):
            rounded = mpf_pos(_evaluated(expression)._mpf_, dps_to_prec(DIGITS), round_nearest)
        digits = Fraction(to_str(rounded, DIGITS))
    except _LostError:
        digits = Fraction(str(sp.N(expression, DIGITS, maxn=4 * DIGITS)))
    return Fraction(0) if abs(digits) < _NEGLIGIBLE else digits


def decimal(expression: sp.Expr) -> sp.Expr:
    """Return a constant with 150 digits, which sympy does not analyse; exact if it is rational or an integer."""
    if expression.is_Rational:
        return expression
    number = exact_number(expression)
    whole = round(number)
    exact = sp.Rational(number.numerator, number.denominator)
    return sp.Integer(whole) if abs(number - whole) < _NEGLIGIBLE else sp.Float(exact, DIGITS)


@lru_cache(maxsize=4096)
def _evaluated(expression: sp.Expr) -> mpmath.mpf:
    """Return a part of a constant; 200 digits are the working precision."""
    if expression.is_Rational:
        return mpmath.mpf(from_rational(int(expression.p), int(expression.q), mpmath.mp.prec, round_nearest))
    if expression.is_Float:
        return mpmath.mpf(expression._mpf_)
    if expression is sp.pi:
        return +mpmath.pi
    # A sum that cancels has lost its digits; sympy takes more of them.
    parts = [_evaluated(part) for part in expression.args]
    if isinstance(expression, sp.Add):
        total = mpmath.fsum(parts)
        if abs(total) <= _CANCELLED * max(map(abs, parts)):
            raise _LostError
        return total
    if isinstance(expression, sp.Mul):
        return mpmath.fprod(parts)
    if isinstance(expression, (sp.sin, sp.cos)):
        return (mpmath.sin if isinstance(expression, sp.sin) else mpmath.cos)(parts[0])
    if isinstance(expression, sp.Pow) and expression.exp.is_Rational and parts[0] > 0:
        return mpmath.power(*parts)
    raise _LostError


TIP = "tool"
"""What the arrays of a chain call its tip."""


def frames_of(robot: Robot, quantity: Quantity) -> tuple[str, ...]:
    """Return the frames for which a quantity is computed: one that is named, all, or the tips."""
    if quantity.frame:
        return (quantity.frame,)
    return robot.frame_names if quantity.kind is Kind.FRAMES else robot.tips


def start_of(robot: Robot, quantity: Quantity) -> str:
    """Return the frame in which the frames of a quantity are seen: the base, unless it names another."""
    return quantity.seen_from or robot.root


def joint_array(robot: Robot, name: str = "q") -> Array:
    """Return the joint vector, or its rates."""
    return Array(name, (robot.dof,))


def pose_array(robot: Robot, quantity: Quantity) -> Array:
    """Return the poses of the frames of a quantity in the base frame, or in the frame from which they are seen."""
    if per_frame(robot, quantity):
        return Array(f"base_T_{_plural(quantity)}", (len(frames_of(robot, quantity)), 4, 4), True, True)
    return Array(f"{quantity.seen_from or 'base'}_T_{quantity.frame or TIP}", (4, 4), True)


def point_array(robot: Robot, quantity: Quantity) -> Array:
    """Return the positions of the frames of a quantity in the base frame, or in the frame from which they are seen."""
    name = _plural(quantity) if per_frame(robot, quantity) else quantity.frame or TIP
    return frame_array(robot, quantity, f"{quantity.seen_from or 'base'}_p_{name}", (3,))


def frame_array(robot: Robot, quantity: Quantity, name: str, shape: tuple[int, ...]) -> Array:
    """Return an array of the same shape for each frame of a quantity; a single frame has no axis of its own."""
    if per_frame(robot, quantity):
        return Array(name, (len(frames_of(robot, quantity)), *shape), per_frame=True)
    return Array(name, shape)


def per_frame(robot: Robot, quantity: Quantity) -> bool:
    """Tell whether the results have an axis that counts frames."""
    return quantity.kind is Kind.FRAMES or (robot.is_tree and not quantity.frame)


def signature(robot: Robot, quantity: Quantity, inputs: tuple[Array, ...], *results: Array) -> Signature:
    """Return the signature of a quantity with these arrays."""
    return Signature(quantity, frames_of(robot, quantity), robot.dof, inputs, results)


def joint_symbols(robot: Robot, values: Values) -> tuple[sp.Symbol, ...]:
    """Return the symbols of the joint vector, in order."""
    return tuple(values[variable.name] for variable in robot.variables)


def parameter_symbols(robot: Robot, values: Values) -> tuple[sp.Symbol, ...]:
    """Return the symbols of the runtime parameters, in order."""
    return tuple(values[parameter.name] for parameter in robot.runtime_parameters)


def _plural(quantity: Quantity) -> str:
    return "frames" if quantity.kind is Kind.FRAMES else "tips"


IN_SINGLE = sp.Dummy("in_single", nonnegative=True)
"""0 in double precision and 1 in single precision; what is made of it and of numbers becomes a constant."""

Definition = tuple[sp.Symbol, sp.Expr]


@dataclass(frozen=True, slots=True)
class Candidate:
    """One way to compute a quantity.

    Attributes:
        name: What distinguishes it from others, in words.
        definitions: Intermediate values, each in terms of inputs, parameters and earlier definitions.
        entries: The numbers of the results, one result after the other, each row by row.
        form: The number of the form of the chain; those of one form are compared before they are searched.
    """

    name: str
    definitions: tuple[Definition, ...]
    entries: tuple[sp.Expr, ...]
    form: int = 0


@dataclass(frozen=True, slots=True)
class Expressions:
    """One kinematic quantity in terms of the numbers it is given and of runtime parameters.

    Attributes:
        variables: The symbols of all numbers of the inputs, one input after the other.
        ways: Ways to compute the results, one or several; lowering takes the one with the least operations.
    """

    signature: Signature
    variables: tuple[sp.Symbol, ...]
    parameters: tuple[sp.Symbol, ...]
    ways: tuple[Candidate, ...]

    @property
    def definitions(self) -> tuple[Definition, ...]:
        """The intermediate values of the first way."""
        return self.ways[0].definitions

    @property
    def entries(self) -> tuple[sp.Expr, ...]:
        """The numbers of the results of the first way, one result after the other, each row by row."""
        return self.ways[0].entries


@dataclass(slots=True)
class LetBindings:
    """Collects definitions while a quantity is evaluated; equal expressions get one name.

    Attributes:
        names: Names that several sets of bindings share, so that what they have in common is made once.
    """

    definitions: list[Definition] = field(default_factory=list)
    names: dict[sp.Expr, sp.Symbol] = field(default_factory=dict)
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

    def way(self, entries: Iterable[sp.Expr], name: str = "") -> Candidate:
        """Return a way to compute some entries by these definitions."""
        return Candidate(name, tuple(self.definitions), tuple(entries))

    def _define(self, expression: sp.Expr) -> sp.Symbol:
        if expression not in self._named:
            if expression not in self.names:
                self.names[expression] = sp.Dummy(f"v{len(self.names)}", real=True)
            symbol = self._named[expression] = self.names[expression]
            self.definitions.append((symbol, expression))
        return self._named[expression]


def by_type(double: sp.Expr, single: sp.Expr) -> sp.Expr:
    """Return a number that depends on the number type, such as a tolerance."""
    return double + IN_SINGLE * (single - double)


def number_of(expression: sp.Expr, *, single: bool) -> float:
    """Return the value of such a number, or of any other one, in a number type."""
    return float(sp.N(expression.subs(IN_SINGLE, int(single))))


@lru_cache(maxsize=2**14)
def has_minus_sign(expression: sp.Expr) -> bool:
    """Tell whether the negative of an expression gets a name in its place; never true of both.

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
    return dict(decompose_power(factor) for factor in sp.Mul.make_args(term) if not factor.is_number)


def is_atom(expression: sp.Expr) -> bool:
    """Tell whether an expression costs nothing: a number, a symbol, a sine or a cosine, or minus one of these."""
    # Asking sympy whether a sum has a minus sign in front takes long, and a sum is never an atom.
    return _is_positive_atom(expression) or bool(
        expression.is_Mul
        and len(expression.args) == 2
        and expression.args[0] is sp.S.NegativeOne
        and _is_positive_atom(expression.args[1])
    )


def _is_positive_atom(core: sp.Expr) -> bool:
    return bool(core.is_Symbol or core.is_number or isinstance(core, (sp.sin, sp.cos)))


def cost(definitions: Sequence[Definition], entries: Sequence[sp.Expr]) -> int:
    """Multiplications and additions in the definitions that the entries need, and in the entries."""
    return sum(map(_operations, _needed(definitions, entries)))


def pairs(definitions: Sequence[Definition], entries: Sequence[sp.Expr]) -> int:
    """Return the angles whose sine or cosine is in the definitions that the entries need, or in the entries."""
    found = (each.atoms(sp.sin, sp.cos) for each in _needed(definitions, entries))
    return len({atom.args[0] for atoms in found for atom in atoms if atom.free_symbols})


def _needed(definitions: Sequence[Definition], entries: Sequence[sp.Expr]) -> list[sp.Expr]:
    by_symbol = dict(definitions)
    found = list(entries)
    seen: set[sp.Symbol] = set()
    for expression in found:
        for symbol in expression.free_symbols:
            if symbol in by_symbol and symbol not in seen:
                seen.add(symbol)
                found.append(by_symbol[symbol])
    return found


def _operations(expression: sp.Expr) -> int:
    if is_atom(expression):
        return 0
    arguments = [argument for argument in expression.args if argument != sp.S.NegativeOne]
    return len(arguments) - 1 + sum(_operations(argument) for argument in arguments)


def chains_of(robot: Robot, quantity: Quantity, values: Values) -> list[tuple[Elementary, ...]]:
    """Return the chain from where a quantity is seen to each of its frames."""
    start = start_of(robot, quantity)
    return [transforms_between(robot, start, frame, values) for frame in frames_of(robot, quantity)]


def by_joints(
    robot: Robot, quantity: Quantity, values: Values, ways: Iterable[Candidate], *results: Array
) -> Expressions:
    """Return a quantity whose only input is the joint vector."""
    return Expressions(
        signature=signature(robot, quantity, (joint_array(robot),), *results),
        variables=joint_symbols(robot, values),
        parameters=parameter_symbols(robot, values),
        ways=tuple(ways),
    )
