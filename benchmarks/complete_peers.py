"""All solutions of arms without a usual closed form, against other tools: `python -m benchmarks.complete_peers`.

ssik and EAIK get the same targets, where they are installed and solve the arm. Six joints: ssik's own arms, and all
solutions for each target. Seven joints: ssik chooses itself what is redundant, so each solution
that it finds is asked of kinegen with the redundancy that this solution has; EAIK holds the last joint at one value.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from benchmarks.arms.sources import ssik
from benchmarks.speed.arm import ROBOTS, Array
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import build
from kinegen.driver.results import BuildOptions
from kinegen.io.load import load
from kinegen.model.joint_bounds import joint_box
from kinegen.model.outputs import COMPLETE_INVERSE, Kind, Quantity
from kinegen.model.robot import TOOL, Robot
from kinegen.runtime.extension import load_package
from kinegen.verify import reference

SIX = ("kinova_jaco2", "fanuc_crx10ial", "ufactory_xarm6", "kinova_gen3_lite")
"""Arms of ssik, which has modules for them; setting up such an arm from its axes takes minutes there."""

SEVEN = ("panda_joint_7", "iiwa14_arm_angle")
INVERSE = Quantity(Kind.INVERSE)
HOLDS, SAME = 1e-6, 1e-4
"""How near the pose of a solution must be to its target to count, and two solutions to be the same, in rad."""

BATCH = 20_000
"""Targets that kinegen is timed at."""


def main() -> None:
    """Print a line for each arm and tool."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.complete_peers")
    parser.add_argument("arms", nargs="*", default=[*SIX, *SEVEN], help="robots, all of them if left out")
    parser.add_argument("--targets", type=int, default=50, help="targets for the other tools")
    options = parser.parse_args()
    print("arm               tool  us a target    ours  times faster  solutions    ours  of theirs not among ours")
    for name in options.arms:
        for row in (against if name in SIX else against_given)(name, options.targets):
            print(row, flush=True)


def against(name: str, count: int) -> Iterator[str]:
    """Six joints: the complete inverse and ssik's module of the arm."""
    if importlib.util.find_spec("ssik") is None:
        return
    maker, _, model = name.partition("_")
    module = importlib.import_module(f"ssik.prebuilt.{maker}.{model}_ik")
    robot = next(ssik(name)).robot
    package = _package(robot, COMPLETE_INVERSE)
    targets = reference.pose(robot, _random(robot, BATCH))[:, 0]
    mine, (solutions, valid) = _timed(partial(package.complete_inverse, targets))
    theirs, found = _timed(lambda: [_joined([q.q for q in module.solve(each)], robot) for each in targets[:count]])
    found = [_holding(robot, q, target) for q, target in zip(found, targets, strict=False)]
    lost = sum(_lost(q, solutions[row][valid[row]]) for row, q in enumerate(found))
    yield _row(name, "ssik", (theirs / count, mine / BATCH), (sum(map(len, found)), int(valid[:count].sum())), lost)


def against_given(name: str, count: int) -> Iterator[str]:
    """Seven joints: the closed form with what is given."""
    robot = load(ROBOTS / f"{name}.yaml")
    package = _package(robot, INVERSE)
    q = _random(robot, BATCH)
    q[:, -1] = q[0, -1]
    targets, given = reference.pose(robot, q)[:, 0], reference.redundancy(robot, q)
    mine, (_, valid) = _timed(partial(package.inverse, targets, given))
    last = float(q[0, -1]) if robot.redundancy == robot.variables[-1].name else None
    for tool, solve in _tools(robot, last):
        theirs, found = _timed(partial(_each, solve, targets[:count]))
        found = [_holding(robot, each, target) for each, target in zip(found, targets, strict=False)]
        lost = 0
        for target, each in zip(targets, found, strict=False):
            own, good = package.inverse(np.repeat(target[None], len(each), axis=0), reference.redundancy(robot, each))
            lost += sum(_lost(one[None], own[row][good[row]]) for row, one in enumerate(each))
        counts = sum(map(len, found)), int(valid[:count].sum())
        yield _row(name, tool, (theirs / count, mine / BATCH), counts, lost)


def _row(name: str, tool: str, seconds: tuple[float, float], counts: tuple[int, int], lost: int) -> str:
    theirs, mine = (1e6 * each for each in seconds)
    return f"{name:<18}{tool:<6}{theirs:11.1f}{mine:8.2f}{theirs / mine:14.1f}{counts[0]:11}{counts[1]:8}{lost:9}"


