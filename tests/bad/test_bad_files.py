"""Bad robot files: one line that says where, what and what would be right, at once, and nothing else happens.

`expected.txt` holds the exact message of every file of this folder. Files that no repository wants to store, such as
ten megabytes of text, are made here.
"""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from kinegen.errors import RobotFileError
from kinegen.io.load import load

FOLDER = Path(__file__).parent
LINES = (FOLDER / "expected.txt").read_text(encoding="utf-8").splitlines()
EXPECTED = {line[: line.index(".yaml") + len(".yaml")]: line for line in LINES}
FILES = sorted(path.name for path in FOLDER.glob("*.yaml"))
MOST_SECONDS = 2.0

GOOD = """kinegen: 1
name: arm
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: waist, a: 0, alpha: 90, d: 0.4, theta: q}
"""


def message_of(path: Path | str) -> str:
    """What `load` says about a bad file, after it has proved to be brief, safe to print and quick."""
    start = time.perf_counter()
    with pytest.raises(RobotFileError) as caught:
        load(path)

    assert time.perf_counter() - start < MOST_SECONDS
    assert type(caught.value) is RobotFileError
    assert str(caught.value).isprintable()
    assert len(caught.value.message) <= 500
    return str(caught.value)


def test_every_file_has_a_message_and_every_message_a_file() -> None:
    assert sorted(EXPECTED) == FILES
    assert len(FILES) >= 60


