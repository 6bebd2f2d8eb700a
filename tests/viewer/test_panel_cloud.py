"""The points that a page carries: small, the same each time, and read back where they were."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kinegen.io.load import load
from kinegen.tools.viewer.document import MOST_POINTS, cloud_data, packed
from kinegen.ui.cli import main
from kinegen.verify import reference
from tests.viewer.node import evaluate, needs_node

ROBOTS = Path(__file__).resolve().parents[2] / "robots"


@pytest.fixture(autouse=True)
def _machine(machine: None) -> None:
    """One cache for the kernels of all tests."""


@needs_node
def test_points_are_read_back_where_they_were() -> None:
    points = np.random.default_rng(2).normal(size=(5000, 3)) * [1, 1000, 1e-3]
    data = packed(points)
    found = np.array(evaluate(("cloud.js",), "unpacked(given)", data)).reshape(-1, 3)

    assert data["count"] == len(found) == 5000
    near = np.ptp(points, axis=0) / 65535
    for axis in range(3):
        np.testing.assert_allclose(np.sort(found[:, axis]), np.sort(points[:, axis]), atol=0.6 * near[axis])
    # The nearest point of the cloud is near in all coordinates at once, not in each by itself.
    for point in points[:50]:
        assert (np.abs(found - point) < 0.6 * near + 1e-6 * np.abs(point)).all(axis=1).any()


@needs_node
@pytest.mark.parametrize("points", [[[1.0, 2.0, 3.0]], [[1.0, 2.0, 3.0], [1.0, 2.0, 4.0]]])
def test_points_in_a_line_or_alone(points: list[list[float]]) -> None:
    found = np.array(evaluate(("cloud.js",), "unpacked(given)", packed(np.array(points)))).reshape(-1, 3)

    np.testing.assert_allclose(found, points, atol=1e-6)


def test_a_cloud_is_the_same_each_time_and_not_too_large() -> None:
    robot = load(ROBOTS / "scara.yaml")
    first, second = (cloud_data(robot, 20_000)["cloud"] for _ in range(2))

    assert first == second
    assert 300 < first["count"] <= MOST_POINTS
    assert len(first["points"]) < 300_000
    low, high = np.array(first["low"]), np.array(first["high"])
    reached = reference.frames(robot, np.array([[0.0, 0.0, 0.0]]))["tool"][0][:3, 3]
    assert (low - 1e-9 <= reached).all()
    assert (reached <= high + 2e-3).all()


def test_a_tree_has_the_points_of_its_first_tip() -> None:
    robot = load(ROBOTS / "hand.yaml")

    assert cloud_data(robot, 50)["cloud"]["tip"] == robot.tips[0]


def test_no_samples_are_no_cloud() -> None:
    assert cloud_data(load(ROBOTS / "scara.yaml"), 0) == {}


@pytest.mark.parametrize("text", ["nan", "inf", "-1", "1.5", "many", "1e30", ""])
def test_a_wrong_number_of_samples_is_one_line(text: str, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    page = tmp_path / "arm.html"
    status = main(["view", str(ROBOTS / "scara.yaml"), "-o", str(page), "--workspace", text])

    assert status != 0
    assert "--workspace" in capsys.readouterr().err
    assert not page.exists()


def test_a_robot_without_joints_reaches_nothing(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    page = tmp_path / "arm.html"
    status = main(["view", str(ROBOTS / "blocks.yaml"), "-o", str(page), "--workspace", "10"])

    assert status != 0
    assert "blocks has no joint, so there is nothing to reach" in capsys.readouterr().err
    assert not page.exists()


@pytest.mark.parametrize("samples", [1, 7])
def test_few_samples_are_few_points(samples: int) -> None:
    robot = replace(load(ROBOTS / "planar_3r.yaml"), description="")

    assert 1 <= cloud_data(robot, samples)["cloud"]["count"] <= MOST_POINTS