def _tools(robot: Robot, last: float | None) -> Iterator[tuple[str, Callable[[Array], Array]]]:
    """Each tool that is installed and solves the arm, as a function from a target to joint vectors."""
    axes, offsets, turn = _lines(robot)
    if importlib.util.find_spec("ssik") is not None:
        limits = np.array(joint_box(robot))
        arm = importlib.import_module("ssik").Manipulator.from_axes(axes, offsets, limits=limits)
        yield "ssik", lambda target: _joined([each.q for each in arm.solve(target @ turn)], robot)
    if importlib.util.find_spec("eaik") is not None and last is not None:
        made: Any = importlib.import_module("eaik.IK_HP").HPRobot(axes, offsets, [(robot.dof - 1, last)])
        # EAIK ends the process where it has no decomposition.
        if made.hasKnownDecomposition():
            yield "EAIK", lambda target: _of_eaik(made.IK(target @ turn), robot)


def _of_eaik(found: Any, robot: Robot) -> Array:
    return _joined([q for q, nearly in zip(found.Q, found.is_LS, strict=True) if not nearly], robot)


def _joined(rows: list[Any], robot: Robot) -> Array:
    return np.array(rows, dtype=float).reshape(-1, robot.dof)


def _lines(robot: Robot) -> tuple[Array, Array, Array]:
    """Axes, offsets from each to the next, and the rotation of the tool as a displacement, where all joints are 0."""
    motion = reference.Kinematics(robot, np.zeros((1, robot.dof)))
    pose, jacobian = motion.pose(TOOL)[0], motion.jacobian(TOOL)[0]
    axes = jacobian[3:].T
    points = pose[:3, 3] + np.cross(axes, jacobian[:3].T)
    # As near to the one before as may be, so that axes that meet have one point.
    for place in range(1, robot.dof):
        one, other, way = axes[place - 1], axes[place], points[place] - points[place - 1]
        slant = one @ other
        if abs(slant) < 1 - 1e-9:
            points[place] += other * ((slant * (one @ way) - other @ way) / (1 - slant**2))
    turn = np.eye(4)
    turn[:3, :3] = pose[:3, :3].T
    places = np.concatenate([np.zeros((1, 3)), points, pose[None, :3, 3]])
    return axes, np.diff(places, axis=0), turn


def _each(solve: Callable[[Array], Array], targets: Array) -> list[Array]:
    return [solve(target) for target in targets]


def _holding(robot: Robot, q: Array, target: Array) -> Array:
    """The joint vectors within the limits that lead to a target, each once, whole turns brought to the middle."""
    low, high = np.array(joint_box(robot)).T
    q = q - 2 * np.pi * np.round((q - (low + high) / 2) / (2 * np.pi))
    apart = np.abs(reference.pose(robot, q)[:, 0] - target).max(axis=(1, 2)) if len(q) else np.zeros(0)
    q = q[(apart < HOLDS) & ((q >= low - HOLDS) & (q <= high + HOLDS)).all(axis=1)]
    once: list[Array] = []
    for each in q:
        if not once or _lost(each[None], np.array(once)):
            once.append(each)
    return np.array(once).reshape(-1, robot.dof)


def _lost(theirs: Array, ours: Array) -> int:
    """How many joint vectors are not among ours, whole turns aside."""
    apart = np.abs((theirs[:, None] - ours[None] + np.pi) % (2 * np.pi) - np.pi).max(axis=2)
    return int((apart.min(axis=1, initial=np.inf) > SAME).sum())


def _random(robot: Robot, count: int) -> Array:
    low, high = np.array(joint_box(robot)).T
    return np.random.default_rng(3).uniform(low, high, (count, robot.dof))


def _timed(call: Callable[[], Any]) -> tuple[float, Any]:
    """Seconds of the processor, and the result."""
    start = time.process_time()
    found = call()
    return time.process_time() - start, found


def _package(robot: Robot, quantity: Quantity) -> ModuleType:
    with tempfile.TemporaryDirectory() as folder:
        options = BuildOptions(output=Path(folder), reals=(ScalarType.DOUBLE,), quantities=(Quantity.POSE, quantity))
        return load_package(build(robot, options, lambda _: None).folder)


if __name__ == "__main__":
    main()
