"""An entry of the cache is what was kept under its name, whole and for nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.runtime.cache import Cache


@pytest.fixture
def cache(tmp_path: Path) -> Cache:
    found = Cache(tmp_path / "kinegen")
    found.save("one", b"first")
    found.save("two", b"second")
    return found


def entry(cache: Cache, key: str) -> Path:
    assert cache.folder is not None
    return cache.folder / cache.shelf / key


def test_what_was_kept_comes_back(cache: Cache) -> None:
    assert (cache.load("one"), cache.load("two"), cache.load("three")) == (b"first", b"second", None)


def test_an_entry_under_another_name_is_none(cache: Cache) -> None:
    entry(cache, "one").replace(entry(cache, "two"))

    assert cache.load("two") is None
    assert cache.load("one") is None


@pytest.mark.parametrize("kept", [slice(-1), slice(20), slice(0), slice(None, None, -1)])
def test_a_damaged_entry_is_none(cache: Cache, kept: slice) -> None:
    path = entry(cache, "one")
    path.write_bytes(path.read_bytes()[kept])

    assert cache.load("one") is None
    assert cache.load("two") == b"second"


def test_every_part_of_a_key_counts() -> None:
    cache = Cache(Path("nowhere"))
    keys = {cache.key(*parts) for parts in ((), ("a",), ("b",), ("a", "b"), ("b", "a"), ("ab",), (("a", "b"),), (1,))}

    assert len(keys) == 8
