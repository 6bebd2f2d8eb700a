"""Broken and hostile files of other formats: each is refused in one line, and nothing outside is read.

`bad/expected.txt` has the message of each file; `python -m tests.formats.test_bad_files` prints it anew.
"""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from kinegen.errors import KinegenError
from kinegen.io.format import ReadOptions
from kinegen.io.load import MAX_BYTES, load

BAD = Path(__file__).resolve().parent / "bad"
FILES = sorted(path for path in BAD.iterdir() if path.name != "expected.txt")
OPTIONS = ReadOptions(table="standard,m,deg")
SECONDS = 20


def message(path: Path) -> str:
    """What reading a file says, with the place of the folder taken out."""
    try:
        load(path, OPTIONS)
    except KinegenError as error:
        return str(error).replace(f"{BAD}/", "")
    return f"{path.name}: accepted"


def expected() -> dict[str, str]:
    """The line of each file in `expected.txt`, by the name of the file."""
    lines = (BAD / "expected.txt").read_text(encoding="utf-8").splitlines()
    return {line.partition(":")[0]: line for line in lines}


EXPECTED = expected() if (BAD / "expected.txt").exists() else {}


def test_there_are_many() -> None:
    assert len(FILES) >= 80
    assert {path.name for path in FILES} == set(EXPECTED)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_a_broken_file_is_one_line(path: Path) -> None:
    begin = time.perf_counter()
    found = message(path)

    assert found == EXPECTED[path.name]
    assert "accepted" not in found
    assert "\n" not in found
    assert "root:" not in found, "something of /etc/passwd was read"
    assert time.perf_counter() - begin < SECONDS


@pytest.mark.parametrize("suffix", ["urdf", "xacro", "xml", "csv", "yaml"])
def test_a_huge_file_is_refused_unread(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"huge.{suffix}"
    with path.open("wb") as file:
        file.write(b'<robot name="x">')
        file.truncate(100 * 1024 * 1024)
    begin = time.perf_counter()
    with pytest.raises(KinegenError, match="too large"):
        load(path, OPTIONS)
    assert time.perf_counter() - begin < 1
    assert path.stat().st_size > MAX_BYTES


if __name__ == "__main__":
    print("\n".join(message(path) for path in FILES))
