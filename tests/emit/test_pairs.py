"""Long chains: sines and cosines in one loop, with the bits of the calls one by one."""

from __future__ import annotations

import ctypes
from pathlib import Path

import numpy as np
import pytest

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c import loops
from kinegen.backends.c.batch import emit_batch
from kinegen.backends.c.kernel import emit_kernel, kernel_context
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import lower_file
from kinegen.errors import ProofError
from kinegen.model.outputs import Quantity
from kinegen.verify.source_checks import require_straight
from tests.emit.emitted import run

ROWS = 26
_HEAD = "kinegen: 1\nname: snake\nconvention: modified\nunits: {length: m, angle: deg}\njoints:\n"


def _lowered(folder: Path, *, parallel: bool, rows: int = ROWS) -> RobotPrograms:
    """A chain with a twist in every row, or with pairs of parallel axes, whose angles are sums."""
    twists = [0 if parallel and row % 2 else 30 + row for row in range(rows)]
    lines = (f"  - {{name: j{row}, alpha: {twist}, a: 0.2, d: 0.1, theta: q}}\n" for row, twist in enumerate(twists))
    file = folder / "snake.yaml"
    file.write_text(_HEAD + "".join(lines), encoding="utf-8")
    return lower_file(file, (Quantity.POSE,))


def _text(kernels: RobotPrograms) -> dict[str, str]:
    kernel_context.cache_clear()
    return emit_kernel(kernels, ScalarType.DOUBLE) | emit_batch(kernels, ScalarType.DOUBLE)


def _results(folder: Path, text: dict[str, str], q: np.ndarray) -> tuple[bytes, ...]:
    """What the kernel for one configuration and the one for batches give."""
    folder.mkdir()
    for name, content in text.items():
        (folder / name).write_text(content, encoding="utf-8")
    warned = ["-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror"]
    sources, output = ["snake.c", "snake_batch.c"], str(folder / "snake.so")
    run(["gcc", "-std=c99", "-O1", *warned, "-ffp-contract=off", "-shared", "-fPIC", *sources, "-o", output], folder)
    library = ctypes.CDLL(output)
    single, batch = np.zeros((len(q), 16)), np.zeros((len(q), 16))
    for row, target in zip(q, single, strict=True):
        library.snake_fk(ctypes.c_void_p(row.ctypes.data), ctypes.c_void_p(target.ctypes.data))
    stride = [ctypes.c_ssize_t(each) for each in (q.shape[1], 1)]
    pointers = [ctypes.c_void_p(array.ctypes.data) for array in (q, batch)]
    library.snake_fk_batch(ctypes.c_size_t(len(q)), pointers[0], *stride, pointers[1], ctypes.c_ssize_t(16), 0)
    return tuple(np.where(np.isnan(each), np.nan, each).tobytes() for each in (single, batch))


@pytest.mark.parametrize("parallel", [False, True], ids=["joint values", "sums"])
def test_the_loop_has_the_bits_of_single_calls(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, parallel: bool) -> None:
    kernels = _lowered(tmp_path, parallel=parallel)
    q = np.random.default_rng(7).uniform(-40, 40, (19, ROWS))
    q[3, 5], q[4, 25], q[5, 0] = np.nan, np.inf, 2e5
    looped = _text(kernels)
    assert ("sines[1] = q" in looped["snake.c"]) == parallel
    monkeypatch.setattr(loops, "MOST_CALLS", ROWS)
    called = _text(kernels)
    kernel_context.cache_clear()
    assert "for (int k" in looped["snake.c"]
    assert "for (int k" not in called["snake.c"] + called["snake_batch.c"]
    found = {*_results(tmp_path / "looped", looped, q), *_results(tmp_path / "called", called, q)}
    assert len(found) == 1
    poses = np.frombuffer(found.pop()).reshape(19, 4, 4)
    assert np.isnan(poses[3:6, :3, :3]).any(axis=(1, 2)).all()
    assert np.isfinite(poses[6:]).all()


def test_shorter_chains_keep_a_line_for_each_pair(tmp_path: Path) -> None:
    text = _text(_lowered(tmp_path, parallel=False, rows=loops.MOST_CALLS))
    assert "sines[" not in "".join(text.values())
    assert "no loop, no branch" in text["snake.h"]


def test_the_proof_reads_the_loop(tmp_path: Path) -> None:
    kernels = _lowered(tmp_path, parallel=True)
    formula = {"_numpy.py": "def fk(q):\n    'Pose.'\n    return q\n"}
    text = _text(kernels) | formula
    assert "but those with a fixed number of turns" in " ".join(text["snake.h"].split())
    require_straight(kernels.robot, text, (Quantity.POSE,), ("double",))
    for old, new in (
        ("snake_sincos(angle, &sines[k][i]", "other(angle, &sines[k][i]"),
        ("k < 26", "k < 25"),
        ("double sines[26][", "double sines[25]["),
        ("angle = sines[k][i];", "angle = (q[0] < 1.0) ? 0.0 : sines[k][i];"),
        ("sines[1][i] = q", "if (q[0] > 1.0) sines[1][i] = q"),
    ):
        assert old in text["snake_batch.c"]
        wrong = text | {"snake_batch.c": text["snake_batch.c"].replace(old, new, 1)}
        with pytest.raises(ProofError, match="is not straight"):
            require_straight(kernels.robot, wrong, (Quantity.POSE,), ("double",))
