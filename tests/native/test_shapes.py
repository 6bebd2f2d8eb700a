"""Arrays of every shape, type, order and stride give what plain NumPy gives."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.native.arrays import WAYS, arranged
from tests.native.conftest import SAMPLES

Loader = Callable[[str, str], ModuleType]

DTYPES = ["f8", "f4", "f2", ">f8", ">f4", "g", "i1", "i4", "u8", "?"]


@st.composite
def cases(draw: st.DrawFn) -> dict[str, Any]:
    name = draw(st.sampled_from([name for name, sample in SAMPLES.items() if not sample.several]))
    sample = SAMPLES[name]
    function = draw(st.sampled_from(sample.functions))
    layout = draw(st.sampled_from(["4x4", "joint_major", *["3x4"] * function.results[0].is_pose]))
    lead = tuple(draw(st.lists(st.integers(0, 4), max_size=3)))
    shape = (sample.dof, draw(st.integers(0, 9))) if layout == "joint_major" else (*lead, sample.dof)
    dtype = np.dtype(draw(st.sampled_from(DTYPES)))
    size = math.prod(shape)
    values = np.array(draw(st.lists(st.integers(0, 9), min_size=size, max_size=size)), dtype).reshape(shape)
    return {
        "name": name,
        "function": function,
        "layout": layout,
        "q": arranged(values, draw(st.sampled_from(WAYS))),
        "out": draw(st.sampled_from([None, *WAYS[:-2]])),
        "threads": draw(st.sampled_from([1, 1, 0, 3])),
    }


@pytest.mark.parametrize("backend", ["c", "numpy"])
@given(case=cases())
@settings(max_examples=400, suppress_health_check=[HealthCheck.too_slow])
def test_any_array_gives_what_numpy_gives(load: Loader, backend: str, case: dict[str, Any]) -> None:
    sample, function, layout, q = SAMPLES[case["name"]], case["function"], case["layout"], case["q"]
    kernel = getattr(load(case["name"], backend), function.name)
    single = sample.reals == ("float",) or q.dtype in ("f4", "f2", ">f4")
    dtype = np.dtype("f4" if single else "f8")
    # Small whole numbers: every type holds them and all that is made of them, so results are equal to the bit.
    expected = sample.reference(function, np.ascontiguousarray(q, dtype).reshape(q.shape), layout=layout)
    out = None if case["out"] is None else arranged(np.full(expected.shape, 7, dtype), case["out"])
    before = q.copy()

    result = kernel(q, out=out, threads=case["threads"], layout=layout)

    assert kernel.backend == backend
    assert result.dtype == dtype
    assert result.shape == expected.shape
    assert np.array_equal(expected, result)
    assert out is None or result is out
    assert np.array_equal(before, q)


@pytest.mark.parametrize("threads", [1, 2, 0])
@pytest.mark.parametrize("shape", [(100_000, 3), (4, 12_345, 3), (70, 1, 500, 3), (3, 40_000)])
def test_large_batches_are_cut_into_blocks(chain: ModuleType, shape: tuple[int, ...], threads: int) -> None:
    sample, layout = SAMPLES["chain"], "joint_major" if shape[0] == 3 else "4x4"
    q = np.random.default_rng(1).integers(-99, 99, shape).astype(float)
    expected = sample.reference(sample.functions[0], q, layout=layout)

    for way in ("plain", "fortran", "sliced", "transposed"):
        result = chain.fk(arranged(q, way), threads=threads, layout=layout)

        assert np.array_equal(expected, result), way


def test_results_do_not_depend_on_place_or_threads(chain: ModuleType) -> None:
    q = np.random.default_rng(2).normal(size=(9_001, 3))
    together = chain.fk(q, threads=2)

    assert np.array_equal(together, chain.fk(q))
    assert np.array_equal(together[4_000:], chain.fk(q[4_000:]))
    assert np.array_equal(together[17], chain.fk(q[17]))
    assert np.array_equal(together[17], chain.fk(q[17].tolist()))


def test_lists_and_numbers_are_double(chain: ModuleType) -> None:
    assert chain.fk([1, 2, 3]).dtype == np.float64
    assert np.array_equal(chain.fk([1, 2, 3]), chain.fk(np.array([1.0, 2.0, 3.0])))
    assert chain.fk([[1, 2, 3], (4.0, 5.0, 6.0)]).shape == (2, 4, 4)


def test_matrices_and_other_subclasses_give_plain_arrays(chain: ModuleType) -> None:
    class Own(np.ndarray[Any, Any]):
        pass

    q = np.arange(6.0).reshape(2, 3)

    assert type(chain.fk(q.view(Own))) is np.ndarray
    assert np.array_equal(chain.fk(q.view(Own)), chain.fk(q))


def test_nan_stays_in_its_pose(chain: ModuleType) -> None:
    q = np.ones((10_000, 3))
    q[[5, 7_777], [0, 2]] = np.nan, np.inf

    result = chain.fk(q)

    bad = ~np.isfinite(result).all(axis=(1, 2))
    assert np.flatnonzero(bad).tolist() == [5, 7_777]


@pytest.mark.parametrize("value", [1e300, -1e300, np.nan])
def test_numbers_beyond_float_pass_silently(load: Loader, backend: str, value: float) -> None:
    result = load("single", backend).fk(np.array([value, 0.0, 0.0]))

    assert result.dtype == np.float32
    assert not np.isfinite(result[0, 0])


def test_interleaved_records_work_in_place(chain: ModuleType) -> None:
    """Joint values and poses side by side in one array share no byte."""
    records = np.zeros(1_000, [("q", "f8", 3), ("T", "f8", (4, 4))])
    records["q"] = np.random.default_rng(3).integers(0, 9, (1_000, 3))

    chain.fk(records["q"], out=records["T"])

    sample = SAMPLES["chain"]
    assert np.array_equal(sample.reference(sample.functions[0], records["q"].copy()), records["T"])
