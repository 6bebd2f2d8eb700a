"""Planes, spheres and anchors that were touched or measured from: unknown too, and found with the arm.

A plane is n p = c, a sphere |p - m| = r, an anchor a point from which distances were measured. Each begins at the best
fit to the points of the table as it is, and its numbers are corrections to that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinegen.calibrate.measurements import Kind, Measurements
from kinegen.errors import KinegenError

Floats = NDArray[np.float64]

NUMBERS = {Kind.PLANE: ("tilt_1", "tilt_2", "offset"), Kind.ANCHOR: ("x", "y", "z"), Kind.SPHERE: ("x", "y", "z")}
RADIUS = "radius"
LEAST = {Kind.PLANE: 3, Kind.ANCHOR: 4, Kind.SPHERE: 4}
"""Points that determine a fixture, without any for the arm."""


@dataclass(frozen=True, slots=True)
class Fixture:
    """One plane, sphere or anchor.

    Attributes:
        kind: What it is.
        name: As in the file of measurements.
        rows: The rows that measured it.
        numbers: Names of its unknowns.
        start: For a plane its normal and offset, for the others the centre and a radius, (4,).
        axes: For a plane the two directions in which the normal can tilt, (2, 3).
    """

    kind: Kind
    name: str
    rows: NDArray[np.intp]
    numbers: tuple[str, ...]
    start: Floats
    axes: Floats

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the unknowns, as reports print them."""
        return tuple(f"{self.kind}_{self.name}_{number}" for number in self.numbers)

    def residuals(self, values: Floats, points: Floats, lengths: Floats) -> tuple[Floats, Floats, Floats]:
        """Distances of points from the fixture, and their derivatives.

        Args:
            values: The unknowns, (K,).
            points: (N, 3).
            lengths: Measured distances or known radii, (N,).

        Returns:
            Measured minus modelled (N,); the derivative of the modelled by the point (N, 3) and by the unknowns (N, K).
        """
        if self.kind is Kind.PLANE:
            return self._plane(values, points)
        away = points - self.start[:3] - values[:3]
        size = np.linalg.norm(away, axis=1)
        outward = away / np.maximum(size, 1e-300)[:, None]
        columns = [-outward]
        if RADIUS in self.numbers:
            lengths = np.full(len(points), self.start[3] + values[3])
            columns.append(np.full((len(points), 1), -1.0))
        return lengths - size, outward, np.hstack(columns)

    def _plane(self, values: Floats, points: Floats) -> tuple[Floats, Floats, Floats]:
        tilted = self.start[:3] + values[:2] @ self.axes
        size = np.linalg.norm(tilted)
        normal = tilted / size
        turning = self.axes @ (np.eye(3) - np.outer(normal, normal)) / size
        by_unknowns = np.hstack([points @ turning.T, np.full((len(points), 1), -1.0)])
        return self.start[3] + values[2] - points @ normal, np.tile(normal, (len(points), 1)), by_unknowns

    def centre(self, values: Floats) -> Floats:
        """The normal and offset of a plane, or the centre and radius of a sphere, (4,); an anchor has radius 0."""
        if self.kind is Kind.PLANE:
            tilted = self.start[:3] + values[:2] @ self.axes
            return np.append(tilted / np.linalg.norm(tilted), self.start[3] + values[2])
        radius = self.start[3] + values[3] if RADIUS in self.numbers else 0.0
        return np.append(self.start[:3] + values[:3], radius)


def find_fixtures(measured: Measurements, points: Floats) -> tuple[Fixture, ...]:
    """The fixtures in the measurements, at their best fits.

    Args:
        measured: The measurements.
        points: Positions (N, 3) of the frame by the table as it is.

    Raises:
        KinegenError: If a fixture has too few rows, or rows that differ in what they know of it.
    """
    keys = dict.fromkeys(
        (kind, name) for kind, name in zip(measured.kinds, measured.fixtures, strict=True) if kind in NUMBERS
    )
    return tuple(_fixture(kind, name, measured, points) for kind, name in keys)


def _fixture(kind: Kind, name: str, measured: Measurements, points: Floats) -> Fixture:
    each = zip(measured.kinds, measured.fixtures, strict=True)
    rows = np.array([row for row, place in enumerate(each) if place == (kind, name)], dtype=np.intp)
    line = measured.lines[int(rows[0])]
    lengths = measured.lengths[rows]
    is_free = kind is Kind.SPHERE and bool(np.isnan(lengths).all())
    if kind is Kind.SPHERE and not is_free and np.isnan(lengths).any():
        raise KinegenError(f"sphere {name!r} has a radius in some of its rows only", measured.path, line)
    if len(rows) <= LEAST[kind]:
        need = f"it takes more than {LEAST[kind]}"
        raise KinegenError(f"{kind} {name!r} has {len(rows)} rows, which say nothing of the arm ({need})",
                           measured.path, line)  # fmt: skip
    numbers = (*NUMBERS[kind], *([RADIUS] if is_free else []))
    where = points[rows]
    if kind is Kind.PLANE:
        middle = where.mean(axis=0)
        directions = np.linalg.svd(where - middle)[2]
        return Fixture(kind, name, rows, numbers, np.r_[directions[2], directions[2] @ middle], directions[:2])
    known = np.where(np.isnan(lengths), 0.0, lengths)
    # |p|^2 - d^2 = 2 m p + (r^2 - |m|^2) is linear in the centre m.
    left = np.hstack([2 * where, np.ones((len(rows), 1))])
    found = np.linalg.lstsq(left, (where**2).sum(axis=1) - known**2, rcond=None)[0]
    radius = float(np.sqrt(max(found[3] + found[:3] @ found[:3], 0.0)))
    return Fixture(kind, name, rows, numbers, np.r_[found[:3], radius], np.zeros((2, 3)))
