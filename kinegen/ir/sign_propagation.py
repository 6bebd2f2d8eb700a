"""Negations cost a statement each; most vanish when a value is stored with the other sign.

In: numbered values and signed outputs. Out: numbered values whose outputs need no sign. A difference can be stored
either way round (`a - b` or `b - a`), a product takes over the sign of its factors, a constant has whatever sign is
wanted. From every output that would need a negation, the nearby differences are tried the other way round, and what
lowers the number of negations is kept. Roots, arc tangents and selections need their operands with the right sign, as
outputs do; an operand that is a negation is such a need, and becomes a statement only where it cannot be met.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from heapq import heappop, heappush

from kinegen.ir.program import Constant, Operator
from kinegen.ir.value_numbering import Node, SinOrCos, Value, ValueTable, live_values
from kinegen.support.dataclass import dataclass

_SUMS = (Operator.ADD, Operator.SUB)
_PRODUCTS = (Operator.MUL, Operator.DIV)
_STRICT = (Operator.SQRT, Operator.ATAN2, Operator.SELECT_LT)
"""Operators that need their operands with the right sign."""

_LARGE = 600
"""With more values than this, no factor is negated: each that is tried takes as long as all before."""

Choice = frozenset[int]
"""The values that are to be stored with the other sign, where there is a choice."""


def propagate_signs(
    values: ValueTable, outputs: Sequence[Value], *, negate: bool = True, both: bool = False
) -> tuple[ValueTable, list[int]]:
    """Choose signs so that few negations remain, and make the remaining ones explicit.

    Returns new values, and the number of each output among them. `negate`: whether factors of several negative products
    are negated in their place. `both`: whether the search starts a second time, with all differences the other way
    round.
    """
    search = _Search.of(values, outputs)
    if not negate or len(search.live) > _LARGE:
        return _rebuild(search, search.signs())
    found = _with_negatives(search)
    # A second start finds other local optima.
    if both and (least := _negations(found[0])):
        other = _with_negatives(replace(search, start=frozenset(search.live)))
        return other if _negations(other[0]) < least else found
    return found


def _with_negatives(search: _Search) -> tuple[ValueTable, list[int]]:
    """Negate a factor where its negative makes several products negative, and not the products."""
    signs = search.signs()
    found = _rebuild(search, signs)
    least = _negations(found[0])
    for number in search.factors(search.negations(signs)) if least > 1 else ():
        other = replace(search, negatives=search.negatives | {number})
        rebuilt = _rebuild(other, other.signs())
        if _negations(rebuilt[0]) < least:
            search, found, least = other, rebuilt, _negations(rebuilt[0])
    return found


def _negations(values: ValueTable) -> int:
    return sum(isinstance(node, Node) and node.operator is Operator.NEG for node in values.nodes)


def _unsigned(values: ValueTable, number: int) -> Value:
    node = values.nodes[number]
    return (-1, node.operands[0]) if isinstance(node, Node) and node.operator is Operator.NEG else (1, number)


_Rule = tuple[int, int, int, bool]
"""What a sign follows from: the operands, 0 for a product or the factor of the second term of a sum, and whether one of
the operands is a constant. A sine follows the first operand alone, and the second one is -1."""


def _rules(nodes: Mapping[int, Node], values: ValueTable) -> dict[int, _Rule]:
    """Return the rules of the operations whose sign depends on that of an operand."""
    found: dict[int, _Rule] = {}
    for number, node in nodes.items():
        match node:
            case Node(SinOrCos.SIN, (angle,)):
                found[number] = angle, -1, 0, False
            case Node(Operator.ADD | Operator.SUB | Operator.MUL | Operator.DIV as operator, (left, right)):
                factor = 1 if operator is Operator.ADD else -1 if operator is Operator.SUB else 0
                constant = any(isinstance(values.nodes[each], Constant) for each in (left, right))
                found[number] = left, right, factor, constant
    return found


@dataclass(frozen=True, slots=True)
class _Search:
    """What can be stored with which sign.

    Attributes:
        wanted: The outputs, and the signed operands of strict operators.
        signs_wanted: For each value that is wanted the signs it is wanted with.
        angles: Values with a sine or cosine, which keep their sign where they can: c1m2 is not called cm12.
        rules: What the signs of operations follow from; all others are positive.
        negatives: Factors whose negative is computed, so that their products have either sign for nothing.
        start: The values that are stored with the other sign at first, where there is a choice.
    """

    values: ValueTable
    outputs: tuple[Value, ...]
    live: tuple[int, ...]
    wanted: tuple[Value, ...]
    users: Mapping[int, Sequence[int]]
    signs_wanted: Mapping[int, frozenset[int]]
    angles: frozenset[int]
    rules: Mapping[int, _Rule]
    negatives: frozenset[int] = frozenset()
    start: Choice = frozenset()

    @classmethod
    def of(cls, values: ValueTable, outputs: Sequence[Value]) -> _Search:
        """Gather what the search needs, once."""
        live = live_values(values, [number for _, number in outputs])
        nodes = {number: node for number in live if isinstance(node := values.nodes[number], Node)}
        # Operands of roots, arc tangents and selections are wanted with a sign, as outputs are.
        strict = (operand for node in nodes.values() if node.operator in _STRICT for operand in node.operands)
        wanted = (*outputs, *(_unsigned(values, operand) for operand in strict))
        users: dict[int, list[int]] = {}
        for number, node in nodes.items():
            for operand in dict.fromkeys(node.operands):
                users.setdefault(operand, []).append(number)
        signs: dict[int, frozenset[int]] = {}
        for sign, number in wanted:
            signs[number] = signs.get(number, frozenset()) | {sign}
        angles = frozenset(node.operands[0] for node in nodes.values() if isinstance(node.operator, SinOrCos))
        return cls(values, tuple(outputs), live, wanted, users, signs, angles, _rules(nodes, values))

    def signs(self) -> dict[int, int]:
        """Return the sign of each stored value so that few negations remain, as far as single changes lead."""
        choice = self.start
        signs = self.stored(choice)
        improved = True
        while improved:
            improved = False
            for output in sorted(self.negations(signs)):
                for move in self.moves(output):
                    changed = self.changed(signs, choice ^ move, move)
                    if self.gain(signs, changed) > 0:
                        choice, improved = choice ^ move, True
                        signs |= changed
                        break
        return signs

    def factors(self, products: set[int]) -> list[int]:
        """Return the factors of several of some products that are no constants, those of the most products first."""
        nodes = [node for number in sorted(products) if isinstance(node := self.values.nodes[number], Node)]
        found = Counter(
            operand for node in nodes if node.operator in _PRODUCTS for operand in dict.fromkeys(node.operands)
        )
        return [number for number, count in found.most_common() if count > 1 and not self.is_constant(number)]

    def is_constant(self, number: int) -> bool:
        return isinstance(self.values.nodes[number], Constant)

    def stored(self, choice: Choice) -> dict[int, int]:
        """Return the sign with which each value is stored, given what is wanted where there is a choice."""
        signs: dict[int, int] = {}
        for number in self.live:
            signs[number] = self._sign(number, signs, choice)
        return signs

    def changed(self, signs: dict[int, int], choice: Choice, move: Choice) -> dict[int, int]:
        """Return the signs that differ after a move; only what depends on the moved values is looked at."""
        found: dict[int, int] = {}
        pending = sorted(move)
        now = dict(signs)
        while pending:
            number = heappop(pending)
            while pending and pending[0] == number:
                heappop(pending)
            if number not in signs:
                continue
            sign = self._sign(number, now, choice)
            if sign != signs[number]:
                found[number] = now[number] = sign
                for user in self.users.get(number, ()):
                    heappush(pending, user)
        return found

    def gain(self, signs: dict[int, int], changed: dict[int, int]) -> int:
        """By how many negations fewer there are after a change."""
        gained = 0
        for number, sign in changed.items():
            wanted = self.signs_wanted.get(number)
            if wanted and not self.is_constant(number):
                gained += any(one != signs[number] for one in wanted) - any(one != sign for one in wanted)
        return gained

    def _sign(self, number: int, signs: Mapping[int, int], choice: Choice) -> int:
        rule = self.rules.get(number)
        if rule is None:
            return 1
        left, right, factor, free = rule
        if right < 0:  # an odd function
            return signs[left]
        sign = signs[left]
        if factor:
            free = free or sign != factor * signs[right]
        else:
            free = free or left in self.negatives or right in self.negatives
            sign *= signs[right]
        if not free or number in self.angles:
            return sign
        return -1 if number in choice else 1

    def negations(self, signs: dict[int, int]) -> set[int]:
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


def _rebuild(search: _Search, signs: dict[int, int]) -> tuple[ValueTable, list[int]]:
    values = ValueTable()
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


def _supplied(search: _Search, values: ValueTable, signs: dict[int, int], moved: dict[int, int], wanted: Value) -> int:
    sign, number = wanted
    node = search.values.nodes[number]
    if isinstance(node, Constant):
        return values.number(node.times(sign))
    return moved[number] if sign == signs[number] else values.apply(Operator.NEG, moved[number])


def _restored(
    search: _Search, values: ValueTable, signs: dict[int, int], moved: dict[int, int], number: int, node: Node
) -> int:
    """Return the same operation on stored operands, with the stored sign."""
    if node.operator in _STRICT:
        wanted = (_unsigned(search.values, operand) for operand in node.operands)
        return values.apply(node.operator, *(_supplied(search, values, signs, moved, value) for value in wanted))
    if node.operator not in (*_SUMS, *_PRODUCTS):
        return values.apply(node.operator, *(moved[operand] for operand in node.operands))
    left, right = node.operands
    # A product that is stored with the other sign negates a factor, a constant for nothing.
    if node.operator in _PRODUCTS:
        factors = [moved[left], moved[right]]
        if signs[number] != signs[left] * signs[right]:
            place = 0 if search.is_constant(left) or left in search.negatives else 1
            factors[place] = _negated(values, factors[place])
        return values.apply(node.operator, *factors)
    # A sum: the positive term is written first, if there is one.
    first = signs[left] * signs[number]
    second = signs[right] * signs[number] * (1 if node.operator is Operator.ADD else -1)
    if first > 0:
        return values.apply(Operator.ADD if second > 0 else Operator.SUB, moved[left], moved[right])
    if second > 0:
        return values.apply(Operator.SUB, moved[right], moved[left])
    if search.is_constant(left):
        return values.apply(Operator.SUB, _negated(values, moved[left]), moved[right])
    return values.apply(Operator.SUB, _negated(values, moved[right]), moved[left])


def _negated(values: ValueTable, number: int) -> int:
    """Return a constant with the other sign, which costs nothing, or the negative of a factor."""
    node = values.nodes[number]
    return values.number(node.times(-1)) if isinstance(node, Constant) else values.apply(Operator.NEG, number)
