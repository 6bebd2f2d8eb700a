"""The printed closed form as matrices of sympy: the same factors and brackets, ready for further algebra.

Symbols have the names of the printout: `q1` for the first joint variable, and the names of parameters. They have no
assumptions, so that `expression.subs("q1", 0.5)` finds them. Sines and cosines are those of the angles, in rad.
"""

from __future__ import annotations

from collections.abc import Mapping

import sympy as sp

from kinegen.textbook.closed_form import ClosedForm, Factor, Function, Pi, Power, Ratio, Root, Sum, Symbol, Term
from kinegen.textbook.sheet import Product

_FUNCTIONS = {"abs": sp.Abs, **{name: getattr(sp, name) for name in "sin cos tan asin acos atan atan2 sqrt".split()}}


def sympy_product(product: Product) -> sp.MatrixBase | sp.MatMul:
    """A product as a matrix, or as a product of matrices that is left as it is where it is printed in parts."""
    matrices = [sympy_matrix(form) for form in product.factors]
    return matrices[0] if len(matrices) == 1 else sp.MatMul(*matrices, evaluate=False)


def sympy_matrix(form: ClosedForm) -> sp.ImmutableMatrix:
    """A closed form as a matrix: 4x4 with the row 0 0 0 1, or 6 rows for a Jacobian."""
    reader = _Trees(dict(form.angles))
    rows = [[reader.sum(entry) for entry in row] for row in form.entries]
    if form.is_transform:
        rows.append([sp.S.Zero, sp.S.Zero, sp.S.Zero, sp.S.One])
    return sp.ImmutableMatrix(len(rows), len(rows[0]), [entry for row in rows for entry in row])


class _Trees:
    """Turns ordered trees back into expressions."""

    def __init__(self, angles: Mapping[str, Sum]) -> None:
        self.angles = {label: self.sum(angle) for label, angle in angles.items()}

    def sum(self, tree: Sum) -> sp.Expr:
        return sp.Add(*map(self.term, tree.terms))

    def term(self, tree: Term) -> sp.Expr:
        return sp.Mul(sp.Integer(tree.sign), *map(self.factor, tree.factors))

    def factor(self, tree: Factor) -> sp.Expr:
        match tree:
            case Symbol(label, "sine"):
                return sp.sin(self.angles[label])
            case Symbol(label, "cosine"):
                return sp.cos(self.angles[label])
            case Symbol(name):
                return sp.Symbol(name)
            case Ratio(value):
                return sp.Rational(value.numerator, value.denominator)
            case Pi():
                return sp.pi
            case Root(inside):
                return sp.sqrt(self.sum(inside))
            case Power(base, exponent):
                return self.factor(base) ** exponent
            case Function(name, arguments):
                return _FUNCTIONS[name](*map(self.sum, arguments))
            case Sum():
                return self.sum(tree)
