"""What a header states of joints is held against the robot, and every call against the bits of the plain batch."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from kinegen.errors import ProofError
from kinegen.io.load import load
from kinegen.model.outputs import Quantity
from kinegen.verify.bit_consistency import Call, require_calls
from kinegen.verify.headers import _require_joints

ROOT = Path(__file__).resolve().parents[2]
PUMA = load(ROOT / "robots" / "puma560.yaml")
HEADER = (ROOT / "generated" / "puma560" / "puma560.h").read_text(encoding="utf-8")
WAIST = "waist       revolute   rad  -2.79253 to 2.79253"


def test_the_joints_of_an_emitted_header_are_right() -> None:
    assert WAIST in HEADER
    _require_joints(PUMA, "puma560.h", HEADER)


@pytest.mark.parametrize(
    "wrong",
    [
        WAIST.replace("-2.79253", "-2.79252"),
        WAIST.replace("to 2.79253", "to 2.79252"),
        WAIST.replace("to 2.79253", "to 2.79263"),
        WAIST.replace("-2.79253", "2.79253"),
        WAIST.replace("-2.79253 to 2.79253", "no limits"),
        WAIST.replace("rad", "deg"),
        WAIST.replace("revolute", "prismatic"),
        WAIST.replace("waist", "wrist"),
    ],
)
def test_a_header_that_states_other_limits_is_refused(wrong: str) -> None:
    """Limits of six digits leave out no joint value, and are hardly wider."""
    with pytest.raises(ProofError, match="is not joint waist of the robot"):
        _require_joints(PUMA, "puma560.h", HEADER.replace(WAIST, wrong))


def called(backend: str, found: Any, wanted: Any) -> int:
    """Hold the result of one call against what is wanted."""
    call = Call("with lists", lambda: (found,), (wanted,))
    return require_calls(PUMA, Quantity.POSITION, "C double", SimpleNamespace(backend=backend), iter([call]))


NUMBERS = np.array([[0.0, 1.5, -2.0], [np.nan, 3.0, 1e-3]])


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_the_same_bits_in_the_same_form_are_the_same_result(backend: str) -> None:
    assert called(backend, NUMBERS.copy(), NUMBERS) == 1


@pytest.mark.parametrize("backend", ["c", "numpy"])
@pytest.mark.parametrize(
    "other",
    [NUMBERS.astype(np.float32).astype(np.float64) + 1e-9, NUMBERS.ravel(), NUMBERS[:1], np.abs(NUMBERS)],
    ids=["another number", "another shape", "fewer", "another sign"],
)
def test_another_result_is_refused(backend: str, other: Any) -> None:
    with pytest.raises(ProofError, match="another result with lists than in a plain batch"):
        called(backend, other, NUMBERS)


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_the_same_numbers_of_another_type_are_refused(backend: str) -> None:
    whole = np.array([[0.0, 1.5, -2.0]])

    with pytest.raises(ProofError, match="another result"):
        called(backend, whole.astype(np.float32), whole)
    with pytest.raises(ProofError, match="another result"):
        called(backend, np.zeros((2, 3)), np.zeros((2, 3), np.int64))


def test_the_last_digits_of_numpy_may_differ_and_those_of_c_may_not() -> None:
    near = NUMBERS * (1 + 2.0**-52)

    assert called("numpy", near, NUMBERS) == 1
    with pytest.raises(ProofError):
        called("c", near, NUMBERS)
    with pytest.raises(ProofError):
        called("numpy", NUMBERS * (1 + 1e-12), NUMBERS)
    with pytest.raises(ProofError):
        called("c", np.where(NUMBERS == 0, -0.0, NUMBERS), NUMBERS)
