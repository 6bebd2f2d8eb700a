"""Among all ways to take the transforms along a path apart, those that leave most zeros in the table.

The entries of a row depend on the transform before its joint and on the one behind it, so the choice is a shortest
path through the ways of each transform.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

from kinegen.robot.expressions import PI, ZERO, Expression, Number, Product
from kinegen.tables.links import Link, Screw
from kinegen.tables.steps import terms

_FURTHER_ROW = 10.0
_OUTSIDE = 1.0
"""What an entry costs more in base or tool than in the table."""
_SIGN = 0.05


@lru_cache(maxsize=4096)
def cost(screw: Screw, *, outside: bool = False) -> float:
    """How much there is to read in two entries: zeros cost nothing, quarter turns less than other angles."""
    found = _SIGN * (_is_negative(screw.turn) + _is_negative(screw.shift))
    if screw.turn != ZERO:
        share = terms(screw.turn)
        quarters = set(share) == {PI} and (2 * share[PI]).denominator == 1
        found += (2.0 if quarters else 3.0) + outside * _OUTSIDE
    if screw.shift != ZERO:
        found += 2.0 + outside * _OUTSIDE
    return found


def _is_negative(expression: Expression) -> bool:
    first = expression.factors[0] if isinstance(expression, Product) else expression
    return isinstance(first, Number) and first.value < 0


@lru_cache(maxsize=4096)
def link_cost(link: Link) -> float:
    """What a transform adds by itself, wherever its ends go."""
    inside = sum(cost(across) for _, across in link.pairs) + sum(cost(along) for along, _ in link.pairs[1:])
    return inside + _FURTHER_ROW * (len(link.pairs) - 1)


def entry_cost(link: Link, *, modified: bool) -> float:
    """What the transform before the first joint adds: its first screw, and its screw about x, may lie outside."""
    first, across = link.pairs[0]
    return cost(first, outside=True) + (0.0 if modified else cost(across, outside=True) - cost(across))


def tail_cost(link: Link, *, modified: bool) -> float:
    """What the transform behind the last joint adds."""
    _, across = link.pairs[0]
    return cost(link.last, outside=True) + (cost(across, outside=True) - cost(across) if modified else 0.0)


def choose(options: Sequence[Sequence[Link]], *, modified: bool) -> tuple[Link, ...]:
    """Choose one way for each transform along a path.

    Args:
        options: For the transform before the first joint, those between joints, and the one behind the last.
        modified: Whether the rows are modified ones; it decides what lies outside of the table.

    Returns:
        The choice with the least to read; the first among equals.
    """
    best: list[tuple[float, tuple[Link, ...]]] = [
        (entry_cost(link, modified=modified) + link_cost(link), (link,)) for link in options[0]
    ]
    for place, ways in enumerate(options[1:], start=1):
        last = place == len(options) - 1
        found: list[tuple[float, tuple[Link, ...]]] = []
        for link in ways:
            own = link_cost(link) + (tail_cost(link, modified=modified) if last else 0.0)
            sums = [spent + cost(path[-1].last + link.pairs[0][0]) for spent, path in best]
            index = min(range(len(sums)), key=lambda i: (round(sums[i], 6), i))
            found.append((sums[index] + own, (*best[index][1], link)))
        best = found
    return min(best, key=lambda each: round(each[0], 6))[1]
