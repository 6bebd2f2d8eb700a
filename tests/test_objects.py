"""What a run remembers of compilers is used for the same text and words alone."""

from __future__ import annotations

from pathlib import Path
from threading import Event

import pytest

from kinegen.runtime.compiler import Compiler
from tests.objects import remembering

WORDS = ("-O1", "-c", "a.c", "-o", "a.o")


class _Counting:
    """A compiler that writes how often it was asked."""

    def __init__(self, store: Path) -> None:
        store.mkdir()
        self.calls = 0
        self.run = remembering(self._run, store)

    def _run(
        self, _: Compiler, folder: Path, arguments: tuple[str, ...], _subject: str, _stop: Event | None = None
    ) -> None:
        self.calls += 1
        (folder / arguments[-1]).write_text(str(self.calls))

    def made(self, folder: Path, words: tuple[str, ...] = WORDS, compiler: str = "gcc") -> str:
        self.run(Compiler((compiler,), ""), folder, words, "a.c", None)
        return (folder / words[-1]).read_text()


@pytest.fixture
def counting(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> _Counting:
    monkeypatch.delenv("CC", raising=False)
    return _Counting(tmp_path / "store")


def sources(folder: Path, header: str = "int a;\n") -> Path:
    (folder / "inner").mkdir(parents=True)
    (folder / "a.c").write_text('#include "a.h"\n')
    (folder / "a.h").write_text('# include "b.h"\n')
    (folder / "inner" / "b.h").write_text(header)
    return folder


def test_the_same_text_is_compiled_once_wherever_it_is(counting: _Counting, tmp_path: Path) -> None:
    words = ("-Iinner", *WORDS)
    first, second = sources(tmp_path / "first"), sources(tmp_path / "second")

    assert [counting.made(first, words), counting.made(second, words)] == ["1", "1"]


def test_a_header_a_word_or_a_compiler_that_differs_is_another_compilation(counting: _Counting, tmp_path: Path) -> None:
    words = ("-Iinner", *WORDS)
    first, second = sources(tmp_path / "first"), sources(tmp_path / "second", "int b;\n")

    assert counting.made(first, words) == "1"
    assert counting.made(second, words) == "2"
    assert counting.made(first, ("-Iinner", "-O2", *WORDS[1:])) == "3"
    assert counting.made(first, words, "clang") == "4"


def test_an_object_that_is_linked_counts_by_its_bytes(counting: _Counting, tmp_path: Path) -> None:
    (tmp_path / "a.o").write_bytes(b"1")
    before = counting.made(tmp_path, ("-shared", "a.o", "-o", "library.so"))
    (tmp_path / "a.o").write_bytes(b"2")

    assert [before, counting.made(tmp_path, ("-shared", "a.o", "-o", "library.so"))] == ["1", "2"]


def test_a_compiler_that_somebody_named_is_asked_each_time(
    counting: _Counting, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CC", "gcc")
    folder = sources(tmp_path / "sources")

    assert [counting.made(folder), counting.made(folder)] == ["1", "2"]
