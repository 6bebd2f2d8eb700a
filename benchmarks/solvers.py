"""Solvers of other tools for joint values of poses, set up from the same table; absent ones are left out.

EAIK and ssik compute closed forms from axes and offsets; Robotics Toolbox for Python descends in C, with joint limits.
"""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.speed.arm import Array, Link, links
from benchmarks.speed.peers.robotics_toolbox import _steps
from kinegen.model.joint_bounds import joint_box
from kinegen.model.robot import Robot

TOLERANCE = 5e-13
"""Half the square of 1e-6: Robotics Toolbox accepts what its error is below, half of the squared way to go."""


@dataclass(frozen=True, slots=True)
class Solver:
    """A way to find joint values.

    Attributes:
        name: What it is called in the table.
        targets: How many targets it is given; slow ones get few.
        run: What is timed, from targets (N, 4, 4) and starts (N, dof).
        solutions: From its result to the joint vectors of each target, shape (solutions, dof).
    """

    name: str
    targets: int
    run: Callable[[Array, Array], Any]
    solutions: Callable[[Any], list[Array]]


def closed_forms(robot: Robot) -> Iterator[Solver]:
    """EAIK, of many targets and one by one, and ssik."""
    axes, offsets, last = _axes(links(robot))
    if _is_installed("eaik"):
        made = importlib.import_module("eaik.IK_HP").HPRobot(axes, offsets)
        yield Solver("EAIK, batch", 5000, lambda targets, _: made.IK_batched(targets @ last.T, 1), _of_eaik)
        yield Solver(
            "EAIK, one a call", 5000, lambda targets, _: [made.IK(each) for each in targets @ last.T], _of_eaik
        )
    if _is_installed("ssik"):
        arm = importlib.import_module("ssik").Manipulator.from_axes(axes, offsets)

        def solve(targets: Array, _: Array) -> Any:
            return [arm.solve(each, respect_limits=False, enumerate_windings=False) for each in targets @ last.T]

        yield Solver("ssik", 300, solve, _of_ssik)


def descents(robot: Robot) -> Iterator[tuple[int, Solver]]:
    """Robotics Toolbox with as many restarts as the number says, and ssik for one solution of a seven-joint arm."""
    if _is_installed("roboticstoolbox"):
        rtb: Any = importlib.import_module("roboticstoolbox")
        sequence = rtb.ETS()
        for step in (step for link in links(robot) for step in _steps(rtb.ET, link)):
            sequence *= step
        sequence = sequence.compile()
        sequence.qlim = np.array(joint_box(robot)).T
        for restarts in (10, 99):

            def descend(targets: Array, starts: Array, searches: int = restarts + 1) -> Any:
                return [
                    sequence.ik_LM(target, q0=start, slimit=searches, tol=TOLERANCE, joint_limits=True)
                    for target, start in zip(targets, starts, strict=True)
                ]

            yield restarts, Solver(f"Robotics Toolbox, {restarts} restarts", 1000, descend, _of_toolbox)
    if _is_installed("ssik") and robot.dof > 6:
        axes, offsets, last = _axes(links(robot))
        arm = importlib.import_module("ssik").Manipulator.from_axes(axes, offsets, limits=np.array(joint_box(robot)))

        def solve(targets: Array, _: Array) -> Any:
            return [arm.solve(each, max_solutions=1) for each in targets @ last.T]

        yield 99, Solver("ssik, one solution", 100, solve, _of_ssik)


def _of_eaik(found: Any) -> list[Array]:
    return [np.array(each.Q)[~np.array(each.is_LS, dtype=bool)] for each in found]


def _of_ssik(found: Any) -> list[Array]:
    return [np.array([solution.q for solution in each]) for each in found]


def _of_toolbox(found: Any) -> list[Array]:
    return [np.array([each.q] if each.success else []) for each in found]


def _axes(table: tuple[Link, ...]) -> tuple[Array, Array, Array]:
    """Axes and offsets from joint to joint where all variables are zero, in the base frame.

    The last rotation comes as a displacement: these tools know no frame behind the last axis that is turned.
    """
    pose, last, axes, offsets = np.eye(4), np.zeros(3), [], []
    for link in table:
        moved = pose @ np.array(link.matrix(np.cos(float(link.theta)), np.sin(float(link.theta))), dtype=float)
        at = pose if link.standard else moved
        if link.joint is not None:
            axes.append(at[:3, 2])
            offsets.append(at[:3, 3] - last)
            last = at[:3, 3]
        pose = moved
    turned = np.eye(4)
    turned[:3, :3] = pose[:3, :3]
    return np.array(axes), np.array([*offsets, pose[:3, 3] - last]), turned


def _is_installed(name: str) -> bool:
    return importlib.util.find_spec(name) is not None
