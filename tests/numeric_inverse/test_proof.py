"""A build proves its numeric inverse and tells what it solved; a wrong search cannot pass."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from kinegen.backends.scalar_types import ScalarType
from kinegen.errors import ProofError
from kinegen.model.outputs import NUMERIC_INVERSE, POSE_AND_JACOBIAN
from kinegen.runtime.extension import load_package
from kinegen.verify import numeric_inverse as proof
from tests.builds.workshop import make, set_machine, write_robot
from tests.verify.test_broken_kernels import Change, break_emitter, first

ARM = """\
kinegen: 1
name: arm
convention: standard
units: {length: m, angle: deg}
parameters:
  reach: {value: 0.5, runtime: true}
joints:
  - {name: turn, theta: q, d: 0.25, a: 0, alpha: 90, limits: [-170, 170]}
  - {name: lift, theta: q, d: 0, a: reach, alpha: 0, limits: [-20, 120]}
  - {name: slide, type: prismatic, theta: 90, d: q, a: 0.1, alpha: 90, limits: [0, 0.4]}
"""
QUANTITIES = (POSE_AND_JACOBIAN, NUMERIC_INVERSE)
WAYS = [
    f"{way}, search{more}"
    for real in ScalarType
    for more in ("", ", other parameters")
    for way in (f"C {real}, batch", f"C {real}", f"NumPy {real}")
]


@pytest.fixture(autouse=True)
def quickly(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(proof, "TARGETS", 200)
    monkeypatch.setattr(proof, "FEWER", 20)
    set_machine(monkeypatch, tmp_path / "cache")


def test_every_way_is_proven_and_the_count_is_told_now_and_remembered(tmp_path: Path) -> None:
    path = write_robot(tmp_path, ARM)
    built, again = (make(path, tmp_path, quantities=QUANTITIES).proof for _ in range(2))
    found = [comparison for comparison in built.comparisons if comparison.quantity == NUMERIC_INVERSE]

    assert [comparison.target for comparison in found] == WAYS
    assert [comparison.poses for comparison in found] == [200, 200, 20, 20, 20, 20] * 2
    assert built.counts[0].startswith("numeric inverse: 200 of 200 random reachable targets solved from random starts")
    assert again == built


def test_without_a_compiler_the_search_in_numpy_is_proven(tmp_path: Path) -> None:
    built = make(write_robot(tmp_path, ARM), tmp_path, quantities=QUANTITIES, compile=False).proof

    assert built.counts[0].startswith("numeric inverse: 20 of 20 random reachable targets solved")


SOLVED = "const int is_near = "
BREAKS: dict[str, tuple[Change, str]] = {
    "a step the wrong way": (first(r"q\[j\] \+ move", "q[j] - move"), "C double numeric_inverse solves only"),
    "a slope of the wrong sign": (
        first(r"moves\[j\] = dot", "moves[j] = -dot"),
        "C double numeric_inverse solves only",
    ),
    "half the distance": (
        first("= position_error;", "= position_error / 2;", SOLVED),
        "C double, (search numeric_inverse differs from the reference|batch numeric_inverse gives another)",
    ),
    "an angle that is not looked at": (
        first(r" && \(rotation_error <= search->rotation_tolerance\)", ""),
        "C double numeric_inverse reports targets as solved",
    ),
    "a whole turn beyond the limits": (
        first(r"current\[j\];", "current[j] + ((j == 0) ? 6.283185307179586 : 0.0);", SOLVED),
        "C double numeric_inverse gives joint vectors that break limits",
    ),
    "a parameter that is not read": (
        first("current, params, pose", "current, &arm_default_params, pose"),
        "C double numeric_inverse solves only 0 of 20",
    ),
}


@pytest.mark.parametrize("case", BREAKS)
def test_a_wrong_search_is_refused(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    change, message = BREAKS[case]
    break_emitter(monkeypatch, "emit_numeric_inverse", "numeric_inverse.c", change, ScalarType.DOUBLE)

    with pytest.raises(ProofError, match=f"arm: {message}"):
        make(write_robot(tmp_path, ARM), tmp_path, quantities=QUANTITIES)


def test_a_small_share_is_told(tmp_path: Path) -> None:
    line = proof.search_line(1000, 980, 20.0, (1e-9, 1e-9), "m")

    assert line.endswith("; most arms get 99%, and more restarts find more")


@pytest.mark.parametrize("compiles", [True, False])
@pytest.mark.parametrize("real", list(ScalarType))
def test_a_package_of_one_type_takes_targets_of_any(real: ScalarType, compiles: bool, tmp_path: Path) -> None:
    """What the types of results are is said in docs/python.md, for all kernels."""
    folder = make(write_robot(tmp_path, ARM), tmp_path, quantities=QUANTITIES, reals=(real,), compile=compiles).folder
    arm = load_package(folder)
    pose, _ = arm.fk_jacobian(np.array([0.3, 0.4, 0.2]))
    double, single = np.asarray(pose, np.float64), np.asarray(pose, np.float32)
    kinds = {np.float64: double, np.float32: single, np.float16: single, list: double.tolist()}
    found = {kind: arm.numeric_inverse(given, restarts=0) for kind, given in kinds.items()}

    for kind, result in found.items():
        wanted = np.float32 if real is ScalarType.FLOAT or kind in (np.float32, np.float16) else np.float64
        assert result.solved
        assert result.q.dtype == result.position_error.dtype == wanted
    out = type(found[list])(*(np.empty_like(np.asarray(entry)) for entry in found[np.float64]))
    arm.numeric_inverse.bind(double, np.zeros(3), *out, restarts=0)()
    np.testing.assert_array_equal(out.q, arm.numeric_inverse(double, np.zeros(3), restarts=0).q)
