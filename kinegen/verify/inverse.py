"""The proof of an inverse: what it solves leads back to the target, and nothing that can be reached is missed."""

from __future__ import annotations

import sys
from collections.abc import Sequence
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
from kinegen.symbolic.inverse.derive import family_of, singular_below, size_of
from kinegen.symbolic.inverse.family import Aim, Family
from kinegen.symbolic.inverse.refine import RESIDUAL
from kinegen.symbolic.inverse.thresholds import thresholds_of
from kinegen.tables.seen import chain_of
from kinegen.verify.branches import require_names
from kinegen.verify.impossible import refuse_the_impossible, unchecked
from kinegen.verify.nearest import require_nearest
from kinegen.verify.seen import require_same_way
from kinegen.verify.solved import AT_LIMITS, Led, SolvedTargets, lead_back, targets_of
from kinegen.verify.ways import DTYPES, Way, ways_to_call

FloatArray = NDArray[np.float64]
Truths = NDArray[np.bool_]

TARGETS = 100_000
"""Random joint vectors whose poses are solved for, by the first way to call the kernel."""

FEWER = 4000
"""The same for every other way."""

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

_ROUNDINGS = 32
"""What a pose may be off by, in units of the last digit of the sum of all lengths of a table."""

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
    ways, chain = ways_to_call(package, quantity, real, parameters), chain_of(robot, quantity)
    most = TARGETS if real == "double" and parameters is None else FEWER
    with unchecked(sys.modules[f"{package.__name__}._inverse"]):
        refuse_the_impossible(robot, quantity, ways, real)
    trials = try_ways(robot, quantity, ways, real, package.BRANCHES, most)
    require_nearest(chain, family_of(chain), package, quantity, real, _rooms(chain, real), parameters)
    return trials


def try_ways(
    robot: Robot, quantity: Quantity, ways: Sequence[Way], real: str, names: Sequence[str], most: int
) -> tuple[Trial, ...]:
    """Solve for the poses of many joint vectors in some ways.

    Args:
        robot: The robot, with the values of the runtime parameters that are tried.
        quantity: The inverse.
        ways: The ways to call it.
        real: Their number type.
        names: What the branches are called.
        most: Random targets of the first way that takes batches; the others get a part of them.

    Returns:
        One trial for each way.

    Raises:
        ProofError: As `try_inverse`, but for `nearest=` and targets that are impossible.
    """
    require_same_way(robot, quantity)
    robot = chain_of(robot, quantity)
    family = family_of(robot)
    tester = _Tester(robot, tuple(names), quantity, family, real, _rooms(robot, real))
    first = next((way for way in ways if "batch" in way.target), ways[-1])
    targets = targets_of(robot, family, most, FEWER // 4)
    trial, led = tester.trial(first, targets)
    fewer, rows = targets.fewer(min(FEWER, most))
    known = led.at(rows)
    return tuple(trial if way is first else tester.trial(way, fewer, known)[0] for way in ways)


def accepted_of(robot: Robot, real: str) -> float:
    """The accepted error; of an arm that is nearly of a family what its kernel accepts, and the reference's own."""
    family = family_of(robot)
    if family.defect is None:
        return ACCEPTED[real]
    own = number_of(RESIDUAL, single=real == "float")
    return 2 * own + float(_ROUNDINGS * np.finfo(np.float64).eps) * reach(robot) / size_of(robot, family)


def _rooms(robot: Robot, real: str) -> FloatArray:
    """How far outside its limits each joint of a valid solution may be."""
    family = family_of(robot)
    near = thresholds_of(family, size_of(robot, family))
    return np.array([number_of(near.room(joint), single=real == "float") for joint in family.joints])


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
    names: tuple[str, ...]
    quantity: Quantity
    family: Family
    real: str
    rooms: FloatArray

    def trial(self, way: Way, targets: SolvedTargets, known: Led | None = None) -> tuple[Trial, Led]:
        """Try one way at all targets; solutions that another way gave too are not led back again."""
        count, special, poses = targets.random, targets.special, targets.poses
        solutions, valid = way.call(targets.inputs(DTYPES[self.real]))
        solved, joints = valid != 0, solutions.astype(np.float64)
        self._require_numbers(way.target, joints, valid)
        self._require_limits(way.target, joints, solved)
        moved = self._require_origins(way.target, joints[:count], solved[:count], targets.points[:count])
        ends = np.cumsum([count, *map(len, special.values())])
        for (name, values), end in zip(special.items(), ends[1:], strict=True):
            part = slice(end - len(values), end)
            if name == AT_LIMITS:
                self._require_origins(way.target, joints[part], solved[part], values)
            self._require_solved(way.target, name, solved[part], values)
        require_names(self.robot, self.names, self.family, way.target, joints[:NAMED], solved[:NAMED])
        led = lead_back(self.robot, self.family, poses, joints, solved, known)
        found = solved.any(axis=1)
        trial = Trial(
            target=way.target,
            poses=int(ends[-1]),
            solutions=int(solved.sum()),
            position_error=float(led.position.max()),
            rotation_error=float(led.rotation.max()),
            accepted=self._accepted(),
            worst=tuple(map(float, targets.points[np.maximum(led.position, led.rotation).argmax()])),
            moved=moved,
            special=tuple(
                (name, len(values), int(found[end - len(values) : end].sum()))
                for (name, values), end in zip(special.items(), ends[1:], strict=True)
            ),
        )
        return trial, led

    def _require_numbers(self, target: str, joints: FloatArray, valid: Any) -> None:
        if not np.isin(valid, (0, 1)).all():
            raise ProofError(f"{self.robot.name}: {target} {self.quantity} gives validity other than 0 and 1")
        if (~np.isfinite(joints).all(axis=2) & (valid != 0)).any():
            raise ProofError(
                f"{self.robot.name}: {target} {self.quantity} reports a solution as valid that is not finite"
            )

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
        if self._may_vanish():
            open_ = open_[~self._are_singular(q[open_])]
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
        missed = far[~(solved[far].any(axis=1) | self._may_vanish()) | ~self._are_singular(q[far])]
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

    def _may_vanish(self) -> bool:
        """Whether the only branch of a singular pose may be invalid, since it merges with another one there."""
        return self.family.defect is not None

    def _accepted(self) -> float:
        return accepted_of(self.robot, self.real)

    def _are_singular(self, q: FloatArray) -> Truths:
        rows = 6 if self.family.aim is Aim.POSE else 3
        weights = np.array([1 / size_of(self.robot, self.family)] * 3 + [1.0] * 3)[:rows, None]
        # The joints that are given move no branch.
        solved = sorted(number - 1 for number in self.family.axes.numbers)
        jacobians = reference.Kinematics(self.robot, q).jacobian(TOOL)[:, :rows, solved] * weights
        singular: Truths = np.linalg.svd(jacobians, compute_uv=False).min(axis=1, initial=np.inf) < max(
            SINGULAR, singular_below(self.robot, self.family)
        )
        return singular
