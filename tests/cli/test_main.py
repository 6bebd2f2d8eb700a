"""The frame around all subcommands: help, errors, exit statuses, interruptions, colours."""

from __future__ import annotations

import contextlib
import gc
import io
import os
import pty
import signal
import subprocess
import sys
from pathlib import Path

import click
import pytest

import kinegen
from kinegen.errors import KinegenError
from kinegen.support.text_layout import broken
from kinegen.ui import cli
from kinegen.ui.cli import main, terminal
from kinegen.ui.cli.terminal import warn_of_cache
from tests.cli.commands import BAD, ROBOTS, ROOT, TWO, start


@pytest.fixture
def failing(monkeypatch: pytest.MonkeyPatch) -> type[BaseException]:
    """`kinegen schema` raises what the test puts into this class's attribute."""

    class Failure(BaseException):
        raised: BaseException = RuntimeError("a bug")

    @click.command("schema")
    def command() -> None:
        raise Failure.raised

    from kinegen.ui.cli import check

    monkeypatch.setattr(check, "schema_command", command)
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


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("shwo", "error: No such command 'shwo' (did you mean show?); see 'kinegen --help'"),
        ("bulid a.yaml", "error: No such command 'bulid' (did you mean build?); see 'kinegen --help'"),
        ("telemetry", "error: No such command 'telemetry'; see 'kinegen --help'"),
        (
            "build a --outputs pose,",
            "error: Invalid value for '--outputs': the name of an output is missing (expected a list ",
        ),
        ("--frobnicate", "error: No such option"),
        ("show", "error: Missing argument 'FILE'; see 'kinegen show --help'"),
        ("show a b", "error: Got unexpected extra argument (b); see 'kinegen show --help'"),
        ("check", "error: Missing argument 'FILE...'; see 'kinegen check --help'"),
        ("build a --real q7", "error: Invalid value for '--real': 'q7' is not one of 'double', 'float', 'both', "),
        (
            "build a --march x --portable",
            "error: --march and --portable exclude each other; see 'kinegen build --help'",
        ),
        ("build \x1b[31m --\x07", "error: No such option"),
        ("build a --table", "error: Option '--table' requires an argument; see 'kinegen build --help'"),
        (
            "show robots/scara.yaml --table standard,mm,deg",
            "error: --table is for CSV table files; robots/scara.yaml is a kinegen YAML file, and what it says is kept",
        ),
    ],
)
def test_wrong_usage_is_one_line_and_2(line: str, told: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(line.split()) == 2

    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(told)
    assert err.count("\n") == 1


def test_no_arguments_print_the_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 2
    assert capsys.readouterr().err.startswith("Usage: kinegen ")


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


@pytest.mark.parametrize("threshold", [0, 700, 500_000])
def test_a_command_collects_cycles_rarely_and_as_before_afterwards(
    threshold: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also after a bug; a process that collects none keeps to that."""
    from kinegen.ui.cli import check

    seen: list[int] = []

    @click.command("schema")
    def command() -> None:
        seen.append(gc.get_threshold()[0])
        raise RuntimeError("a bug")

    monkeypatch.setattr(check, "schema_command", command)
    before = gc.get_threshold()
    gc.set_threshold(threshold, *before[1:])
    try:
        with pytest.raises(RuntimeError, match="a bug"):
            main(["schema"])
        assert gc.get_threshold() == (threshold, *before[1:])
    finally:
        gc.set_threshold(*before)
    assert seen == [max(threshold, 100_000) if threshold else 0]


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
    """What is being done is on stderr, where that is a terminal."""
    ours, theirs = pty.openpty()
    command = [
        sys.executable,
        "-m",
        "kinegen",
        "build",
        ROBOTS / "human_body.yaml",
        "-o",
        tmp_path / "out",
        "--no-compile",
    ]
    with subprocess.Popen(
        command, cwd=ROOT, env=os.environ | {"TERM": "xterm"}, stdout=subprocess.DEVNULL, stderr=theirs
    ) as process:
        os.close(theirs)
        written = b""
        while b": derive" not in written:
            written += os.read(ours, 4096)
        process.send_signal(signal.SIGINT)
        with contextlib.suppress(OSError):  # how Linux reports that the other end is closed
            while part := os.read(ours, 4096):
                written += part
        assert process.wait(timeout=60) == 130
    os.close(ours)

    assert written.endswith(b"\r\x1b[Kinterrupted\r\n")
    assert not (tmp_path / "out").exists()


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C is no signal there")
def test_ctrl_c_that_a_library_swallows_ends_the_build_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def swallowing(*_: object) -> None:
        with contextlib.suppress(BaseException):
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr("kinegen.driver.pipeline.plain_count", swallowing)
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


HEAVY = ("show", ROBOTS / "scara.yaml")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no full device here")
@pytest.mark.parametrize("arguments", [HEAVY, ("--help",), ("check", ROBOTS / "scara.yaml"), ("schema",)])
def test_a_full_stdout_is_one_line(arguments: tuple[str | Path, ...]) -> None:
    """Nothing more follows when Python ends and writes what is left."""
    with Path("/dev/full").open("w") as full:
        command = [sys.executable, "-m", "kinegen", *map(str, arguments)]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False, cwd=ROBOTS.parent)

    assert done.returncode == 1
    assert done.stderr.removeprefix("error: ").removeprefix("cannot print: ") == "No space left on device\n"


@pytest.mark.skipif(os.name != "posix", reason="streams are closed so by shells of POSIX")
@pytest.mark.parametrize("closing", [">&-", "2>&-", ">&- 2>&-", "<&- >&- 2>&-"])
def test_closed_streams_are_streams_that_lead_nowhere(closing: str, tmp_path: Path) -> None:
    """No file that is opened later takes their place."""
    command = f"{sys.executable} -m kinegen build {ROBOTS}/scara.yaml -o {tmp_path}/out --no-compile {closing}"
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=False, cwd=ROBOTS.parent)

    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "out" / "scara" / "scara.c").read_text(encoding="utf-8").startswith("/*")


@pytest.mark.skipif(sys.platform != "linux", reason="the limit works so on Linux")
@pytest.mark.parametrize("megabytes", [100, 150, 200, 250, 300])
@pytest.mark.parametrize("name", ["check", "build"])
def test_too_little_memory_is_told_in_a_line(name: str, megabytes: int, tmp_path: Path) -> None:
    """Where libraries end the process themselves, their words are their own; ours are no traceback."""
    rest = f"-o {tmp_path}/out --no-compile" if name == "build" else ""
    command = f"ulimit -v {megabytes}000; exec {sys.executable} -m kinegen {name} {ROBOTS}/scara.yaml {rest}"
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path), "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(
        ["bash", "-c", command], capture_output=True, text=True, check=False, cwd=ROBOTS.parent, env=environment
    )

    assert "Traceback" not in done.stderr
    if done.returncode == 1 and "OpenBLAS" not in done.stderr:
        assert done.stderr.startswith("error: there is not enough memory, or a limit on memory or threads is too low")
        assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    "failure",
    [
        MemoryError(),
        RuntimeError("can't start new thread"),
        ImportError("x.so: failed to map segment from shared object"),
        OSError(12, "Cannot allocate memory"),
    ],
)
def test_memory_that_runs_out_is_told_in_a_line(
    failure: BaseException, failing: type[BaseException], capsys: pytest.CaptureFixture[str]
) -> None:
    failing.raised = failure  # type: ignore[attr-defined]

    assert main(["schema"]) == 1
    assert capsys.readouterr().err == (
        "error: there is not enough memory, or a limit on memory or threads is too low (see ulimit -a)\n"
    )


NASTY = "esc\x1b[31m\x1b]0;PWN\x07\u202e\nerror: x.yaml: ok.yaml"


@pytest.mark.skipif(os.name != "posix", reason="other systems have no such names")
def test_control_characters_of_names_are_escaped_wherever_they_are_printed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A name can neither paint nor forge a line."""
    robot, broken, output = tmp_path / NASTY, tmp_path / f"2{NASTY}", tmp_path / f"out{NASTY}"
    robot.write_text(TWO, encoding="utf-8")
    broken.write_text(BAD, encoding="utf-8")
    blocked = tmp_path / f"blocked{NASTY}"
    blocked.write_text("", encoding="utf-8")
    lines = [
        ("check", robot),
        ("check", robot, broken),
        ("inspect", robot),
        ("inspect", robot, broken),
        ("show", broken),
        ("build", robot, "-o", output, "--no-compile"),
        ("build", robot, robot, broken, "-o", output, "--no-compile"),
        ("build", robot, "-o", blocked, "--no-compile"),
        ("workspace", robot, "--samples", "1000", "--slices", tmp_path / f"{NASTY}.svg"),
        ("workspace", robot, "--samples", "1000", "--slices", tmp_path / f"{NASTY}.jpg"),
        ("fk", broken, "0", "0"),
        ("build", robot, f"--{NASTY}"),
    ]
    for line in lines:
        main([*map(str, line)])
        out, err = capsys.readouterr()

        assert "PWN" in out + err, line
        assert not set(out + err) & set("\x1b\x07\u202e"), line
        assert not any(words.startswith("error: x.yaml") for words in (out + err).splitlines()), line


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
    first, *others = broken("px = ", formula, terminal.width())

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

    assert done.stdout == "kinegen.ui.cli:main\n"


@pytest.mark.skipif(os.name != "posix", reason="modes are of POSIX")
def test_a_cache_that_others_may_write_to_is_told_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    (tmp_path / "kinegen").mkdir()
    (tmp_path / "kinegen").chmod(0o777)
    warn_of_cache.cache_clear()
    files = []
    for name in ("one", "two"):
        files.append(tmp_path / f"{name}.yaml")
        files[-1].write_text(TWO.replace("name: two", f"name: {name}"), encoding="utf-8")

    assert main(["build", *map(str, files), "-o", str(tmp_path / "out"), "--no-compile"]) == 0

    assert capsys.readouterr().err == (
        f"warning: the cache {tmp_path / 'kinegen'} is not used, since other users may write to it; delete it, and it "
        "is created again\n"
    )
    assert not list((tmp_path / "kinegen").iterdir())


@pytest.mark.parametrize(("command", "left_out"), [("check", {"numpy", "sympy"}), ("show", {"numpy"})])
def test_small_commands_import_no_library_that_they_do_not_use(command: str, left_out: set[str]) -> None:
    code = f"import sys; from kinegen.ui.cli import main; main(['{command}', 'robots/scara.yaml']); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)

    assert not left_out & set(done.stdout.splitlines()[-1].split())
