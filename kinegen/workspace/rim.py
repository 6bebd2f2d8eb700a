"""The rim of a workspace, which even samples reach last, filled in by searching for it.

An arm of many joints is nearly stretched in only a small part of its joint box: even ten million samples miss the
outermost voxels of a 7-joint arm and some percent of its volume. So every free voxel beside one that was hit becomes a
target, and from the joint vector that led next to it a few damped steps of Gauss and Newton (Levenberg, Marquardt) go
for it within the joint limits. Damping and limits carry them along the rim, where the Jacobian is singular and joints
stand at their bounds. Targets that are reached make new ones, until none are, or as many poses are spent as there were
samples.

Nothing is counted that was not reached: a voxel joins with the joint vector that leads into it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinegen.workspace.sample import FloatArray, Samples
from kinegen.workspace.shape import Shape
from kinegen.workspace.tip import Tip
from kinegen.workspace.voxels import CellArray, Grid

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
    """What the search came to.

    Attributes:
        poses: Number of poses that it evaluated.
        q: Shape (dof, K), joint vectors that hit further voxels; they count as samples after all others.
    """

    poses: int
    q: FloatArray


@dataclass(frozen=True, slots=True)
class Seeker:
    """Goes for targets.

    Attributes:
        tip: The tip.
        samples: The sequence that hit the targets' neighbours.
        shape: The region, which fills the space that holds it.
    """

    tip: Tip
    samples: Samples
    shape: Shape

    def seek(self, q: FloatArray, low: FloatArray, high: FloatArray) -> tuple[int, FloatArray]:
        """Search boxes with lower and upper corners (D, N), each from a joint vector of (dof, N).

        Returns:
            The number of poses that it took, and the joint vectors (dof, K) that arrived.
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
        """The half-size voxels that joint vectors lead into."""
        return grid.cells(self._along(q))

    def _along(self, q: FloatArray) -> FloatArray:
        """Points (D, N) along the axes of the region."""
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
    """Search the voxels around those that were hit.

    Args:
        grid: What was hit so far; it takes in what is found.
        seeker: How to search.
        count: How many samples were taken, and how many poses may be spent.

    Returns:
        What was found.
    """
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
