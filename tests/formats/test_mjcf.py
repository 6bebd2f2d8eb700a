"""MJCF files in: default classes, several joints in a body, references, followers, includes, frames."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from kinegen.errors import RobotFileError
from kinegen.io.format import Imported, ReadOptions
from kinegen.io.load import load, load_with_report
from kinegen.model.expression_parser import evaluate
from kinegen.model.expression_values import FLOAT64
from kinegen.model.robot import JointType
from kinegen.verify import reference
from tests.formats.plain import shift, turn

ARM = """\
<mujoco model="my arm">
  <compiler angle="degree"/>
  <default>
    <joint axis="0 1 0" range="-90 90"/>
    <default class="slider"><joint type="slide" axis="0 0 2" range="0 0.5"/></default>
  </default>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body name="base" pos="0 0 0.1">
      <body name="upper" euler="0 0 90">
        <joint name="shoulder" pos="0.01 0 0"/>
        <joint name="roll" axis="1 0 0" limited="false"/>
        <frame pos="0 0 0.3" quat="0.7071 0.7071 0 0">
          <body name="lower" pos="0.1 0 0" childclass="slider">
            <joint name="reach" ref="0.1"/>
            <body name="mirror"><joint name="follow"/></body>
          </body>
        </frame>
      </body>
    </body>
  </worldbody>
  <equality><joint joint1="follow" joint2="reach" polycoef="0.02 -1 0 0 0"/></equality>
</mujoco>
"""


def read(text: str, folder: Path, options: ReadOptions | None = None) -> Imported:
    path = folder / "arm.xml"
    path.write_text(text)
    return load_with_report(path, options or ReadOptions())


def test_poses_defaults_and_followers(tmp_path: Path) -> None:
    found = read(ARM, tmp_path)
    assert [row.type for row in found.robot.rows] == [
        JointType.REVOLUTE,
        JointType.REVOLUTE,
        JointType.PRISMATIC,
        JointType.FOLLOWER,
    ]
    assert found.robot.units.angle == "deg"
    x, y, z = np.eye(3)
    anchor = 0.01 * x
    q = [0.3, -0.7, 0.25]
    upper = shift(0.1 * z) @ turn(z, math.pi / 2) @ shift(anchor) @ turn(y, q[0]) @ shift(-anchor) @ turn(x, q[1])
    lower = upper @ shift(0.3 * z) @ turn(x, math.pi / 2) @ shift(0.1 * x) @ shift(z * (q[2] - 0.1))
    mirror = lower @ shift(z * (0.02 - (q[2] - 0.1)))
    frames = dict(found.report.links)
    poses = reference.frames(found.robot, q)
    for link, pose in (("upper", upper), ("lower", lower), ("mirror", mirror)):
        np.testing.assert_allclose(poses[frames[link]][0], pose, atol=1e-14)


def test_limits_are_in_the_unit_of_the_file(tmp_path: Path) -> None:
    shoulder, roll, reach = read(ARM, tmp_path).robot.variables
    assert shoulder.limits is not None
    assert reach.limits is not None
    assert [float(evaluate(each, {}, FLOAT64)) for each in shoulder.limits] == pytest.approx(
        [-math.pi / 2, math.pi / 2]
    )
    assert roll.limits is None
    assert [float(evaluate(each, {}, FLOAT64)) for each in reach.limits] == [0, 0.5]


@pytest.mark.parametrize(("sequence", "moving"), [("xyz", True), ("zyx", True), ("XYZ", False), ("zxy", True)])
def test_euler_angles_are_about_axes_that_move_or_stay(sequence: str, moving: bool, tmp_path: Path) -> None:
    """Each further turn stands behind the ones before where the axes move along, and before them where they stay."""
    body = '<body name="b" euler="20 -50 110"><joint name="j"/></body>'
    text = f'<mujoco><compiler eulerseq="{sequence}"/><worldbody>{body}</worldbody></mujoco>'
    turns = [turn(np.eye(3)["xyz".index(a)], math.radians(d)) for a, d in zip(sequence.lower(), (20, -50, 110))]
    expected = np.linalg.multi_dot(turns if moving else turns[::-1])

    np.testing.assert_allclose(reference.pose(read(text, tmp_path).robot, [0.0])[0, 0], expected, atol=1e-14)


def test_degrees_near_a_multiple_of_15_are_reported_by_what_they_turn(tmp_path: Path) -> None:
    body = '<body name="b" euler="0 0 {}"><joint name="j"/><body name="t" pos="2 0 0"/></body>'
    model = "<mujoco><worldbody>" + body + "</worldbody></mujoco>"
    (near,) = read(model.format("89.99"), tmp_path).report.findings
    (snapped,) = read(model.format("44.999"), tmp_path, ReadOptions(snap=1e-4)).report.findings

    assert (near.exact, near.changed) == ("90 deg", False)
    assert near.effect == pytest.approx(2 * math.radians(0.01))
    assert (snapped.exact, snapped.changed) == ("45 deg", True)
    assert not read(model.format("89.9"), tmp_path).report.findings
    assert not read(model.format("90"), tmp_path).report.findings


def test_a_quaternion_is_judged_as_a_rotation(tmp_path: Path) -> None:
    body = '<body name="b" quat="{}"><joint name="j"/></body>'
    model = "<mujoco><worldbody>" + body + "</worldbody></mujoco>"
    near = read(model.format("0.92388 0 0 0.382683"), tmp_path).report
    assert [(each.exact, each.changed) for each in near.findings] == [("rpy 0 0 pi/4", True)]
    off = read(model.format("0.9239 0 0 0.3840"), tmp_path).report
    assert not off.changed
    noisy = read(model.format("0.923880 0.000004 0 0.382683"), tmp_path).report
    assert [each.changed for each in noisy.findings] == [False]


def test_included_files_are_beside_the_model(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    inner = '<mujocoinclude><body name="b"><joint name="j"/></body></mujocoinclude>'
    (tmp_path / "parts" / "body.xml").write_text(inner)
    text = '<mujoco model="m"><worldbody><include file="parts/body.xml"/></worldbody></mujoco>'
    assert read(text, tmp_path).robot.dof == 1
    (tmp_path / "parts" / "body.xml").write_text(inner.replace('name="j"', 'name="j" axis="0 0 0"'))
    with pytest.raises(RobotFileError, match=r"arm.xml: joint 'j': axis: the axis is zero"):
        read(text, tmp_path)


def test_a_free_body_can_be_the_base(tmp_path: Path) -> None:
    text = ARM.replace('<body name="base" pos="0 0 0.1">', '<body name="base"><freejoint/>')
    with pytest.raises(RobotFileError, match="start below it with --base 'base'"):
        read(text, tmp_path)
    assert read(text, tmp_path, ReadOptions(base="base")).robot.dof == 3


SCENE = """<mujoco><worldbody>
<body name="ball" pos="3 0 0"><joint type="free"/><body name="mark" pos="0 0 1"/></body>
<body name="left/base" pos="1 0 0"><body name="arm" pos="0 0 1"><joint name="a" axis="0 1 0"/>
  <body name="hand" pos="0 0 2"/></body></body>
