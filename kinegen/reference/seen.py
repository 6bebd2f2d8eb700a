"""A frame as seen from another one that moves too: the inverse of one product, times the other.

A way is written `frame`, which is seen from the base, or `frame/other`, which is seen from the other frame. Joints that
move both are in both products; that they cancel is found here by numbers, and in the kernels by structure.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from kinegen.reference.series import Series, product


def seen_series(places: Mapping[str, Series], way: str) -> Series:
    """A pose as a series, of frames whose poses in the base are series.

    Args:
        places: Poses in the base by frame.
        way: A frame, or a frame and the one from which it is seen.
    """
    frame, slash, start = way.partition("/")
    if not slash:
        return places[frame]
    back = places[start].map(_turned_back)
    # The inverse of a pose is R^T times the pose without rotation that shifts by -p.
    inverse = product(back, _shifted_back(places[start]), np.matmul)
    return product(inverse, places[frame], np.matmul)


def seen_pose(places: Mapping[str, Any], way: str) -> Any:
    """The same of poses that are numbers, shape (N, 4, 4) each."""
    frame, slash, start = way.partition("/")
    if not slash:
        return places[frame]
    return seen_series({name: Series({(): places[name]}, 0) for name in (frame, start)}, way).parts[()]


def _turned_back(part: Any) -> Any:
    """The transposed rotation of a pose or of its derivative, without the shift."""
    found = np.zeros_like(part)
    found[..., :3, :3] = part[..., :3, :3].swapaxes(-1, -2)
    found[..., 3, 3] = part[..., 3, 3]
    return found


def _shifted_back(place: Series) -> Series:
    """The shift of a pose alone, the other way."""

    def back(part: Any) -> Any:
        found = np.zeros_like(part)
        found[..., :3, 3] = -part[..., :3, 3]
        return found

    moved = place.map(back)
    return moved + Series({(): np.zeros_like(place.parts[()]) + np.eye(4, dtype=int)}, place.order)
