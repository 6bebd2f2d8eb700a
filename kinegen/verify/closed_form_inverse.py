"""The proof of an inverse: what it solves leads back to the target, and nothing that can be reached is missed.

The proof of an inverse samples poses of the chain between two frames of a tree. That this chain is the way between
these frames is seen here: its poses are those that the reference gives for one frame as seen from the other one.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen.derive.expressions import number_of
from kinegen.derive.inverse.derive import family_of, size_of
from kinegen.derive.inverse.family import Family
from kinegen.derive.inverse.newton_refinement import RESIDUAL
from kinegen.derive.inverse.tolerances import thresholds_of
from kinegen.errors import ProofError
from kinegen.model.dh_conversion.elementary_transforms import chain_of
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.outputs import Quantity
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import RUNTIME
from kinegen.verify import reference
from kinegen.verify.branches import require_names
from kinegen.verify.inverse_targets import (
    ALIGNED,
    AT_LIMITS,
    BESIDE,
    ON_AN_AXIS,
    Led,
    SolvedTargets,
    lead_back,
    point_text,
    refuse_the_impossible,
    rounding_at_limits,
    targets_of,
    unchecked,
    within_limits,
)
from kinegen.verify.invocations import DTYPES, KernelCall, ways_to_call
from kinegen.verify.merging_samples import MERGING
from kinegen.verify.nearest import require_nearest
from kinegen.verify.records import Invocation
from kinegen.verify.samples import FloatArray, Truths, random_joints, with_values
from kinegen.verify.singular_samples import approaching, are_free, are_singular, are_turned

POSES = 64
"""Random joint vectors at which both are compared."""

SAME_POSE = 1e-12
"""Accepted difference of an entry of a rotation, and of a position relative to the reach."""


def require_same_way(robot: Robot, quantity: Quantity) -> None:
    """See that the chain of an inverse is the way between its frames.

    Raises `ProofError` if a pose of the chain is another one.
    """
    if not quantity.frame:
        return
    chain = chain_of(robot, quantity)
    q = random_joints(robot, POSES)
    wanted = reference.Kinematics(robot, q).pose(quantity.way)
    apart = np.abs(reference.pose(chain, q)[:, 0] - wanted)
    apart[:, :3, 3] /= reach(robot, [quantity.way])
    if not apart.max() < SAME_POSE:
        raise ProofError(f"{robot.name}: the chain of {quantity} has other poses than the robot; nothing was written")


TARGETS = 100_000
"""Random joint vectors whose poses are solved for, by the first way to call the kernel."""

FEWER = 4000
"""The same for every other way."""

NAMED = 200
"""Targets whose solutions are held against the names of their branches, in every way."""

ACCEPTED = {"double": 1e-12, "float": 3e-5}
"""How far the pose of a solution may be from the target: radians, and lengths relative to the reach."""

SAME = {"double": 1e-6, "float": 1e-2}
"""How near a solution must be to the joint vector that the target came from: radians or lengths. Four times what a
joint may be found outside its limits is near enough, too."""

LOST = {"double": 0.0, "float": 0.002}
"""The part of the targets whose joint vectors may be missed: in float rounding may carry one past a limit."""

_ROUNDINGS = 32
"""What a pose may be off by, in units of the last digit of the sum of all lengths of a table."""

UNSOLVED = 0.02
"""The part of the special targets that may have no solution at all."""

ANYWHERE = (ALIGNED, ON_AN_AXIS)
"""Special targets that leave joints free, within limits: in double each of them has a solution."""


@dataclass(frozen=True, slots=True)
class Trial:
    """One way to call an inverse, tried at many targets."""

    invocation: Invocation
    poses: int
    solutions: int
    position_error: float  # Largest distance of a solution's pose from its target, in a coordinate
    rotation_error: float  # The same for entries of the rotation; 0 where the arm is not solved for it
    accepted: float  # Accepted error of a rotation, and of a position relative to the reach
    worst: tuple[float, ...]  # Joint vector of the target with the largest error
    # Number of random targets beside singular poses whose joint vector is not found: rounding moved it, or, where
    # `may_vanish`, its branch is missing
    moved: int
    # For each kind of special target its name, how many there were, and how many have a solution
    special: tuple[tuple[str, int, int], ...]
    may_vanish: bool = False  # The arm is only nearly of its family: branches are missing where they merge
    missing: tuple[tuple[str, int, int], ...] = ()  # If so, as `special`, but how many joint vectors are not found


def try_inverse(
    robot: Robot, package: ModuleType, quantity: Quantity, real: str, parameters: tuple[float, ...] | None = None
) -> tuple[Trial, ...]:
    """Solve for the poses of many joint vectors in every way, and see where the solutions lead.

    `robot`: the robot, with the values of the runtime parameters that are tried; `parameters`: values of the runtime
    parameters; those of the robot file if left out. Returns one trial for each way to call the kernel. Raises
    `ProofError` if a target is solved without the joint vector that it came from, if a valid solution is not finite,
    breaks a limit or stands in a branch of another name, if a target that is not a pose or out of reach is said to be
    solved, or if `nearest=` gives another solution than the nearest.
    """
    ways, chain = ways_to_call(package, quantity, real, parameters), chain_of(robot, quantity)
    most = TARGETS if real == "double" and parameters is None else FEWER
    with unchecked(sys.modules[f"{package.__name__}.{RUNTIME}._inverse"]):
        refuse_the_impossible(robot, quantity, ways, real)
    rooms = rooms_of(as_stated(robot, package, parameters), quantity, real)
    trials = try_ways(robot, quantity, ways, real, package.BRANCHES, most, rooms)
    require_nearest(chain, family_of(chain), package, quantity, real, rooms, parameters)
    return trials


def try_ways(
    robot: Robot,
    quantity: Quantity,
    ways: Sequence[KernelCall],
    real: str,
    names: Sequence[str],
    most: int,
    rooms: FloatArray,
) -> tuple[Trial, ...]:
    """Solve for the poses of many joint vectors in some ways.

    `robot`: the robot, with the values of the runtime parameters that are tried; `most`: random targets of the first
    way that takes batches; the others get a part of them; `rooms`: how far outside its limits the kernel states that
    each joint may be, (dof,); see `rooms_of`. Returns one trial for each way. Raises `ProofError` as `try_inverse`, but
    for `nearest=` and targets that are impossible.
    """
    require_same_way(robot, quantity)
    whole, robot = robot, chain_of(robot, quantity)
    family = family_of(robot)
    tester = _Tester(robot, tuple(names), quantity, family, real, rooms)
    first = next((way for way in ways if way.is_batch), ways[-1])
    # An arm that is nearly of a family looks at the pose of each solution itself.
    beside = approaching(whole, quantity).points if family.defect is None else None
    unit = float(np.finfo(np.float64).eps) * (real == "double")
    targets = targets_of(robot, family, most, FEWER // 4, beside, unit)
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


def as_stated(robot: Robot, package: ModuleType, parameters: tuple[float, ...] | None) -> Robot:
    """The robot with the parameters of its file: for these a kernel states how far joints may be outside limits."""
    return robot if parameters is None else with_values(robot, tuple(package.Params()))


def rooms_of(robot: Robot, quantity: Quantity, real: str) -> FloatArray:
    """How far outside its limits each joint of a valid solution may be, (dof,), in rad or the robot's length unit.

    `robot`: the robot with the parameters of its file.
    """
    return rounding_of(chain_of(robot, quantity), real) * (not robot.strict_limits)


def rounding_of(robot: Robot, real: str) -> FloatArray:
    """Returns how far rounding may move each joint, (dof,), in rad or the robot's length unit."""
    family = family_of(robot)
    near = thresholds_of(family, size_of(robot, family))
    return np.array([number_of(near.rounding(joint), single=real == "float") for joint in family.joints])


