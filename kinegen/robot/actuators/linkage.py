"""How a four-bar linkage stands over the limits of its crank, in floats: whether it closes, and on which side.

In: lengths and crank angles. Out: what decides between the two ways in which the bars fit together. Nothing computed
here enters a kernel but signs and whole turns.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

STEPS = 720
"""Crank angles that are looked at between the limits."""

_SLACK = 1e-9
"""Relative to the longest bar; a linkage may just reach a dead point of its rocker."""

Bars = tuple[float, float, float, float]
"""Ground, crank, coupler and rocker."""


class LinkageError(ValueError):
    """The linkage cannot do what is asked of it; `angle` is the crank angle at which it fails."""

    def __init__(self, message: str, angle: float) -> None:
        super().__init__(message)
        self.angle = angle


@dataclass(frozen=True, slots=True)
class Assembly:
    """What stays the same between the limits; see `actuators.FourBar`."""

    ahead: int
    turns: tuple[int, int]


def assemble(bars: Bars, angles: tuple[float, float], *, crossed: bool) -> Assembly:
    """Follow a linkage from one limit of its crank to the other.

    Args:
        bars: The lengths.
        angles: First and last crank angle, in radians from the ground line.
        crossed: Which of the two assemblies.

    Raises:
        LinkageError: If the bars do not reach, or crank and coupler pass one line.
    """
    first, last = angles
    cranks = [first + (last - first) * step / STEPS for step in range(STEPS + 1)]
    rockers = [_rocker(bars, crank, crossed=crossed) for crank in cranks]
    slack = _SLACK * max(bars) ** 2
    sides = [(crank, _side(bars, crank, rocker)) for crank, rocker in zip(cranks, rockers, strict=True)]
    clear = [(crank, side > 0) for crank, side in sides if abs(side) > slack]
    for (_, before), (crank, after) in itertools.pairwise(clear):
        if before is not after:
            remedy = "keep the limits on one side of this dead centre"
            raise LinkageError(f"crank and coupler are in line, where the rocker turns back; {remedy}", crank)
    ahead = 1 if clear and clear[0][1] else -1
    crank, rocker = cranks[STEPS // 2], rockers[STEPS // 2]
    natural = -round(rocker / math.tau)
    back = _crank(bars, rocker + natural * math.tau, ahead)
    return Assembly(ahead, (natural, round((crank - back) / math.tau)))


def _rocker(bars: Bars, crank: float, *, crossed: bool) -> float:
    """The rocker's angle, which does not jump where the crank moves on."""
    ground, a, b, c = bars
    x, y = a * math.cos(crank) - ground, a * math.sin(crank)
    diagonal = math.hypot(x, y)
    slack = _SLACK * max(bars)
    low, high = abs(b - c), b + c
    if diagonal <= slack or not low - slack <= diagonal <= high + slack:
        reach = f"coupler and rocker reach from {low:.4g} to {high:.4g}"
        beyond = max(low - diagonal, diagonal - high)
        off = f", {beyond:.2g} beyond" if beyond > 0 else ""
        raise LinkageError(f"the tip of the crank is {diagonal:.4g} from the rocker's pivot{off}, but {reach}", crank)
    if a > ground:
        direction = crank + math.atan2(ground * math.sin(crank), a - ground * math.cos(crank))
    else:
        direction = math.pi + math.atan2(-y, -x)
    return direction + (1 if crossed else -1) * _corner(diagonal, c, b)


def _crank(bars: Bars, rocker: float, ahead: int) -> float:
    """The crank's angle, which does not jump where the rocker moves on."""
    ground, a, b, c = bars
    x, y = ground + c * math.cos(rocker), c * math.sin(rocker)
    if c > ground:
        direction = rocker + math.atan2(-ground * math.sin(rocker), c + ground * math.cos(rocker))
    else:
        direction = math.atan2(y, x)
    return direction + ahead * _corner(math.hypot(x, y), a, b)


def _corner(diagonal: float, side: float, opposite: float) -> float:
    """The angle between a diagonal and a bar, opposite of another bar."""
    cosine = (diagonal**2 + side**2 - opposite**2) / (2 * diagonal * side)
    return math.acos(max(-1.0, min(1.0, cosine)))


def _side(bars: Bars, crank: float, rocker: float) -> float:
    """Positive where the crank stands ahead of the tip of the rocker, both seen from the crank's pivot."""
    ground, a, _, c = bars
    x, y = ground + c * math.cos(rocker), c * math.sin(rocker)
    return a * (x * math.sin(crank) - y * math.cos(crank))
