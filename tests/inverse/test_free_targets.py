"""Targets that leave a joint of the arm free, as a build plants them: within limits, and each must be solved."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from kinegen.derive.inverse import solve
from kinegen.derive.inverse.derive import family_of
from kinegen.errors import ProofError
from kinegen.io.load import loads
from kinegen.model.joint_bounds import joint_box
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import TOOL
from kinegen.verify import closed_form_inverse as proof
from kinegen.verify import reference
from kinegen.verify.closed_form_inverse import try_inverse
from kinegen.verify.free_joint_samples import on_an_axis
from tests.inverse.test_module import write

LIMITS = ((-165, 165), (-110, 110), (-110, 70), (-60, 60), (-120, 120), (-100, 100))
ARMS = {
    "anthropomorphic": ["R 0 90", "R 0.43 0", "R 0 90"],
    "of equal links": ["R 0.1 90", "R 0.29 0", "R 0 90"],
    "cylindrical": ["R 0 0", "P 0 90", "P 0 0"],
    "spherical": ["R 0 -90", "R 0 90", "P 0 0"],
    "whose first axes meet": ["R 0 70", "R 0.43 50", "R 0.11 90"],
}
WRIST = ["R 0 -90", "R 0 90", "R 0 0"]


def text_of(name: str) -> str:
    """An arm with a spherical wrist: joint, length and twist of each row."""
    lines = ["kinegen: 1", "name: arm", "convention: standard", "units: {length: m, angle: deg}", "joints:"]
    for number, row in enumerate([*ARMS[name], *WRIST], start=1):
        letter, a, alpha = row.split()
        turn, d = ("q", {4: 0.29, 6: 0.1}.get(number, 0)) if letter == "R" else (0, "q")
        low, high = LIMITS[number - 1] if letter == "R" else (-0.4, 0.8)
        limits = f"limits: [{low}, {high}]"
        lines.append(f"  - {{name: j{number}, theta: {turn}, d: {d}, a: {a}, alpha: {alpha}, {limits}}}")
    return "\n".join(lines)


@pytest.mark.parametrize("name", ARMS)
def test_planted_joint_vectors_are_within_limits_and_leave_one_motion_free(name: str) -> None:
    robot = loads(text_of(name), "arm.yaml")
    q = on_an_axis(robot, family_of(robot), 100)
    low, high = np.array(joint_box(robot)).T
    values = np.linalg.svd(reference.Kinematics(robot, q).jacobian(TOOL), compute_uv=False)

    assert len(q) >= 50
    assert ((q >= low) & (q <= high)).all()
    assert values[:, 5].max() < 1e-12
    assert values[:, 4].min() > 1e-7


def test_an_arm_that_does_not_get_there_has_none() -> None:
    robot = loads(text_of("anthropomorphic").replace("d: 0, a: 0.43", "d: 0.01, a: 0.43"), "arm.yaml")

    assert len(on_an_axis(robot, family_of(robot), 100)) == 0


def test_a_build_refuses_a_kernel_that_leaves_the_wrist_beyond_its_limits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Joint 1 at zero is right where nothing follows it; with narrow limits of the wrist targets are then missed.

    Multiples of 45 deg have some of them, which are allowed a part without solutions; here they may all be without one.
    """
    robot = loads(text_of("anthropomorphic"), "arm.yaml")
    monkeypatch.setattr(proof, "TARGETS", 200)
    monkeypatch.setattr(proof, "FEWER", 400)
    monkeypatch.setattr(proof, "UNSOLVED", 1.0)
    try_inverse(robot, write(tmp_path, robot=robot), Quantity(Kind.INVERSE), "double")
    monkeypatch.setattr(solve, "is_followed", lambda _: False)
    # Another name, since what was derived is kept.
    robot = loads(text_of("anthropomorphic").replace("name: arm", "name: bad"), "arm.yaml")
    bad = write(tmp_path, robot=robot)

    with pytest.raises(ProofError, match=r"has no solution for \d+ of \d+ targets that are on an axis"):
        try_inverse(robot, bad, Quantity(Kind.INVERSE), "double")
