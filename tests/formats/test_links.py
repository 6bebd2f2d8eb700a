"""Names of links: none means another frame than in the file, and a URDF that is written has them again."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from kinegen.errors import KinegenError
from kinegen.io.format import ReadOptions
from kinegen.io.link_writers import write_urdf
from kinegen.io.load import load, load_with_report, loads
from kinegen.model.dh_conversion.convert import to_convention
from kinegen.model.robot import Convention, Robot
from kinegen.model.variants import frame_named
from kinegen.tools.compare import compare
from kinegen.ui.cli import main
from kinegen.verify import reference
from tests.formats.test_write_urdf import link_poses

NAMES = ("base_link", "base", "shoulder", "arm link", "gripper", "gripper_link", "jaw", "wrist", "tool", "tool0")

JOINTS = """
<joint name="mount" type="fixed"><origin xyz="0 0 0.33" rpy="0 0 3.14159265358979"/>
  <parent link="base_link"/><child link="base"/></joint>
<joint name="pan" type="revolute"><origin xyz="0 0 0.1"/><parent link="base_link"/><child link="shoulder"/>
  <axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="lift" type="revolute"><origin xyz="0.1 0 0.2"/><parent link="shoulder"/><child link="arm link"/>
  <axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="hold" type="fixed"><origin xyz="0.3 0 0"/><parent link="arm link"/><child link="gripper"/></joint>
<joint name="gripper" type="revolute"><origin xyz="0 0.02 0"/><parent link="gripper"/><child link="jaw"/>
  <axis xyz="1 0 0"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint>
