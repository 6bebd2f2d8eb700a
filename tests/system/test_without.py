"""kinegen works without what only some systems have, one thing after the other, and without all of it at once."""

from __future__ import annotations

import html
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from tests.builds.workshop import ARM, write_robot
from tests.system.without import LACKS

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(__file__).with_name("without.py")

CONSOLE = {"PYTHONIOENCODING": "cp1252", "PYTHONUTF8": "0", "PYTHONLEGACYWINDOWSSTDIO": "1", "LC_ALL": "C"}
"""A console that is not UTF-8."""


def run(names: str, *arguments: str | Path, place: Path, **variables: str) -> subprocess.CompletedProcess[bytes]:
    """Run the command line in a process that lacks something."""
    own = {"XDG_CACHE_HOME": str(place / "cache"), "TMPDIR": str(place), "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-W", "error", PROGRAM, names, *arguments]
    return subprocess.run(command, cwd=place, env={**os.environ, **own, **variables}, capture_output=True, check=False)


def built(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("name", ["", *LACKS])
def test_what_knows_of_systems_does_without(name: str, tmp_path: Path) -> None:
    """Files are written and exchanged, caches kept, outputs held, kernels called."""
    done = run(name, place=tmp_path)

    assert (done.returncode, done.stderr) == (0, b"")


def test_a_package_is_built_and_built_again_without_all_of_it(tmp_path: Path) -> None:
    """The second build exchanges files of the first one, and removes what is left over."""
    robot = write_robot(tmp_path / "in")
    command: Sequence[str | Path] = ("build", robot, "--no-compile", "--outputs", "pose", "-o", tmp_path / "out")
    first = run(",".join(LACKS), *command, "--real", "both", place=tmp_path)
    robot.write_text(ARM.replace("0.25", "0.125"), encoding="utf-8")
    before = built(tmp_path / "out")
    second = run(",".join(LACKS), *command, "--real", "double", place=tmp_path)
    folder = tmp_path / "out" / robot.stem

    assert (first.returncode, first.stderr) == (0, b"")
    assert (second.returncode, second.stderr) == (0, b"")
    assert "0.125" in (folder / "arm.c").read_text(encoding="utf-8")
    assert "arm/arm_f32.c" in before
    assert built(tmp_path / "out") == {name for name in before if "_f32" not in name}


def test_two_builds_keep_apart_where_folders_have_no_locks(tmp_path: Path) -> None:
    """The lock is then on a file elsewhere; nothing of it is in the folder."""
    code = (
        "import sys; sys.argv[1:] = ['open folders']\n"
        "from tests.system.without import LACKS; LACKS['open folders']()\n"
        "from pathlib import Path\n"
        "from kinegen.errors import WriteError\n"
        "from kinegen.support.system import held\n"
        "from kinegen.support.files.write import write_files\n"
        "folder = Path('out'); folder.mkdir()\n"
        "with held(folder) as alone:\n"
        "    try:\n"
        "        write_files(folder, {'a.txt': 'a'}, patience=0.1)\n"
        "    except WriteError as error:\n"
        "        print(alone, error)\n"
        "write_files(folder, {'a.txt': 'a'})\n"
        "print(sorted(path.name for path in folder.iterdir()))\n"
    )
    own = {"TMPDIR": str(tmp_path), "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env={**os.environ, **own},
        capture_output=True,
        text=True,
        check=True,
    )

    assert done.stdout.splitlines() == [
        "True another build is still writing to out; the earlier output is untouched",
        "['a.txt', 'kinegen-manifest.json']",
    ]


@pytest.mark.parametrize("command", ["show", "check", "inspect", "convert"])
def test_a_console_of_another_encoding_takes_what_is_printed(command: str, tmp_path: Path) -> None:
    text = ARM.replace("convention:", "description: Gelenkwinkel \u03b8 f\u00fcr \u041c\u0438\u0440\nconvention:", 1)
    robot = write_robot(tmp_path / "in", text)
    more = ["-o", tmp_path / "other.csv"] if command == "convert" else []
    done = run("pwd", command, robot, *more, place=tmp_path, **CONSOLE)

    assert (done.returncode, done.stderr) == (0, b""), done
    assert b"Traceback" not in done.stdout
    done.stdout.decode("cp1252")


def test_formulas_for_a_browser_mean_the_same_in_another_encoding(tmp_path: Path) -> None:
    robot = write_robot(tmp_path / "in")
    command = ("show", robot, "--format", "mathml")
    narrow, wide = (run("pwd", *command, place=tmp_path, **own) for own in (CONSOLE, {"PYTHONIOENCODING": "utf-8"}))

    assert b"&#" in narrow.stdout
    assert html.unescape(narrow.stdout.decode("cp1252")) == html.unescape(wide.stdout.decode("utf-8"))
