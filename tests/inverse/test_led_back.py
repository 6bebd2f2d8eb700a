"""Solutions that several ways of calling give are led back once, and every other one by itself."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from kinegen.derive.inverse.derive import family_of
from kinegen.io.load import load
from kinegen.verify.inverse_targets import lead_back, targets_of

ROBOT = load(Path(__file__).parents[2] / "robots" / "puma560.yaml")
FAMILY = family_of(ROBOT)
TARGETS = targets_of(ROBOT, FAMILY, 50, 10)
JOINTS = np.repeat(TARGETS.points[:, None], 2, axis=1)
SOLVED = np.ones(JOINTS.shape[:2], bool)


def test_fewer_targets_are_some_of_all() -> None:
    fewer, rows = TARGETS.fewer(20)

    np.testing.assert_array_equal(fewer.points[:20], TARGETS.points[:20])
    np.testing.assert_array_equal(fewer.points[20:], TARGETS.points[50:])
    np.testing.assert_array_equal(fewer.poses, TARGETS.poses[rows])


def test_another_solution_is_led_back_and_the_same_is_not() -> None:
    first = lead_back(ROBOT, FAMILY, TARGETS.poses, JOINTS, SOLVED, None)
    marked = replace(first, position=first.position + 7)
    others, valid = JOINTS.copy(), SOLVED.copy()
    others[3, 1, 0] += 0.1
    others[4, 1, 0] = np.nan
    valid[4, 1] = False
    led = lead_back(ROBOT, FAMILY, TARGETS.poses, others, valid, marked)

    assert first.position.max() < 1e-12
    assert led.rotation[3] > 1e-3
    np.testing.assert_array_equal(np.flatnonzero(led.position != marked.position), [3, 4])
    assert led.position[4] < 1e-12


def test_what_is_not_valid_need_not_be_the_same() -> None:
    valid = SOLVED.copy()
    valid[:, 1] = False
    first = lead_back(ROBOT, FAMILY, TARGETS.poses, JOINTS, valid, None)
    others = JOINTS.copy()
    others[:, 1] = np.nan

    assert first.has(others, valid).all()
