"""Which results are the same bits: by default wherever a pose stands in a batch, without contraction everywhere."""

from __future__ import annotations

import functools
import math
import re
import shutil
import subprocess
import warnings
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from kinegen.runtime.extension import load_package
from kinegen.runtime.flags import Flags
from kinegen.support.naming import EXTENSION
from tests.native.arrays import WAYS, Array, arranged, bits
from tests.native.conftest import needs_compiler
from tests.native.packages import FLAGS, write_package

Loader = Callable[[str, str], ModuleType]
ROBOTS = ("puma560", "calibrated_2r")
OUTPUTS = ("fk", "frames", "position")
VARIANTS = [variant.name for variant in Flags(portable=True).variants]

pytestmark = needs_compiler


@st.composite
def batches(draw: st.DrawFn) -> dict[str, Any]:
    output = draw(st.sampled_from(OUTPUTS))
    return {
        "name": draw(st.sampled_from(ROBOTS)),
        "output": output,
        "layout": draw(st.sampled_from(["4x4", "joint_major", *["3x4"] * (output != "position")])),
        "dtype": draw(st.sampled_from(["f8", "f4"])),
        "count": draw(st.integers(0, 70)),
        "start": draw(st.integers(0, 40)),
        "q": draw(st.sampled_from(WAYS)),
        "out": draw(st.sampled_from([None, *WAYS[:-2]])),
        "threads": draw(st.sampled_from([1, 1, 0, 3])),
    }


def numbers(kernel: Any, result: Array, layout: str) -> Array:
    """The computed numbers, one row for each configuration; the constant last rows of matrices are left out."""
    if layout == "joint_major":
        return result.T
    upper = result[..., :3, :] if kernel.shape[-2:] == (4, 4) else result
    return upper.reshape(len(result), math.prod(upper.shape[1:]))


def configurations(kernel: Any, case: dict[str, Any]) -> Array:
    """More than the case asks for; where it is about broadcasting, one value for all."""
    q = np.random.default_rng(6).uniform(-4, 4, (110, kernel.dof)).astype(case["dtype"])
    if case["q"] == "broadcast":
        q[:] = q[:, :1] if case["layout"] == "joint_major" else q[0]
    return q


def evaluated(kernel: Any, case: dict[str, Any], q: Array) -> Array:
    """The numbers of the configurations that the case asks for, in its way."""
    layout, part = case["layout"], q[chosen(case)]
    points = arranged(np.ascontiguousarray(part.T) if layout == "joint_major" else part, case["q"])
    out = None
    if case["out"] is not None:
        out = arranged(np.full(kernel(points, layout=layout).shape, 7, q.dtype), case["out"])
    return numbers(kernel, kernel(points, out=out, threads=case["threads"], layout=layout), layout)


def chosen(case: dict[str, Any]) -> slice:
    return slice(case["start"], case["start"] + case["count"])


@given(case=batches())
@settings(max_examples=80, suppress_health_check=[HealthCheck.too_slow])
def test_without_contraction_batches_give_the_bits_of_single_calls(robot: Loader, case: dict[str, Any]) -> None:
    kernel = getattr(robot(case["name"], "reproducible"), case["output"])
    q = configurations(kernel, case)

    found = evaluated(kernel, case, q)

    single = numbers(kernel, np.stack([kernel(point) for point in q]), "4x4")
    np.testing.assert_array_equal(bits(found), bits(single[chosen(case)]))


@given(case=batches())
@settings(max_examples=80, suppress_health_check=[HealthCheck.too_slow])
def test_by_default_a_pose_does_not_depend_on_its_place(robot: Loader, case: dict[str, Any]) -> None:
    """Nor on the order of the numbers in memory, the layout or the threads."""
    kernel = getattr(robot(case["name"], "default"), case["output"])
    q = configurations(kernel, case)

    found = evaluated(kernel, case, q)

    np.testing.assert_array_equal(bits(found), bits(numbers(kernel, kernel(q), "4x4")[chosen(case)]))


@pytest.mark.parametrize("flags", ["default", "reproducible"])
@pytest.mark.parametrize("dtype", ["f8", "f4"])
def test_threads_do_not_change_a_bit(robot: Loader, dtype: str, flags: str) -> None:
    kernel = robot("puma560", flags).fk
    q = np.random.default_rng(7).uniform(-4, 4, (70_001, 6)).astype(dtype)
    expected = bits(kernel(q))

    for threads in (0, 2, 3, 7):
        np.testing.assert_array_equal(bits(kernel(q, threads=threads)), expected)
    np.testing.assert_array_equal(bits(kernel(q[-123:])), expected[-123:])


