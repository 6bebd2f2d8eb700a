"""One pool of threads that all kernels of a package share."""

from __future__ import annotations

import contextlib
import math
import operator
import os
import threading
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

_pools: dict[str, ThreadPoolExecutor] = {}  # the one pool, made when first needed
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pools.clear)  # a child has none of its parent's threads


def workers_for(threads: int) -> int:
    """The number of threads that `threads=` asks for, 0 being all cores."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    try:
        wanted = operator.index(threads)
    except TypeError:
        raise TypeError(f"threads is {threads!r}, expected an integer: 0 (all cores) or more") from None
    if wanted < 0:
        raise ValueError(f"threads is {threads}, expected 0 (all cores) or more")
    return min(wanted or cores, 4 * cores)


def spread(work: Callable[..., None], blocks: Generator[tuple[Any, ...]], workers: int) -> None:
    """Work through the blocks, without NumPy's warnings, the caller together with helpers from the pool."""
    lock = threading.Lock()
    pool = _pools.get("") or _pools.setdefault("", ThreadPoolExecutor(os.cpu_count(), "kinegen"))

    def drain() -> None:
        while True:
            with lock:
                block = next(blocks, None)
            if block is None:
                return
            with np.errstate(all="ignore"):
                work(*block)

    helpers: list[Future[None]] = []
    try:
        # While Python ends, and where the system has no more threads, the caller does all.
        with contextlib.suppress(RuntimeError):
            helpers.extend(pool.submit(drain) for _ in range(workers - 1))
        drain()
    finally:
        with lock:
            blocks.close()
        for helper in helpers:
            if not helper.cancel():
                helper.result()


def blocks_of(arrays: Sequence[NDArray[Any]], lead: int, limit: int) -> Generator[tuple[int, list[NDArray[Any]]]]:
    """Cut a batch along its `lead` leading axes into blocks of at most `limit` poses."""
    first = arrays[0]
    inner = math.prod(first.shape[1:lead])
    if lead == 0:
        yield lead, list(arrays)
    elif inner > limit:
        for parts in zip(*arrays, strict=True):
            yield from blocks_of(parts, lead - 1, limit)
    else:
        step = limit // inner
        for start in range(0, len(first), step):
            yield lead, [array[start : start + step] for array in arrays]
