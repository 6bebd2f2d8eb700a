"""Voxels of a region, their measure, and the search for those along its rim.

Voxels are cubes (squares in a plane, pieces of a line) of one size on a grid that stays fixed in the base frame, so
regions of two arms can be laid over each other. The grid holds half-size voxels; those of the size asked for are 2x2x2
of them. It stands a little off the origin, so that no face of a region with round numbers lies on a face of a voxel.

A region measures h^D (n - F/2) with n voxels hit and F open faces, between a voxel that was hit and one that was not. A
rim with unit normal (nx, ny, nz) has (|nx| + |ny| + |nz|)/h^2 open faces for each unit of area, and the voxels that it
cuts reach beyond it by half of (|nx| + |ny| + |nz|) h on average, so half a voxel for each open face lies outside. The
error left is of second order in h where the rim is curved or slants. A flat rim along the grid cuts all its voxels at
the same place, so there it is of first order and of either sign: the region then measures between the voxels without an
open face and all voxels hit. A voxel inside that no sample hit opens six faces more, so too few samples make the figure
smaller, never larger.

An arm of many joints is nearly stretched in only a small part of its joint box: even ten million samples miss the
outermost voxels of a 7-joint arm and some percent of its volume. So every free voxel beside one that was hit becomes a
target, and from the joint vector that led next to it a few damped steps of Gauss and Newton (Levenberg, Marquardt) go
for it within the joint limits, until none is reached or as many poses are spent as there were samples. Nothing is
counted that was not reached: a voxel joins with the joint vector that leads into it.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from kinegen.errors import KinegenError
from kinegen.support.dataclass import dataclass
from kinegen.tools.workspace.tip_samples import FloatArray, IndexArray, Samples, Shape, Tip

MOST_VOXELS = 1 << 28
"""Half-size voxels of a grid, one byte each."""

CellArray = NDArray[np.int64]

_OFFSET = np.array([0.382, 0.236, 0.146])
_MARGIN = 8
_ROOM, _SPARE, _FINER = 2.8, 6.0 * _MARGIN, 1.02
"""Half-size voxels of a grid for a voxel of the region's length, in addition to these, and steps that are tried."""
_LARGEST_CELL = 2.0**52


@dataclass(frozen=True, slots=True)
class Voxels:
    """The voxels of one size that were hit.

    Attributes:
        corner: Shape (D,), coordinates of the grid's lower corner along the axes of the region.
        hit: Shape (n1, ..., nD), which of them were hit; those on the faces of the grid were not.
    """

    size: float
    corner: FloatArray
    hit: NDArray[np.bool_]

    @property
    def count(self) -> int:
        """Return how many were hit."""
        return int(np.count_nonzero(self.hit))

    @property
    def measure(self) -> float:
        """Length, area or volume of the region (see the head of this module); never less than nothing."""
        faces = sum(int(np.count_nonzero(np.diff(self.hit, axis=axis))) for axis in range(self.hit.ndim))
        return max(0.0, self.count - faces / 2) * self.size**self.hit.ndim

    @property
    def inside(self) -> int:
        """Count those without an open face; a region that has no gap finer than a voxel contains these as a whole."""
        inner = self.hit.copy()
        for axis in range(self.hit.ndim):
            for step in (-1, 1):
                # Voxels on the faces of the grid were not hit, so nothing comes around from the other side.
                inner &= np.roll(self.hit, step, axis)
        return int(np.count_nonzero(inner))

    def weights(self, points: FloatArray) -> FloatArray:
        """Return what voxels around points (D, N) add to the measure: 1 less a half for each open face, at least 0."""
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


def least_size(lengths: FloatArray) -> float:
    """Return the edge of the smallest voxels that a grid holds of a region with lengths (D,), as few samples show."""
    # Later samples reach further, and the grid is enlarged by more than they need.
    size = float(lengths.max()) / MOST_VOXELS
    while np.prod(_ROOM * lengths / size + _SPARE) > MOST_VOXELS:
        size *= _FINER
    return size


