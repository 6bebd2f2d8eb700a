"""The solution nearest to a joint vector: held against all solutions with all whole turns, tried one by one.

Every way to ask for it is tried: the C function, its batch in each variant, and the NumPy form.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np

from kinegen.derive.inverse.family import Aim, Family
from kinegen.derive.inverse.singular_configurations import free_end, in_line
from kinegen.errors import ProofError
from kinegen.model.branches import FreeEnd, InLine
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.outputs import Quantity
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass
from kinegen.verify import reference
from kinegen.verify.bit_consistency import Called, require_same_bits
from kinegen.verify.free_joint_samples import is_freed, joints_freed
from kinegen.verify.inverse_targets import point_text
from kinegen.verify.invocations import DTYPES, Arrays, KernelCall, ways_to_call
from kinegen.verify.samples import SEED, FloatArray

Choose = Callable[[Any, Any], tuple[Any, Any]]

TARGETS = 120
"""Targets of a batch."""

_SLACK = {"double": 1e-9, "float": 1e-3}
"""What rounding may do to squared distances, in part."""

_PLANTED = 4
"""Targets with axes in line, or an end free, for each place where they are."""

_WHOLE = 3
"""Whole turns by which such a place may be away from its first value."""

_NONE = (math.nan, math.inf, -math.inf, 1e16)
"""Joint values to which no solution is near."""


def require_nearest(
    robot: Robot,
    family: Family,
    package: ModuleType,
    quantity: Quantity,
    real: str,
    rooms: FloatArray,
    parameters: tuple[float, ...] | None,
) -> None:
    """See that `nearest=` gives the nearest solution within the limits, and none to what is not a joint vector.

    `robot`: the robot, with the values of the runtime parameters that are tried; `rooms`: how far outside its limits
    each joint may be found; `parameters`: values of the runtime parameters; those of the robot file if left out. Raises
    `ProofError` if another solution is nearer, a limit is broken, one is found where there is none, or a call gives
    other bits than a plain batch.
    """
    params = None if parameters is None else package.Params(*parameters)
    joints = _joints(robot, family, rooms)
    targets, wanted = _inputs(robot, joints, real)
    lines, end = in_line(family), free_end(family)
    planted = _plant(robot, family, targets, wanted)
    for way in ways_to_call(package, quantity, real, parameters):
        if not way.is_plain and way.is_batch:
            continue  # other layouts have no such call
        way.select()
        choose = partial(_in_a_batch if way.is_plain else _one_by_one, way.kernel, params)
        name = f"{robot.name}: {way.target} {quantity} with nearest="
        judge = _Judge(name, robot, joints, lines, real, end, is_placed=family.aim is Aim.POSITION)
        judge.require_choice(way, choose, targets, wanted)
        judge.require_kept(way, choose, targets, wanted, planted)
        judge.require_none(choose, targets, wanted)
        if way.is_plain and parameters is None:
            results = way.kernel.chooses(*targets, wanted)
            called = Called(way.kernel.chooses, None, (*targets, wanted), results)
            require_same_bits(robot, quantity, f"{way.target} nearest", called)


def _in_a_batch(kernel: Any, params: Any, targets: Arrays, wanted: Any) -> tuple[Any, Any]:
    found: tuple[Any, Any] = kernel(*targets, params=params, nearest=wanted)
    return found


def _one_by_one(kernel: Any, params: Any, targets: Arrays, wanted: Any) -> tuple[Any, Any]:
    """Parameters are left out where they are those of the file: such calls have a way of their own."""
    options = {} if params is None else {"params": params}
    found = [kernel(*each, nearest=near, **options) for *each, near in zip(*targets, wanted, strict=True)]
    return np.stack([q for q, _ in found]), np.array([exists for _, exists in found])


@dataclass(frozen=True, slots=True)
class _Joint:
    """One joint: its range, whether there are limits, a whole turn (infinite if it shifts), its room at limits."""

    low: float
    high: float
    is_limited: bool
    turn: float
    room: float


def _joints(robot: Robot, family: Family, rooms: FloatArray) -> tuple[_Joint, ...]:
    turns = (2 * math.pi / abs(float(joint.rate)) if joint.turns else math.inf for joint in family.joints)
    limited = (each.limits is not None for each in robot.variables)
    parts = zip(joint_box(robot), limited, turns, rooms, strict=True)
    return tuple(_Joint(float(low), float(high), own, turn, float(room)) for (low, high), own, turn, room in parts)


def _inputs(robot: Robot, joints: tuple[_Joint, ...], real: str) -> tuple[Arrays, Any]:
    """Targets, some out of reach, and joint vectors: near and far, some exactly at limits, or whole turns beyond."""
    generator = np.random.default_rng(SEED)
    low, high = (np.array([getattr(joint, side) for joint in joints]) for side in ("low", "high"))
    q = generator.uniform(low, high, (TARGETS, len(joints)))
    ends = np.where(generator.integers(0, 2, q.shape), low, high)
    q[::11] = ends[::11]
    wanted = generator.uniform(low - 1, high + 1, q.shape)
    turns = np.array([0.0 if math.isinf(joint.turn) else joint.turn for joint in joints])
    wanted[::3] += turns * generator.integers(-2, 3, q.shape)[::3]
    wanted[1::5], wanted[2::7] = q[1::5], ends[2::7]
    poses = reference.pose(robot, q)[:, 0]
    poses[3::13, :3, 3] += 10 * reach(robot)
    given = (reference.redundancy(robot, q),) if robot.redundancy else ()
    return tuple(each.astype(DTYPES[real]) for each in (poses, *given)), wanted.astype(DTYPES[real])


def joints_in_line(robot: Robot, family: Family) -> FloatArray:
    """Joint vectors (N, dof) within the limits that have two axes in line, for each place where they are."""
    generator, rows = np.random.default_rng(SEED), []
    low, high = np.array(joint_box(robot)).T
    for line in in_line(family) * _PLANTED:
        q, turn = generator.uniform(low, high), 2 * math.pi / abs(float(family.joints[line.middle].rate))
        values = line.at + turn * np.arange(-_WHOLE, _WHOLE + 1)
        inside = values[(low[line.middle] <= values) & (values <= high[line.middle])]
        if inside.size:
            q[line.middle] = inside[np.abs(inside).argmin()]
            rows.append(q)
    return np.array(rows).reshape(-1, robot.dof)


def _plant(robot: Robot, family: Family, targets: Arrays, wanted: Any) -> tuple[int, ...]:
    """Put targets, in place, that wanted joint vectors reach with two axes in line, or an end free; their rows."""
    q = np.concatenate([joints_in_line(robot, family), joints_freed(robot, family, _PLANTED)])[: len(wanted) // 2]
    rows = range(len(wanted) - len(q), len(wanted))
    if q.size:
        wanted[rows.start :], targets[0][rows.start :] = q, reference.pose(robot, q)[:, 0]
        for given in targets[1:]:
            given[rows.start :] = reference.redundancy(robot, q)
    return tuple(rows)


@dataclass(frozen=True, slots=True)
class _Judge:
    name: str
    robot: Robot
    joints: tuple[_Joint, ...]
    lines: tuple[InLine, ...]
    real: str
    end: FreeEnd | None = None
    is_placed: bool = False
    """Whether the rotation of a target is not read."""

    def require_choice(self, way: KernelCall, choose: Choose, targets: Arrays, wanted: Any) -> None:
        """Every row is the nearest of all solutions, with all whole turns that limits allow."""
        (solutions, valid), (found, exists) = way.call(targets), choose(targets, wanted)
        if not np.array_equal(exists, (valid != 0).any(axis=1)):
            raise ProofError(f"{self.name} does not find what is valid")
        if not np.isnan(found[~exists]).all():
            raise ProofError(f"{self.name} gives numbers where there is no solution")
        for row in np.flatnonzero(exists):
            near, given = wanted[row].astype(float), solutions[row][valid[row] != 0].astype(float)
            self._require_nearest(found[row].astype(float), near, given, targets[0][row].astype(float))

    def require_kept(
        self, way: KernelCall, choose: Choose, targets: Arrays, wanted: Any, rows: tuple[int, ...]
    ) -> None:
        """A wanted joint vector that reaches its target is given back where axes are in line, or an end is free."""
        (solutions, valid), (found, _) = way.call(targets), choose(targets, wanted)
        same = math.sqrt(_SLACK[self.real])
        for row in rows:
            near = wanted[row].astype(float)
            options = solutions[row][valid[row] != 0].astype(float)
            is_met = any(self._is_met(line, q, near, same) for line in self.lines for q in options)
            is_met |= is_freed(self.end, targets[0][row].astype(float), options, self.real == "float")
            # Rounding of the other joints leaves more to those in line.
            if is_met and not np.abs(found[row].astype(float) - near).max() <= 10 * same:
                found_text, near_text = point_text(found[row]), point_text(near)
                raise ProofError(f"{self.name} gives {found_text}, but {near_text} reaches the target as well")

    def _is_met(self, line: InLine, q: FloatArray, wanted: FloatArray, same: float) -> bool:
        """Returns whether a solution is a wanted one but for what both joints in line share."""
        joint, apart = self.joints[line.middle], q - wanted
        away = min(abs(q[line.middle] - each) for each in _whole_turns(joint, line.at, q[line.middle]))
        turns = np.array([each.turn if math.isfinite(each.turn) else math.inf for each in self.joints])
        apart -= np.where(np.isfinite(turns), np.round(apart / turns) * np.where(np.isfinite(turns), turns, 0), 0)
        others = np.delete(apart, [line.first, line.last])
        return bool(away <= 0.9 * line.near.of(self.real == "float") and np.abs(others).max() <= same)

    def _require_nearest(self, q: FloatArray, wanted: FloatArray, solutions: FloatArray, target: FloatArray) -> None:
        if not np.isfinite(q).all() or any(self._is_outside(*pair) for pair in zip(self.joints, q, strict=True)):
            raise ProofError(f"{self.name} breaks a limit: {point_text(q)}")
        slack = _SLACK[self.real]
        options = np.array([[*map(_turned, self.joints, values, wanted)] for values in solutions])
        apart = ((options - wanted) ** 2).sum(axis=1)
        if ((q - wanted) ** 2).sum() > apart.min() * (1 + slack) + slack:
            given, near, best = map(point_text, (q, wanted, options[apart.argmin()]))
            raise ProofError(f"{self.name} gives {given} for {near}, but {best} is nearer")
        # Halfway between two whole turns either one is nearest.
        turns = np.array([joint.turn if math.isfinite(joint.turn) else 1.0 for joint in self.joints])
        whole = np.where([math.isfinite(joint.turn) for joint in self.joints], np.round((options - q) / turns), 0)
        is_one = np.abs(options - q - whole * turns).max(axis=1).min() <= slack
        if not is_one and not self._reaches(q, target):
            reason = "is none of the solutions with whole turns added"
            raise ProofError(f"{self.name} gives {point_text(q)}, which {reason}")

    def _reaches(self, q: FloatArray, target: FloatArray) -> bool:
        """Whether a joint vector leads there that is none of the solutions: with axes in line, or an end free."""
        if not self.lines and self.end is None:
            return False
        away = np.abs(reference.pose(self.robot, q[None])[0, 0] - target)
        slack = _SLACK[self.real]
        return bool((self.is_placed or away[:3, :3].max() <= slack) and away[:3, 3].max() <= slack * reach(self.robot))

    def _is_outside(self, joint: _Joint, value: float) -> bool:
        unit = np.finfo(DTYPES[self.real]).eps
        room = joint.room + 8 * float(unit) * max(abs(joint.low), abs(joint.high))
        return joint.is_limited and not joint.low - room <= value <= joint.high + room

    def require_none(self, choose: Choose, targets: Arrays, wanted: Any) -> None:
        """Nothing is near to what is not a joint vector; the other rows of a batch are as they were."""
        usual = choose(targets, wanted)[1]
        for value in _NONE:
            spoilt = wanted.copy()
            rows = np.arange(0, len(spoilt), 2)
            spoilt[rows, np.resize(np.arange(len(self.joints)), len(rows))] = value
            found, exists = choose(targets, spoilt)
            others = np.array_equal(exists[1::2], usual[1::2]) and np.isfinite(found[exists]).all()
            if exists[::2].any() or not np.isnan(found[::2]).all() or not others:
                raise ProofError(f"{self.name} finds a solution near to a joint value of {value}")


def _turned(joint: _Joint, value: float, wanted: float) -> float:
    """Returns a solution's value with those whole turns within the limits that bring it nearest to what is wanted."""
    return min(_whole_turns(joint, value, wanted), key=lambda each: abs(each - wanted))


def _whole_turns(joint: _Joint, value: float, wanted: float) -> Iterator[float]:
    """Yields a solution's value, and others by whole turns that can be the nearest one within the limits."""
    yield value
    if math.isinf(joint.turn):
        return
    places = [wanted] + [joint.low, joint.high] * joint.is_limited
    for place in places:
        middle = round((place - value) / joint.turn)
        for count in range(middle - 2, middle + 3):
            moved = value + count * joint.turn
            if not joint.is_limited or joint.low - joint.room <= moved <= joint.high + joint.room:
                yield moved
