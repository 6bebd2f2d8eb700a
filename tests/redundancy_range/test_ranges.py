"""Ranges of a redundancy: what is inside is valid, refusals, and C as strict compilers see it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.c.redundancy_range import emit_redundancy_range
from kinegen.backends.languages import LANGUAGES, refusals
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import build, lower_file
from kinegen.driver.results import BuildOptions
from kinegen.errors import KinegenError
from kinegen.io.load import load
from kinegen.model.outputs import POSE_AND_JACOBIAN, REDUNDANCY_RANGE, Kind, Quantity, parse_quantity, with_needed
from kinegen.runtime.extension import load_package
from kinegen.runtime.flags import Flags
from kinegen.verify import proof, reference
from kinegen.verify.redundancy_range import ranges_in_numpy
from tests.builds.workshop import ROBOTS, set_machine
from tests.emit.emitted import COMPILERS, STRICT, run

NAMES = ("panda_joint_7", "iiwa14_arm_angle")

HARD = (-1.578, 0.278, 2.186, -0.369, -2.062, 3.159, 2.22)
"""A joint vector of the first of them, whose pose has wide bands of `joint_7` that are just beyond its reach."""

Packages = Callable[[str], ModuleType]


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Packages:
    """A package with ranges of a robot of `robots/`, whose other outputs are not proven again."""

    @cache
    def made(name: str) -> ModuleType:
        with pytest.MonkeyPatch.context() as patch:
            set_machine(patch, tmp_path_factory.mktemp("cache"))
            patch.setattr(proof, "_solve", lambda *_: ([], ""))
            patch.setitem(proof._ATTEMPTS, REDUNDANCY_RANGE, lambda *_: ([], ""))
            options = BuildOptions(
                output=tmp_path_factory.mktemp(name),
                quantities=(Quantity.POSE, REDUNDANCY_RANGE),
                flags=Flags(march=None, optimisation="1"),
            )
            return load_package(build(ROBOTS / f"{name}.yaml", options, lambda _: None).folder)

    return made


def planted(module: ModuleType, count: int, seed: int = 3) -> tuple[Any, Any]:
    low, high = np.array(module.LIMITS).T
    q = np.random.default_rng(seed).uniform(low, high, (count, 7))
    return q, module.fk(q)


def contains(intervals: Any, values: Any, slack: float) -> Any:
    """Whether values (N,) are in intervals (N, branches, most, 2)."""
    each = values[:, None, None]
    return ((each >= intervals[..., 0] - slack) & (each <= intervals[..., 1] + slack)).any(axis=2)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_the_inverse_is_valid_inside_and_nowhere_else(name: str, kind: Any, package: Packages) -> None:
    module, (low, high) = package(name), (-np.pi, np.pi)
    if name == NAMES[0]:
        low, high = module.LIMITS[6]
    slack = 1e-6 if kind is np.float64 else 1e-2
    values = np.linspace(low, high, 1501).astype(kind)
    for target in planted(module, 6)[1].astype(kind):
        intervals, counts = module.redundancy_range(target)
        valid = module.inverse(np.broadcast_to(target, (len(values), 4, 4)), values)[1]
        every = np.broadcast_to(intervals, (len(values), *intervals.shape))

        assert intervals.dtype == kind
        assert intervals.shape == (8, 16, 2)
        assert not (valid & ~contains(every, values, slack)).any()
        assert not (~valid & contains(every, values, -slack)).any()
        assert (np.isnan(intervals[..., 0]).sum(axis=1) == 16 - counts).all()


@pytest.mark.parametrize("name", NAMES)
def test_numpy_finds_the_same(name: str, package: Packages) -> None:
    module = package(name)
    q, targets = planted(module, 3)
    plain = ranges_in_numpy(module, module.redundancy_range)
    (found, counts), (other, same) = module.redundancy_range(targets), plain(targets)
    near, _ = module.inverse(targets, nearest=np.roll(q, 1, axis=0))
    again, _ = plain.nearest(targets, np.roll(q, 1, axis=0))

    np.testing.assert_array_equal(counts, same)
    np.testing.assert_allclose(found, other, atol=1e-7)
    np.testing.assert_allclose(near, again, atol=1e-5)


@pytest.mark.parametrize("name", NAMES)
def test_the_joint_vector_of_a_pose_is_the_nearest_to_itself(name: str, package: Packages) -> None:
    module = package(name)
    q, targets = planted(module, 50)
    found, exists = module.inverse(targets, nearest=q)

    assert exists.all()
    np.testing.assert_allclose(found, q, atol=1e-8)
    one, is_there = module.inverse(targets[0], nearest=q[0])
    np.testing.assert_array_equal(one, found[0])
    assert is_there
    np.testing.assert_array_equal(module.inverse(targets, None, nearest=q, threads=2)[0], found)
    np.testing.assert_array_equal(module.inverse(targets, q0=q)[0], found)
    with pytest.raises(TypeError, match="nearest and q0 are the same argument"):
        module.inverse(targets, nearest=q, q0=q)


def test_in_single_precision_no_halving_is_spent_on_values_just_beyond_reach(package: Packages) -> None:
    """The halvings of a target with wide bands of such values sufficed for the first half of its range alone."""
    module = package(NAMES[0])
    target = module.fk(np.array(HARD))
    intervals, counts = module.redundancy_range(target)
    single, found = module.redundancy_range(target.astype(np.float32))
    plain = ranges_in_numpy(module, module.redundancy_range)(target.astype(np.float32))

    np.testing.assert_array_equal(found, plain.counts)
    np.testing.assert_allclose(single, plain.intervals, atol=2e-3)
    assert (single[:, 1:, 0] - single[:, :-1, 1])[np.arange(1, 16) < found[:, None]].min() > 1e-3
    wide = (np.arange(16) < counts[:, None]) & (intervals[..., 1] - intervals[..., 0] > 0.06)
    assert wide.sum() > 10
    for branch, place in zip(*np.nonzero(wide), strict=True):
        low, high = intervals[branch, place]
        values = np.linspace(low + 0.03, high - 0.03, 50)
        every = np.broadcast_to(single[branch], (50, 1, 16, 2))
        assert contains(every, values, 0.0).all()


@pytest.mark.parametrize("name", NAMES)
def test_nothing_is_found_for_what_is_no_pose_or_no_joint_vector(name: str, package: Packages) -> None:
    module = package(name)
    q, (target, *_) = planted(module, 1)
    for place in range(12):
        for value in (np.nan, np.inf, -np.inf):
            spoilt = target.copy()
            spoilt.flat[place] = value
            assert not module.redundancy_range(spoilt, check=False).counts.any()
            assert not module.inverse(spoilt, nearest=q[0], check=False)[1]
    far = target.copy()
    far[:3, 3] += 10
    assert not module.redundancy_range(far).counts.any()
    assert not module.inverse(far, nearest=q[0])[1]
    for joint in range(7):
        wrong = q[0].copy()
        wrong[joint] = np.nan
        found, exists = module.inverse(target, nearest=wrong)
        assert not exists
        assert np.isnan(found).all()
    with pytest.raises(ValueError, match="not finite"):
        module.redundancy_range(np.full((4, 4), np.nan))


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("name", NAMES)
def test_it_compiles_silently_and_needs_no_library(compiler: str, name: str, tmp_path: Path) -> None:
    kernels = lower_file(ROBOTS / f"{name}.yaml", (REDUNDANCY_RANGE,))
    for real in ScalarType:
        files = emit_kernel(kernels, real) | emit_redundancy_range(kernels, real)
        for file, text in files.items():
            (tmp_path / file).write_text(text, encoding="utf-8")
        source = next(file for file in files if file.endswith("redundancy_range.c"))
        flags = [*STRICT[compiler].split(), "-O1", "-fno-stack-protector"]
        run([compiler, *flags, "-c", tmp_path / source, "-o", tmp_path / "ranges.o"])
        missing = {line.split()[-1] for line in run(["nm", "-u", tmp_path / "ranges.o"]).splitlines()}
        assert all("inverse" in symbol or symbol.endswith("jacobian") or symbol.startswith("mem") for symbol in missing)


def test_it_brings_the_kernels_that_it_needs() -> None:
    assert parse_quantity("redundancy_range") == REDUNDANCY_RANGE
    assert with_needed((REDUNDANCY_RANGE,)) == (POSE_AND_JACOBIAN, Quantity(Kind.INVERSE))
    with pytest.raises(KinegenError, match="not computed for a single frame"):
        parse_quantity("redundancy_range@tool")


def test_an_arm_without_a_redundancy_is_refused_in_one_line() -> None:
    with pytest.raises(KinegenError, match=r"no redundancy range for ur5: its inverse takes the pose alone"):
        lower_file(ROBOTS / "ur5.yaml", (REDUNDANCY_RANGE,))


def test_languages_that_have_none_say_so() -> None:
    kernels = lower_file(ROBOTS / f"{NAMES[1]}.yaml", (REDUNDANCY_RANGE,))
    for name in ("cpp", "rust", "javascript", "matlab", "cuda"):
        found = refusals(kernels, LANGUAGES[name])
        assert any(f"has no {REDUNDANCY_RANGE}: " in line and "\n" not in line for line in found)


def test_the_arm_angle_is_that_of_the_reference(package: Packages) -> None:
    module = package(NAMES[1])
    q, _ = planted(module, 20)
    found = [module.redundancy_range._own(each, module.redundancy_range._limits[np.dtype(float)]) for each in q]

    np.testing.assert_allclose(found, reference.redundancy(load(ROBOTS / f"{NAMES[1]}.yaml"), q), atol=1e-12)
