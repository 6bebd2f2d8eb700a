"""Solves poses with a MoveIt plug-in that is linked with the source of its base class, from a checkout."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tests.controllers.contract import contract
from tests.controllers.elementary import Model
from tests.controllers.moveit_programs import CALLS, Answer, Arm, compiled
from tests.controllers.packages import file_of

GROUPS = tuple(
    group
    for group, entries in contract("moveit2")["groups"].items()
    if any(entry.get("file", "").startswith("moveit_") for entry in entries)
)
"""The groups of the contract that are about this repository."""

SOURCE = "moveit_core/kinematics_base"

_INCLUDED = ("kinematics_base", "macros", "utils")
_POSES = 100


def tried(name: str, place: Path, checkout: Path) -> Iterator[tuple[str, float, float]]:
    """What was measured and what is allowed, for one arm on a pedestal with a gripper.

    Args:
        name: The robot.
        place: An empty folder.
        checkout: MoveIt 2.
    """
    core = checkout.resolve() / "moveit_core"
    includes = [f"-I{core / each / 'include'}" for each in _INCLUDED]
    source = core / "kinematics_base" / "src" / "kinematics_base.cpp"
    arm = Arm(compiled(place, name, includes, [CALLS, source]), Model(file_of(name)))
    rng = np.random.default_rng(1)
    links = " ".join(arm.model.poses(arm.model.random(rng)))
    vectors = [arm.model.random(rng) for _ in range(_POSES)]
    seeds = [arm.model.random(rng) for _ in range(_POSES)]
    lines = [
        line
        for q, seed in zip(vectors, seeds, strict=True)
        for line in (arm.seed(q), f"fk {links}", arm.target(q), "ik", arm.seed(seed), "ik", "search 4 1 0")
    ]
    answers = arm.ask(*lines)
    calls = [answers[place::6] for place in range(4)]  # a search prints what it offered and its time too
    missed = sum(not each.good for call in calls for each in call)
    yield f"calls without a solution, of {4 * _POSES}", float(missed), 0.0
    pairs = list(zip(calls[0], vectors, strict=True))
    yield "links against elementary transforms, m or 1", max(_links_off(arm, *pair) for pair in pairs), 1e-12
    same = zip(calls[1], vectors, strict=True)
    yield "joints for the pose of the seed, rad", max(_joints_off(arm, *pair) for pair in same), 1e-9
    for what, call in (("from another seed", calls[2]), ("by a search", calls[3])):
        off = max(_tip_off(arm, *pair) for pair in zip(call, vectors, strict=True))
        yield f"tip for a pose {what}, m or 1", off, 1e-6


def _links_off(arm: Arm, answer: Answer, q: np.ndarray) -> float:
    positions = np.array([pose[:3, 3] for pose in arm.model.poses(q).values()])
    return float(np.abs(answer.rows(7)[:, :3] - positions).max())


def _joints_off(arm: Arm, answer: Answer, q: np.ndarray) -> float:
    return float(np.abs(arm.joints(answer)[0] - q).max()) if answer.good else np.inf


def _tip_off(arm: Arm, answer: Answer, q: np.ndarray) -> float:
    return float(np.abs(arm.tip(arm.joints(answer)[0]) - arm.tip(q)).max()) if answer.good else np.inf
