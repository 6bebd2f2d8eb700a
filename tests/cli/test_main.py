"""The frame around all subcommands: help, errors, exit statuses, interruptions, colours."""

from __future__ import annotations

import contextlib
import io
import os
import signal
import subprocess
import sys
from pathlib import Path

import click
import pytest

import kinegen
from kinegen import cli
from kinegen.cli import main, terminal
from kinegen.errors import KinegenError
from tests.cli.commands import BAD, ROBOTS, TWO, start


@pytest.fixture
def failing(monkeypatch: pytest.MonkeyPatch) -> type[BaseException]:
    """`kinegen schema` raises what the test puts into this class's attribute."""

    class Failure(BaseException):
        raised: BaseException = RuntimeError("a bug")

    @click.command("schema")
    def command() -> None:
        raise Failure.raised

    from kinegen.cli import schema

    monkeypatch.setattr(schema, "command", command)
    return Failure


def test_help_lists_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0

    printed = capsys.readouterr().out
    assert [line.split()[0] for line in printed.split("Commands:\n")[1].splitlines()] == list(cli.COMMANDS)


@pytest.mark.parametrize("name", cli.COMMANDS)
def test_every_command_has_help(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([name, "--help"]) == 0
    assert capsys.readouterr().out.startswith(f"Usage: kinegen {name} ")


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"kinegen {kinegen.__version__}\n"


@pytest.mark.parametrize("line", ["", "shwo", "--frobnicate", "show", "show a b", "check", "build"])
def test_wrong_usage_exits_with_2(line: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(line.split()) == 2

    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("Usage: kinegen ")


def test_an_error_is_one_line_on_stderr(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "two.yaml"
    path.write_text(BAD, encoding="utf-8")

    assert main(["show", str(path)]) == 1

    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(f"error: {path}:10: joint 2 (slide): unknown key 'alhpa'")
    assert err.count("\n") == 1


def test_debug_adds_the_traceback(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "two.yaml"
    path.write_text(BAD, encoding="utf-8")

    assert main(["--debug", "check", str(path)]) == 1

    err = capsys.readouterr().err
    assert err.startswith("Traceback (most recent call last):")
    assert err.splitlines()[-1].startswith(f"error: {path}:10: ")


def test_a_missing_file_is_an_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", str(tmp_path / "none.yaml")]) == 1
    assert capsys.readouterr().err == f"error: {tmp_path / 'none.yaml'}: cannot be read: no such file or directory\n"


def test_a_bug_is_not_swallowed(failing: type[BaseException]) -> None:
    with pytest.raises(RuntimeError, match="a bug"):
        main(["schema"])


def test_an_error_without_a_file_is_one_line_too(
    failing: type[BaseException], capsys: pytest.CaptureFixture[str]
) -> None:
    failing.raised = KinegenError("the disk is full")  # type: ignore[attr-defined]

    assert main(["schema"]) == 1
    assert capsys.readouterr().err == "error: the disk is full\n"


def test_an_interruption_is_one_line_and_130(failing: type[BaseException], capsys: pytest.CaptureFixture[str]) -> None:
    failing.raised = KeyboardInterrupt()  # type: ignore[attr-defined]

    assert main(["schema"]) == 130
    assert capsys.readouterr() == ("", "interrupted\n")


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C is no signal there")
def test_ctrl_c_ends_a_build_and_leaves_the_folder_alone(tmp_path: Path) -> None:
    process = start("build", ROBOTS / "human_body.yaml", "-o", tmp_path / "out", "--no-compile", PYTHONUNBUFFERED="1")
    assert process.stdout
    while not process.stdout.readline().startswith("  load"):
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)

    assert (process.returncode, err) == (130, "interrupted\n")
    assert not (tmp_path / "out").exists()


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C is no signal there")
def test_ctrl_c_that_a_library_swallows_ends_the_build_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def swallowing(*_: object) -> None:
        with contextlib.suppress(BaseException):
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr("kinegen.build.derive_plain", swallowing)
    before = signal.getsignal(signal.SIGINT)

    assert main(["build", str(ROBOTS / "scara.yaml"), "-o", str(tmp_path / "out"), "--no-compile"]) == 130
    assert capsys.readouterr().err == "interrupted\n"
    assert not (tmp_path / "out").exists()
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.skipif(sys.platform == "win32", reason="pipes close otherwise there")
def test_a_closed_pipe_is_quiet() -> None:
    process = start("show", ROBOTS / "puma560.yaml")
    assert process.stdout
    # The reader goes away before anything is printed: sympy alone takes longer than this.
    process.stdout.close()
    process.wait(timeout=60)
    assert process.stderr

    assert (process.returncode, process.stderr.read()) == (141, "")
    process.stderr.close()


def test_a_terminal_that_lacks_a_character_gets_an_escape(tmp_path: Path) -> None:
    (tmp_path / "two.yaml").write_text(TWO.replace("Two joints", "Łódź"), encoding="utf-8")
    process = start("show", tmp_path / "two.yaml", PYTHONIOENCODING="latin-1", PYTHONUTF8="0")
    assert process.stdout
    first = process.stdout.readline()
    _, err = process.communicate(timeout=60)

    assert (process.returncode, err) == (0, "")
    assert first == "two: \\u0141ód\\u017a\n"


class Terminal(io.StringIO):
    """Something that says it is a terminal."""

    def isatty(self) -> bool:
        """It is."""
        return True


@pytest.mark.parametrize(
    ("stream", "environment", "expected"),
    [
        (Terminal(), {}, True),
        (Terminal(), {"NO_COLOR": ""}, True),
        (Terminal(), {"NO_COLOR": "1"}, False),
        (Terminal(), {"TERM": "dumb"}, False),
        (io.StringIO(), {}, False),
    ],
    ids=["terminal", "empty NO_COLOR", "NO_COLOR", "dumb", "file"],
)
def test_colours_are_for_terminals_that_want_them(
    stream: io.StringIO, environment: dict[str, str], expected: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(sys, "stdout", stream)
    start_of_stream = len(stream.getvalue())
    terminal.say(terminal.good("ok"))

    assert ("\x1b[" in stream.getvalue()[start_of_stream:]) == expected


def test_a_shell_is_told_what_completes_a_word() -> None:
    variables = {"_KINEGEN_COMPLETE": "bash_complete", "COMP_WORDS": "kinegen sc", "COMP_CWORD": "1"}
    process = start(**variables)
    out, err = process.communicate(timeout=60)

    assert (process.returncode, out, err) == (0, "plain,schema\n", "")


def test_lines_are_broken_before_signs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    formula = " + ".join(f"a{index}*c{index}" for index in range(10))
    first, *others = terminal.broken("px = ", formula)

    assert first.startswith("px = a0*c0 + a1*c1")
    assert len(first) <= 60
    assert [line[:7] for line in others] == ["     + "] * len(others)
    assert " ".join([first, *(line.strip() for line in others)]) == f"px = {formula}"


def test_lists_are_filled_to_the_width(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    lines = terminal.filled([f"q{index} joint" for index in range(12)], "  ")

    assert max(len(line) for line in lines) <= 60
    assert len(lines) == 2 + (sum(len(f"q{index} joint, ") for index in range(12)) > 2 * 58)
    assert all(line.startswith("  q") for line in lines)
    assert [line.endswith(",") for line in lines] == [True] * (len(lines) - 1) + [False]


def test_an_installed_command_calls_the_same_function() -> None:
    code = "from importlib.metadata import entry_points as e; print(e(group='console_scripts')['kinegen'].value)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=os.environ)

    assert done.stdout == "kinegen.cli:main\n"
