"""A proof is taken from the cache for the very files, outputs and number types that it was made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from kinegen.io.load import load
from kinegen.model.outputs import Quantity
from kinegen.verify import package_proof
from kinegen.verify.package_proof import cached_proof
from kinegen.verify.records import Comparison, Invocation, Proof

ROBOT = load(Path(__file__).parents[2] / "robots" / "planar_3r.yaml")
HELD = Comparison(Invocation("NumPy", "double"), Quantity.POSE, 3, 1e-15, 1e-16, 1e-13, 1e-13, (0.5,), "tool")
FILES: Mapping[str, str | bytes] = {"__init__.py": "one", "planar_3r.c": "two"}
USUAL = (ROBOT, FILES, (Quantity.POSE,), ("double",))

found: list[Proof] = []


@pytest.fixture(autouse=True)
def _proofs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A cache with the proof of the usual package in it, and proofs that take no time."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(package_proof, "identity", lambda: ("a program", "a machine"))
    monkeypatch.setattr(package_proof, "prove_package", lambda *_: (found[-1], "numpy"))
    found.append(Proof(3.0, (HELD,)))
    assert not cached_proof(*USUAL)[2]


def test_the_same_package_is_proved_once() -> None:
    assert cached_proof(*USUAL) == (found[-1], "numpy", True)


@pytest.mark.parametrize(
    "other",
    [
        (replace(ROBOT, name="another"), *USUAL[1:]),
        (ROBOT, {**FILES, "planar_3r.c": "three"}, *USUAL[2:]),
        (ROBOT, {"__init__.py": "two", "planar_3r.c": "one"}, *USUAL[2:]),
        (ROBOT, {**FILES, "more.c": ""}, *USUAL[2:]),
        (*USUAL[:2], (Quantity.POSE, Quantity.POSITION), ("double",)),
        (*USUAL[:3], ("float",)),
        (*USUAL[:3], ("double", "float")),
    ],
    ids=["robot", "content", "exchanged contents", "a file more", "outputs", "number type", "number types"],
)
def test_what_differs_in_anything_is_proved_anew(other: Any) -> None:
    assert not cached_proof(*other)[2]
    assert cached_proof(*USUAL)[2]


def test_another_program_or_machine_proves_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    for machine in (("another program", "a machine"), ("a program", "another machine"), None):
        monkeypatch.setattr(package_proof, "identity", lambda machine=machine: machine)
        assert not cached_proof(*USUAL)[2]


@pytest.mark.parametrize("kept", [Proof(3.0, ()), Proof(3.0, (HELD, replace(HELD, position_error=1.0)))])
def test_a_proof_of_nothing_or_one_that_does_not_hold_is_not_taken_from_the_cache(kept: Proof) -> None:
    found.append(kept)
    package = (*USUAL[:3], ("float",))

    assert not cached_proof(*package)[2]
    assert not cached_proof(*package)[2]
