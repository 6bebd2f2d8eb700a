"""The complete inverse has as many solutions as a resultant in 60 digits has real roots, and the same ones."""

from __future__ import annotations

import numpy as np
import pytest

from kinegen.io.load import load
from kinegen.model.joint_bounds import joint_box
from kinegen.model.robot import Robot
from kinegen.verify import reference
from tests.builds.workshop import ROBOTS
from tests.complete_inverse.conftest import Packages
from tests.complete_inverse.resultant import solutions
from tests.complete_inverse.starts import Array, apart
from tests.complete_inverse.test_solutions import planted

LOOPS = {"general_6r": 0, "jaco2": 5, "crx10ial": 5, "xarm6": 5, "gen3_lite": 5, "manseur_doty": 0, "ur5": 5}
"""With which joint the loop begins that the resultant is taken of; others are tried where that one has none."""

POSES = 29
"""For each arm: 203 poses together."""


def differing(name: str, package: Packages, q: Array) -> list[str]:
    """The joint vectors for whose poses the two methods do not have the same solutions."""
    robot = load(ROBOTS / f"{name}.yaml")
    found, valid = package(name, "c").complete_inverse(reference.pose(robot, q)[:, 0])
    bad = []
    for row, each in enumerate(q):
        solved = solutions(robot, each.tolist(), (LOOPS[name], *range(6)))
        assert len(solved.joints) + solved.others == 16
        others, ours = within(robot, solved.joints), found[row, valid[row]]
        same = all(min((apart(one, other) for other in others), default=np.inf) < 1e-6 for one in ours)
        if not (len(ours) == len(others) and same):
            bad.append(f"{each.tolist()}: {len(ours)} and {len(others)} solutions")
    return bad


def within(robot: Robot, q: Array) -> Array:
    """Joint vectors within the limits, some whole turns added."""
    low, high = np.array(joint_box(robot)).T
    turned = q + 2 * np.pi * np.ceil((low - q) / (2 * np.pi) - 1e-9)
    inside: Array = q[(turned <= high + 1e-9).all(axis=1)]
    return inside


def test_a_resultant_has_the_same_solutions(package: Packages) -> None:
    assert differing("general_6r", package, planted("general_6r", 1, seed=21)[0]) == []


@pytest.mark.counts
@pytest.mark.parametrize("name", LOOPS)
def test_at_two_hundred_poses(name: str, package: Packages) -> None:
    """Takes 3 to 10 seconds a pose."""
    assert differing(name, package, planted(name, POSES, seed=22)[0]) == []


@pytest.mark.counts
@pytest.mark.parametrize("name", ["jaco2", "general_6r", "xarm6"])
def test_at_limits(name: str, package: Packages) -> None:
    """One joint exactly at one of its limits; what is there has to be found, what is beyond must not."""
    q, box = planted(name, 12, seed=23)[0], np.array(joint_box(load(ROBOTS / f"{name}.yaml")))
    for row, each in enumerate(q):
        each[row % 6] = box[row % 6, row // 6]

    assert differing(name, package, q) == []
