"""Computed values as the analysis sees them: what they are made of, and how much each rounding can lose.

A value refers to earlier ones by their places in the sequence of all values. Nothing here knows integers or formats.
"""

from __future__ import annotations

from dataclasses import dataclass

OUTWARD = 1.0 + 2.0**-45
"""By this much every bound is widened: far more than the rounding of the few operations that make it."""


@dataclass(frozen=True, slots=True)
class Extent:
    """What is known of a group of values.

    Attributes:
        size: Bound on the Euclidean length of the exact values.
        error: Bound on the Euclidean length of the differences between the computed values and the exact ones.
    """

    size: float
    error: float

    @property
    def largest(self) -> float:
        """Bound on the length of the computed values."""
        return (self.size + self.error) * OUTWARD


@dataclass(frozen=True, slots=True)
class Given:
    """A constant or an input; of a constant also the value, next to the exact one."""

    extent: Extent
    value: float | None = None


@dataclass(frozen=True, slots=True)
class Trigonometric:
    """The sine or the cosine of an angle.

    Attributes:
        angle: Tells the angle from others; of each there is at most one sine and one cosine.
        error: Bound on the error.
        pair_error: Bound on the length of the errors of both.
    """

    angle: object
    error: float
    pair_error: float


@dataclass(frozen=True, slots=True)
class Copy:
    """Another value or minus that, rounded anew: the place of the other one, and a bound on the rounding error."""

    source: int
    rounding: float


@dataclass(frozen=True, slots=True)
class Product:
    """A product of two values, or minus that: their places, a bound on the rounding error, and the sign."""

    left: int
    right: int
    rounding: float
    sign: int = 1


@dataclass(frozen=True, slots=True)
class Sum:
    """A sum of two values, or a difference (sign -1): their places, and a bound on the rounding error."""

    left: int
    right: int
    rounding: float
    sign: int = 1


Value = Given | Trigonometric | Copy | Product | Sum
