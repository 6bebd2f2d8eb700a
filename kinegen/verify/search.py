"""The proof of a numeric inverse: the errors that it reports are those that there are, and it solves nearly all."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen.errors import ProofError
from kinegen.outputs import NUMERIC_INVERSE, POSE_AND_JACOBIAN
from kinegen.robot.extent import joint_box, reach
from kinegen.robot.model import TOOL, Robot
from kinegen.verify.impossible import unchecked
from kinegen.verify.samples import SEED
from kinegen.verify.searched_batches import require_search_batches
from kinegen.verify.tips import require_free_parts, require_same_steps, tip_errors, tip_targets
from kinegen.verify.tolerances import accepted_error
from kinegen.verify.ways import DTYPES, numpy_form

FloatArray = NDArray[np.float64]
Truths = NDArray[np.bool_]

TARGETS = 2000
"""Poses of random joint vectors that the compiled search is given, each with a random start."""

FEWER = 60
"""The same for the search in NumPy, and with other values of the runtime parameters."""

PROBES = 8
"""Targets for what every search has to refuse, and for the bounds that it has to keep."""

USUAL_SHARE = 0.99
"""What is told where less is solved; robots of all kinds stay above it."""

LEAST_SHARE = 0.9
"""A search that solves less is broken."""

_ROUNDINGS = 2
"""A difference of poses may be off by so many times what a pose may be."""


@dataclass(frozen=True, slots=True)
class Search:
    """One way to call a numeric inverse, tried at many targets.

    Attributes:
        target: What was called.
        targets: Number of targets.
        solved: Number of those that it calls solved.
        steps: Mean number of steps; 0 where they are not counted.
        distance: Largest distance to its target that it calls solved.
        angle: Largest angle to its target that it calls solved.
        position_error: How far a reported distance is from the true one.
        rotation_error: The same for angles.
        position_tolerance: What was accepted of that.
        rotation_tolerance: What was accepted of that.
        worst: Joint vector of the target for which they differ most.
        frame: The tip for which they do.
    """

    target: str
    targets: int
    solved: int
    steps: float
    distance: float
    angle: float
    position_error: float
    rotation_error: float
    position_tolerance: float
    rotation_tolerance: float
    worst: tuple[float, ...]
    frame: str = TOOL


def try_search(
    robot: Robot, package: ModuleType, real: str, parameters: tuple[float, ...] | None = None
) -> tuple[Search, ...]:
    """Search for the poses of many joint vectors in every way, and see where the solutions lead.

    Args:
        robot: The robot, with the values of the runtime parameters that are tried.
        package: Its generated package, imported.
        real: A number type that it was built for.
        parameters: Values of the runtime parameters; those of the robot file if left out.

    Returns:
        One record for each way to call it.

    Raises:
        ProofError: If a joint vector holds NaN or breaks a limit, if what is called solved is not by what is reported,
            or if too few targets are solved.
    """
    compiled = package.numeric_inverse
    ways = {f"NumPy {real}": (in_numpy(package, compiled), FEWER)}
    params = None if parameters is None else package.Params(*parameters)
    if compiled.backend == "c":
        count = TARGETS if parameters is None else FEWER
        ways = {f"C {real}, batch": (compiled, count), f"C {real}": (_OneByOne(compiled), count)} | ways
    module = sys.modules[type(compiled).__module__]
    found = tuple(
        _Tester(robot, real, target, params, module).search(search, n) for target, (search, n) in ways.items()
    )
    if compiled.backend == "c":
        require_search_batches(robot, package, real, params)
    if compiled.backend == "c" and robot.is_tree:
        name = f"{robot.name}: C {real} {NUMERIC_INVERSE}"
        require_same_steps(robot, compiled, in_numpy(package, compiled), real, name, params)
    return found


def search_line(search: Search, length: str) -> str:
    """A record in one sentence; `length` is the robot's unit."""
    usual = search.solved >= USUAL_SHARE * search.targets
    return (
        f"numeric inverse: {search.solved:,} of {search.targets:,} random reachable targets solved from random starts "
        f"to {search.distance:.1g} {length} and {search.angle:.1g} rad"
        + (f", in {search.steps:.0f} steps on average" if search.steps else "")
        + ("" if usual else f"; most arms get {USUAL_SHARE:.0%}, and more restarts find more")
    )


class _OneByOne:
    """A search that is given one target at a time, as the kernel for one serves it."""

    def __init__(self, search: Any) -> None:
        self._search, self.tolerances = search, search.tolerances

    def __call__(self, targets: Any, starts: Any, **options: Any) -> Any:
        """The results of all targets; the same seed serves each of them."""
        found = [self._search(target, start, **options) for target, start in zip(targets, starts, strict=True)]
        return type(found[0])(*(np.stack(entries) for entries in zip(*found, strict=True)))


