"""The layer of a region that a picture shows, searched until its outline is sharp.

Samples are spread over the whole region, and few of them fall into the one layer around a plane. Every free voxel of
the layer beside one that was reached becomes a target, as along the rim, until none is reached. Nothing is drawn that
was not reached.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kinegen.workspace.rim import Seeker
from kinegen.workspace.sample import FloatArray
from kinegen.workspace.survey import Tally, Workspace
from kinegen.workspace.voxels import CellArray, Voxels

_MOST_ROUNDS = 400
_HAIR = 1e-6
"""How far a target is drawn in, of its edge, so that what arrives is inside."""


def fill_layer(workspace: Workspace, axis: int, place: int) -> NDArray[np.bool_]:
    """Search the free voxels of half the size in one layer.

    Args:
        workspace: A survey of a region in space.
        axis: The axis that is square to the layer.
        place: Number of the layer along it, among `workspace.tally.halves`.

    Returns:
        Which voxels of the layer are reached, along the other two axes.

    Raises:
        ValueError: If the region has no voxels.
    """
    if workspace.tally is None:
        raise ValueError("a region without voxels has no layers")
    seeker = Seeker(workspace.tip, workspace.samples, workspace.shape)
    halves, q = workspace.tally.halves, workspace.tally.q
    reached: NDArray[np.bool_] = np.take(halves.hit, place, axis).copy()
    # The joint vector to set out from for each voxel, by its place in q; -1 where none is known.
    source = _sources(workspace, workspace.tally, axis, place)
    tried = np.full(reached.shape, -1)
    for _ in range(_MOST_ROUNDS):
        near = np.maximum(source, _beside(np.where(reached, source, -1)))
        targets = np.argwhere(~reached & (near >= 0) & (tried != near))
        if not len(targets):
            break
        start = near[tuple(targets.T)]
        tried[tuple(targets.T)] = start
        low = halves.corner[:, None] + (np.insert(targets, axis, place, axis=1).T + _HAIR) * halves.size
        _, arrived = seeker.seek(q[:, start], low, low + (1 - 2 * _HAIR) * halves.size)
        cells = np.delete(_cells(halves, seeker.tip.position(arrived)), axis, axis=0)
        reached[tuple(cells)] = True
        source[tuple(cells)] = q.shape[1] + np.arange(arrived.shape[1])
        q = np.concatenate([q, arrived], axis=1)
    return reached


def _sources(workspace: Workspace, tally: Tally, axis: int, place: int) -> NDArray[np.int64]:
    """For each voxel of a layer the sample that hit the larger voxel around it, or -1."""
    owner = np.full(tally.voxels.hit.shape, -1)
    owner[tuple(_cells(tally.voxels, workspace.tip.position(tally.q)))] = np.arange(tally.q.shape[1])
    layer = np.take(owner, place // 2, axis)
    return np.repeat(np.repeat(layer, 2, axis=0), 2, axis=1)


def _beside(source: NDArray[np.int64]) -> NDArray[np.int64]:
    """The latest source among the four neighbours of each voxel, or -1."""
    wide = np.pad(source, 1, constant_values=-1)
    sides = wide[:-2, 1:-1], wide[2:, 1:-1], wide[1:-1, :-2], wide[1:-1, 2:]
    latest: NDArray[np.int64] = np.maximum.reduce(sides)
    return latest


def _cells(voxels: Voxels, points: FloatArray) -> CellArray:
    """The voxels around points (3, N), by their numbers."""
    last = np.array(voxels.hit.shape)[:, None] - 1
    return np.clip(((points - voxels.corner[:, None]) // voxels.size).astype(np.int64), 0, last)
