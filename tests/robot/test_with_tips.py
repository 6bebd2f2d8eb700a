"""`--tip` on a tree in a robot file: the arm to one frame, with the poses that the tree has there."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest

from kinegen.errors import RobotFileError
from kinegen.io.format import ReadOptions
from kinegen.io.load import load, loads
from kinegen.io.robot_file.write import write
from kinegen.model.robot import TOOL, Robot
from kinegen.model.variants import with_tips
from kinegen.ui.cli import main
from kinegen.verify import reference

ROBOTS = Path(__file__).parents[2] / "robots"
HAND = load(ROBOTS / "hand.yaml")


def trees() -> list[Robot]:
    """The robots with several tips and no actuators."""
    robots = [load(path) for path in sorted(ROBOTS.glob("*.yaml"))]
    return [robot for robot in robots if robot.is_tree and not robot.actuators.readings]


@pytest.mark.parametrize("robot", trees(), ids=lambda robot: robot.name)
def test_an_arm_to_a_tip_has_the_poses_of_the_tree(robot: Robot) -> None:
    q = np.random.default_rng(5).uniform(-0.5, 0.5, (3, robot.dof))
    names = [each.name for each in robot.variables]
    whole = {tip: reference.pose(robot, q)[:, place] for place, tip in enumerate(robot.tips)}
    for tip in robot.tips:
        arm = with_tips(robot, [tip])
        own = q[:, [names.index(each.name) for each in arm.variables]]

        assert arm.tips == (TOOL,)
        assert [each.index for each in arm.variables] == list(range(arm.dof))
        np.testing.assert_allclose(reference.pose(arm, own)[:, 0], whole[tip], atol=1e-12)
        assert loads(write(arm), "arm.yaml").digest == arm.digest


def test_several_tips_make_a_smaller_tree() -> None:
    for wanted in itertools.permutations(HAND.tips, 2):
        part = with_tips(HAND, wanted)

        assert part.tips == tuple(tip for tip in HAND.tips if tip in wanted)
        assert {each.name[1] for each in part.parameters if each.name[0] == "l"} == {tip[0].upper() for tip in wanted}


def test_an_inner_joint_may_be_the_end() -> None:
    arm = with_tips(HAND, ["index_2"])

    assert [row.name for row in arm.rows] == ["index_root", "index_spread", "index_1", "index_2"]
    assert (arm.tips, arm.dof) == ((TOOL,), 3)


@pytest.mark.parametrize(
    ("name", "tip", "message"),
    [
        ("hand", "palm", r"--tip: there is no frame 'palm' \(expected thumb_tip, index_tip"),
        ("puma560", "tool", "--tip is for robots with several tips, and this one has one, its tool"),
    ],
)
def test_what_cannot_be_cut_is_said(name: str, tip: str, message: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(RobotFileError, match=message):
        with_tips(load(ROBOTS / f"{name}.yaml"), [tip])
    assert main(["check", str(ROBOTS / f"{name}.yaml"), "--tip", tip]) == 1
    assert capsys.readouterr().err.startswith(f"error: {ROBOTS / name}.yaml: --tip")


def test_a_joint_that_follows_one_that_is_cut_off_is_refused() -> None:
    text = (
        "kinegen: 1\nname: pair\nconvention: standard\nunits: {length: m, angle: deg}\njoints:\n"
        "  - {name: left, parent: base, theta: q, d: 0, a: 1, alpha: 0}\n"
        "  - {name: right, parent: base, theta: -left, d: 0, a: 1, alpha: 0}\n"
    )

    assert loads(text, "pair.yaml", ReadOptions(tips=("left",))).dof == 1
    with pytest.raises(RobotFileError, match=r"joint 2 \(right\) follows joint left, which is cut off"):
        loads(text, "pair.yaml", ReadOptions(tips=("right",)))


def test_commands_take_the_arm(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    hand, out = str(ROBOTS / "hand.yaml"), str(tmp_path / "index.yaml")

    assert main(["convert", hand, "--tip", "index_tip", "-o", out]) == 0
    capsys.readouterr()
    poses = []
    for words in (["fk", hand, "5", "10", "20", "--tip", "index_tip"], ["fk", out, "5", "10", "20"]):
        assert main(words) == 0
        poses.append(capsys.readouterr().out)
    position = poses[0].partition("position ")[2].partition(" mm")[0].replace(",", "")

    assert poses[0] == poses[1]
    assert main(["doctor", hand, "--tip", "index_tip", "--pose", f"5 10 20 = {position}"]) == 0
    assert "the file agrees with the poses" in capsys.readouterr().out
