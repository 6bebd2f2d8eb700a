"""The last step of lowering: live values in their final order, with the names that people read.

Sines and cosines are `s1`, `c1`, `s23`, `c23`, and an angle that is a sum is `q23`, after the joints in it; every
other temporary is `t0`, `t1`, ... in order of definition. The order keeps few results waiting for their use, as a
processor with few registers likes, and follows from the operations alone.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from fractions import Fraction
from heapq import heapify, heappop, heappush
from typing import Any, Protocol

from kinegen.ir.program import (
    AngleSum,
    Constant,
    Operand,
    Operator,
    Program,
    RuntimeParameter,
    Statement,
    Temporary,
    Variable,
)
from kinegen.ir.value_numbering import Node, SinOrCos, ValueTable, live_values
from kinegen.model.angle_sums import Angle, AngleLabels
from kinegen.model.outputs import Signature


class _Statement(Protocol):
    @property
    def results(self) -> Sequence[str]:
        """The temporaries that it defines."""

    @property
    def operands(self) -> Sequence[Any]:
        """Return what it reads."""


class _Code(Protocol):
    @property
    def statements(self) -> Sequence[_Statement]:
        """The code."""

    @property
    def outputs(self) -> Sequence[Any]:
        """The numbers of the results."""


def last_reads(code: _Code) -> dict[str, int]:
    """Return the place of the statement that reads a temporary last.

    Returns by name, in the order in which the temporaries are read first; without those that are results.
    """
    kept = {operand.name for operand in code.outputs if isinstance(operand, Temporary)}
    return {name: place for name, place in _last_statements(code).items() if name not in kept}


def most_alive(code: _Code) -> int:
    """Return how many temporaries wait for a statement that reads them at the same time, at most."""
    last = _last_statements(code)
    ending = Counter(last.values())
    alive = most = 0
    for place, statement in enumerate(code.statements):
        alive += sum(name in last for name in statement.results) - ending[place]
        most = max(most, alive)
    return most


def _last_statements(code: _Code) -> dict[str, int]:
    return {
        operand.name: place
        for place, statement in enumerate(code.statements)
        for operand in statement.operands
        if isinstance(operand, Temporary)
    }


def minimize_live_ranges(values: ValueTable, numbers: Sequence[int]) -> list[int]:
    """Put first what ends the most waiting.

    Of all operations whose operands are there, the next one leaves the fewest results waiting; of equals, the one that
    was defined first. A result that nothing but an output needs does not wait, since emitters store it at once.

    On a Cortex-M4F this halves the stack that the link frames of a 7-joint arm take. A search for the best order would
    gain little more: compilers shift statements too.

    `numbers`: operations, ascending; their operands may also be values that stand before all of them.
    """
    # Which operations wait for which, and how many users each result has left.
    operands = {number: _operands(values, number) for number in numbers}
    users: dict[int, list[int]] = {}
    for number, each in operands.items():
        for operand in each:
            users.setdefault(operand, []).append(number)
    uses = {operand: len(each) for operand, each in users.items()}
    missing = {number: len(each & operands.keys()) for number, each in operands.items()}

    def left_waiting(number: int) -> int:
        return (number in uses) - sum(uses[operand] == 1 for operand in operands[number])

    # An entry whose number was placed, or leaves fewer waiting than it says, is passed over.
    ready = [(left_waiting(number), number) for number in numbers if not missing[number]]
    heapify(ready)
    order: dict[int, None] = {}
    while ready:
        waiting, number = heappop(ready)
        if number in order or waiting != left_waiting(number):
            continue
        order[number] = None
        # Operands with one user left end their waiting with it: it may now be the best next one.
        changed = []
        for operand in operands[number]:
            uses[operand] -= 1
            if uses[operand] == 1:
                changed += [user for user in users[operand] if user not in order and not missing[user]]
        # Users whose last operand this was are ready.
        for user in users.get(number, ()):
            missing[user] -= 1
            if not missing[user]:
                changed.append(user)
        for user in changed:
            heappush(ready, (left_waiting(user), user))
    return list(order)


def _operands(values: ValueTable, number: int) -> frozenset[int]:
    """Return the operations whose results an operation reads."""
    return frozenset(operand for operand in values.operands(number) if values.operator(operand) is not None)


_READINGS = "actuators"
"""The input of kernels that begin at the motors."""

_HALVES = tuple(SinOrCos)
_LONG = (Operator.SQRT, Operator.ATAN2)


def name_values(
    values: ValueTable,
    outputs: Sequence[int],
    *,
    signature: Signature,
    parameters: tuple[str, ...],
) -> Program:
    """Put live values in order, name them and make them a program."""
    naming = _Naming(values, AngleLabels(signature.dof), signature.inputs[0].name if signature.inputs else "q")
    order = naming.order(outputs)
    for number in order:
        naming.name(number)
    statements = dict.fromkeys(naming.statement(number) for number in order)  # one for both halves of a pair
    return Program(
        signature=signature,
        parameters=parameters,
        angles=tuple(naming.angles.values()),
        statements=tuple(statements),
        outputs=tuple(naming.operand(number) for number in outputs),
    )


class _Naming:
    def __init__(self, values: ValueTable, labels: AngleLabels, vector: str) -> None:
        self.vector = vector
        self.values = values
        self.nodes = values.nodes
        self.labels = labels
        self.angles: dict[int, AngleSum] = {}
        self.names: dict[int, str] = {}
        self.temporaries = 0

    def order(self, outputs: Sequence[int]) -> list[int]:
        """Live operations: everything that leads to a sine or cosine first, then the rest, results soon used.

        The pairs come first because each is a call in C: whatever waits across a call costs stack. Pairs of angles that
        depend on other pairs come after those, with what leads to them.
        """
        # The order of labels follows the joints, not the order of definition.
        live = set(live_values(self.values, outputs))
        trigonometric = [number for number in sorted(live) if isinstance(self.values.operator(number), SinOrCos)]
        for angle in sorted({self._node(number).operands[0] for number in trigonometric}, key=self._angle_key):
            self._add_angle(angle)
        # In each round the sums that pairs wait for, then the pairs, the sine before the cosine.
        early = set(live_values(self.values, trigonometric))
        rank = {angle: place for place, angle in enumerate(self.angles)}
        pairs = sorted(
            trigonometric,
            key=lambda number: (rank[self._node(number).operands[0]], self.values.operator(number) is SinOrCos.COS),
        )
        sums = [number for number in sorted(early) if self.values.operator(number) is not None and number not in pairs]
        rounds = self._rounds(live, _HALVES)
        first = sorted([*sums, *pairs], key=lambda number: rounds[number])  # in each round sums, then pairs
        late = [number for number in sorted(live) if self.values.operator(number) is not None and number not in early]
        return first + [
            number for group in self._grouped(live, late) for number in minimize_live_ranges(self.values, group)
        ]

    def _grouped(self, live: set[int], late: list[int]) -> list[list[int]]:
        """Roots and arc tangents that wait for the same ones stand together, with what leads to them before.

        Each takes a processor long but leaves it time for its neighbours: the eight solutions of an arm of six joints
        come in two thirds of the time.
        """
        rounds = self._rounds(live, _LONG)
        groups: dict[tuple[int, bool], list[int]] = {}
        for number in late:
            groups.setdefault((rounds[number], self.values.operator(number) in _LONG), []).append(number)
        return [groups[key] for key in sorted(groups)]

    def _rounds(self, live: set[int], operators: tuple[Operator | SinOrCos, ...]) -> dict[int, int]:
        """Return how many of some operators have to be taken one after the other before each value can be computed."""
        rounds: dict[int, int] = {}
        for number in sorted(live):
            rounds[number] = max(
                (
                    rounds[operand] + (self.values.operator(operand) in operators)
                    for operand in self.values.operands(number)
                ),
                default=0,
            )
        return rounds

    def name(self, number: int) -> None:
        node = self._node(number)
        if isinstance(node.operator, SinOrCos):
            self.names[number] = self._pair_names(node.operands[0])[node.operator is SinOrCos.COS]
        elif number in self.angles:
            self.names[number] = "q" + self.angles[number].label
        else:
            self.names[number] = f"t{self.temporaries}"
            self.temporaries += 1

    def statement(self, number: int) -> Statement:
        """Return the statement of a named operation; of one half of a pair that of both."""
        node = self._node(number)
        operands = tuple(self.operand(operand) for operand in node.operands)
        if isinstance(node.operator, SinOrCos):
            return Statement(self._pair_names(node.operands[0]), Operator.SINCOS, operands)
        return Statement((self.names[number],), node.operator, operands)

    def _pair_names(self, angle: int) -> tuple[str, str]:
        label = self.angles[angle].label
        return f"s{label}", f"c{label}"

    def operand(self, number: int) -> Operand:
        node = self.nodes[number]
        return Temporary(self.names[number]) if isinstance(node, Node) else node

    def _add_angle(self, number: int) -> None:
        angle = self._angle(number)
        self.angles[number] = AngleSum(self.labels.label(angle, number), self._text(angle), len(angle.terms) > 1)

    def _angle_key(self, number: int) -> tuple[list[int], int]:
        return [joint for joint, _ in self._angle(number).terms], number

    def _angle(self, number: int) -> Angle:
        """Return an angle as a linear combination of joint variables, as far as it is one."""
        node = self.nodes[number]
        if isinstance(node, Variable):
            return Angle(((node.index + 1, Fraction(1)),))
        if isinstance(node, Constant):
            return Angle((), f"{float(node.value):.6g}")
        if isinstance(node, RuntimeParameter):
            return Angle((), node.name)
        match node.operator:
            case Operator.ADD:
                return self._angle(node.operands[0]).plus(self._angle(node.operands[1]), 1)
            case Operator.SUB:
                return self._angle(node.operands[0]).plus(self._angle(node.operands[1]), -1)
            case Operator.MUL if isinstance(self.nodes[node.operands[1]], Constant):
                return self._angle(node.operands[0]).times(self._constant(node.operands[1]))
            case Operator.MUL if isinstance(self.nodes[node.operands[0]], Constant):
                return self._angle(node.operands[1]).times(self._constant(node.operands[0]))
            case _:
                return Angle((), "...")

    def _text(self, angle: Angle) -> str:
        """Return an angle in words: `q2 + q3` of joint variables, `actuators[1]` of readings."""
        return str(angle) if self.vector != _READINGS else angle.text(lambda place: f"{_READINGS}[{place - 1}]")

    def _constant(self, number: int) -> Fraction:
        node = self.nodes[number]
        return node.value if isinstance(node, Constant) else Fraction(1)

    def _node(self, number: int) -> Node:
        node = self.nodes[number]
        if not isinstance(node, Node):
            raise TypeError(f"value {number} is not an operation")
        return node
