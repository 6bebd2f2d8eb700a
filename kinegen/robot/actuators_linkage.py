"""How a four-bar linkage stands over the limits of its crank, in floats: whether it closes, and on which side.

In: lengths and crank angles. Out: what decides between the two ways in which the bars fit together. Nothing computed
here enters a kernel but signs and quarter turns.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

STEPS = 720
"""Crank angles that are looked at between the limits."""

_SLACK = 1e-9
"""Relative to the longest bar; a linkage may just reach a dead point of its rocker."""

Bars = tuple[float, float, float, float]
Point = tuple[float, float]


class LinkageError(ValueError):
    """The linkage cannot do what is asked of it; `angle` is the crank angle at which it fails."""

    def __init__(self, message: str, angle: float) -> None:
        super().__init__(message)
        self.angle = angle


@dataclass(frozen=True, slots=True)
class Assembly:
    """What stays the same between the limits; see `actuators.FourBar`."""

    ahead: int
    turned: tuple[int, int]


def assemble(bars: Bars, angles: tuple[float, float], *, crossed: bool) -> Assembly:
    """Follow a linkage from one limit of its crank to the other.

    Args:
        bars: Ground, crank, coupler and rocker.
        angles: First and last crank angle, in radians from the ground line.
        crossed: Which of the two assemblies.

    Raises:
        LinkageError: If the bars do not reach, or crank and coupler pass one line.
    """
    first, last = angles
    cranks = [first + (last - first) * step / STEPS for step in range(STEPS + 1)]
    tips = [_tips(bars, crank, crossed=crossed) for crank in cranks]
    ahead = [_side(crank, rocker) for crank, rocker in tips]
    slack = _SLACK * max(bars) ** 2
    sides = [(crank, side > 0) for crank, side in zip(cranks, ahead, strict=True) if abs(side) > slack]
    for (_, before), (crank, after) in itertools.pairwise(sides):
        if before is not after:
            remedy = "limits lie on one side of this dead centre"
            raise LinkageError(f"crank and coupler stand in one line, where the rocker turns back; {remedy}", crank)
    sign = 1 if sum(ahead) > 0 else -1
    ground = bars[0]
    outer = _quarters([_direction((x - ground, y)) for (x, y), _ in tips])
    inner = _quarters([_direction(rocker) for _, rocker in tips])
    middle = STEPS // 2
    return Assembly(sign, (_natural(tips[middle], outer, ground), _matching(cranks[middle], tips[middle][1], inner)))


def _tips(bars: Bars, crank: float, *, crossed: bool) -> tuple[Point, Point]:
    """The tips of crank and rocker."""
    ground, a, b, c = bars
    tip = a * math.cos(crank), a * math.sin(crank)
    x, y = tip[0] - ground, tip[1]
    diagonal = math.hypot(x, y)
    slack = _SLACK * max(bars)
    low, high = abs(b - c), b + c
    if diagonal <= slack or not low - slack <= diagonal <= high + slack:
        reach = f"coupler and rocker reach from {low:.4g} to {high:.4g}"
        raise LinkageError(f"the tip of the crank is {diagonal:.4g} from the rocker's pivot, but {reach}", crank)
    cosine = max(-1.0, min(1.0, (diagonal**2 + c**2 - b**2) / (2 * diagonal * c)))
    rocker = math.atan2(y, x) + (1 if crossed else -1) * math.acos(cosine)
    return tip, (ground + c * math.cos(rocker), c * math.sin(rocker))


def _side(crank: Point, rocker: Point) -> float:
    """Positive where the crank stands ahead of the tip of the rocker, both seen from the crank's pivot."""
    return rocker[0] * crank[1] - rocker[1] * crank[0]


def _direction(point: Point) -> float:
    return math.atan2(point[1], point[0])


def _quarters(directions: Sequence[float]) -> int:
    """The quarter turn whose opposite is farthest from all directions, so that atan2 jumps at none of them."""
    clear = [min(abs(math.remainder(d - (k + 2) * math.pi / 2, math.tau)) for d in directions) for k in range(4)]
    return clear.index(max(clear))


def _natural(tips: tuple[Point, Point], quarters: int, ground: float) -> int:
    """Whole turns added, so that the rocker's angle in the middle of the limits lies between -pi and pi."""
    (x, y), (tip_x, tip_y) = tips
    rocker = math.atan2(tip_y, tip_x - ground)
    direction = rocker + math.remainder(math.atan2(y, x - ground) - rocker, math.tau)
    return _whole(direction, quarters)


def _matching(crank: float, rocker_tip: Point, quarters: int) -> int:
    """Whole turns added, so that the crank's angle comes back as it was."""
    direction = crank + math.remainder(_direction(rocker_tip) - crank, math.tau)
    return _whole(direction, quarters)


def _whole(direction: float, quarters: int) -> int:
    """`quarters` and as many whole turns that what is left of a direction lies between -pi and pi."""
    return quarters + 4 * round((direction - quarters * math.pi / 2) / math.tau)
