"""What a build leaves out, or does in another way, for chains of hundreds of rows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.rows import arm
from kinegen.derive import pose
from kinegen.derive.folding import FoldedChain, fold
from kinegen.derive.transforms import symbols, transforms_between
from kinegen.driver import pipeline
from kinegen.io.load import loads
from kinegen.ir.lower import lower
from kinegen.model.robot import Robot
from kinegen.verify import reference
from tests.builds.workshop import ARM, make, write_robot
from tests.evaluation import as_poses, run


def folded(robot: Robot) -> FoldedChain:
    return fold(transforms_between(robot, robot.root, robot.tips[0], symbols(robot, keep_parameters=False)))


@pytest.mark.usefixtures("machine")
def test_the_cost_of_a_very_long_kernel_is_not_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pipeline, "can_measure", lambda: True)
    monkeypatch.setattr(pipeline, "usual_costs", lambda _: pytest.fail("it was measured"))
    monkeypatch.setattr(pipeline, "_MEASURED", 5)

    result = make(write_robot(tmp_path, ARM), tmp_path, compile=True, measure=True)

    assert result.costs == ()
    assert "`kinegen size` measures it" in next(stage.detail for stage in result.stages if stage.name == "measure")


def test_a_long_chain_is_planned_as_its_end_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its plan is one of the cheapest here, and it is found from so many turns on alone."""
    long = folded(loads(arm(30), "long.yaml"))
    cheapest = pose.cheapest_plan(long)
    monkeypatch.setattr(pose, "_LONG", 29)

    assert pose.cheapest_plan(long) == cheapest
    assert cheapest.attach is None or 0 <= cheapest.attach < len(long.turns)


def test_the_pose_of_a_long_chain_is_right() -> None:
    robot = loads(arm(pose._LONG + 4), "long.yaml")
    q = np.random.default_rng(1).uniform(-2, 2, (3, robot.dof))

    program = lower(pose.derive_pose(robot))

    assert len(folded(robot).turns) > pose._LONG
    assert np.allclose(as_poses(run(robot, program, q), 1), reference.pose(robot, q)[..., :3, :], atol=1e-12)
