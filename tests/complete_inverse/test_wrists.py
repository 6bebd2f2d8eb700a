"""Three skew axes before a spherical wrist, or behind a spherical shoulder: solutions share three angles there."""

from __future__ import annotations

import numpy as np
import pytest

from kinegen.backends.complete_inverse.elimination_choice import complete_of
from kinegen.io.load import load
from kinegen.model.joint_bounds import reach
from kinegen.ui.cli import main
from kinegen.verify import reference
from kinegen.verify.inverse_targets import pose_errors
from tests.complete_inverse.conftest import Packages, file_of
from tests.complete_inverse.starts import apart, solutions_from_starts
from tests.complete_inverse.test_multiples import planted as multiples
from tests.complete_inverse.test_solutions import nearest


@pytest.mark.parametrize("backend", ["numpy", pytest.param("c", marks=pytest.mark.long)])
def test_all_solutions_of_three_skew_axes_with_a_spherical_wrist_are_found(backend: str, package: Packages) -> None:
    robot = load(file_of("skew_wrist"))
    count = 3000 if backend == "c" else 60
    random = np.random.default_rng(4).uniform(-np.pi, np.pi, (count, 6))
    q = np.concatenate([random, *(multiples(robot, step, count, seed=step) for step in (90, 45, 30))])
    targets = reference.pose(robot, q)[:, 0]
    solutions, valid = package("skew_wrist", backend).complete_inverse(targets)
    rows, places = np.nonzero(valid)
    errors = pose_errors(reference.pose(robot, solutions[rows, places])[:, 0], targets[rows])

    assert nearest(q, solutions, valid).max() < 1e-5
    assert valid.sum(axis=1).max() == 8
    assert (errors < 2e-10 * np.array([reach(robot, robot.tips), 1.0])).all()


def test_newton_steps_from_many_starts_lead_to_the_same_solutions(package: Packages) -> None:
    robot = load(file_of("skew_wrist"))
    q = np.random.default_rng(6).uniform(-np.pi, np.pi, (3, 6))
    targets = reference.pose(robot, q)[:, 0]
    solutions, valid = package("skew_wrist", "numpy").complete_inverse(targets)
    for target, found, real in zip(targets, solutions, valid, strict=True):
        others = solutions_from_starts(robot, target, starts=400, seed=5)

        assert len(others) == real.sum()
        assert all(min(apart(other, each) for each in found[real]) < 1e-6 for other in others)


def test_inspect_and_the_build_say_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    path = file_of("skew_wrist")
    main(["inspect", str(path)])

    assert "all solutions, up to 16: kinegen build --outputs complete_inverse" in capsys.readouterr().out
    assert len(complete_of(load(path)).eliminations) == 2