class Grid:
    """Collects hits of voxels of a size and of half of it, in 1 to 3 dimensions, and grows with the points."""

    def __init__(self, size: float, dimensions: int, unit: str) -> None:
        self._size, self._unit = size, unit
        self._low = np.zeros(dimensions, np.int64)
        self._hit = np.zeros((0,) * dimensions, np.bool_)
        self._firsts: list[tuple[CellArray, IndexArray]] = []

    def cells(self, points: FloatArray) -> CellArray:
        """Return the half-size voxels of points (D, N), by their numbers (D, N)."""
        scaled = points * (2.0 / self._size)
        scaled += _OFFSET[: len(points), None]
        if scaled.size and np.abs(scaled).max() >= _LARGEST_CELL:
            raise self._too_small(float(np.ptp(points, axis=1).max()))
        return np.floor(scaled, out=scaled).astype(np.int64)

    def add(self, cells: CellArray, numbers: IndexArray) -> tuple[CellArray, IndexArray]:
        """Mark half-size voxels (D, n) as hit by samples of numbers (n,).

        Returns those that were not hit before, each once, with the first sample that hit it.
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
        """Return the voxels of half the size."""
        return Voxels(self._size / 2, self._corner(), self._hit)

    def whole(self) -> Voxels:
        """Return the voxels of the size asked for, as they are now."""
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
        """Return the free half-size voxels (D, N) beside those hit since a sample, and the first hit of a neighbour."""
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
        """Return the half-size voxels that were hit, and the first sample in each."""
        nothing = np.empty((len(self._low), 0), np.int64), np.empty(0, np.int64)
        cells, indices = zip(nothing, *self._firsts, strict=True)
        return np.concatenate(cells, axis=1), np.concatenate(indices)

    def firsts(self) -> IndexArray:
        """Return the first sample in each voxel of the size asked for, in the order in which they came."""
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


BoolArray = NDArray[np.bool_]

_INSIDE, _ROUNDS = (0.3, 0.1, 0.03, 0.01), 4
"""How far inside a target steps aim, of its edge: along a rim its nearest point is approached but never passed, while
a point deep inside draws them past a corner that alone is within reach."""

_BATCH = 1 << 14
"""Targets that are sought side by side."""

_DAMPING = 0.01
"""Of the square of a target's edge, to begin with; so little only matters where the Jacobian is singular."""

_LESS, _MORE, _LEAST_DAMPING = 0.3, 4.0, 1e-6
_LONGEST = 0.1
_DIFFERENCE = 1e-6
"""These two of a joint's range."""


@dataclass(frozen=True, slots=True)
class Rim:
    """Joint vectors (dof, K) that hit further voxels, as samples after all others, and the poses that it took."""

    poses: int
    q: FloatArray


