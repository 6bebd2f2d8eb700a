"""The proof of a numeric inverse: the errors that it reports are those that there are, and it solves nearly all."""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any

import numpy as np

from kinegen.errors import ProofError
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.outputs import NUMERIC_INVERSE, POSE_AND_JACOBIAN, Quantity
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass
from kinegen.verify.inverse_targets import rounding_at_limits, unchecked, within_limits
from kinegen.verify.invocations import BATCH, DTYPES, numpy_form
from kinegen.verify.numeric_inverse_batches import (
    require_free_parts,
    require_same_steps,
    require_search_batches,
    tip_errors,
    tip_targets,
)
from kinegen.verify.records import NUMPY, Comparison, Invocation, solver_comparison
from kinegen.verify.samples import SEED, FloatArray, Truths
from kinegen.verify.tolerances import accepted_error

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


def try_search(
    robot: Robot, package: ModuleType, quantity: Quantity, real: str, parameters: tuple[float, ...] | None = None
) -> tuple[list[Comparison], str]:
    """Search for the poses of many joint vectors in every way, and see where the solutions lead.

    `robot`: the robot, with the values of the runtime parameters that are tried; `parameters`: values of the runtime
    parameters; those of the robot file if left out. Returns a comparison for each way to call it, and how much was
    tried in one sentence. Raises `ProofError` if a joint vector holds NaN or breaks a limit, if what is called solved
    is not by what is reported, or if too few targets are solved.
    """
    compiled = package.numeric_inverse
    ways = {Invocation(NUMPY, real): (in_numpy(package, compiled), FEWER)}
    params = None if parameters is None else package.Params(*parameters)
    if compiled.backend == "c":
        count = TARGETS if parameters is None else FEWER
        scalar = _OneByOne(compiled)
        ways = {Invocation("C", real, BATCH): (compiled, count), Invocation("C", real): (scalar, count), **ways}
    module = sys.modules[type(compiled).__module__]
    found = [_Tester(robot, quantity, way, params, module).search(search, n) for way, (search, n) in ways.items()]
    if compiled.backend == "c":
        require_search_batches(robot, package, real, params)
    if compiled.backend == "c" and robot.is_tree:
        name = f"{robot.name}: C {real} {NUMERIC_INVERSE}"
        require_same_steps(robot, compiled, in_numpy(package, compiled), real, name, params)
    return [comparison for comparison, _ in found], found[0][1]


def search_line(targets: int, solved: int, steps: float, errors: tuple[float, float], length: str) -> str:
    """Says how much is solved, up to which distance and angle; `length` is the robot's unit."""
    usual = solved >= USUAL_SHARE * targets
    return (
        f"numeric inverse: {solved:,} of {targets:,} random reachable targets solved from random starts "
        f"to {errors[0]:.1g} {length} and {errors[1]:.1g} rad"
        + (f", in {steps:.0f} steps on average" if steps else "")
        + ("" if usual else f"; most arms get {USUAL_SHARE:.0%}, and more restarts find more")
    )


class _OneByOne:
    """A search that is given one target at a time, as the kernel for one serves it."""

    def __init__(self, search: Any) -> None:
        self._search, self.tolerances, self.kernel = search, search.tolerances, search.kernel

    def __call__(self, targets: Any, starts: Any, **options: Any) -> Any:
        """The results of all targets; the same seed serves each of them."""
        found = [self._search(target, start, **options) for target, start in zip(targets, starts, strict=True)]
        return type(found[0])(*(np.stack(entries) for entries in zip(*found, strict=True)))


@dataclass(frozen=True, slots=True)
class _Tester:
    robot: Robot
    quantity: Quantity
    invocation: Invocation
    params: Any
    module: ModuleType

    def search(self, numeric_inverse: Any, count: int) -> tuple[Comparison, str]:
        """Try one way at so many targets."""
        low, high = np.array(joint_box(self.robot)).T
        q, starts = np.random.default_rng(SEED).uniform(low, high, (2, count, self.robot.dof))
        targets = tip_targets(self.robot, q).astype(DTYPES[self.real])
        found = numeric_inverse(targets, starts, params=self.params)
        self._require_limits(found.q)
        self._require_bounds(numeric_inverse, targets[:PROBES], starts[:PROBES])
        self._require_types(numeric_inverse, targets[:PROBES], starts[:PROBES])
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
        worst, tip = q[shares.max(axis=(1, 2)).argmax()], self.robot.tips[int(shares.max(axis=(0, 1)).argmax())]
        comparison = solver_comparison(
            self.invocation, "search", self.quantity, count, apart.max(axis=(0, 2)), accepted, worst, tip
        )
        steps, errors = float(found.iterations.mean()), (float(solved[0]), float(solved[1]))
        return comparison, search_line(count, int(found.solved.sum()), steps, errors, self.robot.units.length)

    def _require_limits(self, q: Any) -> None:
        """See that joint vectors are numbers within the limits, but for the rounding of these."""
        room = rounding_at_limits(self.robot, self.real, 4)
        if not (np.isfinite(q) & within_limits(self.robot, q, room)).all():
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

    def _require_types(self, numeric_inverse: Any, targets: Any, starts: FloatArray) -> None:
        """See that the same numbers in another type, and in lists, have the same results."""
        single = targets.astype(np.float32)
        double = single.astype(np.float64)
        options = {"params": self.params, "restarts": 0, "tolerances": numeric_inverse.tolerances[1]}
        small, wide = (numeric_inverse(given, starts, **options) for given in (single, double))
        same = [(numeric_inverse(double.tolist(), starts.tolist(), **options), wide)]
        computed = {numeric_inverse.kernel.types([given])[1] for given in (single, double)}
        same += [(small, wide)] * (len(computed) == 1)
        for one, other in same:
            for field, got, wanted in zip(one._fields, one, other, strict=True):
                if not np.array_equal(got, wanted.astype(got.dtype)):
                    raise ProofError(f"{self._name} gives another {field} for another type; nothing was written")

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
    def real(self) -> str:
        """The number type."""
        return self.invocation.scalar

    @property
    def _name(self) -> str:
        return f"{self.robot.name}: {self.invocation} {NUMERIC_INVERSE}"


def in_numpy(package: ModuleType, search: Any) -> Any:
    """Returns the same search as it would be without the compiled extension."""
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
