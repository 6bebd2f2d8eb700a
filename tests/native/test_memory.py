"""The memory of large results is used again, and lent to the system meanwhile."""

from __future__ import annotations

import gc
import pickle
import re
import resource
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

Loader = Callable[[str, str], ModuleType]

COUNT = 300_000
"""Configurations whose poses are larger than what malloc keeps."""

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="memory is lent as Linux does it")


@pytest.fixture
def chain(load: Loader) -> ModuleType:
    return load("chain", "c")


def inputs(count: int = COUNT, dtype: str = "f8") -> Any:
    """Joint values, all different."""
    return np.arange(3.0 * count).reshape(count, 3).astype(dtype)


def faults() -> int:
    """How often the system had to find a page for this process."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt


def lent() -> int:
    """Bytes that this process has lent to the system."""
    text = Path("/proc/self/smaps_rollup").read_text(encoding="ascii")
    return 1024 * int(re.findall(r"LazyFree: +(\d+) kB", text)[0])


def test_later_results_lie_where_earlier_ones_lay(chain: ModuleType) -> None:
    q = inputs()
    result = chain.fk(q)
    place, expected = result.ctypes.data, result.copy()
    del result
    again = chain.fk(q)

    assert again.ctypes.data == place
    assert again.flags.owndata
    assert again.base is None
    np.testing.assert_array_equal(again, expected)
    assert chain.fk(q).ctypes.data != place, "it is in use"


@pytest.mark.parametrize("layout", ["4x4", "3x4", "joint_major"])
@pytest.mark.parametrize("dtype", ["f8", "f4"])
def test_calls_in_a_row_need_no_new_pages(chain: ModuleType, layout: str, dtype: str) -> None:
    q = inputs(2 * COUNT, dtype)
    q = np.ascontiguousarray(q.T) if layout == "joint_major" else q
    for _ in range(3):
        result = chain.fk(q, layout=layout)
    before = faults()
    for _ in range(3):
        result = chain.fk(q, layout=layout)

    assert faults() - before < result.nbytes >> 21, "fewer than one for each huge page"


def test_what_is_gone_is_lent_to_the_system(chain: ModuleType) -> None:
    gc.collect()
    result = chain.fk(inputs())
    before, size = lent(), result.nbytes
    del result

    assert lent() >= before + size
    held = chain.fk(inputs())
    assert lent() <= before + (1 << 21), "what is written is its own again"
    del held


def test_no_more_than_four_are_kept(chain: ModuleType) -> None:
    """Modules of other tests in this process have lent memory of their own."""
    q, before = inputs(), lent()
    held = [chain.fk(q) for _ in range(8)]
    size = held[0].nbytes
    assert len({each.ctypes.data for each in held}) == 8
    held.clear()

    assert lent() - before < 5.5 * size


def test_a_small_result_takes_no_large_memory(chain: ModuleType) -> None:
    large = chain.fk(inputs(4 * COUNT))
    place = large.ctypes.data
    del large

    assert chain.fk(inputs()).ctypes.data != place


def test_results_can_be_resized_and_pickled(chain: ModuleType) -> None:
    q = inputs()
    expected = chain.fk(q).copy()
    for size in (expected.size // 3, 2 * expected.size, expected.size):
        result = chain.fk(q)
        result.resize(size, refcheck=False)
        flat = expected.reshape(-1)[:size]

        np.testing.assert_array_equal(result[: flat.size], flat)
        assert not result[flat.size :].any()
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(chain.fk(q))), expected)  # noqa: S301 - our own bytes


def test_other_arrays_are_as_ever(chain: ModuleType) -> None:
    core = np._core if hasattr(np, "_core") else np.core
    result = chain.fk(inputs())

    assert core.multiarray.get_handler_name(result) == "kinegen"
    assert core.multiarray.get_handler_name() == "default_allocator"
    assert core.multiarray.get_handler_name(chain.fk(inputs(1000))) == "default_allocator"


def test_too_much_is_refused_and_nothing_stays_behind(chain: ModuleType) -> None:
    with pytest.raises(MemoryError):
        chain.fk(np.broadcast_to(np.ones(3), (1 << 42, 3)))
    core = np._core if hasattr(np, "_core") else np.core

    assert core.multiarray.get_handler_name() == "default_allocator"


def test_threads_never_share_it(chain: ModuleType) -> None:
    def work(seed: int) -> bool:
        q = inputs(COUNT // 2) + seed
        expected = chain.fk(q, out=np.empty((len(q), 4, 4)))
        return all(np.array_equal(chain.fk(q), expected) for _ in range(4))

    with ThreadPoolExecutor(6) as pool:
        assert all(pool.map(work, range(12)))


def test_a_child_has_its_own(chain: ModuleType) -> None:
    q = inputs()
    expected = chain.fk(q).copy()
    receiver, sender = get_context("fork").Pipe(duplex=False)

    def child() -> None:
        sender.send(all(np.array_equal(chain.fk(q), expected) for _ in range(3)))

    process = get_context("fork").Process(target=child)
    process.start()
    same = [np.array_equal(chain.fk(q), expected) for _ in range(3)]

    assert all(same)
    assert receiver.poll(60)
    assert receiver.recv()
    process.join()