@dataclass(frozen=True, slots=True)
class _Tester:
    robot: Robot
    real: str
    target: str
    params: Any
    module: ModuleType

    def search(self, numeric_inverse: Any, count: int) -> Search:
        """Try one way at so many targets."""
        low, high = np.array(joint_box(self.robot)).T
        q, starts = np.random.default_rng(SEED).uniform(low, high, (2, count, self.robot.dof))
        targets = tip_targets(self.robot, q).astype(DTYPES[self.real])
        found = numeric_inverse(targets, starts, params=self.params)
        self._require_limits(found.q)
        self._require_bounds(numeric_inverse, targets[:PROBES], starts[:PROBES])
        if self.robot.is_tree:
            require_free_parts(self.robot, numeric_inverse, self.module, self.real, self._name, self.params)
        reported = np.stack([found.position_error, found.rotation_error], axis=1).reshape(count, 2, -1)
        tolerances = np.array(numeric_inverse.tolerances[self.real == "float"])[:, None]
        self._require_solved(found.solved, np.all(reported <= tolerances, axis=2))
        true = tip_errors(self.robot, found.q.astype(np.float64), targets.astype(np.float64))
        apart, most = np.abs(reported - true), accepted_error(self.robot, self.real) * _ROUNDINGS
        accepted = np.array([most * reach(self.robot, self.robot.tips), most])
        solved = true[found.solved].max(axis=(0, 2))
        shares = apart / accepted[:, None]
        return Search(
            target=self.target,
            targets=count,
            solved=int(found.solved.sum()),
            steps=float(found.iterations.mean()),
            distance=float(solved[0]),
            angle=float(solved[1]),
            position_error=float(apart[:, 0].max()),
            rotation_error=float(apart[:, 1].max()),
            position_tolerance=float(accepted[0]),
            rotation_tolerance=float(accepted[1]),
            worst=tuple(map(float, q[shares.max(axis=(1, 2)).argmax()])),
            frame=self.robot.tips[int(shares.max(axis=(0, 1)).argmax())],
        )

    def _require_limits(self, q: Any) -> None:
        """See that joint vectors are numbers within the limits, but for the rounding of these."""
        low, high = (np.array(side) for side in zip(*joint_box(self.robot), strict=True))
        limited = np.array([variable.limits is not None for variable in self.robot.variables])
        room = 4 * np.finfo(DTYPES[self.real]).eps * np.maximum(np.abs(low), np.abs(high))
        if not (np.isfinite(q) & (~limited | ((q >= low - room) & (q <= high + room)))).all():
            raise ProofError(f"{self._name} gives joint vectors that break limits or hold NaN; nothing was written")

    def _require_bounds(self, numeric_inverse: Any, targets: Any, starts: FloatArray) -> None:
        """See that what is not a pose is left at once, and that a search keeps to its budget and its steps."""
        steps = numeric_inverse(targets, starts, params=self.params, restarts=0, steps=5).iterations
        short = numeric_inverse(targets, starts, params=self.params, tolerances=(0.0, 0.0), budget=4).iterations
        low, high = np.array(joint_box(self.robot)).T
        ends = np.where(np.arange(len(starts))[:, None] % 2, low - 1, high + 1)
        beyond = tip_targets(self.robot, ends).astype(targets.dtype)
        self._require_limits(numeric_inverse(beyond, starts, params=self.params, restarts=0).q)
        if steps.max() > 5 or short.max() > 4:
            raise ProofError(f"{self._name} takes more steps than allowed; nothing was written")
        for what, change in (("NaN", np.nan), ("an infinity", np.inf), ("no rotation", 2.0), ("a reflection", -1.0)):
            spoilt = targets.copy()
            each = spoilt.reshape(len(spoilt), -1, 4, 4)
            one = np.arange(len(each)), np.arange(len(each)) % each.shape[1]  # of several tips each in turn
            with np.errstate(invalid="ignore"):  # zero times infinity is NaN, which is as good
                each[(*one, slice(3), 0 if abs(change) <= 2 else 3)] *= change
            with unchecked(self.module):
                found = numeric_inverse(spoilt, starts, params=self.params, restarts=1)
            if found.solved.any() or found.iterations.any():
                raise ProofError(f"{self._name} searches for targets with {what}; nothing was written")

    def _require_solved(self, solved: Truths, near: Any) -> None:
        if (solved & ~near.all(axis=1)).any():
            raise ProofError(
                f"{self._name} reports targets as solved whose errors exceed the tolerance; nothing was written"
            )
        if solved.mean() < LEAST_SHARE:
            raise ProofError(
                f"{self._name} solves only {int(solved.sum()):,} of {len(solved):,} reachable targets; nothing was "
                "written"
            )

    @property
    def _name(self) -> str:
        return f"{self.robot.name}: {self.target} {NUMERIC_INVERSE}"


def in_numpy(package: ModuleType, search: Any) -> Any:
    """The same search as it would be without the compiled extension."""
    params = getattr(package, "Params", None)
    tips = {"moving": search.moving} if hasattr(search, "moving") else {}
    return type(search)(
        search.__name__,
        module=package.__name__,
        symbol="",
        kernel=numpy_form(package, search.kernel, POSE_AND_JACOBIAN),
        joints=search.joints,
        reach=search.reach,
        tolerances=search.tolerances,
        params=params() if params else None,
        **tips,
    )