@pytest.mark.parametrize("name", FILES)
def test_the_message_is_exact(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(FOLDER)

    assert message_of(name) == EXPECTED[name]


def test_the_message_names_the_file_as_the_user_did() -> None:
    path = FOLDER / FILES[0]

    assert message_of(path).startswith(f"{path}:")


def test_nothing_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    before = sorted(FOLDER.rglob("*.yaml"))
    for name in FILES:
        message_of(FOLDER / name)

    assert list(tmp_path.iterdir()) == []
    assert sorted(FOLDER.rglob("*.yaml")) == before


def bomb(levels: int) -> str:
    """Aliases to lists of aliases: a few lines that stand for ten to the power of `levels` entries."""
    lines = ["a0: &a0 [" + ", ".join(["x"] * 10) + "]"]
    lines += [f"a{i}: &a{i} [" + ", ".join([f"*a{i - 1}"] * 10) + "]" for i in range(1, levels)]
    return "\n".join(lines) + "\n"


def many_steps() -> bytes:
    """Aliases that let one long list of expressions be read two hundred times."""
    steps = ", ".join([f"Tx({'+'.join(['1'] * 150)})"] * 64)
    frames = [f"  f{i}: {{parent: base, ets: *steps}}" for i in range(1, 200)]
    return "\n".join([GOOD + f"frames:\n  f0: {{parent: base, ets: &steps [{steps}]}}", *frames]).encode()


MADE = {
    "binary": (b"\x7fELF\x02\x01\x01\0\0\0", "made.yaml: this is a binary file; a robot file is UTF-8 text"),
    "random bytes": (
        bytes(range(1, 256)),
        "made.yaml:2: byte 0x80 is not UTF-8 text (save the file as UTF-8)",
    ),
    "latin 1": (
        GOOD.encode() + "description: Stäubli\n".encode("latin-1"),
        "made.yaml:7: byte 0xe4 is not UTF-8 text (save the file as UTF-8)",
    ),
    "utf 16": (GOOD.encode("utf-16"), "made.yaml: this is UTF-16 text; save the file as UTF-8"),
    "ten megabytes": (
        GOOD.encode() + b"# padding\n" * 1_000_000,
        "made.yaml: the file is larger than 256 KiB, too large for a robot file",
    ),
    "one byte too many": (
        b"#" * (256 * 1024 + 1),
        "made.yaml: the file is larger than 256 KiB, too large for a robot file",
    ),
    "alias bomb": (
        bomb(9).encode(),
        "made.yaml:5: the entries up to here hold more than 80000 characters, counting each alias in full",
    ),
    "many entries": (
        b"x: [" + b"1, " * 80_000 + b"1]",
        "made.yaml:1: the entries up to here hold more than 80000 characters, counting each alias in full",
    ),
    "control character": (
        GOOD.encode() + b"# \x1b[2J\n",
        r"made.yaml:7: control character '\x1b' is not allowed in a robot file",
    ),
    "line separator": (
        GOOD.encode() + "# a\u2028b\n".encode(),
        r"made.yaml:7: control character '\u2028' is not allowed in a robot file",
    ),
    "bidirectional text": (
        GOOD.encode() + "description: arm \u202e evil\n".encode(),
        r"made.yaml:7: description: character '\u202e' cannot be printed",
    ),
    "long line": (
        b"x" * 250_000,
        "made.yaml:1: the entries up to here hold more than 80000 characters, counting each alias in full",
    ),
    "long steps on many frames": (
        many_steps(),
        "made.yaml:12: the entries up to here hold more than 80000 characters, counting each alias in full",
    ),
    "long key": (
        GOOD.encode() + b"? " + b"x" * 70_000 + b"\n: 1\n",
        f"made.yaml:7: unknown key '{'x' * 37}...' (expected kinegen, name, description, ",
    ),
    "long value": (
        GOOD.encode().replace(b"0.4", b"1" * 70_000),
        "made.yaml:6: joint 1 (waist): d: the expression has 70000 characters (at most 500)",
    ),
    "many lines": (b"\n" * 250_000, "made.yaml: the file is empty (a robot file begins with 'kinegen: 1')"),
    "many rows": (
        GOOD.encode() + b"  - {name: j}\n" * 2_000,
        "made.yaml:6: joints: 2001 rows are too many (at most 256)",
    ),
    "many parameters": (
        GOOD.encode() + b"parameters:\n" + b"".join(b"  p%d: 1\n" % i for i in range(201)),
        "made.yaml:8: parameters: 201 entries are too many (at most 200)",
    ),
    "many frames": (
        GOOD.encode() + b"frames:\n" + b"".join(b"  f%d: {parent: base}\n" % i for i in range(201)),
        "made.yaml:8: frames: 201 entries are too many (at most 200)",
    ),
    "surrogate escape": (
        GOOD.encode() + b'description: "\\ud800"\n',
        r"made.yaml:7: description: character '\ud800' cannot be printed",
    ),
}


@pytest.mark.parametrize("case", MADE)
def test_a_file_no_repository_stores(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    data, expected = MADE[case]
    monkeypatch.chdir(tmp_path)
    Path("made.yaml").write_bytes(data)

    assert message_of("made.yaml").startswith(expected)
    assert [path.name for path in tmp_path.iterdir()] == ["made.yaml"]


def test_a_missing_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)

    assert message_of("arm.yaml") == "arm.yaml: cannot be read: no such file or directory"


def test_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("arm.yaml").mkdir()

    assert message_of("arm.yaml") == "arm.yaml: this is a folder; expected a robot file"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs os.mkfifo, which Unix has")
def test_a_pipe_does_not_block(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    os.mkfifo("arm.yaml")

    assert message_of("arm.yaml") == "arm.yaml: this is not a regular file; expected a robot file"


def test_an_unreadable_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The error is made, as the administrator may read every file."""
    monkeypatch.chdir(tmp_path)
    Path("arm.yaml").write_text(GOOD, encoding="utf-8")

    def refuse(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)

    assert message_of("arm.yaml") == "arm.yaml: cannot be read: permission denied"


def test_file_names_that_no_system_has() -> None:
    assert message_of("arm\0.yaml") == r"arm\x00.yaml: this is not a file name"
    assert message_of("x" * 300).endswith("cannot be read: file name too long")
    assert message_of("\x1b[31m.yaml") == r"\x1b[31m.yaml: cannot be read: no such file or directory"
