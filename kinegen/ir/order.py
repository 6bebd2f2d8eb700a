"""The order of operations: few results at a time wait for their use.

In: operations in the order in which they were defined. Out: the same ones in an order that a processor with few
registers likes, and that follows from the operations alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from heapq import heapify, heappop, heappush

from kinegen.ir.values import Node, Values


def shorten_lives(values: Values, numbers: Sequence[int]) -> list[int]:
    """Put first what ends the most waiting.

    Of all operations whose operands are there, the next one leaves the fewest results waiting; of equals, the one that
    was defined first. A result that nothing but an output needs does not wait, since emitters store it at once.

    On a Cortex-M4F this halves the stack that the link frames of a 7-joint arm take. A search for the best order would
    gain little more: compilers shift statements too.

    Args:
        values: The values.
        numbers: Operations, ascending; their operands may also be values that stand before all of them.

    Returns:
        The same numbers.
    """
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
        changed = []
        for operand in operands[number]:
            uses[operand] -= 1
            if uses[operand] == 1:
                changed += [user for user in users[operand] if user not in order and not missing[user]]
        for user in users.get(number, ()):
            missing[user] -= 1
            if not missing[user]:
                changed.append(user)
        for user in changed:
            heappush(ready, (left_waiting(user), user))
    return list(order)


def _operands(values: Values, number: int) -> frozenset[int]:
    """The operations whose results an operation reads."""
    node = values.nodes[number]
    found = node.operands if isinstance(node, Node) else ()
    return frozenset(operand for operand in found if isinstance(values.nodes[operand], Node))
