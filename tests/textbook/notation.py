"""Reads the shorthand of the published entries: `c1*(a2*c2 + a3*c23)` to sympy.

`c1`, `s1`, `c23`, `s234` are cosine and sine of the sum of the joint variables with these one-digit numbers. Any other
name is a joint variable or a parameter. Text is read through Python's grammar and never evaluated.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping, Sequence
from fractions import Fraction

import sympy as sp

_SHORTHAND = re.compile(r"(?P<function>[cs])(?P<digits>[1-9]+)\Z")
_FUNCTIONS = {"sin": sp.sin, "cos": sp.cos, "sqrt": sp.sqrt, "atan": sp.atan}


def read(text: str | float, names: Mapping[str, sp.Expr], angles: Sequence[sp.Expr], first: int = 1) -> sp.Expr:
    """Read one entry.

    Args:
        text: The entry; YAML may have made a number of it.
        names: What each name stands for.
        angles: The joint variables in the order of q, for the shorthand.
        first: Number of the first joint variable in the shorthand.

    Returns:
        The exact sympy expression.

    Raises:
        KeyError: If a name is unknown.
    """
    return _convert(ast.parse(str(text).strip(), mode="eval").body, names, angles, first)


def _convert(node: ast.expr, names: Mapping[str, sp.Expr], angles: Sequence[sp.Expr], first: int) -> sp.Expr:
    def deeper(part: ast.expr) -> sp.Expr:
        return _convert(part, names, angles, first)

    match node:
        case ast.Constant(int() | float() as number):
            exact = Fraction(str(number))
            return sp.Rational(exact.numerator, exact.denominator)
        case ast.Name("pi"):
            return sp.pi
        case ast.Name(name):
            return names[name] if name in names else _shorthand(name, angles, first)
        case ast.UnaryOp(ast.USub(), operand):
            return -deeper(operand)
        case ast.BinOp(left, ast.Add(), right):
            return deeper(left) + deeper(right)
        case ast.BinOp(left, ast.Sub(), right):
            return deeper(left) - deeper(right)
        case ast.BinOp(left, ast.Mult(), right):
            return deeper(left) * deeper(right)
        case ast.BinOp(left, ast.Div(), right):
            return deeper(left) / deeper(right)
        case ast.BinOp(left, ast.Pow(), right):
            return deeper(left) ** deeper(right)
        case ast.Call(ast.Name(function), [argument], []) if function in _FUNCTIONS:
            return _FUNCTIONS[function](deeper(argument))
    raise ValueError(f"cannot read {ast.unparse(node)}")


def _shorthand(name: str, angles: Sequence[sp.Expr], first: int) -> sp.Expr:
    match = _SHORTHAND.match(name)
    if match is None:
        raise KeyError(name)
    angle = sum((angles[int(digit) - first] for digit in match["digits"]), start=sp.S.Zero)
    return sp.cos(angle) if match["function"] == "c" else sp.sin(angle)
