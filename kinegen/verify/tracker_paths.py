"""Paths on which trackers are tried, with the joint speeds that a twist of the tool costs along them."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.solver_parameters import TRACKING
from kinegen.derive.inverse.derive import family_of
from kinegen.derive.inverse.solve import reads_attitude
from kinegen.errors import ProofError
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.robot import TOOL, Robot
from kinegen.support.dataclass import dataclass
from kinegen.verify import reference
from kinegen.verify.invocations import DTYPES
from kinegen.verify.samples import SEED, FloatArray, Truths, random_joints, singular_samples

SAMPLES = 60
"""Samples of a line."""

LONGEST = 1.2
"""A joint turns by no more along a line, in rad; a stroke is a third of its range at most."""

NULL = 1e-18
"""The squared length of a column that rounding leaves of a joint which moves nothing."""

REGULAR = {"double": 1e-3, "float": 1e-2}
"""Samples whose product of squared sines is larger are regular."""

MATCHING = {"float64": 1e-6, "float32": 1e-4}
"""A solution this near to a joint vector, strokes as parts of the reach, is that joint vector."""

APART = 0.5
"""Two branches that meet at a fold are nearer to each other; at a wrist, joints are half a turn apart."""

BESIDE = 8
"""Samples on either side of a place where branches meet."""


@dataclass(frozen=True, slots=True)
class Lines:
    """Lines in the joint space, all with the same number of samples."""

    q: FloatArray  # Joint vectors, shape (lines, samples, dof)
    targets: FloatArray  # Their poses, shape (lines, samples, 4, 4)
    given: FloatArray | None  # What is given with the poses, shape (lines, samples); None where nothing is
    # Product of the squared sines at which the columns of the Jacobian meet, shape (lines, samples)
    regular: FloatArray

    def inputs(self, line: int, first: int, last: int, dtype: Any) -> tuple[Any, ...]:
        """Returns what a tracker follows on a part of a line."""
        part = slice(first, last)
        given = () if self.given is None else (self.given[line, part].astype(dtype),)
        return (self.targets[line, part].astype(dtype), *given)


def lines_of(robot: Robot, count: int) -> Lines:
    """Random lines, and others whose middle sample is singular."""
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
    """Lines with their poses. `q`: joint vectors, shape (lines, samples, dof)."""
    flat = q.reshape(-1, robot.dof)
    targets = reference.pose(robot, flat)[:, 0].reshape(*q.shape[:2], 4, 4)
    given = reference.redundancy(robot, flat).reshape(q.shape[:2]) if robot.redundancy else None
    return Lines(q, targets, given, regularity(robot, flat).reshape(q.shape[:2]))


def weighted_jacobians(robot: Robot, q: FloatArray, size: float = 0.0) -> FloatArray:
    """Jacobians (N, rows, joints that move), lengths in thirds of the reach; the given joint is left out.

    A kernel has the reach of the robot file also where it is given other parameters: `size` is this one.
    """
    third = (size or reach(robot, robot.tips)) / 3
    rows = 6 if reads_attitude(family_of(robot)) else 3
    weights = np.array([1 / third] * 3 + [1.0] * 3)[:rows, None]
    strides = np.array([third if infinite else 1.0 for infinite in shifts(robot)])
    jacobians = reference.Kinematics(robot, q).jacobian(TOOL)[:, :rows] * weights * strides
    found: FloatArray = jacobians[..., moving(robot)]
    return found


def shifts(robot: Robot) -> tuple[bool, ...]:
    """Returns which joints shift."""
    return tuple(variable.type.value == "prismatic" for variable in robot.variables)


def moving(robot: Robot) -> Truths:
    """Returns which joints a target moves: all but one that is given besides it."""
    return np.array([variable.name != robot.redundancy for variable in robot.variables])


def regularity(robot: Robot, q: FloatArray) -> FloatArray:
    """Returns the same as `spreads`, but 0 where a column is null: joint 1 of a polar arm with its tip on axis 1."""
    lengths = (weighted_jacobians(robot, q) ** 2).sum(axis=1)
    found: FloatArray = np.where((lengths > NULL).all(axis=1), spreads(robot, q), 0)
    return found


def spreads(robot: Robot, q: FloatArray, size: float = 0.0) -> FloatArray:
    """Products of the squared sines of the angles at which each column of a Jacobian meets those before it, (N,)."""
    jacobians = weighted_jacobians(robot, q, size)
    lengths = (jacobians**2).sum(axis=1)
    diagonals = np.diagonal(np.linalg.qr(jacobians, mode="r"), axis1=1, axis2=2) ** 2
    found: FloatArray = np.prod(diagonals / np.where(lengths > 0, lengths, 1), axis=1)
    return found


class Labels:
    """The branches of lines, by all solutions of the package for each sample.

    Args:
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
        size = package.inverse_tracker.reach
        self._apart = np.where(valid, np.where(turns > 0, turned, apart / size).max(axis=3), np.inf)
        nearest = self._apart.argmin(axis=2)
        self.branch = np.where(self._apart.min(axis=2) < MATCHING[str(solutions.dtype)], nearest, -1)

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


