"""Numbers turned in registers: batches with them against the same batches without, bit by bit."""

from __future__ import annotations

import ctypes
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from kinegen.backends.c.batch import emit_batch
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.c.tiles import firsts, lanes_of
from kinegen.backends.scalar_types import ScalarType
from kinegen.model.outputs import POSE_AND_JACOBIAN, Quantity
from kinegen.runtime.flags import Variant
from kinegen.support.naming import c_file, companion, function
from tests.emit.emitted import COMPILERS, STRICT, kernels, run
from tests.emit.test_c_sanitizers import WIDE

FLAGS = "-std=c99 -O1 -ffp-contract=off -fPIC -shared".split()
NUMBERS = 16 + 6 * 6


@pytest.mark.skipif("gcc" not in COMPILERS, reason="needs gcc")
@pytest.mark.parametrize("variant", WIDE, ids=lambda each: each.name)
def test_turned_numbers_are_those_that_are_stored_one_by_one(
    real: ScalarType, variant: Variant, tmp_path: Path
) -> None:
    """Joint vectors side by side, with a gap between them, in rows; matrices of 16 and of 12 numbers; every length."""
    given = kernels("puma560", (POSE_AND_JACOBIAN,))
    files = emit_kernel(given, real) | emit_batch(given, real)
    plain, turned = library(files, tmp_path / "plain"), library(files, tmp_path / "turned", *variant.arguments())
    dtype = np.float64 if real is ScalarType.DOUBLE else np.float32

    for count in (1, 7, 8, 15, 16, 17, 33, 67):
        vectors = np.random.default_rng(count).uniform(-3, 3, (count, 9)).astype(dtype)
        for q in (vectors[:, :6].copy(), vectors[:, 2:8], vectors[:, :6].T.copy().T):
            for layout in (0, 1):
                assert np.array_equal(call(turned, q, real, layout), call(plain, q, real, layout))


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("variant", WIDE, ids=lambda each: each.name)
@pytest.mark.parametrize("quantities", [(Quantity.POSITION,), (POSE_AND_JACOBIAN,)], ids=["read", "read and stored"])
def test_strict_compilers_are_silent_where_numbers_are_turned(
    compiler: str, variant: Variant, quantities: tuple[Quantity, ...], real: ScalarType, tmp_path: Path
) -> None:
    given = kernels("puma560", quantities)
    for name, text in (emit_kernel(given, real) | emit_batch(given, real)).items():
        (tmp_path / name).write_text(text, encoding="utf-8")

    source = tmp_path / c_file("puma560", "c", real, batch=True)
    run([compiler, *STRICT[compiler].split(), *variant.arguments()[:-1], "-fsyntax-only", source])


def test_the_last_four_numbers_may_share_some_with_those_before() -> None:
    assert [firsts(size) for size in (3, 4, 6, 7, 12)] == [(), (0,), (0, 2), (0, 3), (0, 4, 8)]


def test_a_shuffle_does_the_same_in_every_part_or_moves_whole_parts() -> None:
    narrow, wide = lanes_of(ScalarType.FLOAT)

    assert narrow.numbers("a0 b0 a1 b1") == "0, 8, 1, 9, 4, 12, 5, 13"
    assert narrow.whole("a1 b1") == "4, 5, 6, 7, 12, 13, 14, 15"
    assert wide.types == (("four", 16), ("eight", 32), ("sixteen", 64))


def library(files: dict[str, str], folder: Path, *flags: str) -> ctypes.CDLL:
    """The batch kernels, compiled with further flags."""
    folder.mkdir()
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    sources = (folder / name for name in files if name.endswith(".c"))
    run(["gcc", *FLAGS, *flags, *sources, "-o", folder / "batch.so"])
    return ctypes.CDLL(str(folder / "batch.so"))


def call(batch: ctypes.CDLL, q: NDArray[np.floating], real: ScalarType, layout: int) -> NDArray[np.floating]:
    """Poses and Jacobians of joint vectors (N, 6) side by side, with untouched numbers behind them: shape (N, 57)."""
    results = np.full((len(q), NUMBERS + 5), 9, q.dtype)
    size, pointer, stride = ctypes.c_size_t, ctypes.c_void_p, ctypes.c_ssize_t
    kernel = batch[companion(function("puma560", "fk_jacobian", real), "batch")]
    steps = [stride(step // q.itemsize) for step in q.strides]
    outputs = [pointer(results[:, first:].ctypes.data) for first in (0, 16)]
    step = stride(results.shape[1])
    kernel(size(len(q)), pointer(q.ctypes.data), *steps, outputs[0], step, outputs[1], step, ctypes.c_int(layout))
    return results
