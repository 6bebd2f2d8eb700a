"""Negations cost a statement each; most vanish when a value is stored with the other sign.

In: numbered values and signed outputs. Out: numbered values whose outputs need no sign. A difference can be stored
either way round (`a - b` or `b - a`), a product takes over the sign of its factors, a constant has whatever sign is
wanted. From every output that would need a negation, the nearby differences are tried the other way round, and what
lowers the number of negations is kept. Roots, arc tangents and selections need their operands with the right sign, as
outputs do; an operand that is a negation is such a need, and becomes a statement only where it cannot be met.
"""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush

from kinegen.ir.program import Constant, Operator
from kinegen.ir.values import Half, Node, Value, Values

_SUMS = (Operator.ADD, Operator.SUB)
_PRODUCTS = (Operator.MUL, Operator.DIV)
_STRICT = (Operator.SQRT, Operator.ATAN2, Operator.SELECT_LT)
"""Operators that need their operands with the right sign."""

Choice = frozenset[int]
"""The values that are to be stored with the other sign, where there is a choice."""


def absorb_signs(values: Values, outputs: Sequence[Value]) -> tuple[Values, list[int]]:
    """Choose signs so that few negations remain, and make the remaining ones explicit.

    Args:
        values: The values; operands before results.
        outputs: Signed outputs.

    Returns:
        New values, and the number of each output among them.
    """
    live = live_values(values, [number for _, number in outputs])
    wanted = (*outputs, *_strict_operands(values, live))
    search = _Search(
        values, tuple(outputs), live, wanted, _users(values, live), _signs_wanted(wanted), _angles(values, live)
    )
    choice: Choice = frozenset()
    signs = search.stored(choice)
    improved = True
    while improved:
        improved = False
        for output in sorted(search.negations(signs)):
            for move in search.moves(output):
                changed = search.changed(signs, choice ^ move, move)
                if search.gain(signs, changed) > 0:
                    choice, improved = choice ^ move, True
                    signs |= changed
                    break
    return _rebuild(search, signs)


def live_values(values: Values, outputs: Sequence[int]) -> tuple[int, ...]:
    """The values that lead to some outputs, these included, in ascending order."""
    needed = set(outputs)
    for number in range(len(values.nodes) - 1, -1, -1):
        node = values.nodes[number]
        if number in needed and isinstance(node, Node):
            needed.update(node.operands)
    return tuple(sorted(needed))


def _users(values: Values, live: Sequence[int]) -> dict[int, list[int]]:
    found: dict[int, list[int]] = {}
    for number in live:
        node = values.nodes[number]
        for operand in dict.fromkeys(node.operands) if isinstance(node, Node) else ():
            found.setdefault(operand, []).append(number)
    return found


def _signs_wanted(wanted: Sequence[Value]) -> dict[int, frozenset[int]]:
    found: dict[int, frozenset[int]] = {}
    for sign, number in wanted:
        found[number] = found.get(number, frozenset()) | {sign}
    return found


def _strict_operands(values: Values, live: Sequence[int]) -> Iterator[Value]:
    nodes = [node for number in live if isinstance(node := values.nodes[number], Node)]
    for node in nodes:
        if node.operator in _STRICT:
            yield from (_unsigned(values, operand) for operand in node.operands)


def _unsigned(values: Values, number: int) -> Value:
    """A value that may be a negation, as a sign and what is negated."""
    node = values.nodes[number]
    return (-1, node.operands[0]) if isinstance(node, Node) and node.operator is Operator.NEG else (1, number)


def _angles(values: Values, live: Sequence[int]) -> frozenset[int]:
    nodes = [node for number in live if isinstance(node := values.nodes[number], Node)]
    return frozenset(node.operands[0] for node in nodes if isinstance(node.operator, Half))


