"""The proof of the ranges of a redundancy: what is inside is valid, what is outside is not, and nearest is nearest.

Joint vectors are planted, and moved along the curve on which the tool keeps its pose, by the reference alone; every one
within its limits must be in an interval of its branch. Values all over the range are solved by the inverse, which has a
proof of its own: it must be valid inside the intervals and nowhere else.
"""

from __future__ import annotations

import math
import sys
from types import ModuleType
from typing import Any

import numpy as np

from kinegen.backends.redundancy_range import FINENESS, finest_part
from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.inverse.derive import family_of
from kinegen.errors import ProofError
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.outputs import POSE_AND_JACOBIAN, REDUNDANCY_RANGE, Kind, Quantity
from kinegen.model.robot import TOOL, Robot
from kinegen.model.variants import ARM_ANGLE
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import RUNTIME
from kinegen.verify import reference
from kinegen.verify.inverse_targets import point_text, pose_errors, unchecked, within_limits
from kinegen.verify.invocations import DTYPES, numpy_form
from kinegen.verify.records import NUMPY, Comparison, Invocation, solver_comparison
from kinegen.verify.reference.velocity import Kinematics
from kinegen.verify.samples import FloatArray, Truths, random_joints, singular_samples

TARGETS = 200
"""Poses of random joint vectors that the compiled form is given."""

FEWER = 8
"""The poses of those whose whole range is solved."""

FEWEST = 3
"""Poses for the form in NumPy, which takes a thousand times as long, and targets of each kind without intervals."""

VALUES = 1201
"""Values of the redundancy at which a whole range is solved."""

STEPS, STEP = 40, 0.05
"""Steps along the curve of a pose in either direction, and their length in joint space."""

NEAR = {"double": 1e-8, "float": 1e-4}
"""How much farther from a planted joint vector than the solution for its own redundancy the nearest one may be."""

_SLACK = {"double": 1e-6, "float": 5e-3}
"""How far an end may be off, in rad or in part of the range: beside a tangent it goes with the root of the rounding."""

_ROUNDING = {"double": 1e-9, "float": 1e-4}
"""How far distances may be off."""

_BESIDE = 2
"""So many widths of gaps that are not found are tried on either side of the middle of an interval."""

ACCEPTED = {"double": 1e-9, "float": 1e-4}
"""How far the nearest solution may lead from its target, in parts of the reach and in rad."""


def try_ranges(
    robot: Robot, package: ModuleType, quantity: Quantity, real: str, _parameters: Any = None
) -> tuple[list[Comparison], str]:
    """Ask for the ranges of many poses in every way, and see what is inside and outside.

    Returns a comparison for each way to call it, and how much was tried in one sentence. Raises `ProofError` if a joint
    vector within its limits is outside all intervals of its branch, if a value inside an interval is not valid or one
    outside is, if what is not a pose has intervals, or if `nearest=` gives a solution that is not the nearest.
    """
    compiled = package.redundancy_range
    ways = {Invocation(NUMPY, real): (ranges_in_numpy(package, compiled), FEWEST)}
    if compiled.backend == "c":
        ways = {Invocation("C", real): (compiled, TARGETS)} | ways
    found = [_Trial(robot, way, ranges, real).run(package, quantity, n) for way, (ranges, n) in ways.items()]
    return [comparison for comparison, _ in found], found[0][1]


def ranges_in_numpy(package: ModuleType, ranges: Any) -> Any:
    """Returns the same as it would be without the compiled extension."""
    plain = object.__new__(type(ranges))
    vars(plain).update(vars(ranges))
    plain.inverse = numpy_form(package, ranges.inverse, Quantity(Kind.INVERSE))
    plain.kernel = numpy_form(package, ranges.kernel, POSE_AND_JACOBIAN)
    plain.backend, plain._native, plain.inverse.ranges = "numpy", None, plain
    return plain


