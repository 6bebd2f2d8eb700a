"""A call of `kinegen.compile` that was made before in the same words costs the import of its module."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import kinegen
from kinegen.ui.api import loading, module_cache
from tests.api.test_compile import QUICK, again, arm, builds, folders, own_cache

ROOT = Path(__file__).resolve().parents[2]

__all__ = ["builds", "own_cache"]  # fixtures


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A robot file."""
    return Path(kinegen.load(arm(0.5)).save(tmp_path / "arm.yaml"))


@pytest.fixture
def reads(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """The robots that were read."""
    found: list[object] = []
    honest = loading.load

    def noted(source: Any) -> Any:
        found.append(source)
        return honest(source)

    monkeypatch.setattr(loading, "load", noted)
    return found


def test_a_second_process_imports_no_reader_and_no_sympy(own_cache: Path, file: Path) -> None:
    code = (
        "import sys, kinegen; kinegen.compile(sys.argv[1], 'pose', real='double', compile=False); "
        "print({'sympy', 'mpmath', 'cffi', 'jinja2', 'yaml', 'importlib.metadata', 'kinegen.model', 'kinegen.io', "
        "'kinegen.driver.pipeline', 'kinegen.driver.results'} & {*sys.modules})"
    )
    command = [sys.executable, "-W", "ignore", "-c", code, str(file)]
    first, second = (
        subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT).stdout for _ in range(2)
    )

    assert "sympy" in first
    assert second == "set()\n"


@pytest.mark.parametrize("kind", [str, Path, "text"])
def test_the_same_words_are_recognised(
    kind: Any, own_cache: Path, file: Path, reads: list[object], monkeypatch: pytest.MonkeyPatch
) -> None:
    source = file.read_text(encoding="utf-8") if kind == "text" else kind(file)
    first = kinegen.compile(source, **QUICK)
    again(monkeypatch)
    second = kinegen.compile(source, **QUICK)

    assert first.__name__ == second.__name__
    assert len(reads) == 1


def test_other_words_for_the_same_find_the_same_module(own_cache: Path, file: Path, builds: list[str]) -> None:
    words = {**QUICK, "outputs": (word for word in ("position", "pose"))}
    first = kinegen.compile(str(file), **words)

    assert kinegen.compile(str(file), **{**QUICK, "outputs": "pose,position"}) is first
    assert builds == ["arm"]


def test_an_edited_file_is_read_again(own_cache: Path, file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = kinegen.compile(file, **QUICK)
    kinegen.load(arm(0.6)).save(file, force=True)
    again(monkeypatch)
    second = kinegen.compile(file, **QUICK)

    assert first.fk([0.0, 0.0])[0, 3] == 0.75
    assert second.fk([0.0, 0.0])[0, 3] == 0.85


def test_a_file_that_is_edited_while_it_is_compiled_is_not_recognised(
    own_cache: Path, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    old, honest = file.read_bytes(), loading.load

    def edited(source: Any) -> Any:
        file.write_bytes(old.replace(b"0.5", b"0.6"))
        return honest(source)

    monkeypatch.setattr(loading, "load", edited)
    kinegen.compile(file, **QUICK)
    monkeypatch.setattr(loading, "load", honest)
    file.write_bytes(old)

    assert kinegen.compile(file, **QUICK).fk([0.0, 0.0])[0, 3] == 0.75


def test_another_program_or_library_is_another_call(
    own_cache: Path, file: Path, reads: list[object], monkeypatch: pytest.MonkeyPatch
) -> None:
    kinegen.compile(file, **QUICK)
    for name, other in (("program", lambda: "another"), ("libraries", lambda: ("1", "2"))):
        with monkeypatch.context() as patch:
            patch.setattr(f"kinegen.runtime.toolchain_fingerprint.{name}", other)
            kinegen.compile(file, **QUICK)
    kinegen.compile(file, **QUICK)

    assert len(reads) == 3


def test_a_damaged_module_is_made_again(
    own_cache: Path, file: Path, builds: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    kinegen.compile(file, **QUICK)
    (folder,) = folders(own_cache)
    (folder / "_numpy.py").unlink()
    again(monkeypatch)
    kinegen.compile(file, **QUICK)

    assert builds == ["arm", "arm"]


@pytest.mark.parametrize("source", ["<robot name='arm'/>", "\ufeff<robot/>\n", "arm.urdf", "arm.xacro", b"arm.yaml"])
def test_what_may_read_other_files_is_read(source: Any) -> None:
    assert module_cache.call_name(source, ("words",)) == ""


def test_python_need_not_translate_what_is_kept(own_cache: Path, file: Path) -> None:
    kinegen.compile(file, **QUICK)
    (folder,) = folders(own_cache)

    assert {path.name.partition(".")[0] for path in (folder / "__pycache__").iterdir()} == {
        path.stem for path in folder.glob("*.py")
    }
