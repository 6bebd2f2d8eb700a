"""Exact expressions of a robot file: text in, an exact tree out, and nothing evaluated.

In: the text of one table entry, such as `q - 90`, `pi/2`, `0.5*elbow + 10` or `sqrt(2)*a2`.
Out: a tree of frozen nodes with rational numbers (`0.4318` is 4318/10000; see `algebra`). Units, and what a name
refers to, are the loader's business.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from kinegen.robot.algebra import (
    MAX_EXPONENT,
    ONE,
    PI,
    ZERO,
    Call,
    Expression,
    ExpressionError,
    Name,
    Number,
    Pi,
    Power,
    Product,
    Sum,
    add,
    depth,
    largest_number,
    linear,
    multiply,
    names,
    negate,
    number,
    power,
    size,
    substitute,
)

__all__ = [
    "FUNCTIONS",
    "MAX_EXPONENT",
    "ONE",
    "PI",
    "ZERO",
    "Arithmetic",
    "Call",
    "Expression",
    "ExpressionError",
    "Name",
    "Number",
    "Pi",
    "Power",
    "Product",
    "Sum",
    "add",
    "checked_depth",
    "depth",
    "evaluate",
    "largest_number",
    "linear",
    "multiply",
    "names",
    "negate",
    "number",
    "parse",
    "power",
    "size",
    "substitute",
    "text_names",
]

FUNCTIONS = ("sqrt",)
"""The functions of the language; `pi` is its only other word."""

MAX_LENGTH = 500
MAX_DEPTH = 40
"""Levels of brackets, and of the tree; later stages recurse over it with a few frames for each level."""
MAX_DIGITS = 60
_SPELLING = re.compile(r"[A-Za-z0-9_+\-*/().\s]*\Z")
_WORD = re.compile(r"(?P<name>[A-Za-z_][A-Za-z0-9_]*)|(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)")


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
        hint = " (a decimal point is written '.')" if bad == "," else ""
        raise ExpressionError(f"{bad!r} cannot stand in an expression{hint}")
    if _depth(text) > MAX_DEPTH:
        raise ExpressionError(f"brackets are nested more than {MAX_DEPTH} deep")
    exact: list[Fraction] = []
    marked = _WORD.sub(lambda match: _mark(match, exact), text)
    try:
        tree = ast.parse(marked.strip(), mode="eval")
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        raise ExpressionError(f"'{text.strip()}' is not an expression") from None
    return checked_depth(_convert(tree.body, exact, 0))


def checked_depth(expression: Expression) -> Expression:
    """Refuse an expression of more than `MAX_DEPTH` levels.

    Raises:
        ExpressionError: If it has more.
    """
    if depth(expression) > MAX_DEPTH:
        raise ExpressionError(f"the expression has more than {MAX_DEPTH} levels")
    return expression


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
        case ast.Name(name) if (word := name.removeprefix("v_")) in FUNCTIONS:
            raise ExpressionError(f"{word} needs a value, as in {word}(2)")
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