@dataclass(frozen=True, slots=True)
class Seeker:
    """Searches for joint vectors that reach targets; the region fills the space that holds it."""

    tip: Tip
    samples: Samples
    shape: Shape

    def seek(self, q: FloatArray, low: FloatArray, high: FloatArray) -> tuple[int, FloatArray]:
        """Search boxes with lower and upper corners (D, N), each from a joint vector of (dof, N).

        Returns the number of poses that it took, and the joint vectors (dof, K) that arrived.
        """
        movers = list(self.tip.movers)
        width = np.ptp(self.samples.box[movers], axis=1)[:, None]
        least, most = self.samples.bounds[movers, :1], self.samples.bounds[movers, 1:]
        points = self._along(q)
        edge = float(high[0, 0] - low[0, 0])
        damping = np.full(q.shape[1], _DAMPING * edge**2)
        arrived, poses = [np.empty((len(q), 0))], 0
        for inside in _INSIDE * _ROUNDS:
            aim = np.clip(points, low + inside * edge, high - inside * edge)
            away = aim - points
            step = _step(self._jacobians(q, points), away, damping, q[movers] <= least, q[movers] >= most)
            tries = q.copy()
            tries[movers] = np.clip(q[movers] + width * step, least, most)
            reached = self._along(tries)
            poses += (1 + len(movers)) * q.shape[1]
            there = ((low <= reached) & (reached <= high)).all(axis=0)
            arrived.append(tries[:, there])
            closer = ((aim - reached) ** 2).sum(axis=0) < (away * away).sum(axis=0)
            q, points = np.where(closer, tries, q), np.where(closer, reached, points)
            damping = np.maximum(damping * np.where(closer, _LESS, _MORE), _LEAST_DAMPING * edge**2)
            on = ~there
            if not on.any():
                break
            q, points, damping, low, high = q[:, on], points[:, on], damping[on], low[:, on], high[:, on]
        return poses, np.concatenate(arrived, axis=1)

    def cells(self, grid: Grid, q: FloatArray) -> CellArray:
        """Return the half-size voxels that joint vectors lead into."""
        return grid.cells(self._along(q))

    def _along(self, q: FloatArray) -> FloatArray:
        """Return points (D, N) along the axes of the region."""
        return self.shape.axes @ self.tip.position(q)

    def _jacobians(self, q: FloatArray, points: FloatArray) -> FloatArray:
        """Derivatives (N, D, movers) by the joints, each in units of its range."""
        columns = []
        for mover in self.tip.movers:
            moved = q.copy()
            moved[mover] += _DIFFERENCE * np.ptp(self.samples.box[mover])
            columns.append((self._along(moved) - points) / _DIFFERENCE)
        return np.stack(columns, axis=1).transpose(2, 0, 1)


def fill_rim(grid: Grid, seeker: Seeker, count: int) -> Rim:
    """Search the voxels around those that were hit; `grid` takes in what is found, and `count` poses may be spent."""
    found = np.empty((len(seeker.samples.box), 0))
    poses, recent = 0, 0
    while poses < count:
        targets, sources = grid.frontier(recent)
        recent = count + found.shape[1]
        if not sources.size:
            break
        before = found
        for start in range(0, len(sources), _BATCH):
            source = sources[start : start + _BATCH]
            # Sources are samples, or joint vectors of the rim that were found before.
            q = seeker.samples.at(source)
            q[:, source >= count] = before[:, source[source >= count] - count]
            spent, arrived = seeker.seek(q, *grid.corners(targets[:, start : start + _BATCH]))
            poses += spent
            grid.add(seeker.cells(grid, arrived), count + found.shape[1] + np.arange(arrived.shape[1]))
            found = np.concatenate([found, arrived], axis=1)
            if poses >= count:
                break
    return Rim(poses, found)


def _step(
    jacobians: FloatArray, away: FloatArray, damping: FloatArray, least: BoolArray, most: BoolArray
) -> FloatArray:
    """Damped steps (m, N) along `away` (D, N) in units of the joints' ranges.

    Joints (m, N) that stand at their least or most and would go on stay where they are, and the others are asked again.
    """
    step = _damped(jacobians, away, damping)
    held = (least & (step < 0)) | (most & (step > 0))
    if held.any():
        step = _damped(np.where(held.T[:, None, :], 0.0, jacobians), away, damping)
    largest = np.maximum(np.abs(step).max(axis=0), np.finfo(float).tiny)
    shortened: FloatArray = step * np.minimum(1.0, _LONGEST / largest)
    return shortened


def _damped(jacobians: FloatArray, away: FloatArray, damping: FloatArray) -> FloatArray:
    transposed = jacobians.transpose(0, 2, 1)
    damped = jacobians @ transposed + damping[:, None, None] * np.eye(len(away))
    step: FloatArray = (transposed @ np.linalg.solve(damped, away.T[:, :, None]))[:, :, 0].T
    return step
