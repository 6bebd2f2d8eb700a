"""The last step of lowering: live values in their final order, with the names that people read.

Sines and cosines are `s1`, `c1`, `s23`, `c23`, and an angle that is a sum is `q23`, after the joints in it; every
other temporary is `t0`, `t1`, ... in order of definition.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from kinegen.angles import Angle, AngleLabels
from kinegen.ir.order import shorten_lives
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
from kinegen.ir.signs import live_values
from kinegen.ir.values import Half, Node, Values
from kinegen.outputs import Signature

_READINGS = "actuators"
"""The input of kernels that begin at the motors."""

_HALVES = tuple(Half)
_LONG = (Operator.SQRT, Operator.ATAN2)


def name_values(
    values: Values,
    outputs: Sequence[int],
    *,
    signature: Signature,
    parameters: tuple[str, ...],
) -> Program:
    """Put live values in order, name them and make them a program.

    Args:
        values: Numbered values.
        outputs: The number of each output.
        signature: What is computed, for which frames, from what.
        parameters: Names of the runtime parameters.

    Returns:
        The checked program.
    """
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
    def __init__(self, values: Values, labels: AngleLabels, vector: str) -> None:
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
        live = set(live_values(self.values, outputs))
        trigonometric = [number for number in sorted(live) if isinstance(self._operator(number), Half)]
        for angle in sorted({self._node(number).operands[0] for number in trigonometric}, key=self._angle_key):
            self._add_angle(angle)
        early = set(live_values(self.values, trigonometric))
        rank = {angle: place for place, angle in enumerate(self.angles)}
        pairs = sorted(
            trigonometric,
            key=lambda number: (rank[self._node(number).operands[0]], self._operator(number) is Half.COS),
        )
        sums = [number for number in sorted(early) if self._is_operation(number) and number not in pairs]
        rounds = self._rounds(live, _HALVES)
        first = sorted([*sums, *pairs], key=lambda number: rounds[number])  # in each round sums, then pairs
        late = [number for number in sorted(live) if self._is_operation(number) and number not in early]
        return first + [number for group in self._grouped(live, late) for number in shorten_lives(self.values, group)]

    def _grouped(self, live: set[int], late: list[int]) -> list[list[int]]:
        """Roots and arc tangents that wait for the same ones stand together, with what leads to them before.

        Each takes a processor long but leaves it time for its neighbours: the eight solutions of an arm of six joints
        come in two thirds of the time.
        """
        rounds = self._rounds(live, _LONG)
        groups: dict[tuple[int, bool], list[int]] = {}
        for number in late:
            groups.setdefault((rounds[number], self._operator(number) in _LONG), []).append(number)
        return [groups[key] for key in sorted(groups)]

    def _rounds(self, live: set[int], operators: tuple[Operator | Half, ...]) -> dict[int, int]:
        """How many of some operators have to be taken one after the other before each value can be computed."""
        rounds: dict[int, int] = {}
        for number in sorted(live):
            node = self.nodes[number]
            operands = node.operands if isinstance(node, Node) else ()
            rounds[number] = max(
                (rounds[operand] + (self._operator(operand) in operators) for operand in operands), default=0
            )
        return rounds

    def name(self, number: int) -> None:
        """Give a live operation its name."""
        node = self._node(number)
        if isinstance(node.operator, Half):
            self.names[number] = self._pair_names(node.operands[0])[node.operator is Half.COS]
        elif number in self.angles:
            self.names[number] = "q" + self.angles[number].label
        else:
            self.names[number] = f"t{self.temporaries}"
            self.temporaries += 1

    def statement(self, number: int) -> Statement:
        """The statement of a named operation; of one half of a pair that of both."""
        node = self._node(number)
        operands = tuple(self.operand(operand) for operand in node.operands)
        if isinstance(node.operator, Half):
            return Statement(self._pair_names(node.operands[0]), Operator.SINCOS, operands)
        return Statement((self.names[number],), node.operator, operands)

    def _pair_names(self, angle: int) -> tuple[str, str]:
        label = self.angles[angle].label
        return f"s{label}", f"c{label}"

    def operand(self, number: int) -> Operand:
        """A value as an operand."""
        node = self.nodes[number]
        return Temporary(self.names[number]) if isinstance(node, Node) else node

    def _add_angle(self, number: int) -> None:
        angle = self._angle(number)
        self.angles[number] = AngleSum(self.labels.label(angle, number), self._text(angle), len(angle.terms) > 1)

    def _angle_key(self, number: int) -> tuple[list[int], int]:
        return [joint for joint, _ in self._angle(number).terms], number

    def _angle(self, number: int) -> Angle:
        """An angle as a linear combination of joint variables, as far as it is one."""
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
        """An angle in words: `q2 + q3` of joint variables, `actuators[1]` of readings."""
        return str(angle) if self.vector != _READINGS else angle.text(lambda place: f"{_READINGS}[{place - 1}]")

    def _constant(self, number: int) -> Fraction:
        node = self.nodes[number]
        return node.value if isinstance(node, Constant) else Fraction(1)

    def _node(self, number: int) -> Node:
        node = self.nodes[number]
        if not isinstance(node, Node):
            raise TypeError(f"value {number} is not an operation")
        return node

    def _operator(self, number: int) -> Operator | Half | None:
        node = self.nodes[number]
        return node.operator if isinstance(node, Node) else None

    def _is_operation(self, number: int) -> bool:
        return isinstance(self.nodes[number], Node)
