"""Numbered values: each distinct operation exists once, and signs are kept beside the values, not in them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field
from fractions import Fraction
from functools import reduce
from operator import add, mul

from kinegen.ir.program import Constant, Count, Operator, RuntimeParameter, Variable, counted
from kinegen.support.compat import StrEnum
from kinegen.support.dataclass import dataclass

Leaf = Variable | RuntimeParameter | Constant


class SinOrCos(StrEnum):
    """One result of a sine-cosine pair; a value by itself, with a sign and users of its own."""

    SIN = "sin"
    COS = "cos"


@dataclass(frozen=True, slots=True)
class Node:
    """An operation on numbered values; one of two results is taken by a `SinOrCos`."""

    operator: Operator | SinOrCos
    operands: tuple[int, ...]


Value = tuple[int, int]
"""A sign (1 or -1) and the number of a value."""


@dataclass(slots=True)
class ValueTable:
    """All values of a program under construction; operands always have smaller numbers than results."""

    nodes: list[Leaf | Node] = field(default_factory=list)
    _numbers: dict[Leaf | Node, int] = field(default_factory=dict)

    def variable(self, index: int) -> int:
        """Return an entry of the joint vector."""
        return self.number(Variable(index))

    def parameter(self, name: str) -> int:
        """Return a runtime parameter."""
        return self.number(RuntimeParameter(name))

    def constant(self, value: Fraction, single: Fraction | None = None) -> Value:
        """Return a constant; its number stands for the magnitude. `single` is what single precision takes instead."""
        sign = -1 if value < 0 else 1
        return sign, self.number(Constant(abs(value), None if single in (None, value) else sign * single))

    def apply(self, operator: Operator | SinOrCos, *operands: int) -> int:
        """Return an operation; operands of a sum or product are put in order of first use."""
        ordered = tuple(sorted(operands)) if operator in (Operator.ADD, Operator.MUL) else operands
        return self.number(Node(operator, ordered))

    def total(self, terms: Sequence[Value]) -> Value:
        """Add signed values: constants together, the rest in order of first use, a positive one first."""
        constants = [known.times(sign) for sign, known in self._constants(terms)]
        constant, single = _together(constants, add, Fraction(0))
        moving = sorted((term for term in terms if self._constant(term[1]) is None), key=lambda term: term[1])
        if constant or single or not moving:
            moving.append(self.constant(constant, single))
        # A positive term leads, so that a difference needs no negation.
        lead = next((place for place, (sign, _) in enumerate(moving) if sign > 0), None)
        outer = 1 if lead is not None else -1
        first = moving.pop(lead or 0)[1]
        for sign, term in moving:
            first = self.apply(Operator.ADD if sign == outer else Operator.SUB, first, term)
        return outer, first

    def product(self, factors: Sequence[Value]) -> Value:
        """Multiply signed values: constants together, the rest in order of first use."""
        constants = [known.times(sign) for sign, known in self._constants(factors)]
        constant, single = _together(constants, mul, Fraction(1))
        moving = sorted(factor for _, factor in factors if self._constant(factor) is None)
        # A factor of 1 vanishes, and a factor of 0 makes the whole a constant.
        sign, magnitude = self.constant(constant, single)
        for factor_sign, factor in factors:
            if self._constant(factor) is None:
                sign *= factor_sign
        if constant == single == 0 or not moving:
            return sign, magnitude
        if abs(constant) != 1 or single != constant:
            moving.append(magnitude)
        result = moving[0]
        for factor in moving[1:]:
            result = self.apply(Operator.MUL, result, factor)
        return sign, result

    def quotient(self, dividend: Value, divisor: Value) -> Value:
        """Divide signed values."""
        return dividend[0] * divisor[0], self.apply(Operator.DIV, dividend[1], divisor[1])

    def operator(self, number: int) -> Operator | SinOrCos | None:
        """Return the operator of a value, None for a leaf."""
        node = self.nodes[number]
        return node.operator if isinstance(node, Node) else None

    def operands(self, number: int) -> tuple[int, ...]:
        """Return the operands of a value, none for a leaf."""
        node = self.nodes[number]
        return node.operands if isinstance(node, Node) else ()

    def signed(self, value: Value) -> int:
        """Return the number of a value with its sign, for operations to which a sign matters."""
        sign, number = value
        return number if sign > 0 else self.apply(Operator.NEG, number)

    def select(self, left: Value, right: Value, less: Value, other: Value) -> Value:
        """Return `less` where left is less than right, else `other`; a sign that both have is put in front."""
        if left[0] < 0 and right[0] < 0:
            left, right = (1, right[1]), (1, left[1])
        outer = -1 if less[0] < 0 and other[0] < 0 else 1
        chosen = [(outer * sign, number) for sign, number in (less, other)]
        return outer, self.apply(Operator.SELECT_LT, *(self.signed(value) for value in (left, right, *chosen)))

    def _constants(self, values: Sequence[Value]) -> list[tuple[int, Constant]]:
        found = [(sign, self._constant(number)) for sign, number in values]
        return [(sign, constant) for sign, constant in found if constant is not None]

    def _constant(self, number: int) -> Constant | None:
        node = self.nodes[number]
        return node if isinstance(node, Constant) else None

    def number(self, node: Leaf | Node) -> int:
        """Return the number of a leaf or an operation, new or known."""
        if node not in self._numbers:
            self._numbers[node] = len(self.nodes)
            self.nodes.append(node)
        return self._numbers[node]


def _together(
    constants: Sequence[Constant], combine: Callable[[Fraction, Fraction], Fraction], start: Fraction
) -> tuple[Fraction, Fraction]:
    """Return the sum or product of constants, in double and in single precision; few operations have any."""
    if not constants:
        return start, start
    double = reduce(combine, (each.value for each in constants))
    if all(each.single is None for each in constants):
        return double, double
    return double, reduce(combine, (each.of(True) for each in constants))


def live_values(values: ValueTable, outputs: Sequence[int]) -> tuple[int, ...]:
    """Return the values that lead to some outputs, these included, in ascending order."""
    needed = set(outputs)
    for number in range(len(values.nodes) - 1, -1, -1):
        if number in needed:
            needed.update(values.operands(number))
    return tuple(sorted(needed))


def count_of(values: ValueTable, outputs: list[int]) -> Count:
    """Return the operations of values, of which nothing is ordered or named."""
    operators: list[Operator] = []
    angles = set()
    for number in live_values(values, outputs):
        match values.nodes[number]:
            case Node(SinOrCos(), (angle,)):
                angles.add(angle)
            case Node(Operator() as operator):
                operators.append(operator)
    return counted([*operators, *[Operator.SINCOS] * len(angles)])
