"""The proof of the inverse of a five-axis machine: there and back, both branches, singular poses, limits, bad input."""

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from kinegen.derive.expressions import number_of
from kinegen.derive.inverse.five_axis import machine_for, machine_thresholds
from kinegen.errors import ProofError
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.outputs import Quantity
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass
from kinegen.verify.bit_consistency import Called, require_same_bits
from kinegen.verify.closed_form_inverse import ACCEPTED, FEWER, SAME, TARGETS, Trial
from kinegen.verify.five_axis_reference import Sampled
from kinegen.verify.inverse_targets import point_text, rounding_at_limits, within_limits
from kinegen.verify.invocations import DTYPES, KernelCall, ways_to_call
from kinegen.verify.parameter_batches import Alternating, require_varied
from kinegen.verify.samples import SEED, FloatArray, Truths, parameter_sets, random_joints

SINGULAR = {"double": 1e-3, "float": 0.05}
"""Sines between tool and first axis, and distances of a cosine from 1, below which joint values are not compared."""

_SPECIAL = 500
_CALLED = 300
_FAR = (np.nan, np.inf, -np.inf)


@dataclass(frozen=True, slots=True)
class _Targets:
    """What is solved for: joint vectors they come from, points, directions of any length, and joint vectors near."""

    q: FloatArray
    points: FloatArray
    axes: FloatArray
    near: FloatArray

    def inputs(self, real: str) -> tuple[NDArray[np.floating], ...]:
        return tuple(each.astype(DTYPES[real]) for each in (self.points, self.axes, self.near))

    def of(self, rows: Truths) -> _Targets:
        return _Targets(self.q[rows], self.points[rows], self.axes[rows], self.near[rows])


def try_machine(
    robot: Robot, package: ModuleType, quantity: Quantity, real: str, parameters: tuple[float, ...] | None = None
) -> tuple[Trial, ...]:
    """Solve for points and directions of many joint vectors in every way to call the kernel.

    `robot`: the robot, with the values of the runtime parameters that are tried; `parameters`: values of the runtime
    parameters; those of the robot file if left out. Returns one trial for each way. Raises `ProofError` if a solution
    leads elsewhere, breaks a limit or is in the other branch, if the joint vector of a target or any solution of an
    independent solver is missed, if a tool along the first axis moves the first joint from where it was, or if a
    direction out of reach or a number that is none is said to be solved.
    """
    ways = ways_to_call(package, quantity, real, parameters)
    most = TARGETS if real == "double" and parameters is None else FEWER
    trials = try_machine_ways(robot, quantity, ways, real, most)
    for way in ways:
        if way.is_plain and parameters is None:
            _tester(robot, quantity, real).require_calls(way, package)
    return trials


