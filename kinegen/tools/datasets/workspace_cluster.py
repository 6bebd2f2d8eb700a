"""A survey of a workspace whose samples are sifted by the processes of a cluster.

Each takes a run of blocks, and of the voxels that a run hits sends back each one once, so that little travels. The
blocks are put together in order, so the result is that of one process, to the last bit.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import replace
from types import ModuleType
from typing import Any

from kinegen.errors import KinegenError
from kinegen.support.compat import library
from kinegen.support.dataclass import dataclass
from kinegen.tools.datasets.cluster import LOSSES, Shipped, ship
from kinegen.tools.workspace.block_reduction import Block, Sieve, Sift, spans
from kinegen.tools.workspace.options import SurveyOptions
from kinegen.tools.workspace.tip_samples import FloatArray

_RUN = 64
"""Blocks of a run: some seconds of work for what comes back."""


@dataclass(frozen=True, slots=True)
class _Position:
    """The position kernel of a module that travels as bytes."""

    shipped: Shipped
    name: str

    def __call__(self, q: FloatArray) -> FloatArray:
        points: FloatArray = getattr(self.shipped.load(), self.name)(q, layout="joint_major", threads=1)
        return points


def in_processes(client: Any, module: ModuleType, kernel: str) -> Sift:
    """Have the workers of a cluster sift, by the position kernel of a module, for `survey` of a workspace."""
    distributed = library("distributed", "a cluster", "fleet")
    workers = max(1, len(client.scheduler_info()["workers"]))

    # Two runs a worker wait, so that none is idle and little is in memory.
    def sift(sieve: Sieve, options: SurveyOptions) -> Iterator[Block]:
        position = _Position(ship(module), kernel)
        shared = client.scatter(replace(sieve, tip=replace(sieve.tip, position=position)), broadcast=True)
        waiting: deque[Any] = deque()
        try:
            for run in _runs(options.samples):
                waiting.append(client.submit(_sifted, shared, run, pure=False))
                if len(waiting) > 2 * workers:
                    yield from waiting.popleft().result()
            while waiting:
                yield from waiting.popleft().result()
        except distributed.scheduler.KilledWorker as error:
            raise KinegenError(f"workers were lost {LOSSES} times over the same samples") from error
        finally:
            client.cancel(list(waiting))

    return sift


def _runs(samples: int) -> Iterator[tuple[tuple[int, int], ...]]:
    """Yield the blocks, some of them together."""
    blocks = list[tuple[int, int]]()
    for span in spans(samples):
        blocks.append(span)
        if len(blocks) == _RUN:
            yield tuple(blocks)
            blocks.clear()
    if blocks:
        yield tuple(blocks)


def _sifted(sieve: Sieve, run: tuple[tuple[int, int], ...]) -> list[Block]:
    """On a worker: the blocks of a run, each with the voxels that no block of the run before it hits."""
    # A grid of its own: workers keep the sieve, and take runs in any order.
    grid, found = deepcopy(sieve.grid), []
    for start, end in run:
        block = sieve.sift(start, end)
        if grid is not None and block.cells is not None:
            cells, numbers = grid.add(block.cells, block.numbers)
            block = replace(block, cells=cells, numbers=numbers)
        found.append(block)
    return found
