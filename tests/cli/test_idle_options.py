"""Options that none of a command's files takes are refused in one line."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.ui.cli import main
from tests.builds.workshop import ROBOTS

URDF = '<robot name="a"><link name="base"/><link name="tip"/><joint name="j" type="continuous"><parent link="base"/>'
URDF += '<child link="tip"/><axis xyz="0 0 1"/></joint></robot>'
YAML = str(ROBOTS / "puma560.yaml")


@pytest.mark.parametrize(
    ("option", "value", "formats"),
    [
        ("--snap", "1e-3", "URDF, xacro and MJCF"),
        ("--base", "foo", "URDF, xacro and MJCF"),
        ("--package-path", "a=b", "xacro"),
        ("--table", "standard,mm,deg", "CSV table"),
    ],
)
@pytest.mark.parametrize("command", ["check", "inspect"])
def test_a_yaml_file_refuses_what_it_does_not_take(
    command: str, option: str, value: str, formats: str, capsys: pytest.CaptureFixture[str]
) -> None:
    status = main([command, YAML, option, value])
    told = capsys.readouterr().err

    assert status != 0
    assert f"{option} is for {formats} files; {YAML} is a kinegen YAML file" in told


def test_a_table_refuses_to_snap(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "arm.csv"
    main(["convert", YAML, "-o", str(path)])

    assert main(["check", str(path), "--snap", "0.1deg"]) != 0
    assert "--snap is for URDF, xacro and MJCF files" in capsys.readouterr().err


def test_one_file_that_takes_an_option_is_enough(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(URDF, encoding="utf-8")
    back = tmp_path / "arm.yaml"
    main(["convert", str(path), "-o", str(back)])

    main(["compare", str(path), str(back), "--snap", "0"])
    assert "--snap is for" not in capsys.readouterr().err
    assert main(["check", str(path), "--tip", "tip", "--snap", "0"]) == 0