def try_machine_ways(
    robot: Robot, quantity: Quantity, ways: Sequence[KernelCall], real: str, most: int
) -> tuple[Trial, ...]:
    """Solve for points and directions of many joint vectors in some ways.

    `robot`: the robot, with the values of the runtime parameters that are tried; `most`: random targets of the first
    way that takes batches; the others get a part of them. Returns one trial for each way. Raises `ProofError` as
    `try_machine`.
    """
    tester = _tester(robot, quantity, real)
    first = next((way for way in ways if way.is_batch), ways[-1])
    trials = tuple(tester.trial(way, most if way is first else FEWER // 4) for way in ways)
    for way in ways:
        tester.refuse_the_impossible(way)
    return trials


def machine_inputs(robot: Robot, quantity: Quantity, real: str, q: FloatArray) -> tuple[NDArray[np.floating], ...]:
    """Points, directions and joint vectors near, for the tools of some joint vectors (N, dof)."""
    return _tester(robot, quantity, real).targets_of(q).inputs(real)


def _tester(robot: Robot, quantity: Quantity, real: str) -> _Tester:
    return _Tester(robot, quantity, real, Sampled(robot, quantity.way or "tool"))


@dataclass(frozen=True, slots=True)
class _Tester:
    robot: Robot
    quantity: Quantity
    real: str
    sampled: Sampled

    def trial(self, way: KernelCall, count: int) -> Trial:
        """Try one way at all targets."""
        targets = self._targets(count)
        special = {"with the tool along the first axis": self._aligned(), "at a limit": self._at_limits()}
        # Of every group what is said of all solutions: validities, limits, and where they lead.
        groups = (targets, *special.values())
        joints, solved, errors = [], [], []
        for group in groups:
            found, valid = (each.astype(np.float64) for each in way.call(group.inputs(self.real)))
            if not np.isin(valid, (0, 1)).all() or (~np.isfinite(found).all(axis=2) & (valid != 0)).any():
                self._fail(way, "gives a validity other than 0 and 1, or a valid solution that is not finite")
            self._require_limits(way, found, valid != 0)
            errors.append(self._lead_back(group, found, valid != 0))
            joints.append(found)
            solved.append(valid != 0)
        # Then what each group is there for.
        self._require_all(way, targets, joints[0], solved[0])
        self._require_rest(way, groups[1], joints[1], solved[1])
        self._require_origins(way, groups[2], joints[2], solved[2])
        position, rotation = np.concatenate(errors).T
        q = np.concatenate([group.q for group in groups])
        return Trial(
            invocation=way.invocation,
            poses=len(q),
            solutions=int(sum(each.sum() for each in solved)),
            position_error=float(position.max()),
            rotation_error=float(rotation.max()),
            accepted=ACCEPTED[self.real],
            worst=tuple(map(float, q[np.maximum(position, rotation).argmax()])),
            moved=0,
            special=tuple(
                (name, len(group.q), int(truths.any(axis=1).sum()))
                for (name, group), truths in zip(special.items(), solved[1:], strict=True)
            ),
        )

    def require_calls(self, way: KernelCall, package: ModuleType) -> None:
        """Batches of every length and form, and with runtime parameters along them, give the bits of this way."""
        way.select()
        inputs = self._targets(_CALLED).inputs(self.real)
        called = Called(way.kernel, None, inputs, way.call(inputs))
        require_same_bits(self.robot, self.quantity, way.target, called)
        if self.robot.runtime_parameters:
            varied = Alternating(way.kernel, package.Params, parameter_sets(self.robot), inputs)
            require_varied(self.robot, self.quantity, way.target, varied)

    def refuse_the_impossible(self, way: KernelCall) -> None:
        """Directions out of reach, a null vector, and numbers that are none in every entry: nothing is solved."""
        plain = self._targets(8)
        bad = [self._spoilt(plain, place, entry, value) for place, entry, value in _places(self.robot.dof)]
        bad.append(_Targets(plain.q, plain.points, 0 * plain.axes, plain.near))
        generator = np.random.default_rng(SEED)
        axes = generator.normal(size=(4 * FEWER, 3))
        axes /= np.linalg.norm(axes, axis=1)[:, None]
        axes = axes[np.abs(self.sampled.cosines(axes)) > 1 + 1e-3]
        if len(axes):
            rows = np.resize(np.arange(8), len(axes))
            bad.append(_Targets(plain.q[rows], plain.points[rows], axes, plain.near[rows]))
        for group in bad:
            with np.errstate(all="ignore"):
                _, valid = way.call(group.inputs(self.real))
            if np.any(valid != 0):
                self._fail(way, "solves for a direction out of reach, or for a number that is none")

    def _spoilt(self, plain: _Targets, place: int, entry: int, value: float) -> _Targets:
        arrays = [plain.points.copy(), plain.axes.copy(), plain.near.copy()]
        arrays[place][:, entry] = value
        return _Targets(plain.q, *arrays)

    def _targets(self, count: int) -> _Targets:
        return self.targets_of(random_joints(self.robot, count))

    def targets_of(self, q: FloatArray) -> _Targets:
        """Targets of joint vectors; every second one is asked near its own joint vector, the others anywhere."""
        poses = self.sampled.poses(q)
        generator = np.random.default_rng(SEED + 1)
        lengths = generator.choice([0.01, 0.5, 1.0, 100.0], (len(q), 1))
        low, high = np.array(joint_box(self.robot)).T
        near = generator.uniform(low, high, q.shape)
        near[::2] = q[::2]
        return _Targets(q, poses[:, :3, 3], poses[:, :3, 2] * lengths, near)

    def _aligned(self) -> _Targets:
        """Joint vectors with the tool along the first axis, where the machine gets there within its limits."""
        targets = self._targets(_SPECIAL)
        q = targets.q.copy()
        _, cosine, sine = self.sampled.wave
        place = self.sampled.turning[1]
        low, high = joint_box(self.robot)[place]
        lead = np.arctan2(sine, cosine) / self.sampled.rate
        q[:, place] = lead
        end = self.sampled.poses(q[:1])[0, :3, 2]
        aligned = np.linalg.norm(np.cross(end, self.sampled.axis)) < 1e-9 * np.linalg.norm(self.sampled.axis)
        return self.targets_of(q if aligned and low <= lead <= high else q[:0])

    def _at_limits(self) -> _Targets:
        q = self._targets(_SPECIAL).q.copy()
        box = np.array(joint_box(self.robot))
        limited = [each.index for each in self.robot.variables if each.limits is not None]
        for row, point in enumerate(q):
            if limited:
                place = limited[row // 2 % len(limited)]
                point[place] = box[place, row % 2]
        return self.targets_of(q if limited else q[:0])

    def _lead_back(self, group: _Targets, joints: FloatArray, solved: Truths) -> FloatArray:
        """Returns the largest errors of position and direction over the branches of each target, shape (N, 2)."""
        found = np.zeros((len(group.q), 2))
        axes = group.axes / np.linalg.norm(group.axes, axis=1)[:, None]
        for branch in range(joints.shape[1]):
            rows = np.flatnonzero(solved[:, branch])
            poses = self.sampled.poses(joints[rows, branch])
            apart = np.abs(poses[:, :3, 3] - group.points[rows]).max(axis=1)
            aside = np.abs(poses[:, :3, 2] - axes[rows]).max(axis=1)
            found[rows] = np.maximum(found[rows], np.stack([apart, aside], axis=1))
        return found

    def _rounding(self) -> FloatArray:
        near = machine_thresholds(self.robot, self.quantity)
        joints = machine_for(self.robot, self.quantity).joints
        return np.array([number_of(near.rounding(joint), single=self.real == "float") for joint in joints])

    def _require_limits(self, way: KernelCall, joints: FloatArray, solved: Truths) -> None:
        room = rounding_at_limits(self.robot, self.real, 8) + self._rounding() * (not self.robot.strict_limits)
        if (~within_limits(self.robot, joints, room).all(axis=2) & solved).any():
            self._fail(way, "calls solutions valid that break a limit")

    def _require_all(self, way: KernelCall, group: _Targets, joints: FloatArray, solved: Truths) -> None:
        """Both branches against the independent solver, their validity, and the choice among whole turns."""
        axes = group.axes / np.linalg.norm(group.axes, axis=1)[:, None]
        wanted = self.sampled.solutions(group.points, axes)
        near = SINGULAR[self.real]
        aside = np.linalg.norm(np.cross(axes, self.sampled.axis), axis=1) / np.linalg.norm(self.sampled.axis)
        clear = (aside > near) & (np.abs(self.sampled.cosines(axes)) < 1 - near)
        wanted, certain = self._chosen(wanted, group.near)
        apart = np.abs(joints - wanted) > self._same()
        wrong = apart.any(axis=2) & certain & clear[:, None] & solved
        missed = certain & clear[:, None] & ~solved & self._inside(wanted, -1)
        extra = clear[:, None] & solved & ~self._inside(wanted, 1) & certain
        if wrong.any() or missed.any() or extra.any():
            row = int(np.flatnonzero((wrong | missed | extra).any(axis=1))[0])
            what = "has another solution than" if wrong.any() else "misses a solution of" if missed.any() else "adds to"
            self._fail(way, f"{what} the independent solver, the first at q = {point_text(group.q[row])}")
        self._require_origins(way, group.of(clear), joints[clear], solved[clear])

    def _chosen(self, wanted: FloatArray, near: FloatArray) -> tuple[FloatArray, Truths]:
        """Each angle by whole turns within its limits and nearest to `near`, and where that choice is certain."""
        certain = np.ones(wanted.shape[:2], bool)
        wanted = wanted.copy()
        for place in self.sampled.turning:
            joint = next(each for each in machine_for(self.robot, self.quantity).joints if each.number == place + 1)
            turn = 2 * np.pi / abs(float(joint.rate))
            low, high = joint_box(self.robot)[place] if joint.limits is not None else (-turn / 2, turn / 2)
            aim = np.clip(near[:, None, place], low, high) if high - low > turn else (low + high) / 2
            centred = wanted[..., place, None] + turn * np.arange(-6, 7)
            inside = (centred >= low) & (centred <= high)
            away = np.abs(centred - np.asarray(aim)[..., None]) + np.where(inside, 0, 1e6)
            order = np.sort(away, axis=2)
            certain &= np.abs(order[..., 1] - order[..., 0]) > 10 * self._same()[place]
            certain &= np.abs(centred - low).min(axis=2) > 10 * self._same()[place]
            certain &= np.abs(centred - high).min(axis=2) > 10 * self._same()[place]
            wanted[..., place] = np.take_along_axis(centred, away.argmin(axis=2)[..., None], axis=2)[..., 0]
        return wanted, certain

    def _inside(self, joints: FloatArray, sign: int) -> Truths:
        return np.asarray(within_limits(self.robot, joints, sign * 10 * self._same()).all(axis=2))

    def _same(self) -> FloatArray:
        """Returns how near each joint must be: radians, or lengths relative to the reach."""
        scale = [1.0 if place in self.sampled.turning else reach(self.robot) for place in range(self.robot.dof)]
        return np.maximum(SAME[self.real] * np.array(scale), 4 * self._rounding())

    def _require_rest(self, way: KernelCall, group: _Targets, joints: FloatArray, solved: Truths) -> None:
        """See that a tool along the first axis leaves the first joint where it is to be near."""
        place = self.sampled.turning[0]
        joint = next(each for each in machine_for(self.robot, self.quantity).joints if each.number == place + 1)
        turn = 2 * np.pi / abs(float(joint.rate))
        apart = joints[..., place] - group.near[:, None, place]
        moved = np.abs(apart - turn * np.round(apart / turn)) > self._same()[place]
        if (moved & solved).any() or (len(group.q) and not solved.any()):
            self._fail(way, "moves the first joint although the tool is along its axis, or does not solve there")

    def _require_origins(self, way: KernelCall, group: _Targets, joints: FloatArray, solved: Truths) -> None:
        """See that the joint vector of every target that is asked near it is among its solutions."""
        rows = np.flatnonzero((group.near == group.q).all(axis=1))
        apart = (np.abs(joints[rows] - group.q[rows, None]) / self._same()).max(axis=2)
        missed = ~((apart <= 1) & solved[rows]).any(axis=1)
        axes = group.axes[rows] / np.linalg.norm(group.axes[rows], axis=1)[:, None]
        clear = np.abs(self.sampled.cosines(axes)) < 1 - SINGULAR[self.real]
        if self.robot.strict_limits:
            low, high = np.array(joint_box(self.robot)).T
            clear &= (np.abs(group.q[rows] - (low + high) / 2) < (high - low) / 2 - self._rounding()).all(axis=1)
        if (missed & clear).sum() > (0.01 * len(rows) if self.real == "float" else 0):
            place = point_text(group.q[rows][missed & clear][0])
            self._fail(way, f"misses the joint vectors of {int((missed & clear).sum()):,} targets, first q = {place}")

    def _fail(self, way: KernelCall, what: str) -> None:
        raise ProofError(f"{self.robot.name}: {way.target} {self.quantity} {what}; nothing was written")


def _places(dof: int) -> Sequence[tuple[int, int, float]]:
    sizes = (3, 3, dof)
    return [(place, entry, value) for place, size in enumerate(sizes) for entry in range(size) for value in _FAR]
