"""What kind of set the tip sweeps: a point, a curve, a surface or a solid, and whether it lies flat.

Two numbers say it. The rank of the tip's Jacobian at generic joint vectors is the dimension of what is swept: 1 for a
curve, 2 for a surface or a planar region, 3 for a solid. The singular values of sampled points say how many dimensions
of space hold it: a circle is a curve that takes 2, a sphere a surface that takes 3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kinegen.workspace.sample import FloatArray, Samples
from kinegen.workspace.tip import Tip

FLAT = 1e-9
"""Thickness, relative to the size of the region, below which it has none; rounding leaves 1e-15."""

_RANK = 1e-7
_STEP = 1e-5
"""Of a joint's range; differences over it are true to some 1e-10, of the region's size."""

_PLACES = 64

_NAMES = {0: "point", 1: "curve", 2: "surface", 3: "solid"}


@dataclass(frozen=True, slots=True)
class Shape:
    """The kind of a region, and the axes in which it is measured.

    Attributes:
        dimension: Of the region itself: 0 a point, 1 a curve, 2 a surface or planar region, 3 a solid.
        axes: Shape (D, 3), unit vectors in the base frame that span the space which holds it.
        names: A name for each axis: x, y, z where it is one of the base frame, else u, v.
        through: Shape (3,), a point of that space.
    """

    dimension: int
    axes: FloatArray
    names: tuple[str, ...]
    through: FloatArray

    @property
    def fills(self) -> bool:
        """Whether the region has a length, area or volume in the space that holds it."""
        return self.dimension == len(self.axes)

    @property
    def kind(self) -> str:
        """What it is, in words."""
        if self.fills and 1 <= self.dimension <= 2:
            return ("straight line", "planar region")[self.dimension - 1]
        return _NAMES[self.dimension]


def find_shape(tip: Tip, samples: Samples, points: FloatArray) -> Shape:
    """Find the kind of the region.

    Args:
        tip: The tip.
        samples: Joint vectors.
        points: Shape (3, N), where some of them lead.

    Returns:
        The kind and the axes.
    """
    through = points.mean(axis=1)
    size = max(float(np.ptp(points, axis=1).max()), np.finfo(float).tiny)
    # A region that is too small for its distance from the base is rounding.
    if size <= FLAT * float(np.abs(points).max()):
        return Shape(0, np.zeros((0, 3)), (), through)
    directions = np.linalg.svd((points - through[:, None]).T, full_matrices=False)[2]
    thickness = np.ptp(directions @ points, axis=1)
    spanning = int((thickness > FLAT * size).sum())
    axes, names = _axes(directions, spanning)
    return Shape(min(_rank(tip, samples, size), spanning), axes, names, through)


def _axes(directions: FloatArray, spanning: int) -> tuple[FloatArray, tuple[str, ...]]:
    """Axes of the base frame where they serve; in a slanting plane a level one, and one that rises."""
    if spanning == 3:
        return np.eye(3), ("x", "y", "z")
    across = directions[spanning:]
    along = [axis for axis in range(3) if np.abs(across[:, axis]).max() <= FLAT]
    if len(along) == spanning:
        return np.eye(3)[along], tuple("xyz"[axis] for axis in along)
    if spanning == 1:
        line = directions[0]
        return (line * np.sign(line[np.abs(line).argmax()]))[None], ("u",)
    normal = across[0] * np.sign(across[0][np.abs(across[0]).argmax()])
    level = np.cross([0.0, 0.0, 1.0], normal)
    level /= np.linalg.norm(level)
    return np.stack([level, np.cross(normal, level)]), ("u", "v")


def _rank(tip: Tip, samples: Samples, size: float) -> int:
    """The largest rank of the Jacobian, from differences over a small part of each joint's range."""
    q = samples.at(np.arange(_PLACES))
    columns = []
    for mover in tip.movers:
        step = np.zeros_like(q)
        step[mover] = _STEP * np.ptp(samples.box[mover])
        columns.append((tip.position(q + step) - tip.position(q - step)) / (2 * _STEP * size))
    if not columns:
        return 0
    jacobians = np.stack(columns, axis=1).transpose(2, 0, 1)
    return int((np.linalg.svd(jacobians, compute_uv=False) > _RANK).sum(axis=1).max())
