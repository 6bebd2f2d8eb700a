"""The values of a program: numbered, each once whatever its sign, with the exact ranges of those without a sine."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction

from kinegen.ir.bounds.numbers import UnboundedError
from kinegen.ir.program import Constant, Operand, Operator, Program, RuntimeParameter, Statement, Temporary, Variable
from kinegen.ir.values import Half, Leaf, Node, Value, Values

Interval = tuple[Fraction, Fraction]


@dataclass(frozen=True, slots=True)
class Ranges:
    """Where the inputs of a program lie.

    Attributes:
        joints: The smallest and the largest value of each joint variable.
        parameters: The exact value of each runtime parameter.
    """

    joints: tuple[Interval, ...]
    parameters: tuple[Fraction, ...]


@dataclass(frozen=True, slots=True)
class Graph:
    """The values of a program; operands always have smaller numbers than results.

    Attributes:
        nodes: Leaves and operations.
        outputs: The value of each output, up to its sign.
        angles: The values of which a sine or cosine is taken.
    """

    nodes: tuple[Leaf | Node, ...]
    outputs: tuple[int, ...]
    angles: frozenset[int]

    def operation(self, number: int) -> Operator | Half | None:
        """The operator of a value, or None for a leaf."""
        node = self.nodes[number]
        return node.operator if isinstance(node, Node) else None

    def operands(self, number: int) -> tuple[int, ...]:
        """The operands of a value, none for a leaf."""
        node = self.nodes[number]
        return node.operands if isinstance(node, Node) else ()

    def constant(self, number: int) -> Fraction | None:
        """The magnitude of a constant, or None for any other value."""
        node = self.nodes[number]
        return node.value if isinstance(node, Constant) else None


def graph_of(program: Program) -> Graph:
    """Number the values of a program.

    Values that differ in sign alone are one, since rounding to nearest does not see signs, nor do the emitted sine
    and cosine.

    Raises:
        UnboundedError: If it has operations without a rule: roots, arc tangents and selections.
    """
    values = Values()
    values.number(Constant(Fraction(1)))
    known: dict[str, Value] = {}
    used = program.used
    for statement in program.statements:
        if statement.operator is Operator.SINCOS:
            known.update(_halves(values, known, statement, used))
        else:
            known[statement.name] = _value(values, known, statement)
    outputs = tuple(_operand(values, known, operand)[1] for operand in program.outputs)
    nodes = tuple(values.nodes)
    angles = (node.operands[0] for node in nodes if isinstance(node, Node) and isinstance(node.operator, Half))
    return Graph(nodes, outputs, frozenset(angles))


UNITY = 0
"""The number of the constant 1, which every graph holds."""


def _operand(values: Values, known: Mapping[str, Value], operand: Operand) -> Value:
    match operand:
        case Temporary(name):
            return known[name]
        case Constant(value):
            return values.constant(value)
        case Variable() | RuntimeParameter():
            return 1, values.number(operand)


def _halves(
    values: Values, known: Mapping[str, Value], statement: Statement, used: frozenset[Operand]
) -> Iterator[tuple[str, Value]]:
    """Of the sine, which is odd, and the cosine, which is even, those that the program uses."""
    sign, angle = _operand(values, known, statement.operands[0])
    for name, half in zip(statement.results, Half, strict=True):
        if Temporary(name) in used:
            yield name, (sign if half is Half.SIN else 1, values.apply(half, angle))


def _value(values: Values, known: Mapping[str, Value], statement: Statement) -> Value:
    signs, numbers = zip(*(_operand(values, known, operand) for operand in statement.operands), strict=True)
    match statement.operator:
        case Operator.NEG:
            return -signs[0], numbers[0]
        case Operator.MUL | Operator.DIV:
            return signs[0] * signs[1], values.apply(statement.operator, *numbers)
        case Operator.ADD | Operator.SUB:
            second = signs[1] if statement.operator is Operator.ADD else -signs[1]
            return signs[0], values.apply(Operator.ADD if second == signs[0] else Operator.SUB, *numbers)
        case _:
            raise UnboundedError


def intervals(graph: Graph, program: Program, ranges: Ranges) -> tuple[Interval | None, ...]:
    """The exact range of every value that needs no sine or cosine, such as an angle; None for all others.

    Raises:
        UnboundedError: If a divisor may be zero.
    """
    parameters = dict(zip(program.parameters, ranges.parameters, strict=True))
    found: list[Interval | None] = []
    for node in graph.nodes:
        match node:
            case Constant(value):
                found.append((value, value))
            case Variable(index):
                found.append(ranges.joints[index])
            case RuntimeParameter(name):
                found.append((parameters[name], parameters[name]))
            case Node(operator, operands):
                found.append(_range(operator, [found[operand] for operand in operands]))
    return tuple(found)


def largest_angle(program: Program, ranges: Ranges) -> Fraction:
    """The largest magnitude of an angle of which a program takes the sine and cosine; 0 if it takes none."""
    graph = graph_of(program)
    found = intervals(graph, program, ranges)
    ends = (end for angle in graph.angles for end in found[angle] or ())
    return max(map(abs, ends), default=Fraction(0))


def _range(operator: Operator | Half, operands: list[Interval | None]) -> Interval | None:
    ends = [operand for operand in operands if operand is not None]
    if len(ends) < len(operands) or isinstance(operator, Half):
        return None
    (low, high), (first, last) = ends
    match operator:
        case Operator.ADD:
            return low + first, high + last
        case Operator.SUB:
            return low - last, high - first
        case Operator.DIV if first <= 0 <= last:
            raise UnboundedError
        case Operator.DIV:
            first, last = 1 / last, 1 / first
    corners = [one * other for one in (low, high) for other in (first, last)]
    return min(corners), max(corners)
