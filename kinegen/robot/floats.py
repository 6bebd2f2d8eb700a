"""Values of closed expressions as floats, for sizes, boxes and defaults; no kernel is made of them."""

from __future__ import annotations

import math
from collections.abc import Callable

from kinegen.robot.expressions import Arithmetic

_ROUNDING = 1e-12


def _arc(function: Callable[[float], float]) -> Callable[[float], float]:
    """An arc that takes a value beyond 1 by rounding alone for 1."""

    def arc(value: float) -> float:
        return function(math.copysign(1.0, value) if 1.0 < abs(value) < 1.0 + _ROUNDING else value)

    return arc


FLOATS = Arithmetic(
    number=float,
    pi=math.pi,
    functions={
        "sqrt": math.sqrt,
        "sin": math.sin,
        "cos": math.cos,
        "asin": _arc(math.asin),
        "acos": _arc(math.acos),
        "atan": math.atan,
        "atan2": math.atan2,
    },
)
"""Floats, with every function of the language; a function without a value raises ValueError."""
