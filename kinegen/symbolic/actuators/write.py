"""Free expressions in the few functions that a kernel has: roots, `atan2`, sines, cosines and selects."""

from __future__ import annotations

import sympy as sp

from kinegen.symbolic.coordinates import less
from kinegen.symbolic.expressions import Tape


def write(expression: sp.Expr, tape: Tape) -> sp.Expr:
    """Write arc functions as `atan2`, powers of roots as roots, and signs as selects.

    Args:
        expression: Any expression of the file, or its derivative.
        tape: Receives the intermediate values.
    """
    if not expression.free_symbols or expression.is_Symbol:
        return expression
    parts = [write(argument, tape) for argument in expression.args]
    if isinstance(expression, (sp.acos, sp.asin)):
        value = tape.name(parts[0])
        other = _root(tape, (1 - value) * (1 + value))
        pair = (other, value) if isinstance(expression, sp.acos) else (value, other)
        return sp.atan2(*pair, evaluate=False)
    if isinstance(expression, sp.atan2):
        return sp.atan2(tape.name(parts[0]), tape.name(parts[1]), evaluate=False)
    if isinstance(expression, (sp.Abs, sp.sign)):
        value = tape.name(parts[0])
        negative, positive = (-value, value) if isinstance(expression, sp.Abs) else (sp.S.NegativeOne, sp.S.One)
        return less(tape, value, sp.S.Zero, negative, positive)
    if isinstance(expression, sp.Pow) and (2 * expression.exp).is_Integer and not expression.exp.is_Integer:
        return _root(tape, parts[0]) ** (2 * expression.exp)
    return expression.func(*parts)


def _root(tape: Tape, square: sp.Expr) -> sp.Expr:
    # The square gets a name first, or sympy would see through the root.
    return tape.name(sp.sqrt(tape.name(square)))
