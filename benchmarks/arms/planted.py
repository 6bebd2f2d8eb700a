"""Whether the joint vector that a target came from is among the solutions.

The package of the arm computes with NumPy, which takes no compiler; compiled packages are proven by their build.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from benchmarks.arms.ways import BOTH, COMPLETE, GIVEN, Way
from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.inverse.derive import family_of, singular_below, size_of
from kinegen.driver.artifacts import bundle_of, texts_of
from kinegen.driver.pipeline import lower_robot
from kinegen.driver.results import BuildOptions
from kinegen.model.joint_bounds import joint_box
from kinegen.model.outputs import COMPLETE_INVERSE, Kind, Quantity
from kinegen.model.robot import TOOL, JointType, Robot
from kinegen.runtime.extension import load_package
from kinegen.verify import reference

Array = NDArray[np.float64]
Truths = NDArray[np.bool_]

INVERSE = Quantity(Kind.INVERSE)
NEAR = 1e-5
SINGULAR = 1e-3
"""The least singular value of the Jacobian, lengths by the reach, below which rounding moves joints."""


def missed(way: Way, count: int) -> tuple[int, int]:
    """How many of so many planted joint vectors are not found, and how many besides are beside singular poses.

    Args:
        way: How the arm is solved; each of its robots is tried.
        count: Random joint vectors for each robot.
    """
    lost = beside = 0
    for robot in way.robots:
        low, high = np.array(joint_box(robot)).T
        q = np.random.default_rng(7).uniform(low, high, (count, robot.dof))
        away = ~_found(robot, way, q)
        singular = _singular(robot, way, q)
        lost += int((away & ~singular).sum())
        beside += int((away & singular).sum())
    return lost, beside


def _found(robot: Robot, way: Way, q: Array) -> Truths:
    targets = reference.pose(robot, q)[:, 0]
    if way.kind in (COMPLETE, BOTH):
        solutions, valid = _package(robot, COMPLETE_INVERSE).complete_inverse(targets)
    else:
        given = (reference.redundancy(robot, q),) if way.kind == GIVEN else ()
        solutions, valid = _package(robot, INVERSE).inverse(targets, *given)
    apart = np.abs(solutions - q[:, None])
    turns = np.array([each.type is not JointType.PRISMATIC for each in robot.variables])
    apart = np.where(turns, np.abs((apart + np.pi) % (2 * np.pi) - np.pi), apart).max(axis=2)
    found: Truths = np.where(valid, apart, np.inf).min(axis=1) < NEAR
    return found


def _singular(robot: Robot, way: Way, q: Array) -> Truths:
    """Whether joint vectors are so near to singular ones that another solution will do, or that branches merge."""
    below, size, held = SINGULAR, sum(np.ptp(reference.pose(robot, q)[:, 0, :3, 3], axis=0)) / 2, None
    if way.kind not in (COMPLETE, BOTH):
        family = family_of(robot)
        below, size, held = max(below, singular_below(robot, family)), size_of(robot, family), family.held
    jacobians = reference.Kinematics(robot, q).jacobian(TOOL) * np.array([1 / size] * 3 + [1.0] * 3)[:, None]
    if held is not None:
        jacobians = np.delete(jacobians, held.number - 1, axis=2)
    found: Truths = np.linalg.svd(jacobians, compute_uv=False).min(axis=1) < below
    return found


def _package(robot: Robot, quantity: Quantity) -> ModuleType:
    """The package of an arm without a compiled part."""
    options = BuildOptions(reals=(ScalarType.DOUBLE,), quantities=(Quantity.POSE, quantity), compile=False)
    kernels = lower_robot(robot, options.quantities)
    texts = texts_of(bundle_of(kernels, integers=False), options)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / robot.name
        for name, text in texts.package(None).items():
            (place / name).parent.mkdir(parents=True, exist_ok=True)
            (place / name).write_text(str(text), encoding="utf-8")
        return load_package(place)
