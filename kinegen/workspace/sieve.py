"""What a block of samples goes through: the kernel, the figures that are sought, and the numbers of voxels."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from kinegen.errors import KinegenError
from kinegen.workspace.options import SurveyOptions
from kinegen.workspace.reach import Best, Line, best_of
from kinegen.workspace.sample import FloatArray, IndexArray, Samples
from kinegen.workspace.shape import Shape
from kinegen.workspace.tip import Tip
from kinegen.workspace.voxels import CellArray, Grid

_BLOCK = 1 << 16
"""Samples that fit into a processor's second cache together with what becomes of them."""


@dataclass(frozen=True, slots=True)
class Block:
    """What becomes of one block of samples.

    Attributes:
        start: Number of its first sample.
        best: The extremes among them.
        cells: Numbers of half-size voxels (D, n) that they hit; None where none are counted.
        numbers: Shape (n,), the sample that hit each, ascending for each voxel.
    """

    start: int
    best: Best
    cells: CellArray | None
    numbers: IndexArray


@dataclass(frozen=True, slots=True)
class Sieve:
    """Everything that a block of samples goes through.

    Attributes:
        tip: The tip.
        samples: The sequence of joint vectors.
        shape: The region's shape.
        axis: The first joint's axis, if there is one.
        grid: What numbers voxels; None where none are counted.
    """

    tip: Tip
    samples: Samples
    shape: Shape
    axis: Line | None
    grid: Grid | None

    def sift(self, start: int, end: int) -> Block:
        """The block of the samples from `start` to before `end`."""
        points = positions(self.tip, self.samples, start, end)
        along = points if len(self.shape.axes) == 3 else self.shape.axes @ points
        cells = None if self.grid is None else self.grid.cells(along)
        return Block(start, best_of(points, start, self.axis), cells, np.arange(start, end))


Sift = Callable[[Sieve, SurveyOptions], Iterator[Block]]
"""Puts all samples through a sieve; the blocks come in order."""


def in_threads(sieve: Sieve, options: SurveyOptions) -> Iterator[Block]:
    """Have threads of this process sift, a few blocks ahead.

    Args:
        sieve: What the samples go through.
        options: How many samples there are, and how many threads.

    Yields:
        The blocks in order.
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    threads = options.threads or cores
    with ThreadPoolExecutor(threads, "kinegen-workspace") as pool:
        waiting: deque[Future[Block]] = deque()
        try:
            for start, end in spans(options.samples):
                waiting.append(pool.submit(sieve.sift, start, end))
                if len(waiting) > 2 * threads:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for future in waiting:
                future.cancel()


def spans(samples: int) -> Iterator[tuple[int, int]]:
    """Where blocks begin and end; one begins at half of the samples."""
    for low, high in ((0, samples // 2), (samples // 2, samples)):
        for start in range(low, high, _BLOCK):
            yield start, min(start + _BLOCK, high)


def positions(tip: Tip, samples: Samples, start: int, end: int) -> FloatArray:
    """The points (3, N) to which some samples lead.

    Raises:
        KinegenError: If the kernel gives none for one of them.
    """
    points = tip.position(samples.at(np.arange(start, end)))
    if not np.isfinite(points).all():
        raise KinegenError(
            "some joint values within the limits are too large for the kernel, which then gives no position; "
            "expected limits of a few turns"
        )
    return points
