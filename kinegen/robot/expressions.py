"""Exact expressions of a robot file: text in, an exact tree out, and nothing evaluated.

In: the text of one table entry, such as `q - 90`, `pi/2`, `0.5*elbow + 10` or `sqrt(2)*a2`.
Out: a tree of frozen nodes with rational numbers (`0.4318` is 4318/10000). Numbers that stand together are folded,
so `-90/180*pi` is one number times pi. Units, and what a name refers to, are the loader's business.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

FUNCTIONS = ("sqrt",)
"""The functions of the language; `pi` is its only other word."""

MAX_LENGTH = 500
MAX_DEPTH = 40
MAX_EXPONENT = 64
MAX_DIGITS = 60
MAX_BITS = 4000
"""Bits of the numerator or denominator of a power of a number."""
_SPELLING = re.compile(r"[A-Za-z0-9_+\-*/().,\s]*\Z")
_WORD = re.compile(r"(?P<name>[A-Za-z_][A-Za-z0-9_]*)|(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)")


class ExpressionError(ValueError):
    """The text is not an expression of the language; the message says why."""


@dataclass(frozen=True, slots=True)
class Number:
    """An exact rational number."""

    value: Fraction


@dataclass(frozen=True, slots=True)
class Pi:
    """The number pi."""


@dataclass(frozen=True, slots=True)
class Name:
    """A parameter or a joint variable."""

    name: str


@dataclass(frozen=True, slots=True)
class Sum:
    """Two or more terms, added in the order written."""

    terms: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Product:
    """Two or more factors, a number first if there is one."""

    factors: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Power:
    """A base to an integer exponent."""

    base: Expression
    exponent: int


@dataclass(frozen=True, slots=True)
class Call:
    """One of `FUNCTIONS` applied to its argument."""

    function: str
    argument: Expression


Expression = Number | Pi | Name | Sum | Product | Power | Call

ZERO = Number(Fraction(0))
ONE = Number(Fraction(1))
PI = Pi()


def number(value: int | str | Fraction) -> Number:
    """Make an exact number from an integer, a fraction or decimal text."""
    return Number(Fraction(value))


def add(*terms: Expression) -> Expression:
    """Add terms, folding the numbers among them into one that stands last."""
    flat = [part for term in terms for part in (term.terms if isinstance(term, Sum) else (term,))]
    constant = sum((part.value for part in flat if isinstance(part, Number)), Fraction(0))
    others: list[Expression] = [part for part in flat if not isinstance(part, Number)]
    if constant or not others:
        others.append(Number(constant))
    return others[0] if len(others) == 1 else Sum(tuple(others))


def multiply(*factors: Expression) -> Expression:
    """Multiply factors, folding the numbers among them into one that stands first."""
    flat = [part for factor in factors for part in (factor.factors if isinstance(factor, Product) else (factor,))]
    constant = Fraction(1)
    for part in flat:
        if isinstance(part, Number):
            constant *= part.value
    others: list[Expression] = [part for part in flat if not isinstance(part, Number)]
    if constant == 0:
        return ZERO
    if PI in others and Power(PI, -1) in others:
        others.remove(PI)
        others.remove(Power(PI, -1))
    if constant != 1 or not others:
        others.insert(0, Number(constant))
    return others[0] if len(others) == 1 else Product(tuple(others))


def negate(term: Expression) -> Expression:
    """Change the sign."""
    if isinstance(term, Sum):
        return add(*(negate(part) for part in term.terms))
    return multiply(number(-1), term)


def power(base: Expression, exponent: int) -> Expression:
    """Raise to an integer power; a number is folded.

    Raises:
        ExpressionError: On a zero to a negative power, or an exponent beyond `MAX_EXPONENT`.
    """
    if abs(exponent) > MAX_EXPONENT:
        raise ExpressionError(f"exponent {exponent} is too large (at most {MAX_EXPONENT})")
    if exponent == 1:
        return base
    if exponent == 0:
        return ONE
    if isinstance(base, Number):
        if base.value == 0 and exponent < 0:
            raise ExpressionError("division by zero")
        # Bits, not digits: Python refuses to print an integer of more than 4300 digits.
        bits = max(base.value.numerator.bit_length(), base.value.denominator.bit_length())
        if abs(exponent) * bits > MAX_BITS:
            raise ExpressionError("the number is too long")
        return Number(base.value**exponent)
    if isinstance(base, Product):
        return multiply(*(power(factor, exponent) for factor in base.factors))
    if isinstance(base, Power):
        return power(base.base, base.exponent * exponent)
    return Power(base, exponent)


def names(expression: Expression) -> tuple[str, ...]:
    """The names in an expression, in order of appearance, each once."""
    match expression:
        case Name(name):
            found: tuple[str, ...] = (name,)
        case Sum(parts) | Product(parts):
            found = tuple(name for part in parts for name in names(part))
        case Power(base, _):
            found = names(base)
        case Call(_, argument):
            found = names(argument)
        case _:
            found = ()
    return tuple(dict.fromkeys(found))


def largest_number(expression: Expression) -> int:
    """The largest numerator or denominator, without its sign, that an expression holds."""
    match expression:
        case Number(value):
            return max(abs(value.numerator), value.denominator)
        case Sum(parts) | Product(parts):
            return max(largest_number(part) for part in parts)
        case Power(inner, _) | Call(_, inner):
            return largest_number(inner)
        case _:
            return 1


def size(expression: Expression) -> int:
    """The number of nodes of an expression."""
    match expression:
        case Sum(parts) | Product(parts):
            return 1 + sum(size(part) for part in parts)
        case Power(inner, _) | Call(_, inner):
            return 1 + size(inner)
        case _:
            return 1


def substitute(expression: Expression, values: Mapping[str, Expression], pi: Expression = PI) -> Expression:
    """Replace names, and `pi` where another value is given, keeping everything exact."""
    match expression:
        case Name(name):
            return values.get(name, expression)
        case Pi():
            return pi
        case Sum(parts):
            return add(*(substitute(part, values, pi) for part in parts))
        case Product(parts):
            return multiply(*(substitute(part, values, pi) for part in parts))
        case Power(base, exponent):
            return power(substitute(base, values, pi), exponent)
        case Call(function, argument):
            return Call(function, substitute(argument, values, pi))
        case _:
            return expression


def linear(expression: Expression, variables: frozenset[str]) -> tuple[dict[str, Expression], Expression]:
    """Split an expression into the coefficients of some variables and the rest.

    Args:
        expression: The tree.
        variables: Names that may stand in it linearly only.

    Returns:
        The coefficient of each variable that occurs, in order of appearance, and the remaining offset.

    Raises:
        ExpressionError: If a variable stands in a product with another, under a power or in a function.
    """
    match expression:
        case Name(name) if name in variables:
            return {name: ONE}, ZERO
        case Sum(parts):
            coefficients: dict[str, Expression] = {}
            offset: Expression = ZERO
            for part in parts:
                found, rest = linear(part, variables)
                for name, coefficient in found.items():
                    coefficients[name] = add(coefficients.get(name, ZERO), coefficient)
                offset = add(offset, rest)
            return coefficients, offset
        case Product(parts):
            return _linear_product(parts, variables)
        case _:
            inside = [name for name in names(expression) if name in variables]
            if inside:
                raise ExpressionError(f"joint variable '{inside[0]}' must stand linearly, as in '2*{inside[0]} + 1'")
            return {}, expression


def _linear_product(
    parts: tuple[Expression, ...], variables: frozenset[str]
) -> tuple[dict[str, Expression], Expression]:
    moving = [part for part in parts if variables.intersection(names(part))]
    fixed = multiply(*(part for part in parts if part not in moving), ONE)
    if not moving:
        return {}, fixed
    if len(moving) > 1:
        raise ExpressionError("a product of two joint variables is not linear")
    coefficients, offset = linear(moving[0], variables)
    return {name: multiply(fixed, value) for name, value in coefficients.items()}, multiply(fixed, offset)


@dataclass(frozen=True, slots=True)
class Arithmetic:
    """What `evaluate` needs to know about the numbers it works in (floats, mpmath, sympy, arrays).

    Attributes:
        number: Makes a number from a fraction.
        pi: The value of pi.
        functions: One callable for each of `FUNCTIONS`.
    """

    number: Callable[[Fraction], Any]
    pi: Any
    functions: Mapping[str, Callable[[Any], Any]]


def evaluate(expression: Expression, values: Mapping[str, Any], arithmetic: Arithmetic) -> Any:
    """Evaluate an expression in any kind of numbers.

    Args:
        expression: The tree.
        values: A value for each name in it.
        arithmetic: The kind of numbers.

    Raises:
        KeyError: If a name has no value.
    """
    match expression:
        case Number(value):
            return arithmetic.number(value)
        case Pi():
            return arithmetic.pi
        case Name(name):
            return values[name]
        case Sum(parts):
            total = evaluate(parts[0], values, arithmetic)
            for part in parts[1:]:
                total = total + evaluate(part, values, arithmetic)
            return total
        case Product(parts):
            product = evaluate(parts[0], values, arithmetic)
            for part in parts[1:]:
                product = product * evaluate(part, values, arithmetic)
            return product
        case Power(base, exponent):
            raised = evaluate(base, values, arithmetic) ** abs(exponent)
            return raised if exponent > 0 else arithmetic.number(Fraction(1)) / raised
        case Call(function, argument):
            return arithmetic.functions[function](evaluate(argument, values, arithmetic))


def parse(text: str) -> Expression:
    """Read one expression.

    Args:
        text: Numbers, names, `pi`, `+ - * / **`, brackets and the functions in `FUNCTIONS`.

    Returns:
        The exact tree. Exponents are integers; nothing is evaluated in floating point.

    Raises:
        ExpressionError: If the text is anything else; bounded in length, depth and size of numbers.
    """
    if len(text) > MAX_LENGTH:
        raise ExpressionError(f"the expression has {len(text)} characters (at most {MAX_LENGTH})")
    if not text.strip():
        raise ExpressionError("the expression is empty")
    if _SPELLING.match(text) is None:
        bad = next(character for character in text if _SPELLING.match(character) is None)
        raise ExpressionError(f"{bad!r} cannot stand in an expression")
    if _depth(text) > MAX_DEPTH:
        raise ExpressionError(f"brackets are nested more than {MAX_DEPTH} deep")
    exact: list[Fraction] = []
    marked = _WORD.sub(lambda match: _mark(match, exact), text)
    try:
        tree = ast.parse(marked.strip(), mode="eval")
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        raise ExpressionError(f"'{text.strip()}' is not an expression") from None
    return _convert(tree.body, exact, 0)


def text_names(text: str) -> tuple[str, ...]:
    """The names in the text of an expression, each once, also those that fold away, as in `0*q`."""
    words = (match["name"] for match in _WORD.finditer(text))
    return tuple(dict.fromkeys(word for word in words if word and word != "pi" and word not in FUNCTIONS))


def _depth(text: str) -> int:
    deepest = level = 0
    for character in text:
        level += (character == "(") - (character == ")")
        deepest = max(deepest, level)
    return deepest


def _mark(match: re.Match[str], exact: list[Fraction]) -> str:
    """Hide words from Python's grammar, for which `lambda` is no name and 0.1 no exact number."""
    if match["name"]:
        return f" v_{match['name']} "
    return f" n_[{_store(match['number'], exact)}] "


