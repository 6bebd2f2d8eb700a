"""The solution nearest to a joint vector: held against all solutions with all whole turns, tried one by one.

Every way to ask for it is tried: the C function, its batch in each variant, and the NumPy form.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen import reference
from kinegen.errors import ProofError
from kinegen.outputs import Quantity
from kinegen.robot.extent import joint_box, reach
from kinegen.robot.model import Robot
from kinegen.symbolic.inverse.family import Family
from kinegen.verify.calls import Called, require_same_bits
from kinegen.verify.samples import SEED
from kinegen.verify.ways import DTYPES, Arrays, Way, ways_to_call

FloatArray = NDArray[np.float64]
Truths = NDArray[np.bool_]
Choose = Callable[[Any, Any], tuple[Any, Any]]

TARGETS = 120
"""Targets of a batch."""

_SLACK = {"double": 1e-9, "float": 1e-3}
"""What rounding may do to squared distances, in part."""

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

    Args:
        robot: The robot, with the values of the runtime parameters that are tried.
        family: How it is built.
        package: Its package.
        quantity: The inverse.
        real: The number type.
        rooms: How far outside its limits each joint may be found.
        parameters: Values of the runtime parameters; those of the robot file if left out.

    Raises:
        ProofError: If another solution is nearer, a limit is broken, one is found where there is none, or a call gives
            other bits than a plain batch.
    """
    params = None if parameters is None else package.Params(*parameters)
    joints = _joints(robot, family, rooms)
    targets, wanted = _inputs(robot, joints, real)
    for way in ways_to_call(package, quantity, real, parameters):
        if not way.is_plain and way.target != f"C {real}":
            continue  # other layouts have no such call
        way.select()
        choose = partial(_in_a_batch if way.is_plain else _one_by_one, way.kernel, params)
        judge = _Judge(f"{robot.name}: {way.target} {quantity} with nearest=", joints, real)
        judge.require_choice(way, choose, targets, wanted)
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


@dataclass(frozen=True, slots=True)
class _Judge:
    name: str
    joints: tuple[_Joint, ...]
    real: str

    def require_choice(self, way: Way, choose: Choose, targets: Arrays, wanted: Any) -> None:
        """Every row is the nearest of all solutions, with all whole turns that limits allow."""
        (solutions, valid), (found, exists) = way.call(targets), choose(targets, wanted)
        if not np.array_equal(exists, (valid != 0).any(axis=1)):
            raise ProofError(f"{self.name} does not find what is valid")
        if not np.isnan(found[~exists]).all():
            raise ProofError(f"{self.name} gives numbers where there is no solution")
        for row in np.flatnonzero(exists):
            near, given = wanted[row].astype(float), solutions[row][valid[row] != 0].astype(float)
            self._require_nearest(found[row].astype(float), near, given)

    def _require_nearest(self, q: FloatArray, wanted: FloatArray, solutions: FloatArray) -> None:
        if not np.isfinite(q).all() or any(self._is_outside(*pair) for pair in zip(self.joints, q, strict=True)):
            raise ProofError(f"{self.name} breaks a limit: {_text(q)}")
        slack = _SLACK[self.real]
        options = np.array([[*map(_turned, self.joints, values, wanted)] for values in solutions])
        apart = ((options - wanted) ** 2).sum(axis=1)
        if ((q - wanted) ** 2).sum() > apart.min() * (1 + slack) + slack:
            best = options[apart.argmin()]
            raise ProofError(f"{self.name} gives {_text(q)} for {_text(wanted)}, but {_text(best)} is nearer")
        if np.abs(options - q).max(axis=1).min() > slack:
            raise ProofError(f"{self.name} gives {_text(q)}, which is none of the solutions with whole turns added")

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
    """A solution's value with those whole turns within the limits that bring it nearest to what is wanted."""
    return min(_whole_turns(joint, value, wanted), key=lambda each: abs(each - wanted))


def _whole_turns(joint: _Joint, value: float, wanted: float) -> Iterator[float]:
    """A solution's value, and others by whole turns that can be the nearest one within the limits."""
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


def _text(q: Any) -> str:
    return f"({', '.join(f'{float(entry):.6g}' for entry in q)})"
