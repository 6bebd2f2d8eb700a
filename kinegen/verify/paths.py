"""Paths in the joint space on which trackers are tried: lines, what branch each sample is in, and where branches meet.

In: a robot and its package. Out: joint vectors with their poses, and the reference's own view of how regular they are.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen import reference
from kinegen.robot.extent import joint_box, reach
from kinegen.robot.model import TOOL, Robot
from kinegen.symbolic.inverse.derive import family_of
from kinegen.symbolic.inverse.solve import reads_attitude
from kinegen.verify.samples import SEED, singular_samples

FloatArray = NDArray[np.float64]
Truths = NDArray[np.bool_]

SAMPLES = 60
"""Samples of a line."""

LONGEST = 1.2
"""A joint turns by no more along a line, in rad; a stroke is a third of its range at most."""

REGULAR = {"double": 1e-3, "float": 1e-2}
"""Samples whose product of squared sines is larger are regular."""

MATCHING = 1e-6
"""A solution this near to a joint vector is that joint vector."""

APART = 0.5
"""Two branches that meet at a fold are nearer to each other; at a wrist, joints are half a turn apart."""

BESIDE = 8
"""Samples on either side of a place where branches meet."""


@dataclass(frozen=True, slots=True)
class Lines:
    """Lines in the joint space, all with the same number of samples.

    Attributes:
        q: Joint vectors, shape (lines, samples, dof).
        targets: Their poses, shape (lines, samples, 4, 4).
        given: What is given with the poses, shape (lines, samples); None where nothing is.
        regular: Product of the squared sines at which the columns of the Jacobian meet, shape (lines, samples).
    """

    q: FloatArray
    targets: FloatArray
    given: FloatArray | None
    regular: FloatArray

    def inputs(self, line: int, first: int, last: int, dtype: Any) -> tuple[Any, ...]:
        """What a tracker follows on a part of a line."""
        part = slice(first, last)
        given = () if self.given is None else (self.given[line, part].astype(dtype),)
        return (self.targets[line, part].astype(dtype), *given)


def lines_of(robot: Robot, count: int) -> Lines:
    """Random lines, and others whose middle sample is singular.

    Args:
        robot: The robot.
        count: How many of each kind.
    """
    generator = np.random.default_rng(SEED)
    low, high = np.array(joint_box(robot)).T
    longest = np.where(low < -1e300, LONGEST, np.minimum((high - low) / 3, LONGEST)) / 2
    middle = generator.uniform(low + longest, high - longest, (count, robot.dof))
    special = singular_samples(robot)
    chosen = special[generator.integers(0, len(special), count)]
    middle = np.concatenate([middle, np.clip(chosen, low + longest, high - longest)])
    way = generator.uniform(-1, 1, middle.shape) * longest
    places = np.arange(-SAMPLES // 2, SAMPLES // 2 + 1) / (SAMPLES // 2)
    return sampled(robot, middle[:, None] + places[:, None] * way[:, None])


def sampled(robot: Robot, q: FloatArray) -> Lines:
    """Lines with their poses.

    Args:
        robot: The robot.
        q: Joint vectors, shape (lines, samples, dof).
    """
    flat = q.reshape(-1, robot.dof)
    targets = reference.pose(robot, flat)[:, 0].reshape(*q.shape[:2], 4, 4)
    given = reference.redundancy(robot, flat).reshape(q.shape[:2]) if robot.redundancy else None
    return Lines(q, targets, given, spreads(robot, flat).reshape(q.shape[:2]))


def weighted_jacobians(robot: Robot, q: FloatArray) -> FloatArray:
    """Jacobians (N, rows, joints that move), lengths in thirds of the reach; the given joint is left out."""
    third = reach(robot, robot.tips) / 3
    rows = 6 if reads_attitude(family_of(robot)) else 3
    weights = np.array([1 / third] * 3 + [1.0] * 3)[:rows, None]
    strides = np.array([third if infinite else 1.0 for infinite in shifts(robot)])
    jacobians = reference.Kinematics(robot, q).jacobian(TOOL)[:, :rows] * weights * strides
    found: FloatArray = jacobians[..., moving(robot)]
    return found


def shifts(robot: Robot) -> tuple[bool, ...]:
    """Which joints shift."""
    return tuple(variable.type.value == "prismatic" for variable in robot.variables)


def moving(robot: Robot) -> Truths:
    """Which joints a target moves: all but one that is given besides it."""
    return np.array([variable.name != robot.redundancy for variable in robot.variables])


def spreads(robot: Robot, q: FloatArray) -> FloatArray:
    """Products of the squared sines of the angles at which each column of a Jacobian meets those before it, (N,)."""
    jacobians = weighted_jacobians(robot, q)
    lengths = (jacobians**2).sum(axis=1)
    diagonals = np.diagonal(np.linalg.qr(jacobians, mode="r"), axis1=1, axis2=2) ** 2
    found: FloatArray = np.prod(diagonals / np.where(lengths > 0, lengths, 1), axis=1)
    return found


class Labels:
    """The branches of lines, by all solutions of the package for each sample.

    Args:
        package: The package, imported.
        lines: The lines.
        params: Values of the runtime parameters; None for those of the robot file.
    """

    def __init__(self, package: Any, lines: Lines, params: Any) -> None:
        given = () if lines.given is None else (lines.given,)
        solutions, valid = package.inverse(lines.targets, *given, params=params)
        turns = np.array(package.inverse.turnings[0])[:, 0]
        apart = np.abs(solutions - lines.q[:, :, None])
        whole = np.where(turns > 0, turns, 1)
        turned = np.abs((apart + whole / 2) % whole - whole / 2)
        self.lines = lines
        self._apart = np.where(valid, np.where(turns > 0, turned, apart).max(axis=3), np.inf)
        nearest = self._apart.argmin(axis=2)
        self.branch = np.where(self._apart.min(axis=2) < MATCHING, nearest, -1)

    def runs(self, real: str) -> Iterator[tuple[int, int, int]]:
        """The longest part of each line that is regular and in one branch: line, first sample, behind the last."""
        usable = np.where(self.lines.regular > REGULAR[real], self.branch, -1)
        for line, labels in enumerate(usable):
            ends = [0, *(np.flatnonzero(np.diff(labels)) + 1).tolist(), len(labels)]
            parts = [(last - first, first, last) for first, last in itertools.pairwise(ends) if labels[first] >= 0]
            length, first, last = max(parts, default=(0, 0, 0))
            if length > BESIDE:
                yield line, first, last

    def passes(self) -> Iterator[tuple[int, int, int]]:
        """Where a line goes from one branch straight into another that is far from what becomes of the first one."""
        for line, labels in enumerate(self.branch):
            known = np.flatnonzero(labels >= 0)
            for before, after in itertools.pairwise(known.tolist()):
                first, last = before - BESIDE, after + BESIDE + 1
                if labels[before] == labels[after] or after - before > 2 or first < 0 or last > len(labels):
                    continue
                sides = {*labels[first : before + 1]} == {labels[before]}, {*labels[after:last]} == {labels[after]}
                # Nothing else is near: neither what becomes of the first branch, nor another that meets it at a fold.
                if all(sides) and np.sort(self._apart[line, [before, after]], axis=1)[:, 1].min() > APART:
                    yield line, first, last
