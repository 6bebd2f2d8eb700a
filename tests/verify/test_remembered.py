"""A proof is remembered for the same bytes and the same checks, and made anew for anything else."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.emit import files
from kinegen.verify import remembered
from tests.builds.workshop import ARM, make, write_robot


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache folder for each test, with the proof of the small arm in it."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    make(write_robot(tmp_path), tmp_path / "out", compile=False)
    return tmp_path / "cache"


def proved_before(tmp_path: Path, text: str = ARM) -> bool:
    """Whether another build takes the proof from the cache."""
    result = make(write_robot(tmp_path, text), tmp_path / "again", compile=False)
    prove = next(stage for stage in result.stages if stage.name == "prove")

    assert result.proof.holds
    assert len(result.proof.comparisons) > 2
    return "proved before" in prove.detail


def test_the_same_bytes_are_proved_once(tmp_path: Path) -> None:
    assert proved_before(tmp_path)


def test_what_is_remembered_is_the_whole_proof(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    known = make(write_robot(tmp_path), tmp_path / "again", compile=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "empty"))
    fresh = make(write_robot(tmp_path), tmp_path / "again", compile=False)

    assert known.proof == fresh.proof
    assert known.backend == fresh.backend


def test_another_robot_is_proved_anew(tmp_path: Path) -> None:
    assert not proved_before(tmp_path, ARM.replace("0.25", "0.26"))


def test_another_byte_of_any_file_is_proved_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    honest = files.emit_formula
    monkeypatch.setattr(
        files, "emit_formula", lambda kernels: {name: f"{text}\n" for name, text in honest(kernels).items()}
    )

    assert not proved_before(tmp_path)


def test_other_checks_prove_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(remembered, "_checks", lambda: "stricter ones")

    assert not proved_before(tmp_path)


def test_another_numpy_proves_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(remembered.np, "__version__", "9.9")

    assert not proved_before(tmp_path)


def test_a_damaged_entry_is_proved_anew(tmp_path: Path, cache: Path) -> None:
    for entry in cache.rglob("*"):
        if entry.is_file():
            entry.write_bytes(entry.read_bytes()[:-1] + b"?")

    assert not proved_before(tmp_path)


def test_a_cache_that_cannot_be_written_is_done_without(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))

    assert not proved_before(tmp_path)
    assert not proved_before(tmp_path)
