"""The digest of the program: cheap to ask for, and another one after any change of a file."""

from __future__ import annotations

import os
import re
import time
from importlib import metadata
from pathlib import Path

import pytest

from kinegen.runtime import toolchain_fingerprint


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A small program, written a minute ago, and an empty cache."""
    folder = tmp_path / "kinegen"
    (folder / "templates").mkdir(parents=True)
    for name in ("first.py", "second.py", "templates/odd.name"):
        write(folder / name, "raise\n")
    monkeypatch.setattr(toolchain_fingerprint, "_PACKAGE", folder)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(toolchain_fingerprint, "_SETTLED", 0)
    return folder


def write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")
    os.utime(path, ns=(time.time_ns() - 60 * 10**9,) * 2)


def digest() -> str:
    """The digest as another process finds it."""
    time.sleep(0.01)  # more than a tick of the clock of the file system
    return toolchain_fingerprint.program.__wrapped__()


@pytest.fixture
def read(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The names of the files whose contents were read."""
    names: list[str] = []
    honest = Path.read_bytes

    def noted(path: Path) -> bytes:
        names.append(path.name)
        return honest(path)

    monkeypatch.setattr(Path, "read_bytes", noted)
    return names


def test_contents_are_read_once(package: Path, read: list[str]) -> None:
    first = digest()

    assert sorted(read) == ["first.py", "odd.name", "second.py"]
    assert digest() == first
    assert len(read) == 3


def test_an_edited_file_changes_the_key(package: Path) -> None:
    first = digest()
    write(package / "second.py", "pass # other\n")

    assert digest() != first


def test_new_renamed_and_missing_files_change_the_key(package: Path) -> None:
    digests = [digest()]
    write(package / "third.py", "raise\n")
    digests.append(digest())
    (package / "third.py").rename(package / "fourth.py")
    digests.append(digest())
    (package / "first.py").unlink()
    digests.append(digest())

    assert len(set(digests)) == 4


@pytest.mark.skipif(os.name != "posix", reason="other systems have no time of the last change")
def test_an_edit_that_keeps_size_and_modification_time_changes_the_key(package: Path) -> None:
    path = package / "first.py"
    first, status = digest(), path.stat()
    path.write_text("break\n", encoding="utf-8")
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))

    assert (path.stat().st_size, path.stat().st_mtime_ns) == (status.st_size, status.st_mtime_ns)
    assert digest() != first


def test_a_touched_file_is_read_and_the_key_stays(package: Path, read: list[str]) -> None:
    first = digest()
    (package / "first.py").touch()

    assert digest() == first
    assert len(read) == 6


def test_a_file_of_this_moment_is_read_again(package: Path, read: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Its next edit could leave it the same times."""
    monkeypatch.setattr(toolchain_fingerprint, "_SETTLED", 2 * 10**9)
    (package / "first.py").write_text("raise\n", encoding="utf-8")
    digest()
    digest()

    assert len(read) == 6


def test_caches_of_python_and_links_that_lead_nowhere_are_no_part_of_it(package: Path) -> None:
    first = digest()
    (package / "__pycache__").mkdir()
    (package / "__pycache__" / "first.pyc").write_bytes(b"\0")
    (package / ".#first.py").symlink_to("nobody@nowhere")

    assert digest() == first


def test_versions_are_those_that_the_libraries_state() -> None:
    stated = tuple(metadata.version(name) for name in toolchain_fingerprint._LIBRARIES)

    assert tuple(re.sub(r"-py\d.*", "", version) for version in toolchain_fingerprint.libraries()) == stated
