"""A proof is remembered for the same bytes and the same checks, and made anew for anything else."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from kinegen.backends.python import formula
from kinegen.runtime.cache import Cache
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
    honest = formula.emit_formula
    monkeypatch.setattr(
        formula, "emit_formula", lambda kernels: {name: f"{text}\n" for name, text in honest(kernels).items()}
    )

    assert not proved_before(tmp_path)


def test_other_checks_prove_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kinegen.runtime.toolchain_fingerprint.program", lambda: "with stricter ones")

    assert not proved_before(tmp_path)


def test_another_numpy_proves_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One that is found first, as an installer leaves it."""
    (tmp_path / "site" / "numpy-9.9.dist-info").mkdir(parents=True)
    monkeypatch.syspath_prepend(tmp_path / "site")

    assert not proved_before(tmp_path)


@pytest.mark.parametrize("name", ["no-such-library", "mute"])
@pytest.mark.parametrize("finder", ["metadata", "importlib_metadata"], ids=["own", "backport"])
def test_a_library_that_does_not_say_its_version_proves_anew(
    finder: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if finder == "importlib_metadata":
        pytest.importorskip(finder)  # it answers for Python's own from now on, and raises other errors
    (tmp_path / "site" / "mute.egg-info").mkdir(parents=True)
    monkeypatch.syspath_prepend(tmp_path / "site")
    monkeypatch.setattr("kinegen.runtime.toolchain_fingerprint._LIBRARIES", ("numpy", name))

    assert not proved_before(tmp_path)
    assert not proved_before(tmp_path)


def replace_records(cache: Path, change: Callable[[dict[str, Any]], object]) -> None:
    """Alter the proofs that are kept, with right digests in front."""
    for entry in (cache / "kinegen" / "extensions").iterdir():
        record = json.loads(entry.read_bytes()[32:])
        change(record)
        content = json.dumps(record).encode()
        Cache().save(entry.name, content)


CHANGES: dict[str, Callable[[dict[str, Any]], object]] = {
    "an error above what is accepted": lambda kept: kept["proof"]["comparisons"][0].update(position_error=5.0),
    "an error that is not a number": lambda kept: kept["proof"]["comparisons"][0].update(rotation_error=math.nan),
    "nothing compared": lambda kept: kept["proof"].update(comparisons=[]),
    "a field is missing": lambda kept: kept["proof"]["comparisons"][0].pop("worst"),
    "a field more": lambda kept: kept["proof"]["comparisons"][0].update(luck=1),
    "another type": lambda kept: kept["proof"].update(comparisons="many"),
    "another quantity": lambda kept: kept["proof"]["comparisons"][0]["quantity"].update(kind="luck"),
    "nothing in it": lambda kept: kept.clear(),
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_record_that_is_not_a_proof_that_holds_is_proved_anew(change: str, tmp_path: Path, cache: Path) -> None:
    replace_records(cache, CHANGES[change])

    assert not proved_before(tmp_path)


@pytest.mark.parametrize("content", [b"", b"null", b"[]", b"{", b"\x80\x04N.", b"[" * 100_000])
def test_a_record_of_another_shape_is_proved_anew(content: bytes, tmp_path: Path, cache: Path) -> None:
    for entry in (cache / "kinegen" / "extensions").iterdir():
        Cache().save(entry.name, content)

    assert not proved_before(tmp_path)


@pytest.mark.skipif(os.name != "posix", reason="owners and modes are of POSIX")
@pytest.mark.parametrize("place", ["kinegen", "kinegen/extensions"])
def test_a_folder_that_others_may_write_to_is_not_used(place: str, tmp_path: Path, cache: Path) -> None:
    (cache / place).chmod(0o775)

    assert Cache().refusal == (
        f"the cache {cache / place} is not used, since other users may write to it; delete it, and it is created again"
    )
    assert not proved_before(tmp_path)


@pytest.mark.skipif(os.name != "posix" or os.geteuid() != 0, reason="only root can give a folder away")
def test_a_folder_or_an_entry_of_another_user_is_not_used(tmp_path: Path, cache: Path) -> None:
    (entry,) = (cache / "kinegen" / "extensions").iterdir()
    os.chown(entry, 65534, 65534)
    assert not proved_before(tmp_path)

    os.chown(cache / "kinegen", 65534, 65534)
    assert "is not used, since it belongs to another user" in Cache().refusal
    assert not proved_before(tmp_path)


@pytest.mark.skipif(os.name != "posix", reason="modes are of POSIX")
def test_a_new_cache_is_for_its_user_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "deep" / "fresh"))
    before = os.umask(0)
    try:
        Cache().save("key", b"content")
    finally:
        os.umask(before)

    for place in ("", "kinegen", "kinegen/extensions", "kinegen/extensions/key"):
        assert not (tmp_path / "deep" / "fresh" / place).stat().st_mode & 0o077
    assert Cache().load("key") == b"content"


@pytest.mark.parametrize("home", ["", "none"])
def test_without_a_home_folder_nothing_is_kept(home: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", home and str(tmp_path / home))

    Cache().save("key", b"content")

    assert Cache().folder is None
    assert Cache().load("key") is None
    assert not (tmp_path / "none").exists()


def test_a_record_of_another_proof_is_proved_anew(tmp_path: Path, cache: Path) -> None:
    """Copied to where the proof of another robot would be."""
    (entry,) = (cache / "kinegen" / "extensions").iterdir()
    text = ARM.replace("0.25", "0.26")
    make(write_robot(tmp_path, text), tmp_path / "again", compile=False)
    (other,) = set((cache / "kinegen" / "extensions").iterdir()) - {entry}
    other.write_bytes(entry.read_bytes())

    assert not proved_before(tmp_path, text)


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
