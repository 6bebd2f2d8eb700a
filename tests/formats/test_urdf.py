"""URDF files in: poses by a plain matrix product of what the file says, exact numbers, names, tips and followers."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from kinegen.errors import RobotFileError
from kinegen.io.format import Imported, ReadOptions, format_of
from kinegen.io.load import load_with_report, loads
from kinegen.model.expression_parser import Number
from kinegen.model.robot import JointType, Robot
from kinegen.verify import reference
from tests.formats.plain import URDF_TWO, plain_urdf, turn

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


@pytest.mark.parametrize("kind", ["revolute", "continuous", "prismatic"])
def test_a_joint_without_an_axis_moves_along_or_about_x(kind: str, tmp_path: Path) -> None:
    """As the format says, whatever most files write."""
    text = (
        '<robot name="arm"><link name="a"/><link name="b"/>'
        f'<joint name="j" type="{kind}"><parent link="a"/><child link="b"/>'
        '<limit lower="-1" upper="1"/></joint></robot>'
    )
    found = reference.pose(imported(text, tmp_path).robot, [0.3])[0, 0]
    moved = np.eye(4)
    if kind == "prismatic":
        moved[0, 3] = 0.3
    else:
        moved[:3, :3] = turn(np.array([1.0, 0.0, 0.0]), 0.3)[:3, :3]

    np.testing.assert_allclose(found, moved, atol=1e-15)


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
        (ReadOptions(tips=("slide",)), "--tip: there is no link 'slide'; joint 'slide' moves "),
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


def test_prefixes_that_are_not_declared_are_read(tmp_path: Path) -> None:
    text = URDF_TWO.replace("<axis ", '<sensor:camera/><axis drake:kind="1" ').replace("<robot ", '<robot a:b="1" ')
    assert imported(text, tmp_path).robot.rows == imported(URDF_TWO, tmp_path).robot.rows
    # Other defects behind hundreds of these are still found.
    many = text.replace("<link ", "<a:b/>" * 300 + "<link ", 1)
    assert imported(many, tmp_path).robot.dof == 2
    for broken in (many.replace("</robot>", "</robott>"), many.replace("</joint>", "", 1), many + "<x/>"):
        with pytest.raises(RobotFileError, match=r"arm.urdf:\d+: not valid XML: "):
            imported(broken, tmp_path)


def test_elements_without_a_prefix_are_those_of_the_format_in_any_namespace(tmp_path: Path) -> None:
    """A default namespace on the root, as simulators write it, or on an element alone: readers of ROS see none."""
    rows = imported(URDF_TWO, tmp_path).robot.rows
    assert imported(URDF_TWO.replace("<robot ", '<robot xmlns="http://example.org/a" '), tmp_path).robot.rows == rows
    assert imported(URDF_TWO.replace("<axis ", '<axis xmlns="http://example.org/a" ', 1), tmp_path).robot.rows == rows
    # What has a prefix is not of the format, and a message shows the prefix.
    declared = URDF_TWO.replace("<robot ", '<robot xmlns:a="http://example.org/a" ')
    assert imported(declared.replace("<axis ", "<a:axis/><axis ", 1), tmp_path).robot.rows == rows
    whole = declared.replace("<robot ", "<a:robot ").replace("</robot>", "</a:robot>")
    with pytest.raises(RobotFileError, match="the root element is <a:robot>; a URDF file has <robot>"):
        imported(whole, tmp_path)


@pytest.mark.parametrize(
    "left",
    [
        '<xacro:pelvis_sensors name="a"/>',
        '<xacro:include filename="$(find other)/urdf/other.gazebo"/>',
        '<xacro:a><link name="inside"/></xacro:a>',
        "<!-- <xacro:macro name='a'/> ${x} -->",
    ],
)
def test_what_xacro_left_in_a_urdf_file_is_not_looked_at(left: str, tmp_path: Path) -> None:
    spaces = (' xmlns:xacro="http://www.ros.org/wiki/xacro"', ' xmlns:xacro="http://wiki.ros.org/xacro"', "")
    for space in spaces:
        text = URDF_TWO.replace("<robot", f"<robot{space}", 1).replace("</robot>", f"{left}</robot>")
        found = imported(text, tmp_path)
        assert found.robot.rows == imported(URDF_TWO, tmp_path).robot.rows
        assert any("was left out" in note for note in found.report.notes) is left.startswith("<xacro")


@pytest.mark.parametrize(
    "part",
    [
        '<xacro:property name="d" value="1"/>',
        '<xacro:include filename="part.xacro"/><xacro:part/>',
        '<link name="${1}"/><xacro:part/>',
        '<xacro:if value="0"/>',
    ],
)
def test_xacro_with_another_suffix_is_still_expanded(part: str) -> None:
    space = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"'
    text = URDF_TWO.replace("<robot", space, 1).replace("</robot>", f"{part}</robot>")
    assert format_of("arm.urdf", text.encode()).name == "xacro"
    assert format_of("arm.xacro", URDF_TWO.encode()).name == "xacro"