@dataclass(frozen=True, slots=True)
class _Trial:
    robot: Robot
    invocation: Invocation
    ranges: Any
    real: str

    def run(self, package: ModuleType, quantity: Quantity, count: int) -> tuple[Comparison, str]:
        """Try this way at so many targets."""
        q = random_joints(self.robot, count)
        poses = reference.pose(self.robot, q)[:, 0].astype(DTYPES[self.real])
        intervals, counts = self.ranges(poses)
        self._require_order(intervals, counts)
        moved = self._require_planted(q, poses, intervals)
        self._require_everywhere(poses[:FEWER], intervals[:FEWER])
        self._require_middles(self._special()[:count], "singular")
        self._require_none(package, poses[:FEWEST])
        self._require_nearest(poses[:FEWER], q[:FEWER])
        return self._compared(q, poses, quantity), (
            f"redundancy range: {counts.sum():,} intervals for {count:,} random poses; {moved:,} joint vectors that "
            "keep these poses are all inside, and the inverse is valid inside and nowhere else"
        )

    def _compared(self, q: FloatArray, poses: Any, quantity: Quantity) -> Comparison:
        """Returns the joint vectors found again by `nearest=`, and where they lead."""
        found, exists = self.ranges.inverse(poses, nearest=q)
        own, known = self.ranges.inverse(
            poses, reference.redundancy(self.robot, q).astype(DTYPES[self.real]), nearest=q
        )
        off, least = (np.abs(each.astype(float) - q).max(axis=1) for each in (found, own))
        # The nearest of all solutions is about as near as the one for the joint vector's own redundancy.
        far = known & ~(exists & (off <= 2 * least + NEAR[self.real]))
        if far.any():
            raise self._wrong("does not give the joint vector of a pose as the nearest to itself")
        rows = np.flatnonzero(exists)
        errors = np.zeros((len(q), 2))
        errors[rows] = pose_errors(reference.pose(self.robot, found[rows])[:, 0], poses[rows].astype(float))
        size = reach(self.robot, self.robot.tips)
        accepted = ACCEPTED[self.real] * size, ACCEPTED[self.real]
        worst = q[(errors / [size, 1]).max(axis=1).argmax()]
        return solver_comparison(
            self.invocation, "nearest of all", quantity, len(q), errors.max(axis=0), accepted, worst
        )

    def _special(self) -> Any:
        return reference.pose(self.robot, singular_samples(self.robot))[:FEWER, 0].astype(DTYPES[self.real])

    def _wrong(self, what: str) -> ProofError:
        return ProofError(f"{self.robot.name}: {self.invocation} {REDUNDANCY_RANGE} {what}; nothing was written")

    def _span(self) -> tuple[float, float]:
        """Returns the range of the redundancy: that of its limits, or one turn about 0 without any."""
        for variable, (low, high) in zip(self.robot.variables, joint_box(self.robot), strict=True):
            if variable.name == self.robot.redundancy and variable.limits is not None:
                return float(low), float(high)
        return -self._turn() / 2, self._turn() / 2

    def _turn(self) -> float:
        """A whole turn of the redundancy: of the axis of a joint, in units of its variable, or of the arm angle."""
        rates = {joint.name: abs(float(joint.rate)) for joint in family_of(self.robot).joints}
        return 2 * math.pi / rates.get(self.robot.redundancy, 1.0)

    def _unwound(self, values: FloatArray) -> FloatArray:
        """Values of the redundancy, brought into its range by whole turns where no limits say how often it turns."""
        limited = {variable.name for variable in self.robot.variables if variable.limits is not None}
        if self.robot.redundancy in limited:
            return values
        return values - self._turn() * np.round(values / self._turn())

    def _slack(self) -> float:
        low, high = self._span()
        return _SLACK[self.real] * (1 if self.robot.redundancy == ARM_ANGLE else high - low)

    def _narrow(self) -> float:
        """Returns how wide gaps are that are not told from rounding, or are not found."""
        (low, high), real = self._span(), ScalarType(self.real)
        return finest_part(low, high, real) + (self.robot.redundancy != ARM_ANGLE) * FINENESS[real].gap * (high - low)

    def _require_order(self, intervals: Any, counts: Any) -> None:
        """Ends are in rising order and within the range; there are as many as is said, and NaN behind them."""
        low, high = self._span()
        used = np.arange(intervals.shape[2]) < counts[..., None]
        ends = np.where(used[..., None], intervals, np.inf).reshape(*counts.shape, -1)
        rising = (np.diff(np.where(np.isfinite(ends), ends, 1e30), axis=-1) >= 0).all()
        within = (intervals[used] >= low - self._slack()).all() and (intervals[used] <= high + self._slack()).all()
        if not (rising and within and np.isnan(intervals[~used]).all()):
            raise self._wrong("gives intervals that are not in order")

    def _inside(self, intervals: Any, values: FloatArray, slack: float) -> Truths:
        """Returns whether values (N,) are in intervals (N, ..., most, 2) that are wider by a slack at both ends."""
        values = values.reshape(len(values), *[1] * (intervals.ndim - 2))
        found: Truths = ((values >= intervals[..., 0] - slack) & (values <= intervals[..., 1] + slack)).any(axis=-1)
        return found

    def _require_planted(self, q: FloatArray, poses: Any, intervals: Any) -> int:
        """Joint vectors that keep a pose, found by the reference, are in an interval of their branch."""
        checked = 0
        for moved in _moved(self.robot, q):
            rows = np.flatnonzero(within_limits(self.robot, moved).all(axis=1))
            values = self._unwound(reference.redundancy(self.robot, moved[rows]))
            solutions, _ = self.ranges.inverse(poses[rows], values.astype(DTYPES[self.real]))
            off = np.abs(np.sin((solutions - moved[rows, None]) / 2)).max(axis=2)
            branch = off.argmin(axis=1)
            inside = self._inside(intervals[rows, branch], values, self._slack())
            known = off.min(axis=1) < _SLACK[self.real]
            checked += int(known.sum())
            if not inside[known].all():
                worst = moved[rows[known & ~inside][0]]
                raise self._wrong(f"misses the joint vector {point_text(worst)}")
        return checked

    def _require_everywhere(self, poses: Any, intervals: Any) -> None:
        """The inverse is valid inside the intervals and nowhere else."""
        values = np.linspace(*self._span(), VALUES).astype(DTYPES[self.real])
        for pose, own in zip(poses, intervals, strict=True):
            _, valid = self.ranges.inverse(np.broadcast_to(pose, (VALUES, 4, 4)), values, check=False)
            every = np.broadcast_to(own, (VALUES, *own.shape))
            outside = valid & ~self._inside(every, values.astype(float), self._slack())
            inside = ~valid & self._inside(every, values.astype(float), -self._slack())
            if outside.any():
                raise self._wrong("leaves out values for which the inverse is valid")
            if inside.any():
                raise self._wrong("contains values for which the inverse is not valid")

    def _require_middles(self, poses: Any, kind: str) -> None:
        """The inverse is valid in the middle of every interval of some poses, but for gaps too narrow to be found."""
        intervals, counts = self.ranges(poses)
        self._require_order(intervals, counts)
        width = self._narrow()
        for row, branch, place in zip(*np.nonzero(np.arange(intervals.shape[2]) < counts[..., None]), strict=True):
            low, high = intervals[row, branch, place]
            near = np.clip((low + high) / 2 + width * np.arange(-_BESIDE, _BESIDE + 1), low, high)
            repeated = np.broadcast_to(poses[row], (len(near), 4, 4))
            if not self.ranges.inverse(repeated, near.astype(intervals.dtype))[1][:, branch].any():
                raise self._wrong(f"gives an interval of a {kind} pose in whose middle the inverse is not valid")

    def _require_none(self, package: ModuleType, poses: Any) -> None:
        """There are no intervals for what is not a pose, and for what is out of reach."""
        kinds = (("with NaN", 3, np.nan), ("with an infinity", 7, np.inf), ("with a NaN in the rotation", 5, np.nan))
        spoilt = [(what, poses.copy()) for what, _, _ in kinds]
        for (_, targets), (_, place, value) in zip(spoilt, kinds, strict=True):
            targets.reshape(-1, 16)[:, place] = value
        far, scaled = poses.copy(), poses.copy()
        far[:, :3, 3] += 3 * reach(self.robot, self.robot.tips)
        scaled[:, :3, :3] *= 2
        with unchecked(sys.modules[f"{package.__name__}.{RUNTIME}._redundancy_range"]), np.errstate(all="ignore"):
            for what, targets in (*spoilt, ("out of reach", far), ("with a rotation times two", scaled)):
                exists = self.ranges.inverse(targets, nearest=np.zeros(self.robot.dof))[1]
                if self.ranges(targets).counts.any() or exists.any():
                    raise self._wrong(f"gives intervals for targets {what}")
        for value in (np.nan, np.inf, 1e16):
            if self.ranges.inverse(poses[:1], nearest=np.full(self.robot.dof, value))[1].any():
                raise self._wrong(f"finds a solution near to joint values of {value}")

    def _require_nearest(self, poses: Any, q: FloatArray) -> None:
        """No solution for values all over the range is nearer than the one that is given."""
        wanted = np.roll(q, 1, axis=0).astype(DTYPES[self.real])
        found, exists = self.ranges.inverse(poses, nearest=wanted)
        values = np.linspace(*self._span(), VALUES).astype(DTYPES[self.real])
        for pose, near, own, is_there in zip(poses, wanted, found, exists, strict=True):
            repeated = np.broadcast_to(pose, (VALUES, 4, 4))
            others, valid = self.ranges.inverse(repeated, values, nearest=near, check=False)
            best = ((others[valid] - near) ** 2).sum(axis=1).min(initial=np.inf)
            if not is_there and np.isfinite(best):
                raise self._wrong("finds no nearest solution where there is one")
            if is_there and ((own - near) ** 2).sum() > best * (1 + _ROUNDING[self.real]) + _ROUNDING[self.real]:
                raise self._wrong("gives a solution that is not the nearest")


