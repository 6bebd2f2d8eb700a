"""Batches of more configurations than a 32-bit number counts: the arithmetic of indices, in C and in Python."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from numpy.lib.stride_tricks import as_strided

from tests.native.packages import POSES, programs, sources

Loader = Callable[[str, str], ModuleType]
FLAGS = "-std=gnu99 -O1 -ffp-contract=off -fsanitize=undefined -fno-sanitize-recover=all".split()


@pytest.mark.skipif(not shutil.which("gcc") or sys.platform != "linux", reason="needs gcc and Linux")
def test_indices_of_the_c_are_wide_enough(tmp_path: Path) -> None:
    """The loops begin late, so that nobody waits for billions of configurations; all else is as emitted."""
    for name, text in sources(programs("puma560", POSES)).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    batch = (tmp_path / "puma560_batch.c").read_text(encoding="utf-8")
    assert batch.count("size_t begin = 0;") == 1, "the loops over tiles look otherwise: adapt this test"
    late = "extern size_t far_begin;\n" + batch.replace("size_t begin = 0;", "size_t begin = far_begin;")
    (tmp_path / "puma560_batch.c").write_text(f"#include <stddef.h>\n{late}", encoding="utf-8")
    files = [Path(__file__).with_name("far.c"), "puma560.c", "puma560_batch.c"]
    subprocess.run(["gcc", *FLAGS, "-I.", *files, "-o", "far"], cwd=tmp_path, check=True)

    done = subprocess.run(["./far"], cwd=tmp_path, capture_output=True, text=True, check=False)

    if done.returncode == 77:
        pytest.skip("this machine does not give out so many addresses")
    assert (done.stdout, done.stderr, done.returncode) == ("clean\n", "", 0)


@pytest.mark.parametrize("lead", [(2**33,), (2**17, 2**16), (5, 2**31), (2**20, 3, 2**11)])
def test_python_cuts_up_every_batch(load: Loader, backend: str, lead: tuple[int, ...]) -> None:
    """The blocks together are the batch, and each is small enough for one call of C."""
    module = load("chain", backend)
    threads = sys.modules[f"{module.__name__}._runtime._threads"]
    q = np.broadcast_to(np.zeros(3), (*lead, 3))
    out = as_strided(np.zeros((4, 4)), (*lead, 4, 4), (*(0 for _ in lead), 32, 8))
    count = 0
    for axes, (points, target) in threads.blocks_of([q, out], len(lead), 1 << 15):
        assert points.shape[:axes] == points.shape[:-1] == target.shape[:-2]
        size = points.size // 3
        assert 0 < size <= 1 << 15
        count += size

    assert count == np.prod(lead, dtype=np.int64)


def test_a_batch_beyond_32_bits_is_spread_over_all_blocks(
    load: Loader, backend: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A whole call but for the arithmetic, joint-major, where the number of configurations is the longer axis."""
    module, seen = load("chain", backend), []
    kernel, n = module.fk, 2**32 + 3
    # The rows of the result lie over each other here, so that they take no memory.
    monkeypatch.setattr(sys.modules[f"{module.__name__}._runtime._kernel"], "overlaps_itself", lambda _: False)
    monkeypatch.setattr(kernel._engine, "block", 1 << 24)
    monkeypatch.setattr(kernel._engine, "fill", lambda *arguments: seen.append(arguments[-1][-1].shape))
    q = np.broadcast_to(np.zeros((3, 1)), (3, n))
    out = as_strided(np.zeros((12, 1)), (12, n), (8, 0))

    assert kernel(q, out=out, threads=2, layout="joint_major") is out
    assert sum(shape[0] for shape in seen) == n
    assert {shape[1:] for shape in seen} == {(12,)}


@pytest.mark.parametrize(("step", "expected"), [(2**32 + 3, False), (2**32 + 2, True), (3, True)])
def test_rows_beyond_32_bits_that_overlap_are_noticed(load: Loader, step: int, expected: bool) -> None:
    """Addresses alone, of memory that is not there."""
    kernel = sys.modules[f"{load('chain', 'numpy').__name__}._runtime._kernel"]

    found = kernel.overlaps_itself(as_strided(np.zeros(1), (12, 2**32 + 3), (8 * step, 8)))

    assert found is expected
