"""Joint vectors beside singular poses: by the Jacobian of the reference, and by the conditions of an inverse."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen.derive.expressions import number_of
from kinegen.derive.inverse.derive import singular_below, size_of
from kinegen.derive.inverse.family import Aim, Family
from kinegen.derive.inverse.singular_configurations import alignments
from kinegen.derive.inverse.tolerances import FREE
from kinegen.ir.lower import program_of, runtime_defaults
from kinegen.ir.program import Constant, Operand, Operator, Program, RuntimeParameter, Statement, Temporary, Variable
from kinegen.model.dh_conversion.elementary_transforms import chain_of
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.outputs import Quantity
from kinegen.model.robot import JointType, Robot
from kinegen.support.dataclass import dataclass
from kinegen.verify import reference
from kinegen.verify.samples import SEED, FloatArray, Truths, random_joints, singular_values

SINGULAR = 1e-3
"""Where the least singular value of the Jacobian, lengths relative to the reach, is below this, the rounding of a
target may move joints by more; any solution that leads there will then do."""

NEARLY_SINGULAR = {"double": 1e-5, "float": 1e-3}
"""The same for an arm that is nearly of its family, unless more is stated for its defect."""

TURNED = 1e-6
"""How far an arm beside another singular set may turn a wrist that is in line."""

_FREE_TWICE = 1e-6
"""Where two singular values are below this, two motions of the joints leave the tool where it is."""

_FREE_ONCE = 1e-9
"""Where one is below this, one motion does, but for less than the rounding of two branches that meet there."""


def are_singular(robot: Robot, family: Family, real: str, q: FloatArray) -> Truths:
    """Whether rounding, or what is stated for an arm that is nearly of its family, may move or hide branches."""
    least = SINGULAR if family.defect is None else NEARLY_SINGULAR[real]
    return _least(robot, family, q) < max(least, singular_below(robot, family))


def may_merge(robot: Robot, family: Family, q: FloatArray) -> Truths:
    """Whether branches of an arm that is nearly of its family may merge at joint vectors (N, dof), as it is stated."""
    return _least(robot, family, q) < singular_below(robot, family)


def _least(robot: Robot, family: Family, q: FloatArray) -> FloatArray:
    found: FloatArray = _values(robot, family, q).min(axis=1, initial=np.inf)
    return found


def are_free(robot: Robot, family: Family, q: FloatArray, *, beside: bool) -> Truths:
    """Returns whether a joint vector may be without a solution within limits, since two joints are free, or nearly one.

    Two joints that are free at once are chosen one after the other. Where one is nearly free and two branches meet, the
    rounding of the target decides its value, which may take a joint that follows beyond a limit. `q`: joint vectors,
    shape (N, dof); `beside`: whether they are beside singular sets, not on them. Shape (N,).
    """
    values = np.sort(_values(robot, family, q), axis=1)
    once, twice = (values[:, 0] < _FREE_ONCE) & beside, (values[:, 1:2] < _FREE_TWICE).any(axis=1)
    found: Truths = np.asarray(once | twice)
    return found


def are_turned(family: Family, joints: FloatArray, q: FloatArray) -> Truths:
    """Returns whether the rounding of an arm, beside another singular set, leaves the wrist a little out of line.

    The target then has a solution for that arm in which joints are where that little says.
    """
    found = np.zeros(len(q), bool)
    for index, _ in alignments(family):
        rate = float(family.joints[index].rate)
        apart = np.abs(np.sin((joints[..., index] - q[:, None, index]) * rate))
        found |= ((apart > number_of(FREE, single=False)) & (apart < TURNED)).any(axis=1)
    return found


def _values(robot: Robot, family: Family, q: FloatArray) -> FloatArray:
    """Returns the singular values of the Jacobian by the joints that are solved for, lengths relative to the reach."""
    rows = 6 if family.aim is Aim.POSE else 3
    # The joints that are given move no branch.
    solved = sorted(number - 1 for number in family.axes.numbers)
    return singular_values(robot, q, size_of(robot, family), solved, rows)


Numbers = NDArray[Any]


class Values:
    """What the operands of a program are, computed in the number type of the inputs.

    Args:
        inputs: Its inputs, shape (entries, N).
        params: Values of its runtime parameters, in their order.
    """

    def __init__(self, program: Program, inputs: Numbers, params: Sequence[float] = ()) -> None:
        self._inputs = inputs
        self._params: Mapping[str, float] = dict(zip(program.parameters, params, strict=True))
        self._known: dict[str, Numbers] = {}
        with np.errstate(all="ignore"):
            for statement in program.statements:
                operands = tuple(map(self.of, statement.operands))
                for name, function in zip(statement.results, _OPERATIONS[statement.operator], strict=True):
                    self._known[name] = function(*operands)

    def of(self, operand: Operand) -> Numbers:
        """Returns the values of an operand, shape (N,)."""
        match operand:
            case Variable(index):
                found: Numbers = self._inputs[index]
                return found
            case RuntimeParameter(name):
                return self._constant(self._params[name])
            case Constant():
                return self._constant(float(operand.of(self._inputs.dtype == np.float32)))
            case Temporary(name):
                return self._known[name]

    def _constant(self, value: float) -> Numbers:
        return np.full(self._inputs.shape[1:], value, self._inputs.dtype)


def _selected(less: Numbers, more: Numbers, then: Numbers, other: Numbers) -> Numbers:
    found: Numbers = np.where(less < more, then, other)
    return found


_OPERATIONS: Mapping[Operator, tuple[Callable[..., Numbers], ...]] = {
    Operator.ADD: (np.add,),
    Operator.SUB: (np.subtract,),
    Operator.MUL: (np.multiply,),
    Operator.DIV: (np.divide,),
    Operator.NEG: (np.negative,),
    Operator.SINCOS: (np.sin, np.cos),
    Operator.SQRT: (np.sqrt,),
    Operator.ATAN2: (np.arctan2,),
    Operator.SELECT_LT: (_selected,),
}


DECADES = 17
"""Distances 1, 1e-1 and so on to 1e-16 of a radian or of the reach, and the singular set itself."""

STARTS = 12
"""Joint vectors from which each singular set is looked for."""

KEPT = 4
"""Points of each singular set that are approached, where so many are found."""

_STEPS = 24
_LONGEST = 0.5
_DIFFERENCE = 1e-7
_ARRIVED = 1e-7

Watched = tuple[Operand, ...]
"""Operands that vanish together on a singular set."""


@dataclass(frozen=True, slots=True)
class Approach:
    """Joint vectors beside singular sets."""

    points: FloatArray  # Joint vectors within the limits, shape (N, dof)
    # Of each the power of ten that divides its distance, shape (N,); `DECADES` on a singular set
    decades: NDArray[np.intp]


@lru_cache(maxsize=8)
def approaching(robot: Robot, quantity: Quantity) -> Approach:
    """Joint vectors beside every singular set that is found."""
    # Most builds have no inverse, and these modules take a hundredth of their time.
    from kinegen.derive.singularities.singular_points import singular_points

    program, arm = program_of(robot, quantity), chain_of(robot, quantity)
    found = [_Search(arm, program, _watched(program)).points(), singular_points(arm, joint_box(arm), KEPT)]
    points = _within(arm, np.concatenate(found))
    away = np.random.default_rng(SEED).normal(size=(DECADES + 1, *points.shape))
    away /= np.linalg.norm(away, axis=2, keepdims=True)
    decades = np.arange(DECADES + 1)
    distances = np.where(decades < DECADES, 10.0**-decades, 0)
    beside = points + distances[:, None, None] * away * _units(arm)
    low, high = np.array(joint_box(arm)).T
    return Approach(np.clip(beside, low, high).reshape(-1, arm.dof), np.repeat(decades, len(points)))


def _units(robot: Robot) -> FloatArray:
    """Returns what a step of each joint is measured in: radians, or the reach."""
    shifts = [variable.type is JointType.PRISMATIC for variable in robot.variables]
    return np.where(shifts, reach(robot), 1.0)


def _within(robot: Robot, points: FloatArray) -> FloatArray:
    """Returns those of some joint vectors that are within the limits but for whole turns."""
    low, high = np.array(joint_box(robot)).T
    turns = np.array([variable.type is not JointType.PRISMATIC for variable in robot.variables])
    turned = points + np.where(turns, 2 * np.pi * np.ceil((low - points) / (2 * np.pi)), 0)
    within: FloatArray = turned[((low <= turned) & (turned <= high)).all(axis=1)]
    return within


def _watched(program: Program) -> tuple[Watched, ...]:
    """Returns what has to be far from zero for the program to keep its digits."""
    made = {name: statement for statement in program.statements for name in statement.results}
    found = {}
    for statement in program.statements:
        match statement.operator:
            case Operator.SQRT | Operator.ATAN2:
                operands = statement.operands
            case Operator.DIV:
                operands = statement.operands[1:]
            case _:
                continue
        usual = tuple(_usual(each, made) for each in operands)
        if any(isinstance(each, Temporary) for each in usual):
            found[frozenset(usual)] = usual
    return tuple(found.values())


def _usual(operand: Operand, made: dict[str, Statement]) -> Operand:
    """Returns an operand before a sign or another number was chosen for it."""
    while isinstance(operand, Temporary):
        statement = made[operand.name]
        if statement.operator is Operator.NEG:
            operand = statement.operands[0]
        elif statement.operator is Operator.SELECT_LT:
            then, other = statement.operands[2:]
            operand = then if isinstance(other, Constant) or statement.operands[1] == then else other
        else:
            break
    return operand


@dataclass(frozen=True, slots=True)
class _Search:
    robot: Robot
    program: Program
    watched: tuple[Watched, ...]

    def points(self) -> FloatArray:
        """Joint vectors on singular sets, `KEPT` of each at most."""
        count = len(self.watched) * STARTS
        q = random_joints(self.robot, count)
        which = np.repeat(np.arange(len(self.watched)), STARTS)
        length = np.full(count, np.inf)
        for _ in range(_STEPS):
            step = self._step(q, which)
            length = np.linalg.norm(step, axis=1)
            step *= np.minimum(1, _LONGEST / np.maximum(length, _LONGEST))[:, None]
            q = q - step * _units(self.robot)
        return np.concatenate([q[:0], *self._kept(q, length < _ARRIVED)])

    def _kept(self, q: FloatArray, arrived: Truths) -> Iterator[FloatArray]:
        for start in range(0, len(q), STARTS):
            part = slice(start, start + STARTS)
            yield q[part][arrived[part]][:KEPT]

    def _step(self, q: FloatArray, which: NDArray[np.intp]) -> FloatArray:
        """The least step that leads each joint vector to where what it watches vanishes, as far as it is linear."""
        units = _units(self.robot)
        beside = [
            q,
            *(q + _DIFFERENCE * unit * direction for unit, direction in zip(units, np.eye(len(units)), strict=True)),
        ]
        values = self._values(np.concatenate(beside), np.tile(which, len(beside))).reshape(len(beside), len(q), 2)
        slopes = np.moveaxis(values[1:] - values[0], 0, 2) / _DIFFERENCE
        bad = ~np.isfinite(slopes).all(axis=(1, 2))
        slopes[bad], here = 0, np.where(bad[:, None], 0, values[0])
        step: FloatArray = (np.linalg.pinv(slopes, rcond=_DIFFERENCE) @ here[..., None])[..., 0]
        step[bad] = np.nan
        return step

    def _values(self, q: FloatArray, which: NDArray[np.intp]) -> FloatArray:
        """Returns what each joint vector watches, shape (N, 2)."""
        poses = reference.pose(self.robot, q)[:, 0, :3].reshape(len(q), 12).T
        given = reference.redundancy(self.robot, q).reshape(len(q), -1).T if self.robot.redundancy else poses[:0]
        known = Values(self.program, np.concatenate([poses, given]), tuple(map(float, runtime_defaults(self.robot))))
        found = np.zeros((len(q), 2))
        for number, operands in enumerate(self.watched):
            rows = which == number
            for place, operand in enumerate(operands):
                found[rows, place] = known.of(operand)[rows]
        return found
