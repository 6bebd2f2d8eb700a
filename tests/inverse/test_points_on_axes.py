"""Zeros of sums of sines and cosines of an angle and of twice that angle, on which the choice of elbows rests."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from kinegen.derive.inverse.points_on_axes import _zeros


def zeros(function: Callable[[float], float]) -> list[float]:
    """Zeros by the eight values that the function has at equal angles."""
    return sorted(_zeros([function(2 * math.pi * turn / 8) for turn in range(8)]))


@pytest.mark.parametrize(
    ("function", "expected"),
    [
        (lambda x: math.sin(x - 0.5), [0.5 - math.pi, 0.5]),
        (lambda x: math.cos(2 * x), [-3 * math.pi / 4, -math.pi / 4, math.pi / 4, 3 * math.pi / 4]),
        (lambda x: (math.cos(x) - 0.3) * (math.sin(x) - 2), [-math.acos(0.3), math.acos(0.3)]),
        (lambda x: 1 - math.cos(x - 1), [1, 1]),
        (lambda x: 2 + math.cos(x), []),
        (lambda _: 1.0, []),
        (lambda _: 0.0, []),
    ],
    ids=["one order", "two orders", "two of four", "double", "none", "constant", "nothing"],
)
def test_zeros_are_found_with_their_multiplicity(function: Callable[[float], float], expected: list[float]) -> None:
    assert zeros(function) == pytest.approx(expected, abs=1e-6)
