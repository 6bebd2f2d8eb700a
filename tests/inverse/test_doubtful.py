"""Targets that may be left without a solution, and arms that a build must not refuse for them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from kinegen.derive.inverse.derive import family_of
from kinegen.io.load import loads
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import Robot
from kinegen.verify import closed_form_inverse as proof
from kinegen.verify import reference
from kinegen.verify.closed_form_inverse import try_inverse
from kinegen.verify.singular_samples import are_free
from tests.inverse.arms import arm_of, evaluate, joint_vectors
from tests.inverse.test_module import write

NARROW = ("-30, 100", "-110, 110", "-0.3, 0.3", "-45, 45", "-30, 120", "30, 160")
ROWS = {
    "stroke through zero": (
        "theta: q, d: 0.412, a: 0, alpha: -90",
        "theta: q, d: 0.154, a: 0, alpha: 90",
        "theta: 90, d: q, a: 0, alpha: 0",
        "theta: q, d: 0, a: 0, alpha: -90",
        "theta: q, d: 0, a: 0, alpha: 90",
        "theta: q, d: 0.263, a: 0, alpha: 0",
    ),
    "equal links": (
        "theta: q, d: 0, a: 0, alpha: 90",
        "theta: q, d: 0, a: 0.43, alpha: 0",
        "theta: q, d: 0.15, a: 0, alpha: -90",
        "theta: q, d: 0.43, a: 0, alpha: 90",
        "theta: q, d: 0, a: 0, alpha: -90",
        "theta: q, d: 0.06, a: 0, alpha: 0",
    ),
    "equal links, no offset": (
        "theta: q, d: 0, a: 0, alpha: 90",
        "theta: q, d: 0, a: 0.43, alpha: 0",
        "theta: q, d: 0, a: 0, alpha: -90",
        "theta: q, d: 0.43, a: 0, alpha: 90",
        "theta: q, d: 0, a: 0, alpha: -90",
        "theta: q, d: 0.06, a: 0, alpha: 0",
    ),
    "first axes meet": (
        "theta: q, d: 0.3, a: 0, alpha: -90",
        "theta: q, d: 0, a: 0.4, alpha: 90",
        "theta: q, d: 0.1, a: 0.1, alpha: -90",
        "theta: q, d: 0.35, a: 0, alpha: 90",
        "theta: q, d: 0, a: 0, alpha: -90",
        "theta: q, d: 0.1, a: 0, alpha: 0",
    ),
}


def text_of(name: str) -> str:
    """An arm with narrow limits; a joint 3 that turns has wide ones."""
    head = ["kinegen: 1", "name: arm", "convention: standard", "units: {length: m, angle: deg}", "joints:"]
    for number, (row, narrow) in enumerate(zip(ROWS[name], NARROW, strict=True), start=1):
        limits = "-170, 200" if number == 3 and "theta: q" in row else narrow
        head.append(f"  - {{name: j{number}, {row}, limits: [{limits}]}}")
    return "\n".join(head)


def _robot(name: str) -> Robot:
    return loads(text_of(name), "arm.yaml")


@pytest.mark.parametrize("name", ROWS)
def test_an_arm_with_narrow_limits_is_not_refused(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside its singular sets rounding decides where a joint is that is nearly free, and may take it past a limit."""
    robot = _robot(name)
    monkeypatch.setattr(proof, "TARGETS", 200)
    monkeypatch.setattr(proof, "FEWER", 400)

    trials = try_inverse(robot, write(tmp_path, robot=robot), Quantity(Kind.INVERSE), "double")

    assert all(trial.solutions > 200 for trial in trials)


def test_a_wrist_in_line_where_both_shoulders_meet_keeps_its_limits() -> None:
    """A stroke along axis 1, as in a home pose: rounding used to turn the waist, and with it the wrist out of line."""
    robot = loads(text_of("stroke through zero").replace("-0.3, 0.3", "0.1, 0.6"), "arm.yaml")
    arm, q = arm_of(robot), joint_vectors(robot, 1000, 1)
    q[:, 1], q[:, 4] = 0, 0

    _, valid = evaluate(arm, reference.pose(robot, q)[:, 0])

    assert (valid != 0).any(axis=1).all()


def test_an_elbow_that_puts_the_wrist_there_does_too() -> None:
    robot = loads(text_of("equal links").replace("d: 0.43", "d: 0.4"), "arm.yaml")
    arm, q = arm_of(robot), joint_vectors(robot, 2000, 1)
    # The wrist's centre is as near to axis 1 as its offset lets it be: 0.43 cos(q2) = 0.4 sin(q2 + q3).
    q[:, 2], q[:, 4] = np.arcsin(np.clip(0.43 / 0.4 * np.cos(q[:, 1]), -1, 1)) - q[:, 1], 0
    q = q[np.abs(0.43 / 0.4 * np.cos(q[:, 1])) < 0.99]

    _, valid = evaluate(arm, reference.pose(robot, q)[:, 0])

    assert len(q) > 1000
    # Of the others the elbow is nearly stretched or folded.
    assert (valid != 0).any(axis=1).mean() > 0.98


def test_a_wrist_in_line_is_no_excuse() -> None:
    robot = _robot("equal links")
    family, q = family_of(robot), np.array([[0.3, 0.4, 0.5, 0.1, 0.0, 1.0], [0.3, 0.4, 0.5, 0.1, 0.7, 1.0]])

    assert not are_free(robot, family, q, beside=False).any()
    np.testing.assert_array_equal(are_free(robot, family, q, beside=True), [True, False])


def test_two_joints_that_are_free_at_once_are_one() -> None:
    robot = _robot("equal links, no offset")
    q = np.array([[0.3, 0.4, np.pi / 2, 0.1, 0.7, 1.0], [0.3, 0.4, 1.5, 0.1, 0.7, 1.0]])

    np.testing.assert_array_equal(are_free(robot, family_of(robot), q, beside=False), [True, False])
