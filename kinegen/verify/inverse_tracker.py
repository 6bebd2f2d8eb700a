"""The proof of an inverse along a path: it stays in its branch, says when that ends, and keeps to bounds."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np

from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.solver_parameters import TRACKING
from kinegen.derive.inverse.derive import family_of
from kinegen.derive.inverse.solve import reads_attitude
from kinegen.errors import ProofError
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.outputs import INVERSE_TRACKER, POSE_AND_JACOBIAN, Kind, Quantity
from kinegen.model.robot import JointType, Robot
from kinegen.support.dataclass import dataclass
from kinegen.verify import reference
from kinegen.verify.closed_form_inverse import accepted_of, as_stated, rooms_of
from kinegen.verify.inverse_targets import point_text, pose_errors, rounding_at_limits, within_limits
from kinegen.verify.invocations import DTYPES, numpy_form
from kinegen.verify.records import NUMPY, Comparison, Invocation, solver_comparison
from kinegen.verify.samples import FloatArray, random_joints
from kinegen.verify.tracker_paths import Labels, Lines, lines_of, require_speeds, sampled

Make = Callable[..., Any]

LINES = 60
"""Lines of each kind that the compiled form follows."""

FEWER = 2
"""The same for the form in NumPy, and with other values of the runtime parameters."""

SAME = {"double": 1e-6, "float": 2e-2}
"""How near the joint values must be to those that made a path, in rad or parts of the reach."""

_SLACK = {"double": 1e-14, "float": 1e-5}
"""What rounding adds to the change of a joint, relative to the size of its values."""

_BEYOND = 0.1
"""How far beyond its limit a joint is asked to go, in rad or as a part of the range of one that shifts."""

SINGULAR = 1e-9
"""Where the product of squared sines is less, a target leaves joints open, and their values are not compared."""

_AGAIN = 6
"""So often a target is given again before it is seen whether joints that were held back have arrived."""

MOVED = 1
"""The least status of a step that moved."""


def try_tracker(
    robot: Robot, package: ModuleType, quantity: Quantity, real: str, parameters: tuple[float, ...] | None = None
) -> tuple[list[Comparison], str]:
    """Follow paths in every way.

    `robot`: the robot, with the values of the runtime parameters that are tried; `parameters`: values of the runtime
    parameters; those of the robot file if left out. Returns a comparison for each way to call it, and how much was
    tried in one sentence. Raises `ProofError` if a path is not followed with the joint values that made it, if a joint
    moves too far or beyond a limit, if an error or a reason is reported wrongly, or if a refused step changes anything.
    """
    compiled = package.inverse_tracker
    params = None if parameters is None else package.Params(*parameters)
    ways = {Invocation(NUMPY, real): (tracker_in_numpy(package, compiled), FEWER)}
    if compiled.backend == "c":
        ways = {Invocation("C", real): (compiled, LINES if parameters is None else FEWER)} | ways
    rooms = rooms_of(as_stated(robot, package, parameters), Quantity(Kind.INVERSE), real)
    found = [
        _Tester(robot, package, real, way, partial(make, params=params), params, rooms).tracked(quantity, count)
        for way, (make, count) in ways.items()
    ]
    return [comparison for comparison, _ in found], found[0][1]


def tracker_in_numpy(package: ModuleType, maker: Any) -> Any:
    """Returns the same as it would be without the compiled extension."""
    return type(maker)(
        maker.__name__,
        module=package.__name__,
        symbol="",
        inverse=numpy_form(package, maker.inverse, Quantity(Kind.INVERSE)),
        kernel=numpy_form(package, maker.kernel, POSE_AND_JACOBIAN),
        strides=maker.strides,
        reach=maker.reach,
        rigid=maker.rigid,
        given=maker.given,
        reals=maker.reals,
        params=maker.usual_params,
    )


@dataclass(frozen=True, slots=True)
class _Tester:
    robot: Robot
    package: ModuleType
    real: str
    invocation: Invocation
    make: Make
    params: Any
    rooms: FloatArray

    def tracked(self, quantity: Quantity, count: int) -> tuple[Comparison, str]:
        """Try one way on so many lines."""
        lines = lines_of(self.robot, count)
        labels = Labels(self.package, lines, self.params)
        runs, passes = list(labels.runs(self.real)), list(labels.passes())
        followed = [self._follow(lines, part, "in one branch") for part in runs]
        followed += [self._follow(lines, part, "straight through a singularity") for part in passes]
        held = [self._hold_back(lines, part) for part in runs]
        limits = sum(self._to_limit(index) for index in self._limited(max(2, count // 8)))
        # What is refused is the same on all lines: a few show it.
        for part in runs[:: max(1, len(runs) // 8)]:
            self._refuse(lines, part)
        self._refuse_starts()
        usual = reach(self.robot, self.robot.tips) if self.params is None else self.package.inverse_tracker.reach
        require_speeds(self.robot, self._name, self.make, self.real, min(count, 40), usual)
        # Where no line has a run, nothing was followed, and no error is the largest.
        errors = np.concatenate([np.zeros((1, 2)), *followed, *(each for _, each in held)])
        accepted = max(accepted_of(self.robot, self.real), 2 * float(TRACKING.kept[ScalarType(self.real)]))
        size = reach(self.robot, self.robot.tips)
        steps, back = sum(last - first for _, first, last in runs), sum(several for several, _ in held)
        position, rotation = errors.max(axis=0)
        most = position, rotation if reads_attitude(family_of(self.robot)) else 0.0
        nowhere = (0.0,) * self.robot.dof
        comparison = solver_comparison(
            self.invocation, "along paths", quantity, steps, most, (accepted * size, accepted), nowhere
        )
        ends = f", and ended at the limit of a joint {limits:,} times" if limits else ""
        return comparison, (
            f"inverse tracker: {steps:,} steps in one branch, {len(passes):,} passes straight through a "
            f"singularity and {back:,} steps with joints held back were followed{ends}"
        )

    @property
    def _name(self) -> str:
        return f"{self.robot.name}: {self.invocation} {INVERSE_TRACKER}"

    def _begin(self, q: FloatArray, **options: Any) -> Any:
        return self.make(q.astype(DTYPES[self.real]), **options)

    def _errors(self, q: Any, targets: Any) -> FloatArray:
        """Returns how far joint vectors lead from their targets, by the reference."""
        found = pose_errors(reference.pose(self.robot, q.astype(np.float64))[:, 0], targets.astype(np.float64))
        return found * [1.0, float(reads_attitude(family_of(self.robot)))]

    def _reported(self, path: Any, true: FloatArray) -> FloatArray:
        """Returns how far reported errors are from the true ones."""
        reported = np.stack([path.position_error, path.rotation_error], axis=1)
        return np.abs(reported - true)

    def _follow(self, lines: Lines, part: tuple[int, int, int], what: str) -> FloatArray:
        """See that a part of a line is followed with its own joint values; returns errors of poses and reports."""
        line, first, last = part
        q = lines.q[line, first:last]
        inputs = lines.inputs(line, first, last, DTYPES[self.real])
        tracker = self._begin(q[0])
        path = tracker.follow(*inputs)
        if (path.status != MOVED).any():
            at = int(np.argmax(path.status != MOVED))
            reason = f"does not follow a path {what}: status {path.status[at]} at {point_text(q[at])}"
            raise ProofError(f"{self._name} {reason}; nothing was written")
        apart = np.where(lines.regular[line, first:last] > SINGULAR, self._apart(path.q, q), 0)
        if apart.max() > SAME[self.real]:
            at = int(apart.argmax())
            reason = f"follows a path {what} with other joint values: {point_text(path.q[at])} for {point_text(q[at])}"
            raise ProofError(f"{self._name} {reason}; nothing was written")
        true = self._errors(path.q, inputs[0])
        return np.maximum(true, self._reported(path, true))

    def _apart(self, q: Any, wanted: FloatArray) -> FloatArray:
        """Returns the largest difference of a joint, strokes as parts of the reach."""
        size = reach(self.robot, self.robot.tips)
        units = [size if each.type is JointType.PRISMATIC else 1.0 for each in self.robot.variables]
        found: FloatArray = (np.abs(q.astype(np.float64) - wanted) / units).max(axis=1)
        return found

    def _hold_back(self, lines: Lines, part: tuple[int, int, int]) -> tuple[int, FloatArray]:
        """See that no joint exceeds its largest change, and that a path that stops is reached in the end."""
        line, first, last = part
        q = lines.q[line, first:last]
        most = np.maximum(np.abs(np.diff(q, axis=0)).max(axis=0), 1e-6) * np.linspace(0.55, 1.2, self.robot.dof)
        tracker = self._begin(q[0], max_step=most)
        path = tracker.follow(*lines.inputs(line, first, last, DTYPES[self.real]))
        self._require_bounds(np.concatenate([q[:1].astype(DTYPES[self.real]), path.q]), most)
        end = [np.repeat(each[-1:], _AGAIN, axis=0) for each in lines.inputs(line, first, last, float)]
        before = path.q[-1:]
        for _ in range(2 * (last - first) // _AGAIN + 1):
            again = tracker.follow(*end)
            self._require_bounds(np.concatenate([before, again.q]), most)
            before = again.q[-1:]
            if again.status[-1] == MOVED:
                break
        if again.status[-1] != MOVED or self._apart(again.q[-1:], q[-1:])[0] > SAME[self.real]:
            reason = f"does not arrive at the end of a path: {point_text(again.q[-1])} for {point_text(q[-1])}"
            raise ProofError(f"{self._name} {reason}; nothing was written")
        targets = lines.targets[line, first:last].astype(DTYPES[self.real])
        return int((path.status == 2).sum()), self._reported(path, self._errors(path.q, targets))

    def _require_bounds(self, q: Any, most: FloatArray) -> None:
        """See that joint vectors that follow each other keep to limits and to the largest change."""
        changes, sizes = np.abs(np.diff(q.astype(np.float64), axis=0)), np.abs(q[1:]).astype(np.float64)
        if (changes > most + _SLACK[self.real] * (1 + sizes)).any():
            raise ProofError(f"{self._name} moves a joint by more than max_step; nothing was written")
        room = self.rooms + rounding_at_limits(self.robot, self.real, 8)
        if not (within_limits(self.robot, q, room) & np.isfinite(q)).all():
            raise ProofError(f"{self._name} breaks a limit; nothing was written")

    def _limited(self, count: int) -> Iterator[int]:
        """Joints with limits, that a target moves, again and again."""
        found = [each.index for each in self.robot.variables if each.limits and each.name != self.robot.redundancy]
        yield from (found[place % len(found)] for place in range(count if found else 0))

    def _to_limit(self, index: int) -> int:
        """See that a path beyond the limit of a joint ends there, by that reason; returns 1 if the path was regular."""
        low, high = joint_box(self.robot)[index]
        is_stroke = self.robot.variables[index].type is JointType.PRISMATIC
        far = _BEYOND * (float(high - low) if is_stroke else 1.0)
        begin = random_joints(self.robot, 1, index)[0]
        q = np.repeat(begin[None], 21, axis=0)
        q[:, index] = float(high) + np.linspace(-far, far, 21)
        q[0, index] = max(q[0, index], float(low))
        lines = sampled(self.robot, q[None])
        tracker = self._begin(q[0])
        path = tracker.follow(*lines.inputs(0, 1, 21, DTYPES[self.real]))
        self._require_bounds(np.concatenate([q[:1].astype(DTYPES[self.real]), path.q]), np.full(len(begin), math.inf))
        regular = lines.regular.min() > 0.01 and far < high - low
        stopped = np.flatnonzero(path.status < MOVED)
        ends = len(stopped) > 0 and path.status[stopped[0]] == -1 and path.joint[stopped[0]] == index
        if regular and not (ends and stopped[0] in (9, 10, 11)):
            told = f"status {path.status.tolist()}, joint {path.joint.tolist()}"
            raise ProofError(f"{self._name} does not end at the limit of joint {index}: {told}; nothing was written")
        return int(regular)

    def _refuse(self, lines: Lines, part: tuple[int, int, int]) -> None:
        """See that what is not a pose, or out of reach, is refused for this reason and changes nothing."""
        line, first, _ = part
        tracker = self._begin(lines.q[line, first])
        target, *given = lines.inputs(line, first, first + 1, DTYPES[self.real])
        for what, status, spoilt in self._impossible(target):
            before = tracker.q, tracker.branch, tracker.changes
            path = tracker.follow(spoilt, *given)
            same = np.array_equal(tracker.q, before[0]) and (tracker.branch, tracker.changes) == before[1:]
            if path.status[0] != status or not same:
                reason = f"gives status {path.status[0]} for a target {what}, or changes; expected {status}"
                raise ProofError(f"{self._name} {reason}; nothing was written")

    def _impossible(self, target: Any) -> Iterator[tuple[str, int, Any]]:
        reads = reads_attitude(family_of(self.robot))
        for number in (math.nan, math.inf, -math.inf):
            for place in range(12) if reads else (3, 7, 11):
                spoilt = target.copy()
                spoilt.reshape(-1)[place] = number
                yield f"with {number}", -3, spoilt
        if reads:
            for what, change in (("scaled", np.eye(3) * 2), ("reflected", np.diag([1.0, 1.0, -1.0]))):
                spoilt = target.copy()
                spoilt[0, :3, :3] = spoilt[0, :3, :3] @ change
                yield f"with a rotation that is {what}", -3, spoilt
        if all(each.type is JointType.REVOLUTE or each.limits for each in self.robot.variables):
            far = target.copy()
            far[0, :3, 3] += 10 * reach(self.robot)
            yield "out of reach", 0, far

    def _refuse_starts(self) -> None:
        """See that no path begins at what is not a joint vector within the limits."""
        low, high = np.array(joint_box(self.robot)).T
        for variable in self.robot.variables:
            numbers = [math.nan, math.inf, -math.inf]
            if variable.limits:
                numbers += [low[variable.index] - _BEYOND, high[variable.index] + _BEYOND]
            for number in numbers:
                q = (low + high) / 2
                q[variable.index] = number
                options = {"redundancy": 0.0} if variable.name == self.robot.redundancy else {}
                try:
                    self._begin(q, **options)
                except ValueError:
                    continue
                raise ProofError(f"{self._name} begins with {variable.name} at {number}; nothing was written")