def counts_line(trial: Trial) -> str:
    """Returns a trial in one sentence."""
    solved = ", ".join(f"{some:,} of {all_:,} {name}" for name, all_, some in trial.special)
    random = trial.poses - sum(all_ for _, all_, _ in trial.special)
    moved = f" (rounding moved {trial.moved:,}, near singular poses)" if trial.moved else ""
    found = f"each solved by the joint vector that it came from{moved}"
    if trial.may_vanish and trial.moved:
        found = (
            f"{random - trial.moved:,} of them solved by the joint vector that they came from; the branch of the other "
            f"{trial.moved:,} is missing near singular poses, where it merges with another one"
        )
    missing = ", ".join(f"{some:,} of {all_:,} {name}" for name, all_, some in trial.missing)
    solved += f"; joint vectors whose branch is missing: {missing}" if missing else ""
    return (
        f"inverse: {random:,} random targets, {found}, {trial.solutions:,} solutions in all; also solved: {solved}; "
        "no unreachable or NaN target, and none that is not a pose, was reported as solved"
    )


@dataclass(frozen=True, slots=True)
class _Tester:
    robot: Robot
    names: tuple[str, ...]
    quantity: Quantity
    family: Family
    real: str
    rooms: FloatArray

    def trial(self, way: KernelCall, targets: SolvedTargets, known: Led | None = None) -> tuple[Trial, Led]:
        """Try one way at all targets; solutions that another way gave too are not led back again."""
        count, poses = targets.random, targets.poses
        solutions, valid = way.call(targets.inputs(DTYPES[self.real]))
        solved, joints = valid != 0, solutions.astype(np.float64)
        self._require_numbers(way.target, joints, valid)
        self._require_limits(way.target, joints, solved)
        # Random targets come first, so that the joint vectors behind them are known by place.
        moved = self._require_origins(way.target, joints[:count], solved[:count], targets.points[:count])
        ends = np.cumsum([count, *map(len, targets.special.values())])
        found, named = solved.any(axis=1), [np.arange(min(NAMED, count))]
        special, missing = list[tuple[str, int, int]](), list[tuple[str, int, int]]()
        for (name, values), end in zip(targets.special.items(), ends[1:], strict=True):
            part = slice(end - len(values), end)
            if name in (AT_LIMITS, *MERGING):
                lost = self._require_origins(way.target, joints[part], solved[part], values)
            elif self._may_vanish():
                lost = len(self._missed(joints[part], solved[part], values))
            self._require_solved(way.target, name, joints[part], solved[part], values)
            special.append((name, len(values), int(found[part].sum())))
            if self._may_vanish():
                missing.append((name, len(values), lost))
            if name in MERGING:
                named.append(np.arange(part.start, part.stop))
        rows = np.concatenate(named)
        require_names(self.robot, self.names, self.family, way.target, joints[rows], solved[rows])
        # The poses that solutions lead to are the slow part: other ways of calling share them.
        led = lead_back(self.robot, self.family, poses, joints, solved, known)
        trial = Trial(
            invocation=way.invocation,
            poses=int(ends[-1]),
            solutions=int(solved.sum()),
            position_error=float(led.position.max()),
            rotation_error=float(led.rotation.max()),
            accepted=accepted_of(self.robot, self.real),
            worst=tuple(map(float, targets.points[np.maximum(led.position, led.rotation).argmax()])),
            moved=moved,
            special=tuple(special),
            may_vanish=self._may_vanish(),
            missing=tuple(missing),
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
        room = self.rooms + rounding_at_limits(self.robot, self.real, 8)
        outside = ~within_limits(self.robot, joints, room).all(axis=2) & solved
        if outside.any():
            raise ProofError(
                f"{self.robot.name}: {target} {self.quantity} calls {int(outside.sum()):,} solutions valid that break "
                f"a limit, the first q = {point_text(joints[outside][0])}; nothing was written"
            )

    def _require_solved(self, target: str, name: str, joints: FloatArray, solved: Truths, q: FloatArray) -> None:
        """See that nearly all special targets have a solution, and all that leave joints free."""
        open_ = np.flatnonzero(~(solved.any(axis=1) | self._may_be_lost(q)))
        if self._may_vanish():
            open_ = open_[~self._are_singular(q[open_])]
        some = UNSOLVED * len(q)
        if self.real == "double":
            open_ = open_[~are_turned(self.family, joints[open_], q[open_])]
        if name in ANYWHERE and self.real == "double":
            some = 0.0
        else:
            open_ = open_[~are_free(self.robot, self.family, q[open_], beside=name == BESIDE)]
        if len(open_) > some:
            raise ProofError(
                f"{self.robot.name}: {target} {self.quantity} has no solution for {len(open_):,} of {len(q):,} targets "
                f"that are {name}, the first at q = {point_text(q[open_[0]])}; nothing was written"
            )

    def _require_origins(self, target: str, joints: FloatArray, solved: Truths, q: FloatArray) -> int:
        """See that the joint vectors of targets are among their solutions; returns how many singular ones are not."""
        far = self._missed(joints, solved, q)
        missed = far[~(solved[far].any(axis=1) | self._may_vanish()) | ~self._are_singular(q[far])]
        if len(missed) > LOST[self.real] * len(q):
            raise ProofError(
                f"{self.robot.name}: {target} {self.quantity} misses the joint vectors of {len(missed):,} of "
                f"{len(q):,} targets, the first at q = {point_text(q[missed[0]])}; nothing was written"
            )
        return len(far)

    def _missed(self, joints: FloatArray, solved: Truths, q: FloatArray) -> NDArray[np.intp]:
        """Returns the rows of the targets among whose solutions their joint vector is not, but for whole turns."""
        apart = np.abs(joints - q[:, None])
        for axis in self.family.axes.joints:
            if axis.turns:
                turn, place = 2 * np.pi / abs(float(axis.rate)), axis.number - 1
                apart[..., place] = np.abs((apart[..., place] + turn / 2) % turn - turn / 2)
        same = np.maximum(SAME[self.real], 4 * rounding_of(self.robot, self.real))
        nearest = np.where(solved, (apart / same).max(axis=2), np.inf).min(axis=1)
        return np.flatnonzero((nearest > 1) & ~self._may_be_lost(q))

    def _may_be_lost(self, q: FloatArray) -> Truths:
        """Returns which joint vectors rounding may move beyond a strict limit."""
        if not self.robot.strict_limits:
            return np.zeros(len(q), bool)
        low, high = np.array(joint_box(self.robot)).T
        room = rounding_of(self.robot, self.real)
        lost: Truths = ((q < low + room) | (q > high - room)).any(axis=1)
        return lost

    def _may_vanish(self) -> bool:
        """Returns whether the only branch of a singular pose may be invalid, since it merges with another one there."""
        return self.family.defect is not None

    def _are_singular(self, q: FloatArray) -> Truths:
        return are_singular(self.robot, self.family, self.real, q)