<joint name="see" type="fixed"><origin xyz="0 0 0.05"/><parent link="shoulder"/><child link="gripper_link"/></joint>
<joint name="near" type="fixed"><origin xyz="0 0 0.06"/><parent link="shoulder"/><child link="wrist"/></joint>
<joint name="far" type="fixed"><origin xyz="0 0 0.07"/><parent link="shoulder"/><child link="tool"/></joint>
<joint name="end" type="fixed"><origin xyz="0 0 0.08"/><parent link="jaw"/><child link="tool0"/></joint>
"""

URDF = '<robot name="arm">' + "".join(f'<link name="{name}"/>' for name in NAMES) + JOINTS + "</robot>"

FINGERS = """<robot name="hand"><link name="palm"/><link name="a"/><link name="pad"/><link name="b"/>
<joint name="left" type="revolute"><origin xyz="0.1 0 0"/><parent link="palm"/><child link="a"/><axis xyz="0 1 0"/>
  <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="right" type="prismatic"><origin xyz="0 0.1 0"/><parent link="palm"/><child link="b"/><axis xyz="1 0 0"/>
  <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="tip" type="fixed"><origin xyz="0 0 0.1"/><parent link="a"/><child link="pad"/></joint></robot>"""

Q = [0.4, -0.7, 0.3]


def plain(text: str, q: list[float]) -> dict[str, np.ndarray]:
    """The poses of all links by a reading that knows nothing of kinegen; axes may be x, y or z."""
    root = ET.fromstring(text)  # noqa: S314
    values = iter(q)
    found = {"base_link": np.eye(4)}
    for joint in sorted(root.findall("joint"), key=lambda each: NAMES.index(each.find("child").get("link"))):
        origin, axis = joint.find("origin"), joint.find("axis")
        pose = np.eye(4)
        pose[:3, 3] = [float(each) for each in origin.get("xyz").split()]
        if origin.get("rpy"):
            pose[:2, :2] = -np.eye(2)
        if axis is not None:
            place = [float(each) for each in axis.get("xyz").split()].index(1)
            i, j, angle = (place + 1) % 3, (place + 2) % 3, next(values)
            turn = np.eye(4)
            turn[[i, j], [i, j]], turn[i, j], turn[j, i] = np.cos(angle), -np.sin(angle), np.sin(angle)
            pose = pose @ turn
        found[joint.find("child").get("link")] = found[joint.find("parent").get("link")] @ pose
    return found


@pytest.fixture
def robot() -> Robot:
    return loads(URDF, "arm.urdf", ReadOptions(snap=None))


@pytest.mark.parametrize("link", [name for name in NAMES if name not in ("gripper", "tool")])
def test_the_name_of_a_link_means_its_frame(link: str, robot: Robot) -> None:
    frames = reference.frames(robot, np.array(Q))
    np.testing.assert_allclose(frames[frame_named(robot, link)][0], plain(URDF, Q)[link], atol=1e-14)


def test_no_frame_has_the_name_of_another_link(robot: Robot) -> None:
    # The root is called base in every robot, the last link of a chain is its tool, and what moves is a joint.
    others = {link: frame for link, frame in robot.links if frame in NAMES and frame != link}
    assert others == {"base_link": "base", "tool0": "tool", "jaw": "gripper"}


def test_a_link_called_base_that_is_not_the_root_is_reported(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(URDF)
    report = load_with_report(file).report
    frame = dict(report.links)["base"]
    assert ("base", frame) in report.renamed
    assert f"the root link 'base_link' is frame base of the robot; link 'base' is frame {frame}" in report.notes


def test_a_word_for_a_link_and_a_joint_is_one_line(robot: Robot) -> None:
    with pytest.raises(KinegenError, match=r"'gripper' is a link of the file and a joint: .* joint is on link 'jaw'"):
        frame_named(robot, "gripper")
    with pytest.raises(KinegenError, match=r"'tool' is a link of the file and a tool: .* tool is on link 'tool0'"):
        frame_named(robot, "tool")
    # Each of the four can be named.
    words = [dict(robot.links)["gripper"], "jaw", dict(robot.links)["tool"], "tool0"]
    assert len({frame_named(robot, word) for word in words}) == 4


def test_the_links_of_a_file_that_is_written_are_those_of_its_source(robot: Robot) -> None:
    text = write_urdf(robot)
    links = link_poses(text, dict(zip(("pan", "lift", "gripper"), Q, strict=True)))
    for name, pose in plain(URDF, Q).items():
        np.testing.assert_allclose(links[name], pose, atol=1e-14)
    assert {"tool_2", "joint"}.isdisjoint(links)


@pytest.mark.parametrize("convention", [Convention.STANDARD, Convention.MODIFIED, Convention.ETS])
def test_links_stay_where_they_are_in_another_convention(convention: Convention, robot: Robot) -> None:
    found = to_convention(robot, convention).robot
    frames = reference.frames(found, np.array(Q))
    assert {link for link, _ in found.links} == set(NAMES)
    for link, frame in found.links:
        np.testing.assert_allclose(frames[frame][0], plain(URDF, Q)[link], atol=1e-13)


def test_links_are_no_content(robot: Robot) -> None:
    other = loads(URDF.replace("arm link", "arm_plate"), "arm.urdf")
    assert other.digest == robot.digest
    assert "arm_plate" not in repr(other)


@pytest.mark.parametrize("tips", [(), ("pad", "b")])
def test_a_tree_is_compared_with_the_urdf_that_is_written(tips: tuple[str, ...], tmp_path: Path) -> None:
    source, back = tmp_path / "hand.urdf", tmp_path / "back.urdf"
    source.write_text(FINGERS)
    first = load(source, ReadOptions(tips=tips))
    back.write_text(write_urdf(first))
    found = compare(first, load(back, ReadOptions(tips=tips)))
    assert found.same
    assert not found.only_first
    assert len([each for each in found.differences if each.decides]) == 2


def test_several_links_at_the_end_of_a_file_are_told_apart_by_the_other_one() -> None:
    """What is written has each frame on its row, so that several links may end a chain there."""
    text = FINGERS.replace('<joint name="right" type="prismatic">', '<joint name="right" type="fixed">')
    text = text.replace('<parent link="palm"/><child link="b"/>', '<parent link="a"/><child link="b"/>')
    first = loads(
        text.replace('<parent link="a"/><child link="pad"/>', '<parent link="b"/><child link="pad"/>'), "a.urdf"
    )
    second = loads(write_urdf(first), "b.urdf")
    assert dict(first.links)["pad"] == "tool"
    assert "tool" not in dict(second.links).values()
    for one, other in ((first, second), (second, first)):
        assert compare(one, other).same
    third = loads(write_urdf(first).replace('xyz="0 0.1 0.1"', 'xyz="0 0.1 0.2"'), "c.urdf")
    assert not compare(first, third).same


def test_a_tree_without_links_is_compared_with_the_urdf_that_is_written() -> None:
    text = (
        "kinegen: 1\nname: hand\nconvention: modified\nunits: {length: m, angle: rad}\njoints:\n"
        "  - {name: left, parent: base, ets: [Tx(0.1), Ry(q)]}\n"
        "  - {name: right, parent: base, ets: [Ty(0.1), Tx(q)]}\n"
    )
    first = loads(text, "hand.yaml")
    found = compare(first, loads(write_urdf(first), "back.urdf"))
    assert found.same
    assert {each.first for each in found.differences if each.decides} == {"left", "right"}


def test_two_links_are_not_one_because_they_got_one_name() -> None:
    first, second = (loads(FINGERS.replace('"pad"', f'"pad{mark}"'), "hand.urdf") for mark in "!?")
    assert "pad" in first.frame_names
    assert "pad" in second.frame_names
    found = compare(first, second)
    assert "pad" in found.only_first
    assert "pad" in found.only_second


def test_commands_take_the_names_of_links(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(URDF)
    for link, height in (("base_link", "0, 0, 0 m"), ("base", "0, 0, 0.33 m"), ("wrist", "0, 0, 0.16 m")):
        assert main(["fk", str(file), "--frame", link, "0", "0", "0"]) == 0
        out = capsys.readouterr().out
        assert out.startswith("base_link_T_")
        assert f"position {height}" in out
    assert main(["show", str(file), "--to", "tool0"]) == 0
    assert "T_tool" in capsys.readouterr().out
    assert main(["fk", str(file), "--frame", "gripper", "0", "0", "0"]) == 1
    assert "name the one that is meant" in capsys.readouterr().err
    assert main(["build", str(file), "--outputs", "pose@base", "-o", str(tmp_path / "out")]) == 1
    assert "link 'base' of the file is frame 'base_link_2'; write that" in capsys.readouterr().err
