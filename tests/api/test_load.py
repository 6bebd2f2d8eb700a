"""`kinegen.load`: paths, texts and mappings of every format, and what is said of anything else."""

from __future__ import annotations

import copy
import pickle
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinegen
from kinegen.model.robot import Robot as Model

ROOT = Path(__file__).resolve().parents[2]
ROBOTS = sorted((ROOT / "robots").glob("*.yaml"))
ARM: dict[str, Any] = {
    "kinegen": 1,
    "name": "arm",
    "convention": "standard",
    "units": {"length": "m", "angle": "deg"},
    "joints": [
        {"name": "turn", "theta": "q - 90", "d": 0, "a": 0.4318, "alpha": -90, "limits": [-170, 170]},
        {"name": "slide", "theta": 0, "d": "q", "a": Fraction(1, 3), "alpha": 0},
    ],
}
TEXT = """\
kinegen: 1
name: arm
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: turn, theta: q - 90, d: 0, a: 0.4318, alpha: -90, limits: [-170, 170]}
  - {name: slide, theta: 0, d: q, a: 1/3, alpha: 0}
"""
URDF = """\
<robot name="one">
  <link name="base_link"/><link name="tip"/>
  <joint name="turn" type="revolute">
    <parent link="base_link"/><child link="tip"/>
    <origin xyz="0 0 0.1" rpy="1.5708 0 0"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/>
  </joint>
</robot>
"""


@pytest.mark.parametrize("path", ROBOTS, ids=lambda path: path.stem)
def test_every_robot_is_the_model_with_methods(path: Path) -> None:
    robot = kinegen.load(path)

    assert isinstance(robot, Model)
    assert kinegen.load(str(path)) == robot
    assert kinegen.load(robot) is robot
    assert len(robot.table().rows) == len(robot.rows)
    assert str(robot.table()).startswith(robot.name)
    assert pickle.loads(pickle.dumps(robot)) == robot == copy.deepcopy(robot)  # noqa: S301 - our own bytes
    assert robot.name in repr(robot)
    assert len(repr(robot)) < 100


def test_a_robot_says_of_which_convention_its_rows_are() -> None:
    assert repr(kinegen.load(TEXT)) == "<kinegen.Robot arm: 2 joints, standard, lengths in m>"
    assert repr(kinegen.load(URDF, snap=0)) == "<kinegen.Robot one: 1 joint, elementary transforms, lengths in m>"
    mixed = TEXT + "  - {name: flange, ets: [Rx(90)]}\n"
    assert (
        repr(kinegen.load(mixed)) == "<kinegen.Robot arm: 2 joints, standard and elementary transforms, lengths in m>"
    )


def test_text_bytes_and_mapping_are_the_same_robot() -> None:
    robots = [kinegen.load(source) for source in (TEXT, TEXT.encode(), ARM, f"\n{TEXT}")]

    assert {robot.digest for robot in robots} == {robots[0].digest}


def test_numbers_of_a_mapping_are_as_exact_as_they_are_written() -> None:
    robot = kinegen.load({**ARM, "joints": [{**ARM["joints"][0], "a": np.float64(0.4318), "alpha": np.int64(-90)}]})

    assert robot.table().rows[0]["a"] == "0.4318"
    assert robot.table().rows[0]["alpha"] == "-90"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"conventoin": "x"}, "unknown key 'conventoin'"),
        ({"joints": 5}, "joints"),
        ({"joints": [{**ARM["joints"][0], "alpah": 0}]}, "unknown key 'alpah'"),
        ({"joints": [{**ARM["joints"][0], "a": float("nan")}]}, "is not a finite number, in 'a: .nan'"),
        ({"joints": [{**ARM["joints"][0], "a": float("inf")}]}, "is not a finite number"),
        ({"joints": [{**ARM["joints"][0], "a": {1, 2}}]}, r"joints\[0\].a is '{1, 2}', expected text, a number"),
        ({"joints": [{**ARM["joints"][0], 3: 0}]}, r"the key '3' of joints\[0\] is not text"),
        ({"name": "../../etc"}, "name"),
        ({"name": None}, "name is 'None', expected text"),
    ],
)
def test_a_wrong_mapping_says_what_is_wrong(change: dict[str, Any], message: str) -> None:
    with pytest.raises(kinegen.KinegenError, match=message) as caught:
        kinegen.load({**ARM, **change})

    assert caught.value.path == "<mapping>"
    assert caught.value.line is None
    assert "\n" not in str(caught.value)