def _store(digits: str, exact: list[Fraction]) -> int:
    mantissa, _, exponent = digits.lower().partition("e")
    if len(mantissa) > MAX_DIGITS or abs(int(exponent or "0")) > MAX_EXPONENT:
        raise ExpressionError(f"the number {digits[:20]} is out of bounds")
    exact.append(Fraction(digits))
    return len(exact) - 1


def _convert(node: ast.expr, exact: list[Fraction], depth: int) -> Expression:
    if depth > 4 * MAX_DEPTH:
        raise ExpressionError("the expression is too long")
    match node:
        case ast.Subscript(ast.Name("n_"), ast.Constant(int(index))):
            return Number(exact[index])
        case ast.Name("v_pi"):
            return PI
        case ast.Name(name):
            return Name(name.removeprefix("v_"))
        case ast.UnaryOp(ast.UAdd(), operand):
            return _convert(operand, exact, depth + 1)
        case ast.UnaryOp(ast.USub(), operand):
            return negate(_convert(operand, exact, depth + 1))
        case ast.BinOp(left, operator, right):
            return _combine(_convert(left, exact, depth + 1), operator, _convert(right, exact, depth + 1))
        case ast.Call(ast.Name(name), [argument], []):
            function = name.removeprefix("v_")
            if function not in FUNCTIONS:
                raise ExpressionError(f"unknown function '{function}' (expected {', '.join(FUNCTIONS)})")
            return Call(function, _convert(argument, exact, depth + 1))
    raise ExpressionError("only numbers, names, pi, sqrt, + - * / ** and brackets are allowed")


def _combine(left: Expression, operator: ast.operator, right: Expression) -> Expression:
    match operator:
        case ast.Add():
            return add(left, right)
        case ast.Sub():
            return add(left, negate(right))
        case ast.Mult():
            return multiply(left, right)
        case ast.Div():
            return multiply(left, power(right, -1))
        case ast.Pow() if isinstance(right, Number) and right.value.denominator == 1:
            return power(left, right.value.numerator)
        case ast.Pow():
            raise ExpressionError("an exponent must be an integer")
    raise ExpressionError("only the operators + - * / ** are allowed")
