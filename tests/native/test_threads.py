"""The pool that shares a batch: every block once, errors handed on, nothing returned before it is written."""

from __future__ import annotations

import os
import threading
import time
import warnings
from collections.abc import Generator, Iterator
from typing import Any

import numpy as np
import pytest

from kinegen.runtime.vendored._threads import _pools, blocks_of, spread, workers_for


@pytest.fixture(autouse=True)
def _own_pool() -> Iterator[None]:
    kept = dict(_pools)
    _pools.clear()
    yield
    for pool in _pools.values():
        pool.shutdown()
    _pools.clear()
    _pools.update(kept)


def test_zero_asks_for_all_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(6)), raising=False)

    assert [workers_for(threads) for threads in (0, 1, 5, 24, 25, 10_000)] == [6, 1, 5, 24, 24, 24]
    assert workers_for(np.int64(3)) == 3


@pytest.mark.parametrize("threads", [-1, -5])
def test_fewer_than_none_are_refused(threads: int) -> None:
    with pytest.raises(ValueError, match=f"threads is {threads}, expected 0"):
        workers_for(threads)


@pytest.mark.parametrize("threads", [1.5, "2", None])
def test_other_things_than_whole_numbers_are_refused(threads: Any) -> None:
    with pytest.raises(TypeError, match="expected an integer"):
        workers_for(threads)


def test_nothing_returns_before_all_helpers_have_written() -> None:
    """The caller has done its block long before the helper has."""
    caller, written = threading.get_ident(), list[int]()
    begun = threading.Event()

    def work(block: int) -> None:
        if threading.get_ident() == caller:
            begun.wait(5)
        else:
            begun.set()
            time.sleep(0.05)
        written.append(block)

    spread(work, ((block,) for block in range(2)), 2)

    assert sorted(written) == [0, 1]


def test_an_error_of_a_helper_comes_out() -> None:
    caller, begun = threading.get_ident(), threading.Event()

    def work(_block: int) -> None:
        if threading.get_ident() != caller:
            begun.set()
            raise ValueError("of a helper")
        begun.wait(5)

    with pytest.raises(ValueError, match="of a helper"):
        spread(work, ((block,) for block in range(2)), 2)


def test_an_error_of_the_caller_comes_out_and_ends_the_work() -> None:
    done = list[int]()

    def work(block: int) -> None:
        done.append(block)
        raise ValueError("of the caller")

    with pytest.raises(ValueError, match="of the caller"):
        spread(work, ((block,) for block in range(9)), 1)
    assert done == [0]


def test_blocks_are_taken_by_one_thread_at_a_time() -> None:
    """A generator that two threads enter at once raises; each block is slow to come."""
    done = list[int]()

    def slow() -> Generator[tuple[int]]:
        for block in range(12):
            time.sleep(0.004)
            yield (block,)

    spread(done.append, slow(), 3)

    assert sorted(done) == list(range(12))


def test_helpers_help() -> None:
    """Three blocks that wait for each other are only done by three threads."""
    together = threading.Barrier(3, timeout=5)

    spread(lambda _: together.wait(), ((block,) for block in range(3)), 3)


def test_all_calls_share_one_pool() -> None:
    spread(lambda _: None, ((block,) for block in range(2)), 2)
    (pool,) = _pools.values()
    spread(lambda _: None, ((block,) for block in range(2)), 2)

    assert list(_pools.values()) == [pool]


def test_warnings_of_numpy_are_silent() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        spread(np.log, ((np.array([-1.0, 0.0]),) for _ in range(2)), 1)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
def test_a_child_has_no_pool_of_its_parent() -> None:
    spread(lambda _: None, ((block,) for block in range(2)), 2)
    assert _pools
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        child = os.fork()
    if child == 0:
        os._exit(len(_pools))

    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


@pytest.mark.parametrize(
    ("shape", "lead", "limit"),
    [((10, 3), 1, 4), ((10, 3), 1, 5), ((9, 3), 1, 100), ((2, 6, 3), 2, 4), ((3, 2, 2, 3), 3, 4), ((5, 2, 3), 2, 5)],
)
def test_blocks_have_every_configuration_once_and_are_small(shape: tuple[int, ...], lead: int, limit: int) -> None:
    numbers = np.arange(np.prod(shape, dtype=int)).reshape(shape)
    found = list(blocks_of([numbers, numbers[..., 0]], lead, limit))

    assert all(np.prod(arrays[0].shape[:axes], dtype=int) <= limit for axes, arrays in found)
    assert sorted(np.concatenate([arrays[0].ravel() for _, arrays in found])) == list(range(numbers.size))
    assert all((arrays[0][..., 0] == arrays[1]).all() for _, arrays in found)


def test_one_configuration_is_one_block() -> None:
    ((axes, (array,)),) = blocks_of([np.ones((4, 4))], 0, 8)

    assert (axes, array.shape) == (0, (4, 4))
