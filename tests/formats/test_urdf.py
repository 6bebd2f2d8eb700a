"""URDF files in: poses by a plain matrix product of what the file says, exact numbers, names, tips and followers."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from kinegen import reference
from kinegen.errors import RobotFileError
from kinegen.formats.format import Imported, ReadOptions
from kinegen.formats.load import load_with_report, loads
from kinegen.robot.expressions import Number
from kinegen.robot.model import JointType, Robot
from tests.formats.plain import URDF_TWO, plain_urdf

OPTIONS = ReadOptions()


def imported(text: str, tmp_path: Path, options: ReadOptions = OPTIONS) -> Imported:
    path = tmp_path / "arm.urdf"
    path.write_text(text)
    return load_with_report(path, options)


def test_poses_are_those_of_a_plain_product(tmp_path: Path) -> None:
    found = imported(URDF_TWO, tmp_path, ReadOptions(snap=0))
    frames = dict(found.report.links)
    for q in ([0.0, 0.0], [0.3, -0.2], [-1.7, 0.4]):
        poses = reference.frames(found.robot, q)
        plain = plain_urdf(URDF_TWO, dict(zip(("left-hip joint", "slide"), q, strict=True)))
        for link, pose in plain.items():
            np.testing.assert_allclose(poses[frames[link]][0], pose, atol=1e-14)


def test_names_that_are_not_identifiers_are_reported(tmp_path: Path) -> None:
    report = imported(URDF_TWO, tmp_path).report
    assert ("left-hip joint", "left_hip_joint") in report.renamed
    assert dict(report.links)["lower"] == "left_hip_joint"


def test_a_fixed_link_is_a_frame_and_the_only_end_is_the_tool(tmp_path: Path) -> None:
    robot = imported(URDF_TWO, tmp_path).robot
    assert robot.tips == ("flange", "finger_joint")
    assert [row.type for row in robot.rows] == [JointType.REVOLUTE, JointType.PRISMATIC, JointType.FOLLOWER]
    chain = imported(URDF_TWO, tmp_path, ReadOptions(tips=("flange",))).robot
    assert not chain.is_tree
    assert chain.tool
    assert [frame.name for frame in chain.frames] == ["plate"]


def test_numbers_are_decimal_text_and_quarter_turns_are_exact(tmp_path: Path) -> None:
    robot = imported(URDF_TWO, tmp_path).robot
    assert robot.rows[0].steps[0].value == Number(Fraction("0.089159"))
    report = imported(URDF_TWO, tmp_path).report
    assert [(each.text, each.exact) for each in report.changed][:1] == [("1.5708", "pi/2")]
    assert [each.text for each in report.kept] == ["3.141"]
    assert 0 < report.effect < 1e-5


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (ReadOptions(tips=("flnge",)), "--tip: there is no link 'flnge' .*did you mean flange"),
        (ReadOptions(base="lower", tips=("plate",)), "--tip: link 'plate' is not below the base 'lower'"),
        (ReadOptions(tips=("finger",)), "mimics joint 'slide', which is not in the chosen part"),
    ],
)
def test_base_and_tips_that_do_not_fit(options: ReadOptions, message: str, tmp_path: Path) -> None:
    with pytest.raises(RobotFileError, match=message):
        imported(URDF_TWO, tmp_path, options)


def test_base_starts_the_chain_at_another_link(tmp_path: Path) -> None:
    robot = imported(URDF_TWO, tmp_path, ReadOptions(base="lower", tips=("flange",))).robot
    assert [row.name for row in robot.rows] == ["slide"]


def test_content_decides_where_the_suffix_does_not() -> None:
    robot: Robot = loads(URDF_TWO, "arm.xml")
    assert robot.name == "two"
    assert loads(URDF_TWO, "arm").rows == robot.rows


def test_lines_and_digest_are_filled_in(tmp_path: Path) -> None:
    robot = imported(URDF_TWO, tmp_path).robot
    assert robot.rows[0].line == 8
    assert len(robot.digest) == 16
    assert robot.source == "arm.urdf"
