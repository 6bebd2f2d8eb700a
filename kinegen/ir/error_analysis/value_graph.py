"""The values of a program: numbered, each once whatever its sign, with exact ranges; and the rotations among them.

A row is `f * x`, `f * x + g * y` or `f * x - g * y`, where f and g are the cosine and the sine of one angle, or both
constants (a fixed turn, or a scaling). Two rows over the same one or two values are a turn or a reflection if their
signs say so; nothing is taken on trust.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction

from kinegen.ir.error_analysis.directed_rounding import UnboundedError
from kinegen.ir.program import Constant, Operand, Operator, Program, RuntimeParameter, Statement, Temporary, Variable
from kinegen.ir.value_numbering import Leaf, Node, SinOrCos, Value, ValueTable
from kinegen.support.dataclass import dataclass

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

    `outputs`: the value of each output, up to its sign. `angles`: the values of which a sine or cosine is taken.
    """

    nodes: tuple[Leaf | Node, ...]
    outputs: tuple[int, ...]
    angles: frozenset[int]

    def operation(self, number: int) -> Operator | SinOrCos | None:
        """Return the operator of a value, or None for a leaf."""
        node = self.nodes[number]
        return node.operator if isinstance(node, Node) else None

    def operands(self, number: int) -> tuple[int, ...]:
        """Return the operands of a value, none for a leaf."""
        node = self.nodes[number]
        return node.operands if isinstance(node, Node) else ()

    def constant(self, number: int) -> Fraction | None:
        """Return the magnitude of a constant, or None for any other value."""
        node = self.nodes[number]
        return node.value if isinstance(node, Constant) else None


def graph_of(program: Program) -> Graph:
    """Number the values of a program.

    Values that differ in sign alone are one, since rounding to nearest does not see signs, nor do the emitted sine and
    cosine. Raises UnboundedError if it has operations without a rule: roots, arc tangents and selections.
    """
    values = ValueTable()
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
    angles = (node.operands[0] for node in nodes if isinstance(node, Node) and isinstance(node.operator, SinOrCos))
    return Graph(nodes, outputs, frozenset(angles))


UNITY = 0
"""The number of the constant 1, which every graph holds."""


def _operand(values: ValueTable, known: Mapping[str, Value], operand: Operand) -> Value:
    match operand:
        case Temporary(name):
            return known[name]
        case Constant(value):
            return values.constant(value)
        case Variable() | RuntimeParameter():
            return 1, values.number(operand)


def _halves(
    values: ValueTable, known: Mapping[str, Value], statement: Statement, used: frozenset[Operand]
) -> Iterator[tuple[str, Value]]:
    """Of the sine, which is odd, and the cosine, which is even, those that the program uses."""
    sign, angle = _operand(values, known, statement.operands[0])
    for name, half in zip(statement.results, SinOrCos, strict=True):
        if Temporary(name) in used:
            yield name, (sign if half is SinOrCos.SIN else 1, values.apply(half, angle))


def _value(values: ValueTable, known: Mapping[str, Value], statement: Statement) -> Value:
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
    """Return the exact range of every value that needs no sine or cosine, such as an angle; None for all others.

    Raises UnboundedError if a divisor may be zero.
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
    """Return the largest magnitude of an angle of which a program takes the sine and cosine; 0 if it takes none."""
    graph = graph_of(program)
    found = intervals(graph, program, ranges)
    ends = (end for angle in graph.angles for end in found[angle] or ())
    return max(map(abs, ends), default=Fraction(0))


def _range(operator: Operator | SinOrCos, operands: list[Interval | None]) -> Interval | None:
    ends = [operand for operand in operands if operand is not None]
    if len(ends) < len(operands) or isinstance(operator, SinOrCos):
        return None
    # Interval arithmetic with exact fractions.
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


@dataclass(frozen=True, slots=True)
class Term:
    """One product of a row.

    `factor`: the sine, cosine or constant that multiplies it. `product`: the value of the product; None if `operand` is
    one and nothing is multiplied.
    """

    operand: int
    factor: int
    sign: int
    product: int | None


@dataclass(frozen=True, slots=True)
class Row:
    """A value as one or two products.

    `angle`: the angle whose cosine and sine multiply; None if constants do.
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
    """Tell whether two rows over one angle are the rows of a rotation or reflection, or a column of one.

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
    if isinstance(operator, SinOrCos):
        yield Row(number, operands[0], (Term(UNITY, number, 1, None),))
    elif operator is Operator.MUL:
        for factor, operand in (operands, operands[::-1]):
            if isinstance(graph.operation(factor), SinOrCos):
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