@dataclass(frozen=True, slots=True)
class _Search:
    """What can be stored with which sign.

    Attributes:
        values: The values.
        outputs: Signed outputs.
        live: The values that lead to an output.
        wanted: The outputs, and the signed operands of strict operators.
        users: For each value those computed from it.
        signs_wanted: For each value that is wanted the signs it is wanted with.
        angles: Values with a sine or cosine, which keep their sign where they can: c1m2 is not called cm12.
    """

    values: Values
    outputs: tuple[Value, ...]
    live: tuple[int, ...]
    wanted: tuple[Value, ...]
    users: Mapping[int, Sequence[int]]
    signs_wanted: Mapping[int, frozenset[int]]
    angles: frozenset[int]

    def is_constant(self, number: int) -> bool:
        return isinstance(self.values.nodes[number], Constant)

    def stored(self, choice: Choice) -> dict[int, int]:
        """The sign with which each value is stored, given what is wanted where there is a choice."""
        signs: dict[int, int] = {}
        for number in self.live:
            node = self.values.nodes[number]
            signs[number] = 1
            if isinstance(node, Node):
                free, forced = self._sign(node, signs)
                free = free and number not in self.angles
                signs[number] = (-1 if number in choice else 1) if free else forced
        return signs

    def changed(self, signs: dict[int, int], choice: Choice, move: Choice) -> dict[int, int]:
        """The signs that differ after a move; only what depends on the moved values is looked at."""
        found: dict[int, int] = {}
        pending = sorted(move)
        now = ChainMap(found, signs)
        while pending:
            number = heappop(pending)
            while pending and pending[0] == number:
                heappop(pending)
            node = self.values.nodes[number]
            if not isinstance(node, Node) or number not in signs:
                continue
            free, forced = self._sign(node, now)
            free = free and number not in self.angles
            sign = (-1 if number in choice else 1) if free else forced
            if sign != signs[number]:
                found[number] = sign
                for user in self.users.get(number, ()):
                    heappush(pending, user)
        return found

    def gain(self, signs: dict[int, int], changed: dict[int, int]) -> int:
        """By how many negations fewer there are after a change."""
        gained = 0
        for number, sign in changed.items():
            if not self.is_constant(number):
                wanted = self.signs_wanted.get(number, frozenset())
                gained += any(one != signs[number] for one in wanted) - any(one != sign for one in wanted)
        return gained

    def _sign(self, node: Node, signs: Mapping[int, int]) -> tuple[bool, int]:
        """Whether the sign of a result is free, and what it is if not."""
        if node.operator is Half.SIN:  # an odd function
            return False, signs[node.operands[0]]
        if node.operator not in (*_SUMS, *_PRODUCTS):
            return False, 1
        left, right = node.operands
        constant = self.is_constant(left) or self.is_constant(right)
        if node.operator in _PRODUCTS:
            return constant, signs[left] * signs[right]
        second = signs[right] if node.operator is Operator.ADD else -signs[right]
        return constant or signs[left] != second, signs[left]

    def negations(self, signs: dict[int, int]) -> set[int]:
        """The values that are wanted with the sign that they are not stored with."""
        return {number for sign, number in self.wanted if sign != signs[number] and not self.is_constant(number)}

    def moves(self, output: int) -> Iterator[frozenset[int]]:
        """Changes of the choice that may turn the sign of an output: itself, its operands, both."""
        yield frozenset({output})
        node = self.values.nodes[output]
        if not isinstance(node, Node) or node.operator not in (*_SUMS, *_PRODUCTS):
            return
        for operand in node.operands:
            yield frozenset({operand})
            yield frozenset({operand, output})
            inner = self.values.nodes[operand]
            if isinstance(inner, Node) and inner.operator in (*_SUMS, *_PRODUCTS):
                for deeper in inner.operands:
                    yield frozenset({deeper})
                    yield frozenset({deeper, operand})
                    yield frozenset({deeper, operand, output})
        yield frozenset({*node.operands, output})


def _rebuild(search: _Search, signs: dict[int, int]) -> tuple[Values, list[int]]:
    values = Values()
    moved: dict[int, int] = {}
    for number in search.live:
        node = search.values.nodes[number]
        if isinstance(node, Constant):
            moved[number] = values.number(node)
        elif isinstance(node, Node):
            if node.operator is not Operator.NEG:
                moved[number] = _restored(search, values, signs, moved, number, node)
        else:
            moved[number] = values.number(node)
    return values, [_supplied(search, values, signs, moved, value) for value in search.outputs]


def _supplied(search: _Search, values: Values, signs: dict[int, int], moved: dict[int, int], wanted: Value) -> int:
    """A value with the sign that is wanted."""
    sign, number = wanted
    node = search.values.nodes[number]
    if isinstance(node, Constant):
        return values.number(node.times(sign))
    return moved[number] if sign == signs[number] else values.apply(Operator.NEG, moved[number])


def _restored(
    search: _Search, values: Values, signs: dict[int, int], moved: dict[int, int], number: int, node: Node
) -> int:
    """The same operation on stored operands, with the stored sign."""
    if node.operator in _STRICT:
        wanted = (_unsigned(search.values, operand) for operand in node.operands)
        return values.apply(node.operator, *(_supplied(search, values, signs, moved, value) for value in wanted))
    if node.operator not in (*_SUMS, *_PRODUCTS):
        return values.apply(node.operator, *(moved[operand] for operand in node.operands))
    left, right = node.operands
    if node.operator in _PRODUCTS:
        factors = [moved[left], moved[right]]
        if signs[number] != signs[left] * signs[right]:
            place = 0 if search.is_constant(left) else 1
            factors[place] = _negated(values, factors[place])
        return values.apply(node.operator, *factors)
    first = signs[left] * signs[number]
    second = signs[right] * signs[number] * (1 if node.operator is Operator.ADD else -1)
    if first > 0:
        return values.apply(Operator.ADD if second > 0 else Operator.SUB, moved[left], moved[right])
    if second > 0:
        return values.apply(Operator.SUB, moved[right], moved[left])
    if search.is_constant(left):
        return values.apply(Operator.SUB, _negated(values, moved[left]), moved[right])
    return values.apply(Operator.SUB, _negated(values, moved[right]), moved[left])


def _negated(values: Values, constant: int) -> int:
    node = values.nodes[constant]
    if not isinstance(node, Constant):
        raise ValueError("only a constant changes its sign for nothing")
    return values.number(node.times(-1))