def test_a_mapping_that_holds_itself_ends() -> None:
    loop: dict[str, Any] = {**ARM}
    loop["joints"] = [loop]

    with pytest.raises(kinegen.KinegenError, match="nests too deep"):
        kinegen.load(loop)


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("nowhere.yaml", "nowhere.yaml: there is no such file"),
        ("hello", "there is no such file"),
        ("x" * 10_000, "there is no such file"),
        ("\0", "there is no such file"),
        ("robots", "this is a folder"),
        ("", "<text>: the file is empty"),
        ("hello\nworld", "<text>:1: a robot file is made of"),
        ("kinegen: 1\nname: [\n", "<text>:"),
        ("<html>\n</html>", "<text>:1:"),
        ("\ud800\n", "<text>"),
        (b"\xff\xfe\x00", "<text>"),
        ({}, "<mapping>"),
        (5, "expected a path, a text or a mapping that describes a robot, not an int"),
        (None, "not a NoneType"),
        ([ARM], "not a list"),
    ],
    ids=range(15),
)
def test_anything_else_is_one_line(source: Any, message: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    with pytest.raises(kinegen.KinegenError) as caught:
        kinegen.load(source)

    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 600


def test_an_error_has_path_and_line(tmp_path: Path) -> None:
    path = tmp_path / "arm.yaml"
    path.write_text(TEXT.replace("d: q", "d: nan"), encoding="utf-8")

    with pytest.raises(kinegen.KinegenError) as caught:
        kinegen.load(path)

    assert (caught.value.path, caught.value.line) == (str(path), 7)
    assert str(caught.value) == f"{path}:7: {caught.value.message}"


def test_urdf_says_what_reading_changed() -> None:
    with pytest.warns(UserWarning, match="1 rounded number replaced by the exact one"):
        robot = kinegen.load(URDF.replace("1.5708", "1.57"))
    kept = kinegen.load(URDF.replace("1.5708", "1.57"), snap=0)

    assert [finding.exact for finding in robot.report.changed] == ["pi/2"]
    assert robot.notes[0].endswith("(1.57 -> pi/2); rotates the end effector")
    assert kept.report.changed == ()


def test_xacro_text_takes_arguments() -> None:
    text = URDF.replace('name="one"', 'name="one" xmlns:xacro="http://www.ros.org/wiki/xacro"')
    text = text.replace('<link name="base_link"/>', '<xacro:arg name="h" default="0"/><link name="base_link"/>')
    robot = kinegen.load(text.replace("0 0 0.1", "0 0 $(arg h)").replace("1.5708", "0"), arguments={"h": 0.5})

    assert kinegen.reference.fk(robot, [0.0])[2, 3] == 0.5
    with pytest.raises(kinegen.KinegenError, match=r"<text>:\d+: xacro: name 'nothing'"):
        kinegen.load(text.replace("0 0 0.1", "0 0 ${nothing}"))


def test_a_csv_table_needs_its_meaning() -> None:
    robot = kinegen.load("theta,d,a,alpha\nq,0,500,0\nq,0,250,0\n", table="standard,mm,deg")

    assert robot.dof == 2
    assert robot.units.length == "mm"


def test_a_robot_without_joints_has_a_pose() -> None:
    robot = kinegen.load({**ARM, "joints": [{"name": "plate", "theta": 90, "d": 0, "a": 1, "alpha": 0}]})

    assert kinegen.reference.fk(robot, []).shape == (4, 4)
    assert kinegen.reference.fk(robot, np.zeros((3, 0))).shape == (3, 4, 4)
    assert "base_T_tool" in str(robot.closed_form())


def test_the_judge_has_the_shapes_of_a_module_and_refuses_others() -> None:
    robot = kinegen.load(TEXT)

    assert kinegen.reference.fk(robot, np.zeros((2, 3, 2))).shape == (2, 3, 4, 4)
    assert np.isnan(kinegen.reference.fk(robot, [np.nan, 0.0])[0, 3])
    assert np.allclose(kinegen.reference.fk(robot, [0.0, 1.0], "turn")[:3, 3], [0, -0.4318, 0])
    for wrong, options in (([0.0], {}), ("ab", {}), ([0.0, 0.0], {"frame": "no"}), ([0.0, 0.0], {"params": {"x": 1}})):
        with pytest.raises(kinegen.KinegenError, match="arm"):
            kinegen.reference.fk(robot, wrong, **options)  # type: ignore[arg-type]


def test_a_robot_cannot_be_changed() -> None:
    robot = kinegen.load(TEXT)

    with pytest.raises(AttributeError, match="cannot be changed: name"):
        robot.name = "other"  # type: ignore[misc]
    with pytest.raises(AttributeError, match="cannot be changed: other"):
        robot.other = 1  # type: ignore[attr-defined]
    with pytest.raises(AttributeError, match="cannot be changed: name"):
        del robot.name


def test_saving_replaces_nothing_unasked(tmp_path: Path) -> None:
    robot = kinegen.load(TEXT)
    path = robot.save(tmp_path / "arm.yaml")

    assert kinegen.load(path).digest == robot.digest
    with pytest.raises(kinegen.KinegenError, match="the file exists; force=True"):
        robot.save(path)
    with pytest.raises(kinegen.KinegenError, match="suffix"):
        robot.save(tmp_path / "arm.docx")
    assert robot.save(path, force=True) == path


def test_conversion_keeps_every_pose() -> None:
    robot = kinegen.load(ROOT / "robots" / "puma560.yaml")
    q = np.random.default_rng(1).uniform(-2, 2, (20, 6))

    for convention in ("standard", "modified", "ets"):
        other = robot.convert(convention)
        assert isinstance(other, kinegen.Robot)
        assert np.allclose(kinegen.reference.fk(other, q), kinegen.reference.fk(robot, q), atol=1e-12)
    with pytest.raises(kinegen.KinegenError, match="unknown convention 'denavit'"):
        robot.convert("denavit")
