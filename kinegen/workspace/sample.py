"""Joint vectors that fill the joint box evenly.

Random joint vectors leave gaps beside clusters: of n voxels that random samples hit m times each on average, n exp(-m)
stay empty, and the gaps are worst along the rim of a workspace, where only a thin part of the joint box leads. The
additive recurrence of Roberts ("The unreasonable effectiveness of quasirandom sequences", 2018) spreads its points so
that no cluster forms, costs one product and one remainder a number, gives any point of the sequence without those
before it, and stays even wherever it ends: its first half is a fair sample of the same box. Joints that do not move
the tip are left out of it, since an even spread is the easier the fewer dimensions there are.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinegen.workspace.ranges import Range

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Samples:
    """A sequence of joint vectors.

    Attributes:
        box: Shape (dof, 2), the ends of each joint variable's range.
        bounds: Shape (dof, 2), how far a search that begins at a sample may go.
        movers: The joint variables that vary; the others stay in the middle of their ranges.
        start: Shape (movers,), the point of the unit cube where the sequence begins.
    """

    box: FloatArray
    bounds: FloatArray
    movers: tuple[int, ...]
    start: FloatArray

    def at(self, indices: IndexArray) -> FloatArray:
        """The joint vectors of some places in the sequence, shape (dof, N)."""
        q = np.empty((len(self.box), len(indices)))
        q[:] = self.box.mean(axis=1)[:, None]
        for mover, part in zip(self.movers, spread(indices, self.start), strict=True):
            low, high = self.box[mover]
            # Rounding may carry the largest values over the bound.
            np.minimum(low + part * (high - low), high, out=q[mover])
        return q


def spread(indices: IndexArray, start: FloatArray) -> Iterator[FloatArray]:
    """Some points of the sequence that begins at a point (d,) of the unit cube, one coordinate (N,) after the other."""
    count = indices.astype(float)
    for first, step in zip(start, _steps(len(start)), strict=True):
        part = count * step
        part += first
        part -= np.floor(part)
        yield part


def sequence(ranges: tuple[Range, ...], movers: tuple[int, ...], seed: int) -> Samples:
    """The sequence of a seed.

    Args:
        ranges: What each joint variable runs through.
        movers: The joint variables that vary.
        seed: Decides where the sequence begins; equal seeds give equal sequences.

    Returns:
        The sequence.
    """
    box = np.array([(each.low, each.high) for each in ranges]).reshape(-1, 2)
    bounds = np.array([each.bounds for each in ranges]).reshape(-1, 2)
    return Samples(box, bounds, movers, np.random.default_rng(seed).random(len(movers)))


def _steps(dimensions: int) -> FloatArray:
    """The steps of the recurrence: powers of 1/g, where g is the positive root of g^(d+1) = g + 1.

    That is the golden ratio for one dimension, and the plastic number for two.
    """
    root = 2.0
    for _ in range(64):  # a contraction by more than a half
        root = (1.0 + root) ** (1.0 / (dimensions + 1))
    return root ** -np.arange(1.0, dimensions + 1)
