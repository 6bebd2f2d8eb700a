"""What is known of the matrix of one or two rows: its norm, the error of its entries, the size of the computed ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from typing import Protocol

from kinegen.ir.bounds.graph import Graph
from kinegen.ir.bounds.numbers import ONE, ZERO, NumberType, norm, root, upper
from kinegen.ir.bounds.rows import Row


class Known(Protocol):
    """What has to be known of a factor."""

    @property
    def exact(self) -> Decimal:
        """Bound of its exact magnitude."""

    @property
    def error(self) -> Decimal:
        """Bound of its error."""

    @property
    def computed(self) -> Decimal:
        """Bound of its computed magnitude."""


@dataclass(frozen=True, slots=True)
class Matrix:
    """Bounds for a matrix of sines and cosines, or of constants.

    Attributes:
        scale: Spectral norm of the exact matrix.
        wobble: Spectral norm of its error.
        weight: Spectral norm of the matrix of the computed magnitudes.
    """

    scale: Decimal
    wobble: Decimal
    weight: Decimal


def matrix(rows: Sequence[Row], graph: Graph, singles: Sequence[Known], real: NumberType) -> Matrix:
    """The matrix of one row, of two rows that turn, or of two rows of constants."""
    factors = [singles[term.factor] for row in rows for term in row.terms]
    size, error, computed = (
        norm(*(factor.exact for factor in factors)),
        norm(*(factor.error for factor in factors)),
        norm(*(factor.computed for factor in factors)),
    )
    if rows[0].angle is None:
        return Matrix(_spectral(rows, graph) if len(rows) > 1 else size, error, computed)
    if len(factors) == 1:
        return Matrix(size, error, computed)
    # Errors of a cosine and a sine: a vector of the plane that adds to their own, and the same turned by a right angle
    # in the other row. An error of the angle moves the pair along the circle, by no more than itself.
    pair = real.pair_error + singles[rows[0].angle].error
    columns = len(rows[0].terms) if len(rows) > 1 else 1
    return Matrix(ONE, min(pair, error), (ONE + pair) * (root(Decimal(columns))))


def _spectral(rows: Sequence[Row], graph: Graph) -> Decimal:
    """The spectral norm of two rows of constants over at most two operands, from its closed form."""
    operands = list(dict.fromkeys(operand for row in rows for operand in row.operands))
    entries = [[Fraction(0), Fraction(0)] for _ in rows]
    for row, line in zip(rows, entries, strict=True):
        for term in row.terms:
            line[operands.index(term.operand)] += term.sign * (graph.constant(term.factor) or 0)
    (a, b), (c, d) = entries
    squares = a * a + b * b + c * c + d * d
    determinant = abs(a * d - b * c)
    spread = root(upper((squares - 2 * determinant) * (squares + 2 * determinant)))
    return root((upper(squares) + spread) / 2) if squares else ZERO