def _moved(robot: Robot, q: FloatArray) -> list[FloatArray]:
    """Joint vectors along the curves on which the tool keeps its pose: steps, each led back by Newton steps."""
    targets, found = reference.pose(robot, q)[:, 0], [q]
    for sign in (1, -1):
        here, before = q, None
        for _ in range(STEPS):
            way = np.linalg.svd(Kinematics(robot, here).jacobian(TOOL))[2][:, -1]
            turn = np.sign(way.sum(axis=1)) * sign if before is None else np.sign((way * before).sum(axis=1))
            before = way * np.where(turn == 0, 1, turn)[:, None]
            here = here + STEP * before
            for _ in range(3):
                here = here + _newton(robot, here, targets)
            off = pose_errors(reference.pose(robot, here)[:, 0], targets).max(axis=1)
            found.append(np.where((off < 1e-9 * max(1, reach(robot)))[:, None], here, np.nan))
    return found


def _newton(robot: Robot, q: FloatArray, targets: FloatArray) -> FloatArray:
    """Returns the step that leads joint vectors to poses."""
    motion = Kinematics(robot, q)
    jacobian, poses = motion.jacobian(TOOL), motion.pose(TOOL)
    between = targets[:, :3, :3] @ poses[:, :3, :3].swapaxes(1, 2)
    skew = (between - between.swapaxes(1, 2)) / 2
    turn = np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1)
    way = np.concatenate([targets[:, :3, 3] - poses[:, :3, 3], turn], axis=1)
    found: FloatArray = (np.linalg.pinv(jacobian, rcond=1e-6) @ way[..., None])[..., 0]
    return found
