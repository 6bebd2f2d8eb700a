"""Exact expressions of a robot file: text in, an exact tree out, and nothing evaluated.

In: the text of one table entry, such as `q - 90`, `pi/2`, `0.5*elbow + 10` or `sqrt(2)*a2`. Out: a tree of frozen nodes
with rational numbers (`0.4318` is 4318/10000; see `expression_nodes`). Units, and what a name refers to, are the
loader's business.
"""

from __future__ import annotations

import ast
import re
import unicodedata
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

from kinegen.model.expression_nodes import (
    MAX_EXPONENT,
    ONE,
    PI,
    ZERO,
    Atan2,
    Call,
    Expression,
    ExpressionError,
    Linear,
    Name,
    Number,
    Pi,
    Power,
    Product,
    Sum,
    add,
    arc_tangent,
    arcs,
    call,
    depth,
    divisors,
    is_arc,
    largest_number,
    linear,
    multiply,
    names,
    negate,
    number,
    parts_of,
    power,
    rebuilt,
    roots,
    size,
    substitute,
    without_arcs,
)
from kinegen.support.dataclass import dataclass

__all__ = [
    "ACTUATOR_FUNCTIONS",
    "FUNCTIONS",
    "MAX_EXPONENT",
    "ONE",
    "PI",
    "ZERO",
    "Arithmetic",
    "Atan2",
    "Call",
    "Expression",
    "ExpressionError",
    "Linear",
    "Name",
    "Number",
    "Pi",
    "Power",
    "Product",
    "Sum",
    "add",
    "arc_tangent",
    "arcs",
    "call",
    "checked_depth",
    "depth",
    "divisors",
    "evaluate",
    "is_arc",
    "largest_number",
    "linear",
    "multiply",
    "names",
    "negate",
    "number",
    "parse",
    "parts_of",
    "power",
    "rebuilt",
    "roots",
    "size",
    "substitute",
    "text_names",
    "without_arcs",
]

FUNCTIONS = ("sqrt", "asin", "acos", "atan", "atan2")
"""The functions of the language, all of constants; `pi` is its only other word."""

ACTUATOR_FUNCTIONS = (*FUNCTIONS, "sin", "cos")
"""What the expressions of `actuators` may use, also of joints and readings; the table is linear in its joints."""

_VALUES = {"sqrt": "2", "sin": "30", "cos": "30", "asin": "0.5", "acos": "0.5", "atan": "0.5", "atan2": "1, 2"}
"""A value of each function, for messages."""

MAX_LENGTH = 500
MAX_DEPTH = 40
"""Levels of brackets, and of the tree; later stages recurse over it with a few frames for each level."""
MAX_DIGITS = 60
_SPELLING = re.compile(r"[A-Za-z0-9_+\-*/().,\s]*\Z")
_WORD = re.compile(r"(?P<name>[A-Za-z_][A-Za-z0-9_]*)|(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)")

MINUS = "\N{MINUS SIGN}"
"""What printed tables and PDF files have in place of `-`; it is read as that."""

_UNIT = re.compile(r"[0-9.)]\s*(mm|cm|m|in|inch|inches|ft|deg|degrees?|rad|radians?)\b", re.IGNORECASE)
_UNIT_SIGNS = "\N{DEGREE SIGN}\N{PRIME}\N{DOUBLE PRIME}"
_UNITLESS = "; write the number without its unit, which units: or --table sets"

_DATE = re.compile(r"\s*[0-9]{4}-[0-9]{1,2}-[0-9]{1,2}\s*\Z")
_OCTAL = re.compile(r"0[0-9]+\Z")


@dataclass(frozen=True, slots=True)
class Arithmetic:
    """The kind of numbers in which `evaluate` works: floats, mpmath, sympy, arrays.

    Attributes:
        number: Makes a number from a fraction.
        pi: The value of pi.
        functions: One callable for each function that occurs, `FUNCTIONS` at least.
    """

    number: Callable[[Fraction], Any]
    pi: Any
    functions: Mapping[str, Callable[..., Any]]


def evaluate(expression: Expression, values: Mapping[str, Any], arithmetic: Arithmetic) -> Any:
    """Evaluate an expression in any kind of numbers, with a value for each name in it."""
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
        case Atan2(y, x):
            return arithmetic.functions["atan2"](evaluate(y, values, arithmetic), evaluate(x, values, arithmetic))


