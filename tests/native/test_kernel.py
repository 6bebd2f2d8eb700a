"""Calls of every kind: refusals, results in place, threads, parameters, bound arguments, pickling."""

from __future__ import annotations

import copy
import gc
import os
import pickle
import re
import subprocess
import sys
import threading
import tracemalloc
import weakref
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from numpy.lib.stride_tricks import as_strided

from tests.native.conftest import SAMPLES

Loader = Callable[[str, str], ModuleType]

Q = np.arange(6.0).reshape(2, 3)
RIGHT = np.zeros((2, 4, 4))


def read_only() -> Any:
    out = np.empty((2, 4, 4))
    out.flags.writeable = False
    return out


# What is wrong, the inputs and the arguments of the call, the error and its words.
REFUSED: dict[str, tuple[tuple[Any, ...], dict[str, Any], type[Exception], str]] = {
    "too short": ((np.zeros(2),), {}, ValueError, "fk: q has shape (2,), expected (..., 3)"),
    "wrong last axis": ((np.zeros((3, 5)),), {}, ValueError, "fk: q has shape (3, 5), expected (..., 3)"),
    "no axis": ((1.0,), {}, ValueError, "fk: q has shape (), expected (..., 3)"),
    "empty list": (([],), {}, ValueError, "fk: q has shape (0,), expected (..., 3)"),
    "joint-major, one axis": (
        (np.zeros(3),),
        {"layout": "joint_major"},
        ValueError,
        "fk: q has shape (3,), expected (3, N)",
    ),
    "joint-major, transposed": (
        (np.zeros((5, 3)),),
        {"layout": "joint_major"},
        ValueError,
        "fk: q has shape (5, 3), expected (3, N)",
    ),
    "complex": (
        (np.zeros(3, complex),),
        {},
        TypeError,
        "q has entries of type complex128, expected plain real numbers",
    ),
    "objects": ((np.array([1, None, 2]),), {}, TypeError, "q has entries of type object, expected plain real numbers"),
    "text": ((["a", "b", "c"],), {}, TypeError, "q has strings, expected plain real numbers"),
    "dates": (
        (np.zeros(3, "M8[s]"),),
        {},
        TypeError,
        "q has entries of type datetime64[s], expected plain real numbers",
    ),
    "records": ((np.zeros(3, "f8,f8"),), {}, TypeError, "expected plain real numbers"),
    "nothing": ((None,), {}, TypeError, "q has entries of type object, expected plain real numbers"),
    "masked": ((np.ma.zeros(3),), {}, TypeError, "q is a masked array, expected plain real numbers"),
    "ragged": (([[1, 2, 3], [4, 5]],), {}, ValueError, "fk: q holds lists of different lengths, expected an array"),
    "layout": ((Q,), {"layout": "4x3"}, ValueError, "fk: no layout '4x3' (there are ('4x4', '3x4', 'joint_major'))"),
    "negative threads": ((Q,), {"threads": -1}, ValueError, "threads is -1, expected 0 (all cores) or more"),
    "negative threads, one pose": ((Q[0],), {"threads": -2}, ValueError, "threads is -2"),
    "half a thread": ((Q,), {"threads": 1.5}, TypeError, "threads is 1.5, expected an integer: 0 (all"),
    "params of a robot without": (
        (Q,),
        {"params": (1.0,)},
        TypeError,
        "params is given, but the robot has no runtime parameters",
    ),
    "out of another shape": (
        (Q,),
        {"out": np.empty((2, 3, 4))},
        ValueError,
        "fk: out has shape (2, 3, 4), expected (2, 4, 4) for q of shape (2, 3)",
    ),
    "out of broadcast shape": ((Q,), {"out": np.empty((5, 2, 4, 4))}, ValueError, "expected (2, 4, 4)"),
    "out of another type": ((Q,), {"out": RIGHT.astype("f4")}, TypeError, "out is of type float32, expected float64"),
    "out for float": ((Q.astype("f4"),), {"out": RIGHT}, TypeError, "out is of type float64, expected float32"),
    "out of whole numbers": ((Q,), {"out": RIGHT.astype(int)}, TypeError, "out is of type int64, expected float64"),
    "out of foreign bytes": ((Q,), {"out": np.empty((2, 4, 4), ">f8")}, TypeError, "out is of type >f8"),
    "out read-only": ((Q,), {"out": read_only()}, ValueError, "fk: out is read-only"),
    "out a list": ((Q,), {"out": [1]}, TypeError, "fk: out is a list, expected a plain NumPy array"),
    "out masked": ((Q,), {"out": np.ma.empty((2, 4, 4))}, TypeError, "out is a MaskedArray, expected a plain"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_is_refused_with_a_reason(chain: ModuleType, case: str) -> None:
    inputs, arguments, error, words = REFUSED[case]

    with pytest.raises(error, match=re.escape(words)):
        chain.fk(*inputs, **arguments)


def test_positions_have_no_3x4(chain: ModuleType) -> None:
    with pytest.raises(ValueError, match=re.escape("no layout '3x4' (there are ('4x4', 'joint_major'))")):
        chain.position(Q, layout="3x4")


SPACE = np.zeros(1000)
FOLDED: dict[str, tuple[Any, str]] = {
    "one place for all": (as_strided(SPACE, (2, 4, 4), (0, 32, 8)), "4x4"),
    "one place for a row": (as_strided(SPACE, (2, 4, 4), (128, 0, 8)), "4x4"),
    "the next begins before the last has ended": (as_strided(SPACE, (2, 4, 4), (64, 32, 8)), "4x4"),
    "backwards": (as_strided(SPACE[100:], (2, 4, 4), (-64, 32, 8)), "4x4"),
    "less than an entry apart": (as_strided(SPACE, (2, 4, 4), (128, 32, 4)), "4x4"),
    "without last rows": (as_strided(SPACE, (2, 3, 4), (64, 32, 8)), "3x4"),
    "joint-major": (as_strided(SPACE, (12, 2), (8, 8)), "joint_major"),
    "joint-major, one row": (as_strided(SPACE, (12, 2), (0, 8)), "joint_major"),
}


@pytest.mark.parametrize("case", FOLDED)
def test_out_that_overlaps_itself_is_refused(chain: ModuleType, case: str) -> None:
    out, layout = FOLDED[case]
    q = Q.T.copy() if layout == "joint_major" else Q

    with pytest.raises(ValueError, match="fk: out overlaps itself: several entries share memory"):
        chain.fk(q, out=out, layout=layout)
    with pytest.raises(ValueError, match="fk: out overlaps itself"):
        chain.fk.bind(q, out, layout=layout)


@pytest.mark.parametrize(
    "out",
    [
        np.empty((2, 4, 4))[::-1],
        np.empty((4, 4, 2)).T,
        np.empty((2, 8, 8))[:, ::2, ::-2],
        np.empty((2, 1, 4, 4))[:, 0],
        np.empty((4, 2, 4)).swapaxes(0, 1),
    ],
    ids=["reversed", "Fortran", "every other", "one axis less", "swapped"],
)
def test_out_that_is_a_part_or_another_order_is_filled(chain: ModuleType, out: Any) -> None:
    assert np.array_equal(chain.fk(Q, out=out), chain.fk(Q))


AT_EXIT = """
import atexit, sys, warnings
import numpy as np
sys.path.insert(0, sys.argv[1])
import chain

q = np.linspace(-1, 1, 60_000).reshape(-1, 3)
expected = chain.fk(q)

class Late:
    def __del__(self):
        print("last", np.array_equal(chain.fk(q, threads=3), expected))

late = Late()
if sys.argv[2] == "used before":
    chain.fk(q, threads=3)
atexit.register(lambda: print("exit", np.array_equal(chain.fk(q, threads=3), expected)))
"""


@pytest.mark.parametrize("before", ["used before", "not used before"])
def test_threads_may_be_asked_for_while_python_ends(before: str, tmp_path: Path, cache: Path) -> None:
    """There are none any more, so the caller does all of the work."""
    folder = SAMPLES["chain"].write(tmp_path, cache)

    done = subprocess.run(
        [sys.executable, "-B", "-c", AT_EXIT, folder.parent, before], capture_output=True, text=True, check=True
    )

    assert done.stderr == ""
    assert done.stdout.splitlines() == ["exit True", "last True"]


@pytest.mark.parametrize("start", [0, 1, 15, 16, 40])
def test_overlap_is_refused(chain: ModuleType, start: int) -> None:
    memory = np.zeros(60)
    out, q = memory[3:19].reshape(4, 4), memory[start : start + 3]
    shared = np.shares_memory(out, q)

    if shared:
        with pytest.raises(ValueError, match="fk: out shares memory with q"):
            chain.fk(q, out=out)
    else:
        assert chain.fk(q, out=out) is out


def test_overlap_of_a_batch_is_refused(chain: ModuleType) -> None:
    memory = np.zeros((100, 19))

    with pytest.raises(ValueError, match="out shares memory with q"):
        chain.fk(memory[:, :3], out=memory[:, 2:18].reshape(100, 4, 4))

    assert chain.fk(memory[:, :3], out=memory[:, 3:].reshape(100, 4, 4)).shape == (100, 4, 4)


@pytest.mark.parametrize("shape", [(0, 3), (4, 0, 3), (0, 7, 3)])
def test_empty_batches_give_empty_results(chain: ModuleType, shape: tuple[int, ...]) -> None:
    assert chain.fk(np.empty(shape)).shape == (*shape[:-1], 4, 4)
    assert chain.fk(np.empty(shape), threads=0).shape == (*shape[:-1], 4, 4)
    assert chain.fk(np.empty((3, 0)), layout="joint_major").shape == (12, 0)


def test_out_is_filled_and_returned(chain: ModuleType) -> None:
    out = np.full((2, 4, 4), np.nan)

    assert chain.fk(Q, out=out) is out
    assert np.array_equal(out, chain.fk(Q))
    assert chain.fk(Q[0], out=out[1]).base is out
    assert np.array_equal(out[1], out[0])


def test_a_failed_call_leaves_out_alone(chain: ModuleType) -> None:
    out = np.full((4, 4), 7.0)

    with pytest.raises(ValueError, match="shape"):
        chain.fk(np.zeros(4), out=out)

    assert (out == 7.0).all()


# Threads --------------------------------------------------------------------------------------------------------------


def test_many_threads_may_call_at_once(chain: ModuleType) -> None:
    batches = [np.random.default_rng(seed).normal(size=(5_000 + 3_000 * seed, 3)) for seed in range(8)]
    expected = [chain.fk(q) for q in batches]

    with ThreadPoolExecutor(8) as pool:
        for _ in range(3):
            results = list(pool.map(lambda q: chain.fk(q, threads=3), batches))

            assert all(np.array_equal(a, b) for a, b in zip(expected, results, strict=True))


def test_the_pool_is_made_once_and_only_for_large_batches(load: Loader, backend: str) -> None:
    kernel = sys.modules[f"{load('tree', backend).__name__}._runtime._threads"]
    kernel._pools.clear()

    load("tree", backend).fk(np.zeros((4_096, 3)), threads=8)
    assert not [thread for pool in kernel._pools.values() for thread in pool._threads]

    load("tree", backend).fk(np.zeros((50_000, 3)), threads=2)
    (pool,) = kernel._pools.values()
    load("tree", backend).fk(np.zeros((50_000, 3)), threads=0)
    assert list(kernel._pools.values()) == [pool]
    assert pool._threads


def test_first_calls_at_once_share_one_pool(load: Loader, backend: str) -> None:
    module = load("tree", backend)
    kernel = sys.modules[f"{module.__name__}._runtime._threads"]
    kernel._pools.clear()
    start = threading.Barrier(8)

    def call(_: int) -> bool:
        start.wait()
        return bool(module.fk(np.ones((20_000, 3)), threads=3).all())

    with ThreadPoolExecutor(8) as callers:
        list(callers.map(call, range(8)))

    assert len(kernel._pools) == 1
    assert len(kernel._pools[""]._threads) <= (os.cpu_count() or 1)


def test_an_error_in_a_thread_comes_out(load: Loader) -> None:
    kernel = load("chain", "numpy").fk
    formula, calls = kernel._engine._formula, []

    def fail(q: Any) -> Any:
        calls.append(threading.get_ident())
        raise ZeroDivisionError

    kernel._engine._formula = fail
    try:
        with pytest.raises(ZeroDivisionError):
            kernel(np.zeros((1_000_000, 3)), threads=4)
    finally:
        kernel._engine._formula = formula

    assert len(calls) <= 4, "the rest of the batch is not worked through"


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_threads_work_after_a_fork(chain: ModuleType) -> None:
    q = np.ones((50_000, 3))
    expected = chain.fk(q, threads=2)

    context = get_context("fork")
    receiver, sender = context.Pipe(duplex=False)

    def child() -> None:
        sender.send(bool(np.array_equal(expected, chain.fk(q, threads=2))))

    process = context.Process(target=child)
    process.start()

    assert receiver.poll(20)
    assert receiver.recv()
    process.join()


# Parameters -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", ["f8", "f4"])
@pytest.mark.parametrize("name", ["runtime", "runtime_tree"])
def test_parameters_reach_the_kernel(load: Loader, backend: str, name: str, dtype: str) -> None:
    module, sample = load(name, backend), SAMPLES[name]
    q = np.arange(10.0 * sample.dof).reshape(10, sample.dof).astype(dtype)

    for function in sample.functions:
        kernel = getattr(module, function.name)
        for offset in (None, 0.5, 8.0, None, 0.5):
            params = None if offset is None else module.Params(offset)
            expected = sample.reference(function, q, offset=offset)

            assert np.array_equal(expected, kernel(q, params=params))
            assert np.array_equal(expected[3], kernel(q[3], params=params))
            assert np.array_equal(expected[3], kernel(q[3].tolist(), params=params).astype(dtype))


def test_parameters_of_another_kind_are_refused(load: Loader, backend: str) -> None:
    with pytest.raises(TypeError, match="fk: params is of type dict, expected Params"):
        load("runtime", backend).fk(Q, params={"offset": 1.0})


def test_parameters_may_change_from_call_to_call_in_threads(load: Loader, backend: str) -> None:
    module, sample = load("runtime", backend), SAMPLES["runtime"]

    def evaluate(offset: float) -> bool:
        params = module.Params(offset)
        expected = sample.reference(sample.functions[0], Q, offset=offset)
        return all(np.array_equal(expected, module.fk(Q, params=params)) for _ in range(50))

    with ThreadPoolExecutor(4) as pool:
        assert all(pool.map(evaluate, np.arange(8.0).tolist()))


# Bound arguments ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["chain", "tree", "fixed", "runtime", "runtime_tree"])
@pytest.mark.parametrize("dtype", ["f8", "f4"])
def test_a_bound_step_reads_and_writes_anew(load: Loader, backend: str, name: str, dtype: str) -> None:
    module, sample = load(name, backend), SAMPLES[name]
    params = {"params": module.Params(5.0)} if sample.parameter else {}
    for function in sample.functions:
        q, out = np.zeros(sample.dof, dtype), np.empty(function.results[0].shape, dtype)
        step = getattr(module, function.name).bind(q, out, **params)
        for value in (1.0, 2.0):
            q[:] = value
            step()

            assert np.array_equal(sample.reference(function, q, offset=5.0 if params else None), out)


@pytest.mark.parametrize(
    ("shape", "layout"), [((7, 3), "4x4"), ((2, 7, 3), "3x4"), ((3, 7), "joint_major"), ((3,), "3x4")]
)
def test_batches_can_be_bound(chain: ModuleType, shape: tuple[int, ...], layout: str) -> None:
    q = np.zeros(shape)
    out = np.empty_like(chain.fk(q, layout=layout))
    step = chain.fk.bind(q, out, layout=layout)
    q[...] = np.random.default_rng(4).normal(size=shape)
    step()

    assert np.array_equal(chain.fk(q, layout=layout), out)


def test_a_bound_step_keeps_its_arrays(chain: ModuleType) -> None:
    q, out = np.ones(3), np.empty((4, 4))
    step = chain.fk.bind(q, out)
    alive = weakref.ref(q), weakref.ref(out)
    with pytest.raises(ValueError, match="resize"):
        q.resize(100)
    del q, out
    gc.collect()
    step()

    assert all(reference() is not None for reference in alive)


def test_arrays_in_files_and_read_only_ones_can_be_bound(chain: ModuleType, tmp_path: Path) -> None:
    q, out = np.memmap(tmp_path / "q", "f8", "w+", shape=3), np.memmap(tmp_path / "out", "f8", "w+", shape=(4, 4))
    view = q[:]
    view.flags.writeable = False
    for source in (q, view, np.asarray(view)):
        q[:] += 1
        chain.fk.bind(source, out)()

        assert np.array_equal(chain.fk(np.asarray(q)), out)


@pytest.mark.parametrize(
    ("q", "out", "error", "words"),
    [
        (np.ma.zeros(3), np.empty((4, 4)), TypeError, "q is a masked array"),
        ([1.0, 2.0, 3.0], np.empty((4, 4)), TypeError, "bind needs q as an array of float64 or float32"),
        (np.zeros(3, int), np.empty((4, 4)), TypeError, "bind needs q as an array of float64 or float32"),
        (np.zeros(3), np.empty((4, 3)), ValueError, "out has shape (4, 3)"),
        (np.zeros(3), np.empty((4, 4), "f4"), TypeError, "out is of type float32"),
        (np.zeros(4), np.empty((4, 4)), ValueError, "q has shape (4,)"),
    ],
)
def test_what_cannot_be_bound_is_refused(
    chain: ModuleType, q: Any, out: Any, error: type[Exception], words: str
) -> None:
    with pytest.raises(error, match=re.escape(words)):
        chain.fk.bind(q, out)


# Objects --------------------------------------------------------------------------------------------------------------


def test_kernels_pickle_by_name(chain: ModuleType) -> None:
    assert pickle.loads(pickle.dumps(chain.fk)) is chain.fk  # noqa: S301 - our own bytes
    assert copy.deepcopy(chain.fk) is chain.fk
    assert copy.copy(chain.position) is chain.position


def test_workers_receive_kernels(load: Loader, backend: str) -> None:
    """A fresh process imports the package and finds the kernel in it."""
    folder = Path(str(load("chain", backend).__file__)).parent
    code = (
        "import pickle, sys; sys.path.insert(0, sys.argv[1]); import numpy as np\n"
        "import chain; data = pickle.dumps((chain.fk, np.ones(3)))\n"
        "from multiprocessing import get_context\n"
        "if __name__ == '__main__':\n"
        "    with get_context('spawn').Pool(1) as pool:\n"
        "        print(pool.map(chain.fk, [np.ones(3)] * 3)[2][0].tolist(), chain.backend)\n"
    )
    script = folder.parent / f"spawn_{backend}.py"
    script.write_text(code)

    done = subprocess.run(
        [sys.executable, "-B", script, folder.parent], capture_output=True, text=True, timeout=60, check=False
    )

    assert done.stdout == f"[1.0, 2.0, 3.0, 4.0] {backend}\n", done.stderr


def test_kernels_tell_what_they_are(chain: ModuleType, backend: str) -> None:
    how = "c (native, reproducible)" if backend == "c" else "numpy"
    assert repr(chain.fk) == f"<{chain.__name__}.fk: q (3,) to (4, 4), backend {how}>"
    assert chain.fk.__doc__.splitlines()[2] == "The fk."
    assert chain.fk.__name__ == "fk"
    assert (chain.fk.dof, chain.fk.shape, chain.fk.backend) == (3, (4, 4), backend)


# Large data -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", ["f8", "i2"])
def test_files_larger_than_memory_stream_through(chain: ModuleType, tmp_path: Path, dtype: str, backend: str) -> None:
    count = 200_000
    q = np.memmap(tmp_path / "q", dtype, "w+", shape=(count, 3))
    q[:] = np.arange(count)[:, None] % 1_000
    q.flush()
    out = np.memmap(tmp_path / "out", "f8", "w+", shape=(count, 4, 4))
    tracemalloc.start()

    result = chain.fk(np.memmap(tmp_path / "q", dtype, "r", shape=(count, 3)), out=out)

    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    sample = SAMPLES["chain"]
    assert result is out
    assert np.array_equal(sample.reference(sample.functions[0], q.astype(float)), out)
    assert peak < out.nbytes / 3, "memory does not grow with the batch"
