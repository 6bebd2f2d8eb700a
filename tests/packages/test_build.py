"""`kinegen build --package`: where the package goes, what it holds by default, what an earlier one leaves behind."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import pytest

from kinegen.backends.firmware.ecosystem import Ecosystem
from kinegen.backends.scalar_types import ScalarType
from kinegen.support.files.manifest import MANIFEST
from kinegen.support.naming import Q30
from kinegen.ui.cli import main
from tests.emit.emitted import ROOT
from tests.packages.packages import project

SCARA = str(ROOT / "robots" / "scara.yaml")


def build(*options: str) -> None:
    """Build without a compiler, which these tests do not need, what `project` holds."""
    assert main(["build", SCARA, "--no-compile", "--outputs", "pose,frames,position", *options]) == 0


def files(folder: Path) -> dict[str, str]:
    """Every file below a folder but the list of them, by path."""
    paths = sorted(path for path in folder.rglob("*") if path.is_file() and path.name != MANIFEST)
    return {path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8") for path in paths}


@pytest.mark.parametrize(
    ("name", "folder", "reals"),
    [
        ("cmake", "external", (ScalarType.DOUBLE, ScalarType.FLOAT)),
        ("platformio", "lib", (ScalarType.FLOAT,)),
        ("arduino", "libraries", (ScalarType.FLOAT,)),
        ("esp-idf", "components", (ScalarType.FLOAT,)),
    ],
)
def test_it_goes_where_such_a_project_looks(
    name: str, folder: str, reals: tuple[ScalarType, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)

    build("--package", name)

    assert files(tmp_path / folder / "scara") == dict(project("scara", Ecosystem(name), reals))
    assert [path.name for path in tmp_path.iterdir()] == [folder]


def test_folder_and_number_types_can_be_named(tmp_path: Path) -> None:
    build("--package", "esp-idf", "-o", str(tmp_path / "here"), "--real", "double")

    assert files(tmp_path / "here" / "scara") == dict(project("scara", Ecosystem.ESP_IDF, (ScalarType.DOUBLE,)))


@pytest.mark.parametrize(("real", "reals"), [("q30", (Q30,)), ("float,q30", (ScalarType.FLOAT, Q30))])
def test_packages_of_integers_have_them_alone_or_beside_others(
    real: str, reals: tuple[str, ...], tmp_path: Path
) -> None:
    """With a compiler, so that they are proved first; the list has a digest of each file."""
    assert main(["build", SCARA, "--package", "arduino", "-o", str(tmp_path), "--real", real]) == 0
    held = files(tmp_path / "scara")
    listed = json.loads((tmp_path / "scara" / MANIFEST).read_text(encoding="utf-8"))["files"]

    assert held == dict(project("scara", Ecosystem.ARDUINO, reals))
    assert listed == {path: hashlib.sha256(text.encode()).hexdigest() for path, text in held.items()}


def test_kernels_of_another_number_type_do_not_stay_where_they_would_be_compiled(tmp_path: Path) -> None:
    build("--package", "arduino", "-o", str(tmp_path), "--real", "both")
    (tmp_path / "scara" / "src" / "mine.c").write_text("int mine;\n")
    (tmp_path / "scara" / "mine.txt").write_text("mine\n")

    build("--package", "arduino", "-o", str(tmp_path))

    kept = {"src/mine.c": "int mine;\n", "mine.txt": "mine\n"}
    assert files(tmp_path / "scara") == dict(project("scara", Ecosystem.ARDUINO)) | kept


def test_a_package_leaves_a_python_package_in_the_same_folder_alone(tmp_path: Path) -> None:
    build("-o", str(tmp_path))
    before = files(tmp_path / "scara")

    build("--package", "cmake", "-o", str(tmp_path))

    assert before.items() <= files(tmp_path / "scara").items()


def test_fewer_outputs_give_a_package_of_those(tmp_path: Path) -> None:
    build("--package", "platformio", "-o", str(tmp_path), "--outputs", "position")
    held = files(tmp_path / "scara")

    assert "scara_f32_position(q, base_p_tool);" in held["examples/pose/pose.cpp"]
    assert "scara_f32_fk" not in "".join(held.values())


def test_json_names_every_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    build("--package", "cmake", "-o", str(tmp_path), "--json")
    record = json.loads(capsys.readouterr().out)["builds"][0]

    assert {file["path"] for file in record["files"]} == {
        str(tmp_path / "scara" / path) for path in (*project("scara", Ecosystem.CMAKE), MANIFEST)
    }


def test_an_unknown_kind_of_project_is_named_with_those_that_are_known(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["build", SCARA, "--package", "zephyr"]) == 2

    told = capsys.readouterr().err
    assert "'zephyr' is not one of 'cmake', 'platformio', 'arduino', 'esp-idf'" in told
