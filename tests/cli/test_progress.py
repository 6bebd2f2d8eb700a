"""What a person at a terminal sees while a build takes its time, and nobody else does."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
from pathlib import Path

import pytest

from kinegen.driver import pipeline as building
from kinegen.driver.results import BuildOptions
from tests.cli.commands import ROBOTS, TWO

CLEARED = "\r\x1b[K"


def on_terminal(folder: Path, *arguments: str, term: str = "xterm") -> str:
    """What `kinegen build` writes where stdout and stderr are one terminal."""
    (folder / "two.yaml").write_text(TWO, encoding="utf-8")
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "kinegen", "build", str(folder / "two.yaml"), "--no-compile", *arguments]
    environment = os.environ | {"TERM": term, "XDG_CACHE_HOME": str(folder / "cache")}
    with subprocess.Popen(
        [*command, "-o", str(folder / "out")], stdin=theirs, stdout=theirs, stderr=theirs, env=environment
    ) as process:
        os.close(theirs)
        written = b""
        while True:
            try:
                part = os.read(ours, 4096)
            except OSError:  # how Linux reports that the other end is closed
                break
            if not part:
                break
            written += part
        assert process.wait() == 0, written.decode()
    os.close(ours)
    return written.decode()


def test_a_terminal_shows_which_output_is_derived(tmp_path: Path) -> None:
    written = on_terminal(tmp_path, "--outputs", "pose,jacobian")

    assert f"{CLEARED}  two.yaml: derive pose (1 of 2){CLEARED}  two.yaml: derive jacobian (2 of 2){CLEARED}" in written
    assert f"{CLEARED}  two.yaml: lower jacobian (2 of 2){CLEARED}" in written
    assert f"{CLEARED}  two.yaml: verify every output in every way to call it{CLEARED}" in written


def test_what_passed_is_gone_before_a_stage_is_reported(tmp_path: Path) -> None:
    written = on_terminal(tmp_path)

    for line in written.replace("\r\n", "\n").split("\n"):
        shown = line.rpartition(CLEARED)[2]
        assert " of 3)" not in shown
        assert "verify every" not in shown


@pytest.mark.parametrize(("arguments", "term"), [(("--json",), "xterm"), ((), "dumb")])
def test_machines_and_plain_terminals_get_no_passing_line(
    tmp_path: Path, arguments: tuple[str, ...], term: str
) -> None:
    written = on_terminal(tmp_path, *arguments, term=term)

    assert "\x1b[K" not in written
    assert "derive pose (" not in written


def test_a_pipe_gets_no_passing_line(tmp_path: Path) -> None:
    (tmp_path / "two.yaml").write_text(TWO, encoding="utf-8")
    command = [sys.executable, "-m", "kinegen", "build", "two.yaml", "--no-compile", "-o", "out"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)

    assert done.stderr == ""
    assert "\r" not in done.stdout


def test_a_build_says_what_begins(tmp_path: Path) -> None:
    begun: list[str] = []
    building.build(ROBOTS / "planar_3r.yaml", BuildOptions(output=tmp_path, compile=False), str, begun.append)

    derived = [work for work in begun if work.startswith("derive ")]
    assert derived[:3] == ["derive pose (1 of 3)", "derive frames (2 of 3)", "derive position (3 of 3)"]
    assert [work.split()[0] for work in begun if " of " not in work][:2] == ["load", "derive"]
