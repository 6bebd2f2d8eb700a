"""Arms that miss a condition by the noise of floating point are exact arms of their family, and the message says so."""

from __future__ import annotations

import numpy as np
import pytest

from kinegen.derive.inverse.axes import Axes, joint_axes
from kinegen.derive.inverse.classification import NotClosedForm, recognise
from kinegen.derive.inverse.family import Family
from kinegen.derive.inverse.nearest_family import rounded
from kinegen.io.load import load, loads
from kinegen.model.robot import Robot
from kinegen.verify import reference
from tests.builds.workshop import ROBOTS
from tests.inverse.arms import arm_of, distances, errors, evaluate, joint_vectors


def arm(rows: list[str], angle: str = "rad") -> Robot:
    """A robot of standard rows, in metres."""
    head = f"kinegen: 1\nname: noisy\nconvention: standard\nunits: {{length: m, angle: {angle}}}\njoints:\n"
    lines = [f"  - {{name: j{place}, {row}}}\n" for place, row in enumerate(rows, 1)]
    return loads(head + "".join(lines), "noisy.yaml")


NOISY = {
    "planar 3R": arm(
        [
            "theta: q, d: 0, a: 0.4, alpha: 1e-15",
            "theta: q, d: 1e-15, a: 0.3, alpha: -2e-15",
            "theta: q, d: 0, a: 0.2, alpha: 0",
        ]
    ),
    "SCARA, joints RRP": arm(
        [
            "theta: q, d: 0.4, a: 0.35, alpha: 1e-15",
            "theta: q, d: 0, a: 0.25, alpha: 1e-16",
            "theta: 0, d: q, a: 0, alpha: 0",
        ]
    ),
    "SCARA, joints RRPR": arm(
        [
            "theta: q, d: 0.4, a: 0.35, alpha: 3.141592653589793",
            "theta: q, d: 0, a: 0.25, alpha: 1e-14",
            "theta: 0, d: q, a: 0, alpha: 0",
            "theta: q, d: 0.1, a: 0, alpha: 2e-15",
        ]
    ),
    "AL5D type": arm(
        [
            "theta: q, d: 0.1, a: 1e-17, alpha: 1.5707963267948966",
            "theta: q, d: 1e-16, a: 0.15, alpha: 1e-15",
            "theta: q, d: 0, a: 0.18, alpha: -1e-15",
            "theta: q, d: 0, a: 1e-16, alpha: 1.570796326794898",
            "theta: q, d: 0.1, a: 0, alpha: 0",
        ]
    ),
    "UR type": arm(
        [
            "theta: q, d: 0.089159, a: 0, alpha: 90",
            "theta: q, d: 0, a: -0.425, alpha: 1e-15",
            "theta: q, d: 0, a: -0.39225, alpha: 0",
            "theta: q, d: 0.10915, a: 0, alpha: 90.0000000000001",
            "theta: q, d: 0.09465, a: 1e-15, alpha: -90",
            "theta: q, d: 0.0823, a: 0, alpha: 0",
        ],
        "deg",
    ),
    "arm with parallel axes 2, 3 and spherical wrist": arm(
        [
            "theta: q, d: 0.675, a: 0.26, alpha: -90",
            "theta: q, d: 0, a: 0.68, alpha: 1e-15",
            "theta: q, d: 1e-16, a: -0.035, alpha: 90",
            "theta: q, d: -0.67, a: 1e-15, alpha: -90",
            "theta: q, d: 1e-15, a: 1e-15, alpha: 90.00000000000001",
            "theta: q, d: -0.158, a: 0, alpha: 180",
        ],
        "deg",
    ),
}


@pytest.mark.parametrize("name", NOISY)
def test_a_noisy_arm_is_of_its_family_and_the_condition_says_so(name: str) -> None:
    family = recognise(NOISY[name])

    assert isinstance(family, Family)
    assert family.name.startswith(name)
    assert family.defect is None
    assert "within 1e-12 (rad, parts of the arm's length) count as exact" in family.conditions[-1]


@pytest.mark.parametrize("name", NOISY)
def test_its_solutions_are_those_of_the_arm_as_the_file_has_it(name: str) -> None:
    robot = NOISY[name]
    solver = arm_of(robot)
    q = joint_vectors(robot, 200, seed=5)
    poses = reference.pose(robot, q)[:, 0]
    solutions, valid = evaluate(solver, poses)
    holds = valid != 0

    assert np.where(holds, distances(solver, solutions, q), np.inf).min(axis=1).max() < 1e-7
    assert errors(solver, np.where(holds[..., None], solutions, 0), poses)[holds].max() < 1e-11


@pytest.mark.parametrize("name", ["puma560", "ur5", "al5d", "scara", "stanford", "iiwa14", "panda_joint_7", "jaco2"])
def test_axes_without_noise_stay_as_they_are(name: str) -> None:
    axes = joint_axes(load(ROBOTS / f"{name}.yaml"))
    assert isinstance(axes, Axes)
    found = rounded(axes)

    assert not found.changed
    assert found.axes == axes


def test_what_is_more_than_noise_is_not_rounded() -> None:
    robot = arm(
        [
            "theta: q, d: 0.4, a: 0.35, alpha: 1e-11",
            "theta: q, d: 0, a: 0.25, alpha: 0",
            "theta: 0, d: q, a: 0, alpha: 0",
        ]
    )

    assert isinstance(recognise(robot), NotClosedForm)


def test_a_tool_whose_length_is_an_argument_leaves_the_size_to_the_arm() -> None:
    text = (ROBOTS / "puma560.yaml").read_text(encoding="utf-8")
    text = text.replace("parameters:\n", "parameters:\n  reach: {value: 0.1, runtime: true}\n", 1)
    robot = loads(f"{text}\ntool: {{xyz: [0, 0, reach]}}\n", "puma560.yaml")

    assert robot.runtime_parameters
    assert not rounded(joint_axes(robot)).changed
