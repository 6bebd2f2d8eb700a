"""What a proof accepts, and why it is more for joints that turn more than once."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from kinegen.build import build
from kinegen.results import BuildOptions
from kinegen.robot.load import load, loads
from kinegen.verify.tolerances import TOLERANCES, UNITS, accepted_error

ROBOTS = sorted((Path(__file__).parents[2] / "robots").glob("*.yaml"))

SCARA = """
kinegen: 1
name: scara4
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: j1, theta: q, d: 0.3, a: 0.4, alpha: 0, limits: [-170, 170]}
  - {name: j2, theta: q, d: 0, a: 0.3, alpha: 180, limits: [-150, 150]}
  - {name: j3, theta: 0, d: q, a: 0, alpha: 0, limits: [0, 0.2]}
  - {name: j4, theta: q, d: 0, a: 0, alpha: 0, limits: [-3600, 3600]}
"""


@pytest.mark.parametrize("path", ROBOTS, ids=lambda path: path.stem)
def test_robots_whose_joints_stay_within_a_turn_are_held_to_the_plain_tolerances(path: Path) -> None:
    robot = load(path)

    assert accepted_error(robot, "double") == TOLERANCES.double
    assert accepted_error(robot, "float") == TOLERANCES.float


def test_ten_turns_add_the_rounding_of_their_sums_with_the_other_joints() -> None:
    robot = loads(SCARA, "scara4.yaml")

    assert accepted_error(robot, "float") == TOLERANCES.float + UNITS["float"] * 20 * math.pi * 2


def test_a_joint_of_many_turns_parallel_to_others_builds(tmp_path: Path) -> None:
    path = tmp_path / "scara4.yaml"
    path.write_text(SCARA, encoding="utf-8")
    result = build(path, BuildOptions(output=tmp_path, compile=False), lambda _: None)

    assert result.proof.holds
