"""Voxels of a region: which of them samples hit, and what they measure together.

Voxels are cubes (squares in a plane, pieces of a line) of one size on a grid that stays fixed in the base frame, so
regions of two arms can be laid over each other. The grid holds half-size voxels; those of the size asked for are 2x2x2
of them. It stands a little off the origin, so that no face of a region with round numbers lies on a face of a voxel.

What a region measures is taken as h^D (n - F/2) with n voxels hit and F open faces, that is, faces between a voxel that
was hit and one that was not. A voxel on the rim counts as a whole although only a part of it is inside: a rim with unit
normal (nx, ny, nz) has (|nx| + |ny| + |nz|)/h^2 open faces for each unit of area, and the voxels that it cuts reach
beyond it by half of (|nx| + |ny| + |nz|) h on average, so half a voxel for each open face is what lies outside. The
error left is of second order in h. A voxel inside that no sample hit is missing and opens six faces more, so too few
samples make the figure smaller, never larger.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinegen.errors import KinegenError
from kinegen.workspace.sample import FloatArray, IndexArray

MOST_VOXELS = 1 << 28
"""Half-size voxels of a grid, one byte each."""

CellArray = NDArray[np.int64]

_OFFSET = np.array([0.382, 0.236, 0.146])
_MARGIN = 8
_LARGEST_CELL = 2.0**52


@dataclass(frozen=True, slots=True)
class Voxels:
    """The voxels of one size that were hit.

    Attributes:
        size: Edge of a voxel.
        corner: Shape (D,), coordinates of the grid's lower corner along the axes of the region.
        hit: Shape (n1, ..., nD), which of them were hit; those on the faces of the grid were not.
    """

    size: float
    corner: FloatArray
    hit: NDArray[np.bool_]

    @property
    def count(self) -> int:
        """How many were hit."""
        return int(np.count_nonzero(self.hit))

    @property
    def measure(self) -> float:
        """Length, area or volume of the region (see the head of this module); never less than nothing."""
        faces = sum(int(np.count_nonzero(np.diff(self.hit, axis=axis))) for axis in range(self.hit.ndim))
        return max(0.0, self.count - faces / 2) * self.size**self.hit.ndim

    def weights(self, points: FloatArray) -> FloatArray:
        """What the voxels around points (D, N) add to the measure: 1 less a half for each open face, at least 0."""
        last = np.array(self.hit.shape)[:, None] - 1
        cells = np.clip(((points - self.corner[:, None]) // self.size).astype(np.int64), 0, last)
        faces = np.zeros(points.shape[1])
        for axis in range(self.hit.ndim):
            for step in (-1, 1):
                beside = cells.copy()
                beside[axis] = np.clip(beside[axis] + step, 0, last[axis])
                faces += ~self.hit[tuple(beside)]
        weights: FloatArray = np.where(self.hit[tuple(cells)], np.maximum(0.0, 1.0 - faces / 2), 0.0)
        return weights


class Grid:
    """Collects hits; it grows as points come to lie outside.

    Args:
        size: Edge of the voxels asked for; the grid holds those of half of it.
        dimensions: Of the space, 1 to 3.
        unit: Of lengths, for messages.
    """

    def __init__(self, size: float, dimensions: int, unit: str) -> None:
        self._size, self._unit = size, unit
        self._low = np.zeros(dimensions, np.int64)
        self._hit = np.zeros((0,) * dimensions, np.bool_)
        self._firsts: list[tuple[CellArray, IndexArray]] = []

    def cells(self, points: FloatArray) -> CellArray:
        """The half-size voxels of points (D, N), by their numbers (D, N)."""
        scaled = points * (2.0 / self._size)
        scaled += _OFFSET[: len(points), None]
        if scaled.size and np.abs(scaled).max() >= _LARGEST_CELL:
            raise self._too_small(float(np.ptp(points, axis=1).max()))
        return np.floor(scaled, out=scaled).astype(np.int64)

    def add(self, cells: CellArray, numbers: IndexArray) -> tuple[CellArray, IndexArray]:
        """Mark voxels as hit.

        Args:
            cells: Numbers of half-size voxels (D, n).
            numbers: Shape (n,), the sample that hit each.

        Returns:
            Those that were not hit before, each once, with the first sample that hit it.
        """
        fresh = cells[:, :0], numbers[:0]
        if not cells.size:
            return fresh
        self._make_room(cells.min(axis=1), cells.max(axis=1))
        flat = cells[0] - self._low[0]
        for cell, low, length in zip(cells[1:], self._low[1:], self._hit.shape[1:], strict=True):
            flat *= length
            flat += cell - low
        hit = self._hit.reshape(-1)
        places = np.flatnonzero(~hit[flat])
        if places.size:
            free, first = np.unique(flat[places], return_index=True)
            hit[free] = True
            fresh = cells[:, places[first]], numbers[places[first]]
            self._firsts.append(fresh)
        return fresh

    def halves(self) -> Voxels:
        """The voxels of half the size."""
        return Voxels(self._size / 2, self._corner(), self._hit)

    def whole(self) -> Voxels:
        """The voxels of the size asked for, as they are now."""
        hit = self._hit
        for axis in range(hit.ndim):
            even, odd = (np.take(hit, np.arange(begin, hit.shape[axis], 2), axis) for begin in (0, 1))
            hit = even | odd
        return Voxels(self._size, self._corner(), hit)

    def corners(self, cells: CellArray) -> tuple[FloatArray, FloatArray]:
        """The lower and the upper corners (D, N) of half-size voxels, drawn in by a hair so that they stay inside."""
        low = (cells - _OFFSET[: len(cells), None]) * (self._size / 2)
        hair = self._size * 1e-6
        return low + hair, low + (self._size / 2 - hair)

    def frontier(self, since: int) -> tuple[CellArray, IndexArray]:
        """The free half-size voxels beside those first hit by sample `since` or a later one.

        Returns:
            Their numbers (D, N), and for each the first sample in a neighbour.
        """
        cells, indices = self._hits()
        recent = indices >= since
        cells, indices = cells[:, recent], indices[recent]
        sides = np.concatenate([np.eye(len(cells), dtype=np.int64), -np.eye(len(cells), dtype=np.int64)])
        beside = np.concatenate([cells + side[:, None] for side in sides], axis=1) - self._low[:, None]
        sources = np.tile(indices, len(sides))
        free = ~self._hit[tuple(beside)]
        flat = np.ravel_multi_index(tuple(beside[:, free]), self._hit.shape)
        _, first = np.unique(flat, return_index=True)
        return beside[:, free][:, first] + self._low[:, None], sources[free][first]

    def _hits(self) -> tuple[CellArray, IndexArray]:
        """The half-size voxels that were hit, and the first sample in each."""
        nothing = np.empty((len(self._low), 0), np.int64), np.empty(0, np.int64)
        cells, indices = zip(nothing, *self._firsts, strict=True)
        return np.concatenate(cells, axis=1), np.concatenate(indices)

    def firsts(self) -> IndexArray:
        """The first sample in each voxel of the size asked for, in the order in which they came."""
        cells, indices = self._hits()
        order = np.argsort(indices)
        larger = (cells[:, order] - self._low[:, None]) // 2
        _, first = np.unique(np.ravel_multi_index(tuple(larger), self._hit.shape), return_index=True)
        return indices[order][np.sort(first)]

    def _corner(self) -> FloatArray:
        corner: FloatArray = (self._low - _OFFSET[: len(self._low)]) * (self._size / 2)
        return corner

    def _make_room(self, low: CellArray, high: CellArray) -> None:
        """Enlarge the grid; its faces stay free, and its corner even, so that larger voxels fit."""
        old_low, old_high = self._low, self._low + self._hit.shape
        if self._hit.size and (low > old_low + 1).all() and (high < old_high - 2).all():
            return
        if self._hit.size:
            low, high = np.minimum(low, old_low + 2), np.maximum(high, old_high - 3)
        margin = _MARGIN + (high - low) // 16
        new_low = (low - margin) // 2 * 2
        shape = (high + margin + 1 - new_low + 1) // 2 * 2
        if float(np.prod(shape.astype(float))) > MOST_VOXELS:
            raise self._too_small(float((high - low).max()) * self._size / 2)
        grown = np.zeros(tuple(shape), np.bool_)
        if self._hit.size:
            inside = itertools.starmap(slice, zip(old_low - new_low, old_high - new_low, strict=True))
            grown[tuple(inside)] = self._hit
        self._low, self._hit = new_low, grown

    def _too_small(self, extent: float) -> KinegenError:
        unit, most = self._unit, int(MOST_VOXELS ** (1 / len(self._low)) / 2.4)
        return KinegenError(
            f"voxels of {self._size:g} {unit} are too small for a region of {extent:.4g} {unit}: "
            f"expected {extent / most:.2g} {unit} or more"
        )