# Portable builds ------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def variant(tmp_path_factory: pytest.TempPathFactory, cache: Path) -> Callable[[str, str], ModuleType]:
    """The package of a real robot, with a variant forced as people do it."""

    @functools.cache
    def get(flags: str, name: str) -> ModuleType:
        # Another place for each, since a loaded extension has one variant for all who import it.
        folder = write_package("puma560", FLAGS[flags], tmp_path_factory.mktemp("variant"), cache)
        with pytest.MonkeyPatch.context() as patch, warnings.catch_warnings():
            patch.setenv("KINEGEN_VARIANT", name)
            warnings.simplefilter("ignore")
            module = load_package(folder)
        if module.backend != "c":
            pytest.skip(f"this processor has no {name}")
        return module

    return get


@pytest.mark.parametrize("name", VARIANTS)
@pytest.mark.parametrize("flags", ["portable", "portable, reproducible"])
def test_every_variant_can_be_forced(variant: Callable[[str, str], ModuleType], flags: str, name: str) -> None:
    words = [name, *["reproducible"] * (flags != "portable")]

    assert variant(flags, name).fk.variant == ", ".join(words)


@pytest.mark.parametrize("dtype", ["f8", "f4"])
@pytest.mark.parametrize("name", VARIANTS)
def test_without_contraction_all_variants_give_the_same_bits(
    robot: Loader, variant: Callable[[str, str], ModuleType], name: str, dtype: str
) -> None:
    q = np.random.default_rng(8).uniform(-4, 4, (203, 6)).astype(dtype)
    expected = bits(robot("puma560", "reproducible").fk(q))
    found = variant("portable, reproducible", name).fk

    np.testing.assert_array_equal(bits(found(q)), expected)
    np.testing.assert_array_equal(bits(np.stack([found(point) for point in q])), expected)


@pytest.mark.parametrize("dtype", ["f8", "f4"])
@pytest.mark.parametrize("name", VARIANTS)
def test_variants_agree(variant: Callable[[str, str], ModuleType], name: str, dtype: str) -> None:
    """With contraction those with fused operations differ in the last bits, which shows that they are in use."""
    q = np.random.default_rng(9).uniform(-4, 4, (203, 6)).astype(dtype)
    kernel = variant("portable", name).fk
    single = np.stack([kernel(point) for point in q])

    np.testing.assert_allclose(kernel(q), single, rtol=0, atol=1e-14 if dtype == "f8" else 1e-5)
    assert np.array_equal(kernel(q), single) == (name == "baseline")


def test_the_best_variant_is_picked(robot: Loader, variant: Callable[[str, str], ModuleType]) -> None:
    picked = robot("puma560", "portable").fk.variant

    assert picked in VARIANTS
    for better in VARIANTS[VARIANTS.index(picked) + 1 :]:
        with pytest.raises(pytest.skip.Exception):
            variant("portable", better)


@pytest.mark.parametrize("flags", ["portable", "default"])
def test_an_unknown_variant_is_named(tmp_path: Path, cache: Path, monkeypatch: pytest.MonkeyPatch, flags: str) -> None:
    """A build that has no variants does not ask."""
    folder = write_package("puma560", FLAGS[flags], tmp_path, cache)
    monkeypatch.setenv("KINEGEN_VARIANT", "avx1024\udcff")

    if flags == "portable":
        with pytest.warns(RuntimeWarning, match=r"it has no variant 'avx1024\\udcff' that this processor can run"):
            module = load_package(folder)
    else:
        module = load_package(folder)

    assert module.backend == ("numpy" if flags == "portable" else "c")


@pytest.mark.skipif(not shutil.which("objdump"), reason="needs objdump")
@pytest.mark.parametrize(
    ("name", "flags"),
    [("puma560", "reproducible"), ("puma560", "portable, reproducible"), ("calibrated_2r", "reproducible")],
)
def test_without_contraction_nothing_is_fused(robot: Loader, name: str, flags: str) -> None:
    extension = Path(str(robot(name, flags).__file__)).with_name(EXTENSION)
    code = subprocess.run(["objdump", "-d", extension], capture_output=True, text=True, check=True).stdout

    assert not re.findall(r"\b(?:vfn?m(?:add|sub)|fn?m(?:add|sub)|fml[as])\w*", code)