<body name="swing"><joint type="ball"/></body>
MORE</worldbody></mujoco>"""


def test_free_objects_beside_an_arm_are_left_out_and_named(tmp_path: Path) -> None:
    found = read(SCENE.replace("MORE", ""), tmp_path)
    alone = read(SCENE.replace("MORE", ""), tmp_path, ReadOptions(tips=("hand",)))
    assert [link for link, _ in found.report.links] == ["world", "left/base", "arm", "hand"]
    np.testing.assert_array_equal(*(reference.fk(each.robot, [0.3]) for each in (found, alone)))
    for joint, link in (("ball_joint", "ball"), ("swing_joint", "swing")):
        note = (
            f"joint '{joint}' has no axis and carries no joint that moves, so link '{link}' is left out, with what is"
        )
        assert any(each.startswith(note) for each in found.report.notes)


def test_a_free_robot_beside_an_arm_is_still_refused(tmp_path: Path) -> None:
    walker = '<body name="torso"><freejoint/><body name="leg"><joint name="hip"/></body></body>'
    with pytest.raises(RobotFileError, match=r"joint 'torso_joint' is free.*--base 'torso'"):
        read(SCENE.replace("MORE", walker), tmp_path)
    assert read(SCENE.replace("MORE", walker), tmp_path, ReadOptions(base="torso")).robot.dof == 1


def test_a_part_in_which_nothing_moves_names_the_links_where_joints_move(tmp_path: Path) -> None:
    with pytest.raises(RobotFileError, match=r"no joint moves .*; joints move on 'left/base', which --base takes"):
        read(SCENE.replace("MORE", ""), tmp_path, ReadOptions(base="ball"))


@pytest.mark.parametrize("maker", ["attach", "replicate", "composite", "flexcomp"])
def test_what_makes_bodies_beside_the_tips_is_left_out_and_named(maker: str, tmp_path: Path) -> None:
    text = SCENE.replace("MORE", f'<body name="box"><{maker} count="3"><body name="c"/></{maker}></body>')
    with pytest.raises(RobotFileError, match=f"arm.xml:6: <{maker}> makes bodies .*--tip"):
        read(text, tmp_path)
    found = read(text, tmp_path, ReadOptions(tips=("hand",)))
    assert found.robot.dof == 1
    assert f"line 6: <{maker}> is left out, with the bodies that it makes" in found.report.notes
    with pytest.raises(RobotFileError, match="there is no link 'c'"):
        read(text, tmp_path, ReadOptions(tips=("c",)))


@pytest.mark.parametrize(
    "inside", ["<geom/>", '<frame pos="0 0 1"><geom/><replicate count="2"><site/></replicate></frame>']
)
def test_a_replicate_of_shapes_alone_makes_no_bodies(inside: str, tmp_path: Path) -> None:
    text = SCENE.replace("MORE", f'<replicate count="3" offset="0 0 1">{inside}</replicate>')
    found = read(text, tmp_path)
    assert found.robot.dof == 1
    assert not any("replicate" in each for each in found.report.notes)


def test_links_to_one_file_are_several_files(tmp_path: Path) -> None:
    """As MuJoCo has it: hands include the same finger under several names."""
    (tmp_path / "finger.xml").write_text('<mujocoinclude><body><joint axis="0 1 0"/></body></mujocoinclude>')
    for name in ("first.xml", "middle.xml"):
        (tmp_path / name).symlink_to("finger.xml")
    text = '<mujoco><worldbody><body name="palm"><joint name="wrist"/>{}</body></worldbody></mujoco>'
    path = tmp_path / "hand.xml"
    path.write_text(text.format('<include file="first.xml"/><include file="middle.xml"/><include file="finger.xml"/>'))
    assert load(path, ReadOptions(snap=0)).dof == 4
    path.write_text(text.format('<include file="first.xml"/><include file="./first.xml"/>'))
    with pytest.raises(RobotFileError, match=r"'\./first\.xml' is included twice"):
        load(path)
    # A link may not lead elsewhere, nor a file include itself under new names.
    (tmp_path / "inside").mkdir()
    (tmp_path / "inside" / "out.xml").symlink_to(tmp_path / "finger.xml")
    inner = tmp_path / "inside" / "hand.xml"
    inner.write_text(text.format('<include file="out.xml"/>'))
    with pytest.raises(RobotFileError, match="not in the folder of the model"):
        load(inner)
    (tmp_path / "again.xml").symlink_to("hand.xml")
    path.write_text(text.format('<include file="again.xml"/>'))
    with pytest.raises(RobotFileError, match=r"'again\.xml' is included twice"):
        load(path)


LOOP = """<mujoco><worldbody>
<body name="upper"><joint name="s"/><body name="fore" pos="0 0 1"><joint name="e"/>
<body name="hand" pos="1 0 0"><joint name="h"/><body name="finger"><joint name="f"/></body>
<body name="pad" pos="0 1 0"><joint name="p"/></body></body></body></body>
<body name="crank"><joint name="c"/><body name="rod" pos="1 0 0"><joint name="r"/></body></body>
</worldbody><equality><KIND BODIES/></equality></mujoco>"""


@pytest.mark.parametrize("kind", ["connect", "weld"])
@pytest.mark.parametrize(
    ("first", "second", "free", "held"),
    [
        ("fore", "rod", [], ["upper", "fore", "hand", "crank", "rod"]),
        ("finger", "pad", ["upper", "hand", "rod"], ["finger", "pad"]),
        ("pad", "fore", ["fore", "rod"], ["hand", "finger", "pad"]),
        ("pad", "hand", ["hand", "finger", "rod"], ["pad"]),
        ("hand", "", ["rod"], ["upper", "hand"]),
    ],
)
def test_a_loop_holds_the_joints_between_its_bodies_in_either_order(
    kind: str, first: str, second: str, free: list[str], held: list[str], tmp_path: Path
) -> None:
    """Those below the body at which the ways from both meet, and no others."""
    path = tmp_path / "m.xml"
    for one, other in ((first, second), (second, first)) if second else ((first, second),):
        bodies = f'body1="{one}"' + (f' body2="{other}"' if other else "")
        path.write_text(LOOP.replace("KIND", kind).replace("BODIES", bodies))
        for tip in free:
            assert load(path, ReadOptions(tips=(tip,))).dof > 0
        for tip in held:
            with pytest.raises(RobotFileError, match=f"m.xml:[0-9]+: joint .* is in the loop that <{kind}> on line 6"):
                load(path, ReadOptions(tips=(tip,)))


@pytest.mark.parametrize("kind", ["connect", "weld"])
def test_loops_through_sites_are_those_of_their_bodies(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "m.xml"
    text = """<mujoco><worldbody><body name="a"><joint name="j"/><site name="s"/>
<body name="b" pos="1 0 0"><joint name="k"/><frame><site name="t"/></frame></body></body>
<body name="moved" mocap="true"><site name="m"/></body></worldbody>
<equality><KIND site1="s" site2="SITE"/></equality></mujoco>""".replace("KIND", kind)
    path.write_text(text.replace("SITE", "t"))
    with pytest.raises(
        RobotFileError, match=f"joint 'k' is in the loop that <{kind}> on line 4 closes between bodies 'a' and 'b'"
    ):
        load(path)
    assert load(path, ReadOptions(tips=("a",))).dof == 1
    path.write_text(text.replace("SITE", "m"))
    assert load(path, ReadOptions(tips=("b",))).dof == 2
    path.write_text(text.replace("SITE", "u"))
    with pytest.raises(RobotFileError, match=r"m.xml:4: equality: there is no site 'u' \(expected s, t, m"):
        load(path)
