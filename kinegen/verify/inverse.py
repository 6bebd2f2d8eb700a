"""The proof of an inverse: what it solves leads back to the target, and nothing that can be reached is missed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen import reference
from kinegen.errors import ProofError
from kinegen.outputs import Quantity
from kinegen.robot.extent import joint_box, reach
from kinegen.robot.model import TOOL, Robot
from kinegen.symbolic.expressions import number_of
from kinegen.symbolic.inverse.derive import family_of
from kinegen.symbolic.inverse.family import Aim, Family
from kinegen.symbolic.inverse.places import alignments, boundaries
from kinegen.symbolic.inverse.thresholds import thresholds_of
from kinegen.verify.branches import require_names
from kinegen.verify.impossible import refuse_the_impossible
from kinegen.verify.nearest import require_nearest
from kinegen.verify.samples import RANDOM, SEED, proof_samples
from kinegen.verify.ways import DTYPES, Way, ways_to_call

FloatArray = NDArray[np.float64]
Truths = NDArray[np.bool_]

TARGETS = 100_000
"""Random joint vectors whose poses are solved for, by the first way to call the kernel."""

FEWER = 4000
"""The same for every other way."""

TARGETS_APART = 120
"""Joint vectors from whose poses impossible targets are made."""

AT_LIMITS = "at a limit"

NAMED = 200
"""Targets whose solutions are held against the names of their branches, in every way."""

ACCEPTED = {"double": 1e-9, "float": 3e-5}
"""How far the pose of a solution may be from the target: radians, and lengths relative to the reach."""

SAME = {"double": 1e-6, "float": 1e-2}
"""How near a solution must be to the joint vector that the target came from: radians or lengths. Four times what a
joint may be found outside its limits is near enough, too."""

SINGULAR = 1e-3
"""Where the least singular value of the Jacobian, lengths relative to the reach, is below this, the rounding of a
target may move joints by more; any solution that leads there will then do."""

LOST = {"double": 0.0, "float": 0.002}
"""The part of the targets whose joint vectors may be missed: in float rounding may carry one past a limit."""

UNSOLVED = 0.02
"""The part of the special targets that may have no solution at all."""


@dataclass(frozen=True, slots=True)
class Trial:
    """One way to call an inverse, tried at many targets.

    Attributes:
        target: What was called.
        poses: Number of targets.
        solutions: Number of valid solutions.
        position_error: Largest distance of a solution's pose from its target, in a coordinate.
        rotation_error: The same for entries of the rotation; 0 where the arm is not solved for it.
        accepted: Accepted error of a rotation, and of a position relative to the reach.
        worst: Joint vector of the target with the largest error.
        moved: Number of random targets beside singular poses whose joint vector rounding moved, see `SINGULAR`.
        special: For each kind of special target its name, how many there were, and how many have a solution.
    """

    target: str
    poses: int
    solutions: int
    position_error: float
    rotation_error: float
    accepted: float
    worst: tuple[float, ...]
    moved: int
    special: tuple[tuple[str, int, int], ...]


def try_inverse(
    robot: Robot, package: ModuleType, quantity: Quantity, real: str, parameters: tuple[float, ...] | None = None
) -> tuple[Trial, ...]:
    """Solve for the poses of many joint vectors in every way, and see where the solutions lead.

    Args:
        robot: The robot, with the values of the runtime parameters that are tried.
        package: Its generated package, imported.
        quantity: The inverse.
        real: A number type that it was built for.
        parameters: Values of the runtime parameters; those of the robot file if left out.

    Returns:
        One trial for each way to call the kernel.

    Raises:
        ProofError: If a target is solved without the joint vector that it came from, if a valid solution is not finite,
            breaks a limit or stands in a branch of another name, if a target that is not a pose or out of reach is said
            to be solved, or if `nearest=` gives another solution than the nearest.
    """
    family = family_of(robot)
    near = thresholds_of(family, reach(robot))
    rooms = np.array([number_of(near.room(joint), single=real == "float") for joint in family.axes.joints])
    tester = _Tester(robot, package, quantity, family, real, rooms)
    ways = ways_to_call(package, quantity, real, parameters)
    first = next((way for way in ways if "batch" in way.target), ways[-1])
    refuse_the_impossible(robot, family, package, quantity, ways, real, _random(robot, TARGETS_APART, SEED))
    most = TARGETS if real == "double" and parameters is None else FEWER
    trials = tuple(tester.trial(way, most if way is first else FEWER) for way in ways)
    require_nearest(robot, family, package, quantity, real, rooms, parameters)
    return trials


def counts_line(trial: Trial) -> str:
    """A trial in one sentence."""
    solved = ", ".join(f"{some:,} of {all_:,} {name}" for name, all_, some in trial.special)
    random = trial.poses - sum(all_ for _, all_, _ in trial.special)
    moved = f" (rounding moved {trial.moved:,}, beside singular poses)" if trial.moved else ""
    return (
        f"inverse: {random:,} random targets, each solved by the joint vector that it came from{moved}, "
        f"{trial.solutions:,} solutions in all; also solved: {solved}; no unreachable or NaN target, and "
        "none that is not a pose, was reported as solved"
    )


@dataclass(frozen=True, slots=True)
class _Tester:
    robot: Robot
    package: ModuleType
    quantity: Quantity
    family: Family
    real: str
    rooms: FloatArray

    def trial(self, way: Way, count: int) -> Trial:
        """Try one way at so many random targets, and at all special ones."""
        q = _random(self.robot, count, SEED)
        special = self._special()
        points = np.concatenate([q, *special.values()])
        poses = reference.pose(self.robot, points)[:, 0]
        solutions, valid = way.call((poses.astype(DTYPES[self.real]),))
        solved, joints = valid != 0, solutions.astype(np.float64)
        self._require_numbers(way.target, joints, valid)
        self._require_limits(way.target, joints, solved)
        moved = self._require_origins(way.target, joints[:count], solved[:count], q)
        ends = np.cumsum([count, *map(len, special.values())])
        for (name, values), end in zip(special.items(), ends[1:], strict=True):
            part = slice(end - len(values), end)
            if name == AT_LIMITS:
                self._require_origins(way.target, joints[part], solved[part], values)
            self._require_solved(way.target, name, solved[part], values)
        require_names(self.robot, self.package, self.family, way.target, joints[:NAMED], solved[:NAMED])
        position, rotation = self._errors(joints, solved, poses)
        found = solved.any(axis=1)
        return Trial(
            target=way.target,
            poses=len(points),
            solutions=int(solved.sum()),
            position_error=float(position.max()),
            rotation_error=float(rotation.max()),
            accepted=ACCEPTED[self.real],
            worst=tuple(map(float, points[np.maximum(position, rotation).argmax()])),
            moved=moved,
            special=tuple(
                (name, len(values), int(found[end - len(values) : end].sum()))
                for (name, values), end in zip(special.items(), ends[1:], strict=True)
            ),
        )

    def _require_numbers(self, target: str, joints: FloatArray, valid: Any) -> None:
        if not np.isin(valid, (0, 1)).all():
            raise ProofError(f"{self.robot.name}: {target} {self.quantity} gives validity other than 0 and 1")
        if (~np.isfinite(joints).all(axis=2) & (valid != 0)).any():
            raise ProofError(f"{self.robot.name}: {target} {self.quantity} calls a solution valid that is not finite")

    def _require_limits(self, target: str, joints: FloatArray, solved: Truths) -> None:
        """See that every joint of a valid solution is within its limits, but for what is stated."""
        low, high = np.array(joint_box(self.robot)).T
        limited = np.array([variable.limits is not None for variable in self.robot.variables])
        room = self.rooms + 8 * np.finfo(DTYPES[self.real]).eps * np.maximum(np.abs(low), np.abs(high))
        outside = (limited & ((joints < low - room) | (joints > high + room))).any(axis=2) & solved
        if outside.any():
            place = ", ".join(f"{entry:.6g}" for entry in joints[outside][0])
            raise ProofError(
                f"{self.robot.name}: {target} {self.quantity} calls {int(outside.sum()):,} solutions valid that break "
                f"a limit, the first q = ({place}); nothing was written"
            )

    def _require_solved(self, target: str, name: str, solved: Truths, q: FloatArray) -> None:
        """See that nearly all special targets have a solution."""
        open_ = np.flatnonzero(~solved.any(axis=1))
        if len(open_) > UNSOLVED * len(q):
            place = ", ".join(f"{entry:.6g}" for entry in q[open_[0]])
            raise ProofError(
                f"{self.robot.name}: {target} {self.quantity} has no solution for {len(open_):,} of {len(q):,} targets "
                f"that are {name}, the first at q = ({place}); nothing was written"
            )

    def _require_origins(self, target: str, joints: FloatArray, solved: Truths, q: FloatArray) -> int:
        """See that the joint vector of every target is among its solutions, but for whole turns.

        Returns:
            How many of them are not, for the rounding of targets beside singular poses.
        """
        apart = np.abs(joints - q[:, None])
        for axis in self.family.axes.joints:
            if axis.turns:
                turn, place = 2 * np.pi / abs(float(axis.rate)), axis.number - 1
                apart[..., place] = np.abs((apart[..., place] + turn / 2) % turn - turn / 2)
        nearest = np.where(solved, (apart / self._same()).max(axis=2), np.inf).min(axis=1)
        far = np.flatnonzero(nearest > 1)
        missed = far[~solved[far].any(axis=1) | ~self._are_singular(q[far])]
        if len(missed) > LOST[self.real] * len(q):
            first = ", ".join(f"{entry:.6g}" for entry in q[missed[0]])
            raise ProofError(
                f"{self.robot.name}: {target} {self.quantity} misses the joint vectors of {len(missed):,} of "
                f"{len(q):,} targets, the first at q = ({first}); nothing was written"
            )
        return len(far)

    def _same(self) -> FloatArray:
        """How near each joint must be."""
        return np.maximum(SAME[self.real], 4 * self.rooms)

    def _are_singular(self, q: FloatArray) -> Truths:
        rows = 6 if self.family.aim is Aim.POSE else 3
        weights = np.array([1 / reach(self.robot)] * 3 + [1.0] * 3)[:rows, None]
        jacobians = reference.Kinematics(self.robot, q).jacobian(TOOL)[:, :rows] * weights
        singular: Truths = np.linalg.svd(jacobians, compute_uv=False).min(axis=1, initial=np.inf) < SINGULAR
        return singular

    def _errors(self, joints: FloatArray, solved: Truths, poses: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Errors of positions and rotations, the largest over the branches of each target."""
        position, rotation = np.zeros((2, len(poses)))
        for branch in range(joints.shape[1]):
            rows = np.flatnonzero(solved[:, branch])
            if not len(rows):
                continue
            apart = np.abs(reference.pose(self.robot, joints[rows, branch])[:, 0] - poses[rows])[:, :3]
            position[rows] = np.maximum(position[rows], apart[..., 3].max(axis=1))
            if self.family.aim is Aim.POSE:
                rotation[rows] = np.maximum(rotation[rows], apart[..., :3].max(axis=(1, 2)))
        return position, rotation

    def _special(self) -> dict[str, FloatArray]:
        """Joint vectors at corners, at multiples of 45 degrees, and where branches meet."""
        found = {"singular and extreme": proof_samples(self.robot)[:-RANDOM]}
        for name, places in (("stretched or folded", boundaries(self.family)), ("aligned", alignments(self.family))):
            points = [self._with(index, value) for index, values in places for value in values]
            points = [each for each in points if len(each)]
            if points:
                found[name] = np.concatenate(points)
        limits = self._at_limits()
        return found | ({AT_LIMITS: limits} if len(limits) else {})

    def _at_limits(self) -> FloatArray:
        """Random joint vectors with one joint exactly at one of its limits."""
        box = np.array(joint_box(self.robot))
        limited = [variable.index for variable in self.robot.variables if variable.limits is not None]
        points = _random(self.robot, FEWER // 4 if limited else 0, SEED)
        for row, point in enumerate(points):
            index = limited[row // 2 % len(limited)]
            point[index] = box[index, row % 2]
        return points

    def _with(self, index: int, value: float) -> FloatArray:
        """Random joint vectors with one joint at a value, or whole turns from it; none if its limits exclude it."""
        low, high = joint_box(self.robot)[index]
        turn = 2 * math.pi / abs(float(self.family.axes.joints[index].rate))
        turned = value + turn * math.ceil((low - value) / turn - 1e-9)
        points = _random(self.robot, FEWER // 4, SEED + index)
        points[:, index] = turned
        return points if turned <= high else points[:0]


def _random(robot: Robot, count: int, seed: int) -> FloatArray:
    """Joint vectors from the joint box."""
    low, high = np.array(joint_box(robot)).T
    return np.random.default_rng(seed).uniform(low, high, (count, robot.dof))
