"""Outputs of one frame as seen from another one: the inverse of one product times the other, and nothing above both."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from kinegen.derive.dispatch import derive
from kinegen.derive.expressions import Expressions
from kinegen.errors import KinegenError
from kinegen.io.load import load
from kinegen.model.joint_bounds import reach
from kinegen.model.outputs import parse_quantity
from kinegen.model.robot import Robot
from kinegen.verify import reference
from kinegen.verify.reference import Kinematics

ROBOTS = Path(__file__).resolve().parents[2] / "robots"
MILL = "trunnion_mill"


@pytest.fixture(scope="module")
def mill() -> Robot:
    return load(ROBOTS / f"{MILL}.yaml")


def numbers(expressions: Expressions, q: np.ndarray, robot: Robot) -> np.ndarray:
    """The entries at a joint vector, by plain substitution."""
    known = dict(zip(expressions.variables, map(float, q), strict=False))
    known |= {symbol: float(sp.N(robot_value(robot, symbol.name))) for symbol in expressions.parameters}
    for symbol, expression in expressions.definitions:
        known[symbol] = float(sp.N(expression.subs(known)))
    return np.array([float(sp.N(entry.subs(known))) for entry in expressions.entries])


def robot_value(robot: Robot, name: str) -> float:
    return {"tool_length": 120.0}[name] if robot.name == MILL else 0.0


def test_pose_is_one_product_after_the_inverse_of_the_other(mill: Robot) -> None:
    q = np.array([0.4, -1.1, 120.0, -35.0, 410.0])
    found = numbers(derive(mill, parse_quantity("pose@cutter/workpiece")), q, mill).reshape(3, 4)
    frames = reference.frames(mill, q[None])
    wanted = np.linalg.inv(frames["workpiece"][0]) @ frames["cutter"][0]
    np.testing.assert_allclose(found, wanted[:3], rtol=0, atol=1e-12 * reach(mill))


@pytest.mark.parametrize("way", ["index_tip/thumb_tip", "index_tip/index_1", "index_1/index_tip"])
def test_reference_agrees_with_linear_algebra_and_differences(way: str) -> None:
    robot = load(ROBOTS / "hand.yaml")
    q = np.full((1, robot.dof), 0.3)
    frame, _, start = way.partition("/")

    def pose(at: np.ndarray) -> np.ndarray:
        frames = reference.frames(robot, at)
        return np.linalg.inv(frames[start][0]) @ frames[frame][0]

    np.testing.assert_allclose(Kinematics(robot, q).pose(way)[0], pose(q), atol=1e-12)
    jacobian = Kinematics(robot, q).jacobian(way)[0]
    step = 1e-6
    for joint in range(robot.dof):
        moved = step * np.eye(robot.dof)[joint]
        slope = (pose(q + moved) - pose(q - moved)) / (2 * step)
        turning = slope[:3, :3] @ pose(q)[:3, :3].T
        angular = [turning[2, 1], turning[0, 2], turning[1, 0]]
        np.testing.assert_allclose(jacobian[:, joint], [*slope[:3, 3], *angular], atol=1e-6)


def test_joints_that_move_both_frames_do_not_appear() -> None:
    robot = load(ROBOTS / "hand.yaml")
    expressions = derive(robot, parse_quantity("pose@index_tip/index_1"))
    read = {symbol.name for _, each in expressions.definitions for symbol in each.free_symbols}
    read |= {symbol.name for each in expressions.entries for symbol in each.free_symbols}
    assert "index_2" in read
    assert not read & {"index_spread", "index_1", "thumb_1"}


def test_reach_counts_the_links_between_the_frames() -> None:
    robot = load(ROBOTS / "hand.yaml")
    assert reach(robot, ["index_3/index_2"]) == pytest.approx(20)
    assert reach(robot, ["index_3/index_2"]) == reach(robot, ["index_2/index_3"])


def test_names(mill: Robot) -> None:
    quantity = parse_quantity("jacobian_local@cutter/workpiece")
    assert str(quantity) == "jacobian_local@cutter/workpiece"
    assert quantity.function == "jacobian_local_cutter_in_workpiece"
    (pose,) = derive(mill, parse_quantity("pose@cutter/workpiece")).signature.results
    assert pose.name == "workpiece_T_cutter"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("pose@cutter/", "the name of a frame is missing after /"),
        ("pose@cutter/cutter", "frame 'cutter' is seen from itself"),
        ("pose@/workpiece", "the name of a frame is missing after @"),
        ("frames@cutter/workpiece", "'frames' is not computed for a single frame"),
    ],
)
def test_what_is_not_a_way(text: str, message: str) -> None:
    with pytest.raises(KinegenError, match=message):
        parse_quantity(text)


@pytest.mark.parametrize("way", ["cutter/nowhere", "nowhere/cutter"])
def test_unknown_frames(mill: Robot, way: str) -> None:
    with pytest.raises(KinegenError, match="unknown frame 'nowhere'"):
        derive(mill, parse_quantity(f"pose@{way}"))
