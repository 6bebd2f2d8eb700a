"""Where the sine-cosine pair is cut up for interval analysis.

The pair subtracts the nearest multiple of pi/2 from its angle. Intervals do not see that both belong together: over all
angles at once the difference seems as large as the angle, and a polynomial of it is worth nothing. Over a piece on
which the multiple is one number they do. So the angle is cut where the multiple changes, and between.

The cuts decide how tight the results are, and nothing else: whatever they are, every angle lies in one piece.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from kinegen.emit.environment import environment
from kinegen.emit.reals import Real
from kinegen.emit.sincos import SINCOS

PIECES = 16
"""Pieces of a quarter turn. The terms that make up for rounding are differences of near numbers, whose intervals are as
wide as the piece."""

_KINDS: Mapping[Real, Any] = {Real.DOUBLE: np.float64, Real.FLOAT: np.float32}


def pair_text(prefix: str, real: Real) -> str:
    """The emitted pair, as it stands in the kernels."""
    return environment().get_template(SINCOS[real].template).render(prefix=prefix, qualifier="static")


def cuts(real: Real, low: float, high: float, pieces: int = PIECES) -> tuple[float, ...]:
    """Places at which a range of angles is cut.

    Args:
        real: The number type.
        low: The smallest angle.
        high: The largest.
        pieces: Pieces of a quarter turn.

    Returns:
        Numbers of the type between the two, ascending; a piece begins with each, and the first one with `low`.
    """
    kind = _KINDS[real]
    multiple = multiple_of(real)
    numbers = range(math.floor(low / (math.pi / 2)), math.ceil(high / (math.pi / 2)) + 2)
    found: list[float] = []
    for left, right in itertools.pairwise(_first(multiple, number, kind) for number in numbers):
        found += [float(kind(left + (right - left) * part / pieces)) for part in range(pieces)]
    return tuple(place for place in found if low < place <= high)


def multiple_of(real: Real) -> Callable[[Any], float]:
    """How the pair of a number type finds the nearest multiple of pi/2, read from its text."""
    kind = _KINDS[real]
    text = pair_text("pair", real)
    number = r"(-?[\d.]+(?:e[+-]?\d+)?)F?;"
    steps = ("scaled = x * ", "turns = scaled * ", "shifted = turns + ", "k = shifted - ")
    scale, back, up, down = (kind(_only(re.escape(step) + number, text)) for step in steps)

    def multiple(x: Any) -> float:
        with np.errstate(over="ignore", invalid="ignore"):
            return float((((kind(x) * scale) * back) + up) - down)

    return multiple


def _only(pattern: str, text: str) -> str:
    """The one match of a pattern."""
    (found,) = re.findall(pattern, text)
    return str(found)


def _first(multiple: Callable[[Any], float], number: int, kind: Any) -> float:
    """The smallest number that belongs to a multiple, found by halving."""
    low, high = kind((number - 1) * math.pi / 2), kind(number * math.pi / 2)
    while np.nextafter(low, high) < high:
        middle = kind(low + (high - low) / kind(2))
        if multiple(middle) < number:
            low = middle
        else:
            high = middle
    return float(high)
