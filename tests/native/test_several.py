"""Kernels of several inputs and results, of poses as inputs and of results of any shape."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from kinegen.model.outputs import Array
from kinegen.runtime.cffi_interface import Function
from tests.native.arrays import WAYS, arranged
from tests.native.conftest import SAMPLES

Loader = Callable[[str, str], ModuleType]

NAMES = ("several", "several_tips", "several_fixed")
FUNCTIONS = [(name, function) for name in NAMES for function in SAMPLES[name].functions[3:]]
LAYOUTS = ("4x4", "3x4", "joint_major")


@pytest.fixture
def several(load: Loader, backend: str) -> ModuleType:
    """A chain of three joints with kernels of several inputs and results."""
    return load("several", backend)


def shape_in(array: Array, lead: tuple[int, ...], layout: str) -> tuple[int, ...]:
    """The shape of a batch of inputs in a layout."""
    if layout == "joint_major":
        return (array.size, *lead)
    return (*lead, *array.shape[:-2], 3, 4) if layout == "3x4" and array.is_pose else (*lead, *array.shape)


def values_for(function: Function, leads: list[tuple[int, ...]], layout: str, dtype: str = "f8") -> list[Any]:
    """Whole numbers for the inputs of a kernel; every number type holds them and all that is made of them."""
    generator = np.random.default_rng(8)
    shapes = [shape_in(array, lead, layout) for array, lead in zip(function.inputs, leads, strict=True)]
    return [generator.integers(0, 9, shape).astype(dtype) for shape in shapes]


def as_tuple(results: Any) -> tuple[Any, ...]:
    """One result or several, as a tuple."""
    return results if isinstance(results, tuple) else (results,)


# What is computed -----------------------------------------------------------------------------------------------------


@st.composite
def cases(draw: st.DrawFn) -> dict[str, Any]:
    name, function = draw(st.sampled_from(FUNCTIONS))
    layouts = LAYOUTS if any(array.is_pose for array in function.results) else LAYOUTS[::2]
    layout = draw(st.sampled_from(layouts))
    axes = tuple(draw(st.lists(st.integers(0, 4), min_size=1, max_size=1 if layout == "joint_major" else 3)))
    leads = []
    for _ in function.inputs:
        # Each input may lack axes in front, and may have one element where others have several.
        own = tuple(1 if draw(st.booleans()) and extent else extent for extent in axes)
        leads.append(own if layout == "joint_major" else own[draw(st.integers(0, len(own))) :])
    return {
        "name": name,
        "function": function,
        "layout": layout,
        "leads": leads if draw(st.booleans()) else [axes for _ in leads],
        "dtypes": [draw(st.sampled_from(["f8", "f8", "f4", "i4", "f2"])) for _ in function.inputs],
        "ways": [draw(st.sampled_from(WAYS[:-2])) for _ in function.inputs],
        "out": draw(st.sampled_from([None, *WAYS[:-2]])),
        "threads": draw(st.sampled_from([1, 1, 0, 3])),
    }


@pytest.mark.parametrize("backend", ["c", "numpy"])
@given(case=cases())
@settings(max_examples=150, suppress_health_check=[HealthCheck.too_slow])
def test_any_arrays_give_what_numpy_gives(load: Loader, backend: str, case: dict[str, Any]) -> None:
    sample, function, layout = SAMPLES[case["name"]], case["function"], case["layout"]
    single = all(dtype in ("f4", "f2") for dtype in case["dtypes"])
    plain = [array.astype("f4" if single else "f8") for array in values_for(function, case["leads"], layout)]
    expected = as_tuple(sample.reference(function, *plain, layout=layout))
    inputs = [
        arranged(array.astype(dtype), way)
        for array, dtype, way in zip(plain, case["dtypes"], case["ways"], strict=True)
    ]
    out: Any = None
    if case["out"] is not None:
        out = tuple(arranged(np.full(each.shape, 7, each.dtype), case["out"]) for each in expected)
        out = out if len(out) > 1 else out[0]

    results = getattr(load(case["name"], backend), function.name)(
        *inputs, out=out, threads=case["threads"], layout=layout
    )

    assert isinstance(results, tuple) == (len(function.results) > 1)
    assert out is None or results is out
    for found, wanted in zip(as_tuple(results), expected, strict=True):
        assert (found.shape, found.dtype) == (wanted.shape, wanted.dtype)
        assert np.array_equal(found, wanted)


@pytest.mark.parametrize(("name", "function"), FUNCTIONS)
@pytest.mark.parametrize("dtype", ["f8", "f4"])
def test_single_configurations_and_batches_give_the_same_bits(
    load: Loader, backend: str, name: str, function: Function, dtype: str
) -> None:
    kernel = getattr(load(name, backend), function.name)
    leads: list[tuple[int, ...]] = [(20,) for _ in function.inputs]
    inputs = [each + np.asarray(0.1, dtype) for each in values_for(function, leads, "4x4", dtype)]
    together = as_tuple(kernel(*inputs))

    for place in (0, 7, 19):
        alone = as_tuple(kernel(*(each[place] for each in inputs)))
        assert [one.tobytes() for one in alone] == [each[place].tobytes() for each in together]


@pytest.mark.parametrize("threads", [1, 3, 0])
@pytest.mark.parametrize("layout", LAYOUTS)
def test_large_batches_are_cut_alike_for_all_arrays(several: ModuleType, layout: str, threads: int) -> None:
    sample, function = SAMPLES["several"], SAMPLES["several"].function("moving")
    inputs = values_for(function, [(70_001,), (1,)] if threads == 1 else [(70_001,)] * 2, layout)
    expected = sample.reference(function, *inputs, layout=layout)

    for found, wanted in zip(several.moving(*inputs, threads=threads, layout=layout), expected, strict=True):
        assert np.array_equal(found, wanted)


def test_one_configuration_of_an_input_serves_a_batch_of_the_other(several: ModuleType) -> None:
    sample, function = SAMPLES["several"], SAMPLES["several"].function("transform")
    pose, points = values_for(function, [(), (5, 7)], "4x4")

    assert several.transform(pose, points).shape == (5, 7, 3)
    assert np.array_equal(several.transform(pose, points), sample.reference(function, pose, points))


def test_nothing_is_read_of_the_last_row_of_a_pose(several: ModuleType) -> None:
    (pose,) = values_for(SAMPLES["several"].function("inverse_pose"), [(30,)], "4x4")
    spoilt = pose.copy()
    spoilt[:, 3] = np.nan

    assert np.array_equal(several.inverse_pose(spoilt), several.inverse_pose(pose))
    assert np.array_equal(several.inverse_pose(spoilt[0]), several.inverse_pose(pose[0]))


def test_a_nan_stays_in_its_configuration(several: ModuleType) -> None:
    q, qd = np.ones((10_000, 3)), np.ones((10_000, 3))
    q[5, 0], qd[7_777, 2] = np.nan, np.inf

    for result in several.moving(q, qd):
        assert np.flatnonzero(~np.isfinite(result).all(axis=(1, 2))).tolist() == [5, 7_777]


def test_results_of_no_joints_are_empty(load: Loader, backend: str) -> None:
    module = load("several_fixed", backend)
    q = np.empty((4, 0))
    pose, jacobian = module.moving(q, q)

    assert (pose.shape, jacobian.shape) == ((4, 4, 4), (4, 6, 0))
    assert (pose[..., 3, :] == [0, 0, 0, 1]).all()
    assert module.hessian(q).shape == (4, 0, 6, 0)
    assert module.hessian(q[0]).shape == (0, 6, 0)
    assert module.hessian(q.T, layout="joint_major").shape == (0, 4)
    assert np.array_equal(module.twist(q, q), np.tile(np.arange(1.0, 7.0), (4, 1)))


def test_lists_and_types_are_joined(several: ModuleType) -> None:
    """Single precision only where all inputs are so."""
    single = np.ones(3, "f4")

    assert several.twist([1, 2, 3], [0, 0, 0]).dtype == np.float64
    assert several.twist(single, single).dtype == np.float32
    assert several.twist(single, np.ones(3)).dtype == np.float64
    assert several.twist(single, [1, 1, 1]).dtype == np.float64


def test_parameters_reach_every_result(load: Loader, backend: str) -> None:
    module, sample = load("several_tips", backend), SAMPLES["several_tips"]
    function = sample.function("moving")
    inputs = values_for(function, [(9,)] * 2, "4x4")
    expected = sample.reference(function, *inputs, offset=5.0)

    for found, wanted in zip(module.moving(*inputs, params=module.Params(5.0)), expected, strict=True):
        assert np.array_equal(found, wanted)


# Results in place -----------------------------------------------------------------------------------------------------

Q, QD = np.arange(6.0).reshape(2, 3), np.ones((2, 3))


def results() -> tuple[Any, Any]:
    """Arrays for the results of two configurations."""
    return np.zeros((2, 4, 4)), np.zeros((2, 6, 3))


def read_only() -> Any:
    out = np.zeros((2, 6, 3))
    out.flags.writeable = False
    return out


MEMORY = np.zeros(200)
OUT_REFUSED: dict[str, tuple[Any, type[Exception], str]] = {
    "one array": (results()[0], TypeError, "moving: out must be a tuple of arrays for base_T_tool, jacobian"),
    "a list": (list(results()), TypeError, "moving: out must be a tuple of arrays for base_T_tool, jacobian"),
    "too few": (results()[:1], TypeError, "moving: out must be a tuple of arrays for base_T_tool, jacobian"),
    "too many": ((*results(), results()[0]), TypeError, "out must be a tuple of arrays for base_T_tool, jacobian"),
    "the wrong way round": (
        results()[::-1],
        ValueError,
        "moving: out for base_T_tool has shape (2, 6, 3), expected (2, 4, 4) for q of shape (2, 3), qd of shape (2, 3)",
    ),
    "a shape": ((results()[0], np.zeros((2, 3, 6))), ValueError, "out for jacobian has shape (2, 3, 6), expected"),
    "a type": ((results()[0], np.zeros((2, 6, 3), "f4")), TypeError, "out for jacobian is of type float32, expected"),
    "no array": ((results()[0], None), TypeError, "out for jacobian is a NoneType, expected a plain NumPy array"),
    "read-only": ((results()[0], read_only()), ValueError, "moving: out for jacobian is read-only"),
    "each other": (
        (MEMORY[:32].reshape(2, 4, 4), MEMORY[31:67].reshape(2, 6, 3)),
        ValueError,
        "moving: out for jacobian shares memory with base_T_tool",
    ),
}


@pytest.mark.parametrize("case", OUT_REFUSED)
def test_what_cannot_hold_the_results_is_refused_and_stays_as_it_is(several: ModuleType, case: str) -> None:
    out, error, words = OUT_REFUSED[case]

    with pytest.raises(error, match=re.escape(words)) as caught:
        several.moving(Q, QD, out=out)

    assert "\n" not in str(caught.value)
    assert all(not np.any(each) for each in (out if isinstance(out, (tuple, list)) else [out]) if each is not None)


@pytest.mark.parametrize("place", [0, 1])
def test_results_may_not_lie_in_an_input(several: ModuleType, place: int) -> None:
    memory = np.zeros(100)
    inputs = [memory[:6].reshape(2, 3), memory[6:12].reshape(2, 3)]
    jacobian = memory[5 + 6 * place : 41 + 6 * place].reshape(2, 6, 3)

    with pytest.raises(ValueError, match=f"moving: out for jacobian shares memory with {['q', 'qd'][place]}"):
        several.moving(*inputs, out=(np.zeros((2, 4, 4)), jacobian))

    apart = memory[12:48].reshape(2, 6, 3)
    assert several.moving(*inputs, out=(np.zeros((2, 4, 4)), apart))[1] is apart


def test_inputs_may_be_one_array(several: ModuleType) -> None:
    function = SAMPLES["several"].function("twist")

    assert np.array_equal(several.twist(Q, Q), SAMPLES["several"].reference(function, Q, Q))


def test_a_single_result_is_given_without_a_tuple(several: ModuleType) -> None:
    out = np.empty((2, 6))

    assert several.twist(Q, QD, out=out) is out
    with pytest.raises(TypeError, match="twist: out is a tuple, expected a plain NumPy array"):
        several.twist(Q, QD, out=(out,))


# Inputs that cannot be ------------------------------------------------------------------------------------------------

IN_REFUSED: dict[str, tuple[str, tuple[Any, ...], type[Exception], str]] = {
    "none": ("moving", (), TypeError, "moving takes 2 arrays (q, qd), 0 given"),
    "one": ("moving", (Q,), TypeError, "moving takes 2 arrays (q, qd), 1 given"),
    "three": ("moving", (Q, QD, Q), TypeError, "moving takes 2 arrays (q, qd), 3 given"),
    "two for one": ("inverse_pose", (np.eye(4), Q), TypeError, "inverse_pose takes 1 array (a_T_b), 2 given"),
    "no pose": ("inverse_pose", (), TypeError, "inverse_pose takes 1 array (a_T_b), 0 given"),
    "second shape": ("moving", (Q, np.ones(4)), ValueError, "moving: qd has shape (4,), expected (..., 3)"),
    "second type": (
        "moving",
        (Q, ["a", "b", "c"]),
        TypeError,
        "moving: qd has strings, expected plain real",
    ),
    "vector for a pose": ("inverse_pose", (np.ones(12),), ValueError, "a_T_b has shape (12,), expected (..., 4, 4)"),
    "3x4 for a pose": (
        "inverse_pose",
        (np.ones((3, 4)),),
        ValueError,
        "inverse_pose: a_T_b has shape (3, 4), expected (..., 4, 4)",
    ),
    "batches": (
        "moving",
        (np.ones((5, 3)), np.ones((4, 3))),
        ValueError,
        "moving: the shapes of q (5, 3), qd (4, 3) do not fit together",
    ),
}


@pytest.mark.parametrize("case", IN_REFUSED)
def test_inputs_that_cannot_be_are_named(several: ModuleType, case: str) -> None:
    name, inputs, error, words = IN_REFUSED[case]

    with pytest.raises(error, match=re.escape(words)) as caught:
        getattr(several, name)(*inputs)

    assert "\n" not in str(caught.value)


def test_a_layout_without_last_rows_is_for_results_with_matrices(several: ModuleType) -> None:
    with pytest.raises(ValueError, match=re.escape("twist: no layout '3x4' (there are ('4x4', 'joint_major'))")):
        several.twist(Q, QD, layout="3x4")

    assert [each.shape for each in several.moving(Q, QD, layout="3x4")] == [(2, 3, 4), (2, 6, 3)]


# Bound arguments, files, threads --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "function"), FUNCTIONS)
@pytest.mark.parametrize("lead", [(), (6,)])
def test_a_bound_step_reads_and_writes_all_arrays_anew(
    load: Loader, backend: str, name: str, function: Function, lead: tuple[int, ...]
) -> None:
    module, sample = load(name, backend), SAMPLES[name]
    params = {"params": module.Params(5.0)} if sample.parameter else {}
    inputs = [np.zeros((*lead, *array.shape)) for array in function.inputs]
    outs = [np.full((*lead, *array.shape), np.nan) for array in function.results]
    step = getattr(module, function.name).bind(*inputs, *outs, **params)
    for value in (1.0, 2.0):
        for place, array in enumerate(inputs):
            array[...] = value + place
        step()
        expected = as_tuple(sample.reference(function, *inputs, offset=5.0 if params else None))

        assert all(np.array_equal(out, wanted) for out, wanted in zip(outs, expected, strict=True))


BOUND_REFUSED: dict[str, tuple[list[Any], type[Exception], str]] = {
    "too few": (
        [Q, QD, results()[0]],
        TypeError,
        "bind takes 4 arrays (q, qd, base_T_tool, jacobian), 3 given",
    ),
    "mixed types": (
        [Q, QD.astype("f4"), *results()],
        TypeError,
        "moving: bind needs qd as an array of float64",
    ),
    "a list": ([Q, [[0.0] * 3] * 2, *results()], TypeError, "moving: bind needs qd as an array of float64"),
    "a result": ([Q, QD, results()[0], np.zeros((6, 3))], ValueError, "out for jacobian has shape (6, 3), expected"),
    "overlap": ([Q, QD, results()[0], QD], ValueError, "out for jacobian has shape (2, 3), expected (2, 6, 3)"),
}


@pytest.mark.parametrize("case", BOUND_REFUSED)
def test_what_cannot_be_bound_is_refused(several: ModuleType, case: str) -> None:
    arrays, error, words = BOUND_REFUSED[case]

    with pytest.raises(error, match=re.escape(words)):
        several.moving.bind(*arrays)


def test_arrays_in_files_work_in_place(several: ModuleType, tmp_path: Path) -> None:
    count, sample = 50_000, SAMPLES["several"]
    function = sample.function("moving")
    arrays = [
        np.memmap(tmp_path / array.name, "f8", "w+", shape=(count, *array.shape))
        for array in (*function.inputs, *function.results)
    ]
    arrays[0][:] = np.arange(count)[:, None] % 1_000
    arrays[1][:] = 3
    expected = sample.reference(function, *(np.asarray(array) for array in arrays[:2]))

    several.moving(*arrays[:2], out=tuple(arrays[2:]), threads=2)

    assert all(np.array_equal(found, wanted) for found, wanted in zip(arrays[2:], expected, strict=True))


def test_many_threads_may_call_at_once(several: ModuleType) -> None:
    batches = [np.random.default_rng(seed).normal(size=(2, 4_000 + 3_000 * seed, 3)) for seed in range(4)]
    expected = [several.moving(*batch) for batch in batches]

    with ThreadPoolExecutor(4) as pool:
        for found, wanted in zip(
            pool.map(lambda batch: several.moving(*batch, threads=3), batches), expected, strict=True
        ):
            assert all(np.array_equal(one, other) for one, other in zip(found, wanted, strict=True))


def test_kernels_tell_what_they_take_and_give(several: ModuleType) -> None:
    assert repr(several.moving).startswith(f"<{several.__name__}.moving: q (3,), qd (3,) to ((4, 4), (6, 3)), backend ")
    assert several.moving.shape == ((4, 4), (6, 3))
    assert several.twist.shape == (6,)
    assert [math.prod(array.shape) for array in several.transform.inputs] == [16, 3]
