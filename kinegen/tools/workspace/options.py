"""Holds the options of a survey and the units of its measures; it imports nothing heavy."""

from __future__ import annotations

from kinegen.errors import KinegenError
from kinegen.support.dataclass import dataclass

MOST_SAMPLES = 10**11
"""Places in the sequence keep enough digits up to here."""


@dataclass(frozen=True, slots=True)
class SurveyOptions:
    """Options of a survey, of 1 to `MOST_SAMPLES` joint vectors; 0 threads are one on each processor.

    Attributes:
        voxel: Edge of a voxel in the file's length unit; None for one that suits the number of samples.
        seed: Decides where the sequence of samples begins.
    """

    samples: int
    voxel: float | None = None
    seed: int = 0
    threads: int = 0

    def __post_init__(self) -> None:
        if not 1 <= self.samples <= MOST_SAMPLES:
            raise KinegenError(f"{self.samples} samples (expected 1 to {MOST_SAMPLES:.0e})".replace("e+", "e"))


@dataclass(frozen=True, slots=True)
class Plane:
    """A plane to cut a region with, square to an axis of the base frame, 0 to 2, in the file's length unit."""

    axis: int
    at: float


MEASURES = {1: "length", 2: "area", 3: "volume"}
"""What a region measures, by its dimension."""

_METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
_POWERS = {1: "", 2: "²", 3: "³"}


def in_words(measure: float, dimension: int, unit: str) -> str:
    """Return a length (dimension 1), area or volume in words, with four digits and its unit.

    A length has the unit of the file, an area or volume metres where that is metric.
    """
    if dimension > 1 and unit in _METRES:
        measure, unit = measure * _METRES[unit] ** dimension, "m"
    return f"{measure:.4g} {unit}{_POWERS[dimension]}"
