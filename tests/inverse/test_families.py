"""Arms of every family, in any convention: solutions lead back, and the joint vector that was asked for is one."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kinegen.io.load import loads
from kinegen.model.robot import Robot
from kinegen.verify import reference
from kinegen.verify.branches import require_names
from kinegen.verify.samples import singular_samples
from tests.inverse.arms import DISTAL, Arm, arm_of, distances, errors, evaluate, joint_vectors, robots

ROBOTS = Path(__file__).parents[2] / "robots"

NAMES = {
    "cylindrical arm, lift first": "cylindrical arm",
    "anthropomorphic arm, offset waist": "anthropomorphic arm",
    "arm with spherical wrist": "arm with parallel axes 2, 3 and spherical wrist",
    "arm with spherical wrist, waist aslant": "arm with parallel axes 2, 3 and spherical wrist",
    "arm with spherical wrist, equal links": "arm with parallel axes 2, 3 and spherical wrist",
    "Stanford": "Stanford type: spherical arm with spherical wrist",
    "gantry with wrist": "Cartesian arm with spherical wrist",
    "UR type": "UR type: parallel axes 2, 3, 4",
    "UR type, offset waist": "UR type: parallel axes 2, 3, 4",
    "axes 1, 2 meet, wrist": "arm whose axes 1, 2 meet, with spherical wrist",
    "axes 1, 2 meet, wrist in line": "arm whose axes 1, 2 meet, with spherical wrist",
    "spherical shoulder": "arm with parallel axes 4, 5 and spherical shoulder",
    "Panda without joint 7": "arm whose axes 5, 6 meet, with spherical shoulder",
    "UR type from the tool": "UR type: parallel axes 3, 4, 5",
    "AL5D type": "AL5D type: waist, parallel axes 2, 3, 4, roll",
    "AL5D type, offset hand": "AL5D type: waist, parallel axes 2, 3, 4, roll",
}


@pytest.mark.parametrize("kind", DISTAL)
def test_every_solution_leads_back_and_none_is_missed(kind: str) -> None:
    @settings(max_examples=2)
    @given(robots(kind), st.integers(0, 10**6))
    def check(robot: Robot, seed: int) -> None:
        arm = arm_of(robot)

        assert arm.family.name == NAMES.get(kind, kind)
        _check_random(arm, seed)
        _check_singular(arm)

    check()


def _check_random(arm: Arm, seed: int) -> None:
    q = joint_vectors(arm.robot, 200, seed)
    poses = reference.pose(arm.robot, q)[:, 0]
    solutions, valid = evaluate(arm, poses)
    solved = valid != 0

    assert set(np.unique(valid)) <= {0.0, 1.0}
    assert np.isfinite(solutions[solved]).all()
    assert errors(arm, solutions, poses)[solved].max() < 1e-9
    assert np.where(solved, distances(arm, solutions, q), np.inf).min(axis=1).max() < 1e-6


def _check_singular(arm: Arm) -> None:
    """Where any turn of a joint would do, the one that is chosen leads back too; limits may leave none."""
    q = singular_samples(arm.robot)
    poses = reference.pose(arm.robot, q)[:, 0]
    solutions, valid = evaluate(arm, poses)
    solved = valid != 0

    assert np.isfinite(solutions[solved]).all()
    assert errors(arm, solutions, poses)[solved].max(initial=0.0) < 1e-9
    assert solved.any(axis=1).all() or any(joint.limits for joint in arm.family.axes.joints)


@pytest.mark.parametrize("kind", ["arm with spherical wrist", "planar 3R", "Stanford"])
def test_solutions_keep_within_the_limits(kind: str) -> None:
    @settings(max_examples=2)
    @given(robots(kind), st.integers(0, 10**6))
    def check(robot: Robot, seed: int) -> None:
        arm = arm_of(robot)
        solutions, valid = evaluate(arm, reference.pose(robot, joint_vectors(robot, 200, seed))[:, 0])
        for joint in arm.family.axes.joints:
            if joint.limits is not None:
                low, high = map(float, joint.limits)
                values = solutions[valid != 0][:, joint.number - 1]

                assert low - 2e-7 <= values.min()
                assert values.max() <= high + 2e-7

    check()


@pytest.mark.parametrize("name", ["puma560", "stanford", "ur5", "al5d"])
@pytest.mark.parametrize("signs", [(1, 1, 1, 1, 1, 1), (-1, 1, -1, 1, 1, -1), (1, -1, 1, -1, -1, 1)])
def test_runtime_lengths_may_take_other_values_and_signs(name: str, signs: tuple[int, ...]) -> None:
    """Formulas hold for negative lengths too; only what a branch is called may then change."""
    text = (ROBOTS / f"{name}.yaml").read_text(encoding="utf-8")
    text = re.sub(r"^  (\w+): (-?[\d.]+)$", r"  \1: {value: \2, runtime: true}", text, flags=re.MULTILINE)
    arm = arm_of(loads(text, f"{name}.yaml"))
    values = tuple(
        sign * value * (1 + place / 10) for place, (sign, value) in enumerate(zip(signs, arm.params, strict=False))
    )
    parameters = dict(zip((each.name for each in arm.robot.runtime_parameters), values, strict=True))
    q = joint_vectors(arm.robot, 200, 5)
    poses = reference.pose(arm.robot, q, parameters)[:, 0]
    solutions, valid = evaluate(replace(arm, params=values), poses)
    solved = valid != 0
    reached = np.stack([reference.pose(arm.robot, each, parameters)[:, 0] for each in solutions.swapaxes(0, 1)], axis=1)

    assert len(parameters) > 1
    np.testing.assert_allclose(reached[solved], np.repeat(poses, solved.sum(axis=1), axis=0), atol=1e-9)
    assert np.where(solved, distances(arm, solutions, q), np.inf).min(axis=1).max() < 1e-6


@pytest.mark.parametrize("kind", DISTAL)
@pytest.mark.parametrize("count", [2, pytest.param(12, marks=pytest.mark.long)])
def test_every_solution_is_what_the_name_of_its_branch_says(kind: str, count: int) -> None:
    """Axes read off the Jacobian of the reference say on which side the shoulder, the elbow and the wrist are."""

    @settings(max_examples=count)
    @given(robots(kind))
    def check(robot: Robot) -> None:
        arm = arm_of(robot)
        q = joint_vectors(arm.robot, 40, 5)
        solutions, valid = evaluate(arm, reference.pose(arm.robot, q)[:, 0])
        package = ModuleType("arm")
        package.__dict__["BRANCHES"] = arm.family.branches

        require_names(arm.robot, package.BRANCHES, arm.family, "C double", solutions, valid != 0)

    check()
