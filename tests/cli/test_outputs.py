"""Outputs of all commands: nothing that kinegen did not write is replaced, and that is known before the work."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from kinegen.errors import WriteError
from kinegen.support.files.manifest import MARKS, is_sealed, other_kind, sealed
from kinegen.support.files.write import check_files, write_files
from kinegen.tools.wheels.build import archive, is_own
from kinegen.ui.cli import COMMANDS, command_of, main
from tests.cli.commands import ROOT, TWO

WRITES = {"output", "write", "slices", "cloud", "plot"}
"""Names of options that name what is written."""

MINE = b"mine\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to be in, with a robot file of two joints and joint vectors for it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "two.yaml").write_text(TWO, encoding="utf-8")
    np.save(tmp_path / "q.npy", np.zeros((3, 2)))
    return tmp_path


def never(*_: object, **__: object) -> None:
    """Stands for the work of a command."""
    raise AssertionError("this is the work")


def test_every_command_that_writes_asks_for_force() -> None:
    found = {}
    for name in (each for each in COMMANDS if each != "show"):  # its --output is what it prints
        names = {each.name for each in command_of(name).params}
        if names & WRITES:
            found[name] = "force" in names

    assert {"build", "view", "convert", "eval", "doctor", "calibrate", "prove", "workspace"} <= found.keys()
    assert all(found.values())


@pytest.mark.parametrize(
    ("words", "work"),
    [
        ("view two.yaml -o mine.html", "kinegen.ui.cli.view._write_page"),
        ("view two.yaml -o mine.svg", "kinegen.ui.cli.view.write_picture"),
        ("convert two.yaml -o mine.yaml", "kinegen.ui.cli.convert._write"),
        ("doctor two.yaml --pose 0 --write mine.yaml", "kinegen.ui.cli.measurements._observed"),
        ("calibrate two.yaml measured.csv -o mine.yaml", "kinegen.tools.calibrate.run.calibrate"),
        ("calibrate two.yaml measured.csv --plot mine.svg", "kinegen.tools.calibrate.run.calibrate"),
        ("workspace two.yaml --slices mine.png", "kinegen.ui.cli.workspace._study"),
        ("workspace two.yaml --cloud mine.npz", "kinegen.ui.cli.workspace._study"),
        ("workspace two.yaml --cloud mine.parquet", "kinegen.ui.cli.workspace._study"),
        ("eval two.yaml q.npy -o mine.parquet", "kinegen.tools.datasets.run.compiled"),
        ("eval two.yaml q.npy -o mine.zarr", "kinegen.tools.datasets.run.compiled"),
    ],
)
def test_a_file_of_the_user_is_refused_before_the_work(
    words: str, work: str, folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    arguments = words.split()
    path = folder / arguments[-1]
    path.write_bytes(MINE)
    place, _, name = work.rpartition(".")
    monkeypatch.setattr(importlib.import_module(place), name, never)

    assert main(arguments) == 1

    errors = capsys.readouterr().err
    assert errors.count("\n") == 1
    assert errors.startswith(f"error: {path.name}: ")
    assert "choose another name, or overwrite it with --force" in errors
    assert path.read_bytes() == MINE
    with pytest.raises(AssertionError, match="this is the work"):
        main([*arguments, "--force"])


def test_an_input_is_never_replaced_even_with_force(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "link.npz").symlink_to("two.yaml")
    for arguments in (
        ["workspace", "two.yaml", "--cloud", "link.npz", "--force"],
        ["workspace", "two.yaml", "--limits-from", "q.npz", "--cloud", "q.npz", "--force"],
        ["calibrate", "two.yaml", "measured.svg", "--plot", "measured.svg", "--force"],
    ):
        assert main(arguments) == 1
        assert "this is an input, which is never overwritten" in capsys.readouterr().err


def test_the_folder_of_a_build_is_looked_at_before_the_work(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("kinegen.driver.pipeline._compile", never)
    (folder / "file").write_bytes(MINE)
    (folder / "own" / "two").mkdir(parents=True)
    (folder / "own" / "two" / "two.c").write_bytes(MINE)
    (folder / "listed" / "two").mkdir(parents=True)
    write_files(folder / "listed" / "two", {"two.h": "as it was\n"})
    (folder / "listed" / "two" / "two.h").write_bytes(MINE)
    for place, words in (
        ("file", "two: Not a directory; the earlier output is untouched"),
        ("file/below", "two: Not a directory; the earlier output is untouched"),
        ("own", "two.c was not written by kinegen, or changed since"),
        ("listed", "two.h was not written by kinegen, or changed since"),
    ):
        assert main(["build", "two.yaml", "-o", place]) == 1
        errors = capsys.readouterr().err
        assert words in errors
        assert errors.count("\n") == 1
    for options in (["-o", "own", "--force"], ["-o", "new"]):
        with pytest.raises(AssertionError, match="this is the work"):
            main(["build", "two.yaml", *options])
    assert (folder / "own" / "two" / "two.c").read_bytes() == MINE


def test_a_build_does_not_remove_a_package_of_another_kind(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """As in a checkout where the library is committed, and somebody builds without options."""
    build = ["build", "two.yaml", "-o", ".", "--outputs", "position", "--real", "float", "--no-compile"]
    assert main([*build, "--package", "platformio"]) == 0
    before = {path: path.read_bytes() for path in (folder / "two").rglob("*") if path.is_file()}
    capsys.readouterr()

    assert main(build) == 1
    errors = capsys.readouterr().err
    assert "two holds a PlatformIO library, which would lose " in errors
    assert "choose another folder, or replace it with --force; nothing was written" in errors
    assert errors.count("\n") == 1
    assert {path: path.read_bytes() for path in (folder / "two").rglob("*") if path.is_file()} == before

    assert main([*build, "--force"]) == 0
    assert not (folder / "two" / "library.json").exists()
    assert main(build) == 0


def test_a_forced_package_takes_the_place_of_one_of_another_kind_as_a_whole(tmp_path: Path) -> None:
    folder = tmp_path / "arm"
    write_files(folder, {"sim/moves.ngc": "G1\n", "Makefile": "all:\n", "README.md": "one\n", "arm_glue.c": "int a;\n"})
    (folder / "arm_glue.c").write_bytes(MINE)
    (folder / "notes.txt").write_bytes(MINE)

    write_files(folder, {"printer.cfg": "[printer]\n", "README.md": "two\n"}, force=True)

    left = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    assert left == {"printer.cfg", "README.md", "kinegen-manifest.json", "arm_glue.c", "notes.txt"}


def test_kinds_that_share_a_folder_lose_nothing_to_each_other() -> None:
    python, cmake = ["__init__.py", "arm.c"], ["examples/pose.c", "README.md"]
    assert other_kind([], python, []) == ""
    assert other_kind(python, python, ["arm.c", "javascript/arm.js"]) == ""
    assert other_kind(python, cmake, []) == ""
    assert other_kind(python, cmake, ["arm.c"]) == "a Python package"
    assert other_kind([*python, *cmake], cmake, ["README.md"]) == ""
    assert other_kind([*python, *cmake], python, ["examples/pose.c"]) == "a CMake library"
    assert other_kind(["report.json", "report.txt"], python, ["report.txt"]) == "the evidence of kinegen prove"
    assert len(set(MARKS.values())) == len(MARKS)


def test_what_a_folder_would_refuse_is_known_without_writing(tmp_path: Path) -> None:
    write_files(tmp_path / "arm", {"__init__.py": "", "arm.c": "old\n"})
    before = {path.name: path.read_bytes() for path in (tmp_path / "arm").iterdir()}
    evidence = {"report.json": "{}"}
    with pytest.raises(WriteError, match=r"holds a Python package, which would lose 2 files such as __init__\.py"):
        check_files(tmp_path / "arm", evidence, stale=lambda _: True)
    check_files(tmp_path / "arm", evidence, stale=lambda _: True, force=True)
    check_files(tmp_path / "arm", evidence)
    check_files(tmp_path / "none", evidence)

    assert {path.name: path.read_bytes() for path in (tmp_path / "arm").iterdir()} == before
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize("suffix", [".html", ".svg", ".pdf", ".png"])
def test_a_seal_holds_for_what_it_was_made_for(suffix: str, tmp_path: Path) -> None:
    png = b"\x89PNG\r\n\x1a\n" + bytes(40) + bytes.fromhex("0000000049454e44ae426082")
    content = png if suffix == ".png" else b"<svg>\n</svg>\n"
    path, whole = tmp_path / f"a{suffix}", sealed(content, suffix)
    path.write_bytes(whole)

    assert is_sealed(path)
    assert len(whole) > len(content)
    for place in (0, 5, len(content) - 1, len(content) + 8, len(whole) - 1):
        altered = bytearray(whole)
        altered[place] ^= 1
        path.write_bytes(altered)
        assert not is_sealed(path)
    for other in (b"", content, whole + b"\n", whole[:-1]):
        path.write_bytes(other)
        assert not is_sealed(path)


def test_pictures_with_a_seal_are_pictures_and_are_replaced(folder: Path) -> None:
    for name in ("arm.svg", "arm.png", "arm.pdf"):
        assert main(["view", "two.yaml", "-o", name]) == 0
        assert is_sealed(folder / name)
        assert main(["view", "two.yaml", "-o", name, "--size", "3"]) == 0
    from matplotlib.image import imread

    assert imread(folder / "arm.png").ndim == 3
    (folder / "arm.svg").write_bytes((folder / "arm.svg").read_bytes().replace(b"<svg", b"<svg class='mine'", 1))
    assert main(["view", "two.yaml", "-o", "arm.svg"]) == 1


def test_a_wheel_is_known_by_what_it_holds(tmp_path: Path) -> None:
    info = "two-0.1.dist-info"
    about = b"Wheel-Version: 1.0\nGenerator: kinegen 0.1\n"
    (tmp_path / "own.whl").write_bytes(archive({"two/__init__.py": b"", f"{info}/WHEEL": about}, info))
    other = about.replace(b"kinegen", b"hatchling")
    (tmp_path / "other.whl").write_bytes(archive({"two/__init__.py": b"", f"{info}/WHEEL": other}, info))
    (tmp_path / "edited.whl").write_bytes((tmp_path / "own.whl").read_bytes())
    with zipfile.ZipFile(tmp_path / "edited.whl", "a") as opened:
        opened.writestr("two/more.py", "mine")
    (tmp_path / "no.whl").write_bytes(MINE)

    assert [is_own(tmp_path / f"{name}.whl") for name in ("own", "other", "edited", "no", "none")] == [
        True,
        False,
        False,
        False,
        False,
    ]


def test_a_build_whose_reader_went_away_writes_its_package(folder: Path) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    try:
        ended = subprocess.run(
            [sys.executable, "-m", "kinegen", "build", "two.yaml", "-o", "out", "--no-compile", "--real", "float"],
            cwd=folder,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            stdout=writing,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    finally:
        os.close(writing)

    assert (ended.returncode, ended.stderr) == (0, "")
    assert (folder / "out" / "two" / "kinegen-manifest.json").exists()
