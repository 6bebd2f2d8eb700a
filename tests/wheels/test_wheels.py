"""`kinegen build --package wheel`: what pip installs, where it runs, and that its self-test finds faults."""

from __future__ import annotations

import base64
import csv
import hashlib
import json
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from packaging.tags import sys_tags
from packaging.utils import parse_wheel_filename

from kinegen.backends.python.vendored import SHARED
from kinegen.errors import MissingToolError
from kinegen.runtime.compiler import find_compiler
from kinegen.tools.wheels.build import platform_tag
from kinegen.ui.cli import main
from tests.cli.commands import ROBOTS, TWO


def wheels(folder: Path, *arguments: str | Path) -> dict[str, Path]:
    """The wheels of a call that succeeds, by whether they are for `any` system."""
    assert main(["build", "--package", "wheel", "-o", str(folder), *map(str, arguments)]) == 0
    return {"any" if path.stem.endswith("-any") else "here": path for path in folder.glob("*.whl")}


def installed(wheel: Path, folder: Path) -> Path:
    """A wheel as pip unpacks it."""
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--no-index", "--no-deps", "--no-compile"]
    subprocess.run([*command, "--target", str(folder), str(wheel)], check=True, capture_output=True)
    return folder


def selftest(folder: Path, name: str) -> subprocess.CompletedProcess[str]:
    """The self-test of an installed robot, elsewhere than in this checkout."""
    environment = {**os.environ, "PYTHONPATH": str(folder), "PYTHONWARNINGS": "ignore", "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-m", name]
    return subprocess.run(command, env=environment, cwd=folder, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The wheels of a small robot, compiled."""
    try:
        find_compiler()
    except MissingToolError:
        pytest.skip("needs a C compiler")
    folder = tmp_path_factory.mktemp("two")
    (folder / "two.yaml").write_text(TWO, encoding="utf-8")
    return wheels(folder, folder / "two.yaml", "--outputs", "pose,jacobian")


def test_pip_takes_the_wheel_of_this_system(two: dict[str, Path], tmp_path: Path) -> None:
    tags = parse_wheel_filename(two["here"].name)[3]

    assert tags & set(sys_tags())
    assert {(tag.interpreter, tag.abi) for tag in tags} == {("cp310", "abi3")}
    done = selftest(installed(two["here"], tmp_path), "two")
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.fullmatch(r"(two: float(64|32), backend c, 2 functions: passed\n){2}", done.stdout)


def test_the_other_wheel_has_no_extension(two: dict[str, Path], tmp_path: Path) -> None:
    with zipfile.ZipFile(two["any"]) as opened:
        assert not [name for name in opened.namelist() if name.endswith(".so")]
        about = opened.read(next(name for name in opened.namelist() if name.endswith("/WHEEL"))).decode()

        modules = {name for name in opened.namelist() if name.startswith("two/_runtime/")}

    assert {f"two/_runtime/{name}" for name in SHARED} < modules
    assert "Root-Is-Purelib: true" in about
    assert "Tag: py3-none-any" in about
    assert "backend numpy" in selftest(installed(two["any"], tmp_path), "two").stdout


@pytest.mark.parametrize("kind", ["here", "any"])
def test_the_record_lists_every_file(two: dict[str, Path], kind: str) -> None:
    with zipfile.ZipFile(two[kind]) as opened:
        record = next(name for name in opened.namelist() if name.endswith("/RECORD"))
        rows = {row[0]: row[1:] for row in csv.reader(opened.read(record).decode().splitlines())}
        assert set(rows) == set(opened.namelist())
        for name in set(rows) - {record}:
            content = opened.read(name)
            digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
            assert rows[name] == [f"sha256={digest}", str(len(content))]


def test_the_same_robot_gives_the_same_bytes(two: dict[str, Path], tmp_path: Path) -> None:
    (tmp_path / "two.yaml").write_text(TWO, encoding="utf-8")
    again = wheels(tmp_path, tmp_path / "two.yaml", "--outputs", "pose,jacobian")

    assert {kind: path.read_bytes() for kind, path in again.items()} == {
        kind: path.read_bytes() for kind, path in two.items()
    }


@pytest.mark.parametrize(
    "robot",
    ["calibrated_2r", "scara", *(pytest.param(name, marks=pytest.mark.long) for name in ("hand", "panda_joint_7"))],
)
def test_the_self_test_holds_for_trees_parameters_and_slides(robot: str, tmp_path: Path) -> None:
    outputs = "pose,jacobian" if robot in ("hand", "calibrated_2r") else "pose,inverse"
    made = wheels(tmp_path, ROBOTS / f"{robot}.yaml", "--no-compile", "--outputs", outputs)

    assert set(made) == {"any"}
    done = selftest(installed(made["any"], tmp_path / "site"), robot)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "backend numpy" in done.stdout


@pytest.mark.parametrize("function", ["fk", "inverse"])
@pytest.mark.parametrize(("wanted", "other"), [(" + ", " - "), (" * ", " + ")])
def test_the_self_test_finds_a_wrong_kernel(function: str, wanted: str, other: str, tmp_path: Path) -> None:
    made = wheels(tmp_path, ROBOTS / "planar_3r.yaml", "--no-compile", "--outputs", "pose,inverse")
    site = installed(made["any"], tmp_path / "site")
    assert selftest(site, "planar_3r").returncode == 0
    source = site / "planar_3r" / "_numpy.py"
    head, name, body = source.read_text(encoding="utf-8").partition(f"\ndef {function}(")
    altered, count = re.subn(rf"(?m)^(    \w+ = [^#\n]*?){re.escape(wanted)}", rf"\1{other}", body)
    assert count > 1
    source.write_text(head + name + altered, encoding="utf-8")
    done = selftest(site, "planar_3r")

    assert done.returncode == 1, done.stdout + done.stderr
    assert f"FAILED: {function}" in done.stdout


def test_several_robots_in_one_wheel(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = [ROBOTS / "planar_joint.yaml", ROBOTS / "planar_3r.yaml"]
    arguments = ["--no-compile", "--bundle", "Plane-Arms", "--json"]
    made = wheels(tmp_path, *files, *arguments)["any"]
    document = json.loads(capsys.readouterr().out)
    site = installed(made, tmp_path / "site")

    assert document["wheels"] == [str(made)]
    assert [build["ok"] for build in document["builds"]] == [True, True]
    assert made.name.startswith("plane_arms-0.")
    assert parse_wheel_filename(made.name)[0] == "plane-arms"
    assert [selftest(site, name).returncode for name in ("planar_joint", "planar_3r")] == [0, 0]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--package", "wheel", "two.yaml", "planar.yaml"], "2 robots in one wheel need a name for it: --bundle NAME"),
        (["--package", "wheel", "two.yaml", "--bundle", "../up"], "'../up' is not a name of a wheel"),
        (
            ["--package", "wheel", "two.yaml", "planar.yaml", "--bundle", "x", "--no-compile"],
            "two robots are called 'two'",
        ),
        (["--bundle", "x", "two.yaml"], "--bundle is the name of a wheel, so it needs --package wheel"),
        (["--package", "wheel", "two.yaml", "--march", "native"], "--march and --package wheel exclude each other"),
        (["--package", "wheel", "two.yaml", "--languages", "rust"], "--package writes no other languages"),
        (["--package", "wheel", "two.yaml", "--real", "q30"], "--real q30 and --package wheel exclude each other"),
    ],
)
def test_a_wrong_call_is_one_line_and_writes_nothing(
    arguments: list[str],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("two.yaml", "planar.yaml"):
        Path(name).write_text(TWO, encoding="utf-8")

    assert main(["build", *arguments]) != 0
    assert message in capsys.readouterr().err.splitlines()[-1]
    assert not Path("dist").exists()


def test_without_a_compiler_the_other_wheel_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    Path("two.yaml").write_text(TWO, encoding="utf-8")

    assert main(["build", "--package", "wheel", "two.yaml"]) == 1
    assert "--no-compile makes the wheel that computes with NumPy" in capsys.readouterr().err
    assert not Path("dist").exists()


LINUX = sys.platform == "linux"


@pytest.mark.skipif(not LINUX, reason="tags of Linux")
@pytest.mark.parametrize(
    ("names", "tag"),
    [
        (["libc.so.6", "GLIBC_2.2.5", "GLIBC_2.34"], "manylinux_2_34"),
        (["libc.so.6", "GLIBC_2.2.5"], "manylinux_2_"),
        (["libc.so.6", "libtbb.so.12", "GLIBC_2.2.5"], "linux_"),
        (["libc.musl-x86_64.so.1"], "linux_"),
    ],
)
def test_the_tag_follows_from_the_c_library(names: list[str], tag: str) -> None:
    content = b"\x7fELF\0" + b"\0".join(name.encode() for name in names) + b"\0"

    assert platform_tag([content]).startswith(f"cp310-abi3-{tag}")
