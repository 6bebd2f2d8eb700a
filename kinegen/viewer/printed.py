"""The ordered trees of a closed form as JSON, beside those of `expressions`.

A list begins with an operation, as there; `["c", label]` and `["s", label]` are the cosine and sine of an angle of the
closed form, and `["n", name]` is a parameter as it is printed.
"""

from __future__ import annotations

import math

from kinegen.textbook.closed_form import Factor, Function, Pi, Power, Ratio, Root, Sum, Symbol, Term
from kinegen.viewer.expressions import Tree


def printed_tree(part: Sum | Factor | Term) -> Tree:
    """A sum, term or factor of a closed form as a tree, with every name kept.

    Args:
        part: What `kinegen.textbook.closed_form` made.

    Returns:
        The tree; its value is in radians and the file's length unit.
    """
    match part:
        case Sum(terms):
            return _joined("+", [printed_tree(term) for term in terms], 0)
        case Term(sign, factors):
            trees = [printed_tree(factor) for factor in factors]
            return _joined("*", [-1, *trees] if sign < 0 else trees, 1)
        case Symbol(name, "sine"):
            return ["s", name]
        case Symbol(name, "cosine"):
            return ["c", name]
        case Symbol(name, "joint"):
            return ["q", int(name[1:]) - 1]
        case Symbol(name):
            return ["n", name]
        case Ratio(value):
            return int(value) if value.denominator == 1 else float(value)
        case Pi():
            return math.pi
        case Root(inside):
            return ["sqrt", printed_tree(inside)]
        case Power(base, exponent):
            return ["^", printed_tree(base), exponent]
        case Function(name, arguments):
            return [name, *map(printed_tree, arguments)]


def _joined(operator: str, parts: list[Tree], neutral: int) -> Tree:
    return parts[0] if len(parts) == 1 else [operator, *parts] if parts else neutral
