"""MJCF files in: default classes, several joints in a body, references, followers, includes, frames."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from kinegen import reference
from kinegen.errors import RobotFileError
from kinegen.formats.format import Imported, ReadOptions
from kinegen.formats.load import load_with_report
from kinegen.robot.expressions import evaluate
from kinegen.robot.floats import FLOATS
from kinegen.robot.model import JointType
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
    assert [float(evaluate(each, {}, FLOATS)) for each in shoulder.limits] == pytest.approx([-math.pi / 2, math.pi / 2])
    assert roll.limits is None
    assert [float(evaluate(each, {}, FLOATS)) for each in reach.limits] == [0, 0.5]


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
