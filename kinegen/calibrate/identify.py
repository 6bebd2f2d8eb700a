"""What the measurements cannot distinguish: named, and kept at the value of the file.

In: the derivatives of the residuals, in standard deviations, by unknowns counted in units (a hundredth of the reach, a
hundredth of a radian). A singular value below 1 belongs to a combination of unknowns that is not known even to one
unit. For each such combination one unknown is fixed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinegen.calibrate.choice import BASE_NAMES, TOOL_NAMES

Floats = NDArray[np.float64]

LEAST = 1.0
"""The smallest singular value of a combination that counts as known."""

EXACT = 1e-8
"""Below this share of the largest singular value no measurement of this kind knows the combination."""

_PART = 5e-3
"""The share of a combination, of its largest, from which an unknown is a part of it."""

_MOUNT_WEIGHT, _FIXTURE_WEIGHT = 0.2, 0.05
"""An entry of the table is rather fixed than base or tool, or a fixture, which are in no data sheet."""


@dataclass(frozen=True, slots=True)
class Tied:
    """An unknown that is fixed because it cannot be distinguished from others.

    Attributes:
        name: The unknown.
        partners: The others that move what was measured in the same way, with their factors: one unit of `name` is
            the sum of factor times unit of each; empty if `name` moves nothing that was measured.
        sigma: Standard deviation of the combination, in units; infinite if no measurement of this kind knows it.
    """

    name: str
    partners: tuple[tuple[str, float], ...]
    sigma: float

    @property
    def exact(self) -> bool:
        """Whether more measurements of the same kind could not help."""
        return bool(np.isinf(self.sigma))


def tied(names: tuple[str, ...], jacobian: Floats, units: Floats, candidates: NDArray[np.bool_]) -> tuple[Tied, ...]:
    """Find the unknowns to fix.

    Args:
        names: Names of the unknowns.
        jacobian: Derivative of the residuals, (R, U).
        units: What counts as one unit of each unknown, (U,).
        candidates: Which unknowns are free, (U,).

    Returns:
        The unknowns to fix, in the order of `names`.
    """
    free = np.flatnonzero(candidates)
    scaled = jacobian[:, free] * units[free]
    # The triangular factor has the same singular values, and one row for each unknown at most.
    _, sizes, directions = np.linalg.svd(np.linalg.qr(scaled, mode="r"), full_matrices=True)
    sizes = np.r_[sizes, np.zeros(len(free) - len(sizes))]
    limit = EXACT * max(sizes[0], 1e-300) if len(sizes) else 0.0
    lost = (sizes < LEAST) | (sizes <= limit)
    if not lost.any():
        return ()
    lost_directions = directions[lost]
    picked = _pick(lost_directions, np.array([_weight(names[place]) for place in free]))
    # Combinations in which one of the picked is 1 and the others 0.
    combinations = np.linalg.solve(lost_directions[:, picked], lost_directions)
    sigmas = np.where(sizes[lost] <= limit, np.inf, 1 / np.maximum(sizes[lost], 1e-300))
    found = []
    for place, combination in zip(picked, combinations, strict=True):
        parts = [
            (names[free[other]], -float(share))
            for other, share in enumerate(combination)
            if other != place and abs(share) > _PART * np.abs(combination).max()
        ]
        # A combination is as uncertain as the worst of the directions that it is made of.
        shares = np.abs(lost_directions @ combination)
        worst = float(sigmas[shares > _PART * shares.max()].max())
        found.append(Tied(names[free[place]], tuple(parts), worst))
    order = {name: place for place, name in enumerate(names)}
    return tuple(sorted(found, key=lambda each: order[each.name]))


def _weight(name: str) -> float:
    if name in BASE_NAMES or name in TOOL_NAMES:
        return _MOUNT_WEIGHT
    return _FIXTURE_WEIGHT if name.startswith(("plane_", "sphere_", "anchor_")) else 1.0


def _pick(directions: Floats, weights: Floats) -> list[int]:
    """One unknown for each direction, so that the others determine it well: columns of a pivoted QR decomposition."""
    left, picked = directions.copy(), list[int]()
    for _ in range(len(directions)):
        sizes = np.linalg.norm(left, axis=0) * weights
        sizes[picked] = -1.0
        # Of unknowns that are equal but for rounding, the last in the table is fixed.
        place = int(np.flatnonzero(sizes >= sizes.max() * (1 - 1e-6))[-1])
        picked.append(place)
        axis = left[:, place] / np.linalg.norm(left[:, place])
        left -= np.outer(axis, axis @ left)
    return picked
