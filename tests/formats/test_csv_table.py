"""DH tables as CSV: columns by header, cells as exact expressions, meaning by option."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.errors import RobotFileError
from kinegen.io.format import ReadOptions
from kinegen.io.load import load_with_report, loads
from kinegen.model.robot import Convention, JointType
from kinegen.ui.cli import main

YAML = """\
kinegen: 1
name: table
convention: standard
units: {length: mm, angle: deg}
joints:
  - {name: waist, theta: q + 90, d: 0, a: 0, alpha: 90, limits: [-160, 160]}
  - {name: slide, theta: 0, d: q + 20, a: 431.8, alpha: 0}
"""
OPTIONS = ReadOptions(table="standard,mm,deg")


@pytest.mark.parametrize(
    "text",
    [
        "joint,theta,d [mm],a,alpha (deg),min,max\nwaist,q1 + 90,0,0,90,-160,160\nslide,0,d2 + 20,431.8,0,,\n",
        "name;type;θ;d;a;α;lower;upper\nwaist;R;90;0;0;90;-160;160\nslide;P;0;20;431.8;0;;\n",
        (
            "# from the manual\nalpha\ta\td\ttheta\tjoint\tqmin\tqmax\n"
            "90\t0\t0\tq+90\twaist\t-160\t160\n0\t431.8\tq+20\t0\tslide\t\t\n"
        ),
    ],
)
def test_a_table_is_that_of_a_robot_file(text: str) -> None:
    assert loads(text, "table.csv", OPTIONS).digest == loads(YAML, "table.yaml").digest


def test_a_first_line_can_say_what_the_table_means(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    rows = "joint,theta,d,a,alpha,min,max\nwaist,q + 90,0,0,90,-160,160\nslide,0,q + 20,431.8,0,,\n"
    path.write_text("# standard,mm,deg\n# tool from wrist: [Tz(20)]\n" + rows)
    found = load_with_report(path)
    assert found.robot.digest == loads(YAML, "table.yaml").digest
    assert found.report.notes == ("line 2 is not read: # tool from wrist: [Tz(20)]",)
    path.write_text("# only a remark\n" + rows)
    with pytest.raises(RobotFileError, match="does not say its convention and units"):
        load_with_report(path)
    with pytest.raises(RobotFileError, match="--table 'mm': expected a convention, a length and an angle"):
        load_with_report(path, ReadOptions(table="mm"))


@pytest.mark.parametrize("blank", [",,,,,,\n", ";;;;;;\n", " , ,,,,,\n", "\t\t\n"])
def test_rows_that_a_spreadsheet_left_empty_are_no_rows(blank: str) -> None:
    text = "joint,theta,d,a,alpha,min,max\nwaist,q + 90,0,0,90,-160,160\nslide,0,q + 20,431.8,0,,\n"
    head, first, second = text.splitlines(keepends=True)
    assert (
        loads(blank + head + first + blank + second + blank, "table.csv", OPTIONS).digest
        == loads(YAML, "t.yaml").digest
    )


@pytest.mark.parametrize("start", [b"PK\x03\x04", bytes.fromhex("d0cf11e0a1b11ae1")])
@pytest.mark.parametrize("options", [[], ["--table", "standard,mm,deg"]])
def test_a_workbook_is_one_line_that_says_what_to_do(
    start: bytes, options: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "table.xlsx"
    path.write_bytes(start + b"\0\xff" * 200_000)
    robot = tmp_path / "table.yaml"
    robot.write_text(YAML)
    for command in (["check", str(path), *options], ["doctor", str(robot), "--poses", str(path)]):
        assert main(command) == 1
        assert "this is a workbook of a spreadsheet, or an archive; save the sheet" in capsys.readouterr().err


def test_rows_without_names_are_numbered() -> None:
    robot = loads("i,type,theta,d,a,alpha\n1,R,0,0,0,0\n2,F,0,0,1,0\n", "t.csv", ReadOptions(table="modified,m,rad"))
    assert [row.name for row in robot.rows] == ["joint_1", "joint_2"]
    assert [row.type for row in robot.rows] == [JointType.REVOLUTE, JointType.FIXED]
    assert robot.convention is Convention.MODIFIED


@pytest.mark.parametrize("table", ["", "standard", "standard,mm", "denavit,mm,deg", "standard,mm,turns"])
def test_the_meaning_is_never_guessed(table: str) -> None:
    with pytest.raises(RobotFileError, match=r"standard,mm,deg|unknown word"):
        loads("theta,d,a,alpha\nq,0,0,0\n", "t.csv", ReadOptions(table=table))
