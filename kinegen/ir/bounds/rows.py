"""Finds the rotations in a program: values that are a row of a 2x2 matrix times one or two other values.

A row is `f * x`, `f * x + g * y` or `f * x - g * y`, where f and g are the cosine and the sine of one angle, or both
constants (a fixed turn, or a scaling). Two rows over the same one or two values are a turn or a reflection if their
signs say so; nothing is taken on trust.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from kinegen.ir.bounds.graph import UNITY, Graph
from kinegen.ir.program import Operator
from kinegen.ir.values import Half


@dataclass(frozen=True, slots=True)
class Term:
    """One product of a row.

    Attributes:
        operand: The value that is multiplied.
        factor: The sine, cosine or constant that multiplies it.
        sign: 1 or -1.
        product: The value of the product; None if `operand` is one and nothing is multiplied.
    """

    operand: int
    factor: int
    sign: int
    product: int | None


@dataclass(frozen=True, slots=True)
class Row:
    """A value as one or two products.

    Attributes:
        value: The value.
        angle: The angle whose cosine and sine multiply; None if constants do.
        terms: The products, of different operands.
    """

    value: int
    angle: int | None
    terms: tuple[Term, ...]

    @property
    def operands(self) -> tuple[int, ...]:
        """The values that are multiplied."""
        return tuple(term.operand for term in self.terms)


def all_rows(graph: Graph) -> tuple[tuple[Row, ...], ...]:
    """For every value the ways in which it is a row."""
    found: list[tuple[Row, ...]] = []
    for number in range(len(graph.nodes)):
        rows = _sums(graph, found, number) if _is_sum(graph, number) else _products(graph, number)
        found.append(tuple(rows))
    return tuple(found)


def turns(first: Row, second: Row, graph: Graph) -> bool:
    """Whether two rows over one angle are the rows of a rotation or reflection, or a column of one.

    Args:
        first: A row of sine and cosine.
        second: Another one.
        graph: The values.

    Returns:
        True for `(c x, s x)` and for `(c x + s y, s x - c y)` in any order and with any signs that make the rows
        orthogonal.
    """
    if first.angle is None or first.angle != second.angle or set(first.operands) != set(second.operands):
        return False
    others = {term.operand: term for term in second.terms}
    signs = 1
    for term in first.terms:
        other = others[term.operand]
        if graph.operation(term.factor) is graph.operation(other.factor):
            return False
        signs *= term.sign * other.sign
    return len(first.terms) == 1 or signs == -1


def _is_sum(graph: Graph, number: int) -> bool:
    return graph.operation(number) in (Operator.ADD, Operator.SUB)


def _products(graph: Graph, number: int) -> Iterator[Row]:
    operator, operands = graph.operation(number), graph.operands(number)
    if isinstance(operator, Half):
        yield Row(number, operands[0], (Term(UNITY, number, 1, None),))
    elif operator is Operator.MUL:
        for factor, operand in (operands, operands[::-1]):
            if isinstance(graph.operation(factor), Half):
                yield Row(number, graph.operands(factor)[0], (Term(operand, factor, 1, number),))
            elif graph.constant(factor) is not None:
                yield Row(number, None, (Term(operand, factor, 1, number),))


def _sums(graph: Graph, found: list[tuple[Row, ...]], number: int) -> Iterator[Row]:
    first, second = graph.operands(number)
    sign = 1 if graph.operation(number) is Operator.ADD else -1
    if _is_sum(graph, first) or _is_sum(graph, second):
        return
    for one in found[first]:
        for other in found[second]:
            (x,), (y,) = one.terms, other.terms
            distinct = one.angle is None or graph.operation(x.factor) is not graph.operation(y.factor)
            if one.angle == other.angle and x.operand != y.operand and distinct:
                yield Row(number, one.angle, (x, Term(y.operand, y.factor, sign, y.product)))