def parse(text: str, functions: tuple[str, ...] = FUNCTIONS) -> Expression:
    """Read one expression.

    Args:
        text: Numbers, names, `pi`, `+ - * / **`, brackets and functions.
        functions: The functions that may be used; `FUNCTIONS`, or `ACTUATOR_FUNCTIONS`.

    Returns:
        The exact tree. Exponents are integers; nothing is evaluated in floating point.

    Raises:
        ExpressionError: If the text is anything else; bounded in length, depth and size of numbers.
    """
    text = text.replace(MINUS, "-")
    if len(text) > MAX_LENGTH:
        raise ExpressionError(f"the expression has {len(text)} characters (at most {MAX_LENGTH})")
    if not text.strip():
        raise ExpressionError("the expression is empty")
    if _SPELLING.match(text) is None:
        bad = next(character for character in text if _SPELLING.match(character) is None)
        instead = "; write - for a minus" if unicodedata.category(bad) == "Pd" else _UNITLESS * (bad in _UNIT_SIGNS)
        raise ExpressionError(f"{bad!r} is not allowed in an expression{instead}")
    if _DATE.match(text):
        raise ExpressionError(f"'{text.strip()}' is a date; write a difference with spaces, as in 3 - 2 - 1")
    if _depth(text) > MAX_DEPTH:
        raise ExpressionError(f"brackets are nested more than {MAX_DEPTH} deep")
    exact: list[Fraction] = []
    marked = _WORD.sub(lambda match: _mark(match, exact), text)
    try:
        tree = ast.parse(marked.strip(), mode="eval")
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        unitless = _UNITLESS if _UNIT.search(text) else ""
        raise ExpressionError(f"'{text.strip()}' is not an expression{unitless}") from None
    return checked_depth(_Conversion(exact, functions).convert(tree.body, 0))


def checked_depth(expression: Expression) -> Expression:
    """Refuse an expression of more than `MAX_DEPTH` levels."""
    if depth(expression) > MAX_DEPTH:
        raise ExpressionError(f"the expression has more than {MAX_DEPTH} levels")
    return expression


def text_names(text: str, functions: tuple[str, ...] = FUNCTIONS) -> tuple[str, ...]:
    """Return the names in the text of an expression, each once, also those that fold away, as in `0*q`."""
    words = (match["name"] for match in _WORD.finditer(text))
    return tuple(dict.fromkeys(word for word in words if word and word != "pi" and word not in functions))


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
    if _OCTAL.match(digits):
        raise ExpressionError(f"the number {digits[:20]} begins with 0, as octal numbers do; write it without")
    mantissa, _, exponent = digits.lower().partition("e")
    if len(mantissa) > MAX_DIGITS:
        raise ExpressionError(f"the number {digits[:20]}... has {len(mantissa)} characters (at most {MAX_DIGITS})")
    if abs(int(exponent or "0")) > MAX_EXPONENT:
        raise ExpressionError(f"the number {digits[:20]} is out of bounds")
    exact.append(Fraction(digits))
    return len(exact) - 1


@dataclass(frozen=True, slots=True)
class _Conversion:
    """From Python's tree to ours, given the numbers that were hidden and the functions that may be used."""

    exact: list[Fraction]
    functions: tuple[str, ...]

    def convert(self, node: ast.expr, depth: int) -> Expression:
        """Convert one node and all below it."""
        if depth > 4 * MAX_DEPTH:
            raise ExpressionError("the expression is too long")
        match node:
            case ast.Subscript(ast.Name("n_"), ast.Constant(int(index))):
                return Number(self.exact[index])
            case ast.Name("v_pi"):
                return PI
            case ast.Name(name) if (word := name.removeprefix("v_")) in self.functions:
                needed = "two values" if word == "atan2" else "a value"
                raise ExpressionError(f"{word} needs {needed}, as in {word}({_VALUES[word]})")
            case ast.Name(name):
                return Name(name.removeprefix("v_"))
            case ast.UnaryOp(ast.UAdd(), operand):
                return self.convert(operand, depth + 1)
            case ast.UnaryOp(ast.USub(), operand):
                return negate(self.convert(operand, depth + 1))
            case ast.BinOp(left, operator, right):
                return _combine(self.convert(left, depth + 1), operator, self.convert(right, depth + 1))
            case ast.Call(ast.Name(name), arguments, []):
                return self._call(name.removeprefix("v_"), arguments, depth)
            case ast.Tuple():
                raise ExpressionError("',' is not allowed in an expression (a decimal point is written '.')")
        words = ", ".join(self.functions)
        raise ExpressionError(f"only numbers, names, pi, {words}, + - * / ** and brackets are allowed")

    def _call(self, function: str, arguments: list[ast.expr], depth: int) -> Expression:
        if function not in self.functions:
            raise ExpressionError(f"unknown function '{function}' (expected {', '.join(self.functions)})")
        wanted = 2 if function == "atan2" else 1
        if len(arguments) != wanted:
            raise ExpressionError(f"{function} takes {wanted} value{'s' if wanted > 1 else ''}, found {len(arguments)}")
        values = [self.convert(argument, depth + 1) for argument in arguments]
        return arc_tangent(values[0], values[1]) if function == "atan2" else call(function, values[0])


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
