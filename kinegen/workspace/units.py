"""Lengths, areas and volumes in words: what a file gives in mm or cm fills square and cubic metres."""

from __future__ import annotations

MEASURES = {1: "length", 2: "area", 3: "volume"}
"""What a region measures, by its dimension."""

_METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
_POWERS = {1: "", 2: "²", 3: "³"}


def in_words(measure: float, dimension: int, unit: str) -> str:
    """A length, area or volume with its unit.

    Args:
        measure: In powers of the file's unit.
        dimension: 1 for a length, 2 for an area, 3 for a volume.
        unit: The file's unit of length.

    Returns:
        Four digits and the unit: a length in that of the file; an area or volume in metres where it is metric.
    """
    if dimension > 1 and unit in _METRES:
        measure, unit = measure * _METRES[unit] ** dimension, "m"
    return f"{measure:.4g} {unit}{_POWERS[dimension]}"