ACCEPTED = {"double": 1e-7, "float": 3e-2}
"""How far speeds may be from the formula, relative to the largest one and to the size of the twist."""

_MOST = 0.3
"""The bound of all speeds in one of the calls."""


def require_speeds(robot: Robot, name: str, make: Callable[..., Any], real: str, count: int, size: float) -> None:
    """See that speeds, residuals and the part of a twist that bounds allow are those of the formula.

    `make`: makes a tracker at a joint vector; `count`: joint vectors, random ones and singular ones; `size`: the reach
    that lengths count beside: that of the robot file, whatever the runtime parameters are. Raises `ProofError` saying
    which of them is wrong.
    """
    special = singular_samples(robot)[:count]
    points = np.concatenate([random_joints(robot, count, SEED), special]).astype(DTYPES[real]).astype(np.float64)
    twists = np.random.default_rng(SEED).uniform(-1, 1, (len(points), 6))
    twists[:, :3] *= size / 3
    twists = twists.astype(DTYPES[real]).astype(np.float64)
    jacobians = reference.Kinematics(robot, points).jacobian(TOOL)
    units = np.array([size / 3] * 3 + [1.0] * 3)
    for q, twist, jacobian, wanted in zip(
        points, twists, jacobians, _formula(robot, points, twists, real, size), strict=True
    ):
        try:
            tracker = make(q.astype(DTYPES[real]))
        except ValueError:
            continue  # in float, an end of the joint box may be outside the limits
        free, bounded = tracker.speeds(twist), tracker.speeds(twist, max_speed=_MOST)
        scale = ACCEPTED[real] * (1 + np.abs(wanted).max() + np.abs(wanted / _strides(robot, size)).max())
        if np.abs((free.qd - wanted) / _strides(robot, size)).max() > scale:
            raise ProofError(f"{name} gives other joint speeds than damped least squares; nothing was written")
        if np.abs((free.residual - (twist - jacobian @ free.qd)) / units).max() > scale:
            raise ProofError(f"{name} reports another residual of a twist than there is; nothing was written")
        factor = min(1.0, float(_MOST / max(np.abs(free.qd).max(), 1e-300)))
        if free.factor != 1 or abs(bounded.factor - factor) > 1e-5 or not np.array_equal(bounded.qd, free.qd):
            raise ProofError(f"{name} gives another part of a twist than bounds allow; nothing was written")


def _strides(robot: Robot, size: float) -> FloatArray:
    return np.array([size / 3 if each else 1.0 for each in shifts(robot)])


def _formula(robot: Robot, q: FloatArray, twists: FloatArray, real: str, size: float) -> FloatArray:
    """(J^T J + k)^-1 J^T V by singular values, with k of Nakamura and Hanafusa; 0 for a joint that is given."""
    jacobians, moves = weighted_jacobians(robot, q, size), moving(robot)
    rows = jacobians.shape[1]
    weights = np.array([3 / size] * 3 + [1.0] * 3)
    near = np.maximum(1 - spreads(robot, q, size) / float(TRACKING.near[ScalarType(real)]), 0)
    least = float(TRACKING.least_damping[ScalarType(real)])
    damping = np.where(near > 0, near**2 * float(TRACKING.speed_damping) + least, 0)
    u, s, vt = np.linalg.svd(jacobians, full_matrices=False)
    gains = s / (s**2 + damping[:, None] + 1e-30)
    parts = np.einsum("nij,ni->nj", u, (twists * weights)[:, :rows]) * gains
    found = np.zeros((len(q), robot.dof))
    found[:, moves] = np.einsum("nij,ni->nj", vt, parts)
    return found * _strides(robot, size)
