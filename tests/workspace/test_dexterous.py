"""The dexterous part: which orientations an arm gives, and where it gives them all."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from numpy.typing import NDArray

from kinegen.model.outputs import Kind
from kinegen.tools.workspace.dexterous import Inverse, dexterous_part, find_inverse, find_turning
from kinegen.tools.workspace.tip_samples import joint_ranges
from kinegen.verify import reference
from tests.workspace import arms

FREEDOMS = {
    "puma560": (3, True),
    "iiwa14": (3, True),
    "planar_3r": (1, True),
    arms.RING + "  - {name: roll, ets: [Rz(q)]}\n": (1, True),
    arms.RING: (1, False),
    "al5d": (3, False),
    "cartesian": (0, False),
    arms.TWO_LINKS: (1, False),
    arms.SHELL: (2, False),
    arms.SPHERE: (2, False),
    arms.POINT: (1, True),
}


@pytest.mark.parametrize("joints", FREEDOMS)
def test_the_orientations_that_an_arm_gives(joints: str) -> None:
    turning = find_turning(arms.robot(joints), arms.surveyed(joints, 1000))

    assert (turning.freedom, turning.free) == FREEDOMS[joints]


def test_the_line_of_a_planar_arm_is_its_normal() -> None:
    turning = find_turning(arms.robot(arms.TILTED), arms.surveyed(arms.TILTED, 1000))

    assert turning.line is not None
    assert np.allclose(arms.surveyed(arms.TILTED, 1000).shape.axes @ turning.line, 0)


def planar_inverse(first: float, second: float, third: float) -> Inverse:
    """Whether a planar arm reaches a pose: the wrist must lie in the annulus of the first two links."""

    def reached(poses: NDArray[np.float64]) -> NDArray[np.bool_]:
        wrist = np.linalg.norm(poses[:, :3, 3] - third * poses[:, :3, 0], axis=1)
        return (abs(first - second) <= wrist) & (wrist <= first + second)

    return reached


def test_the_dexterous_part_of_a_planar_arm() -> None:
    """Every orientation where abs(a1 - a2) <= abs(r - a3) and r + a3 <= a1 + a2, with a3 the last link."""
    workspace = arms.surveyed(arms.THREE_LINKS)
    turning = find_turning(arms.robot(arms.THREE_LINKS), workspace)

    found = dexterous_part(workspace, turning, planar_inverse(1, 0.6, 0.2))

    assert found.measure == pytest.approx(pi * (1.4**2 - 0.6**2), rel=0.02)
    assert 0 < found.dexterous < found.voxels


def test_the_closed_form_inverse_finds_the_same() -> None:
    workspace, robot = arms.surveyed(arms.THREE_LINKS), arms.robot(arms.THREE_LINKS)
    turning = find_turning(robot, workspace)
    closed = find_inverse(arms.kernels(arms.THREE_LINKS, Kind.INVERSE), joint_ranges(robot))

    assert dexterous_part(workspace, turning, closed) == dexterous_part(workspace, turning, planar_inverse(1, 0.6, 0.2))


def test_the_inverse_keeps_a_slide_within_its_range() -> None:
    """Without limits in the file, a slide is sampled over a range that its inverse knows nothing of."""
    robot = arms.robot("cartesian")
    reached = find_inverse(arms.kernels("cartesian", Kind.INVERSE), joint_ranges(robot))
    at_rest = reference.pose(robot, [[0, 0, 0], [0, 0, 0.9], [0, 0, 1.1]])[:, 0]

    assert list(reached(at_rest)) == [True, True, False]


def test_an_inverse_that_reaches_all_makes_all_of_it_dexterous() -> None:
    workspace = arms.surveyed("puma560")
    turning = find_turning(arms.robot("puma560"), workspace)
    seen = []

    def reached(poses: NDArray[np.float64]) -> NDArray[np.bool_]:
        seen.append(poses[:1])
        return np.ones(len(poses), bool)

    found = dexterous_part(workspace, turning, reached)
    R = np.concatenate(seen)[:, :3, :3]

    assert found.dexterous == found.voxels
    assert np.allclose(R @ R.transpose(0, 2, 1), np.eye(3))
    assert np.allclose(np.linalg.det(R), 1)
    # Spread over all orientations, they cancel out.
    assert np.abs(R.mean(axis=0)).max() < 0.05


@pytest.mark.parametrize("voxel", [None, 0.05, 0.13])
def test_a_part_that_is_the_whole_measures_the_whole(voxel: float | None) -> None:
    """A SCARA with a roll turns its tool every way about the vertical, wherever it gets to."""
    workspace, robot = arms.surveyed(arms.RING_WITH_ROLL, voxel=voxel), arms.robot(arms.RING_WITH_ROLL)
    inverse = find_inverse(arms.kernels(arms.RING_WITH_ROLL, Kind.INVERSE), joint_ranges(robot))

    found = dexterous_part(workspace, find_turning(robot, workspace), inverse)

    assert found.share == pytest.approx(1)
    assert found.share <= 1
    assert found.measure == found.share * arms.measured(workspace)


def test_an_arm_that_cannot_turn_has_none_to_measure() -> None:
    workspace = arms.surveyed(arms.TWO_LINKS)
    turning = find_turning(arms.robot(arms.TWO_LINKS), workspace)

    with pytest.raises(ValueError, match="no dexterous part"):
        dexterous_part(workspace, turning, planar_inverse(1, 1, 1))
