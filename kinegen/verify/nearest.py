"""The solution nearest to a joint vector: held against all solutions with all whole turns, tried one by one."""

from __future__ import annotations

import math
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen import reference
from kinegen.errors import ProofError
from kinegen.outputs import Quantity
from kinegen.robot.extent import joint_box
from kinegen.robot.model import Robot
from kinegen.symbolic.inverse.family import Family
from kinegen.verify.samples import SEED
from kinegen.verify.ways import DTYPES

FloatArray = NDArray[np.float64]

TARGETS = 120
"""Targets of a batch, and a tenth of them one by one."""

_SLACK = {"double": 1e-9, "float": 1e-3}
"""What rounding may do to squared distances, in part."""

_NONE = (math.nan, math.inf, -math.inf, 1e9)
"""Joint values to which no solution is near; the last one only for a joint that turns."""


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
        ProofError: If another solution is nearer, a limit is broken, or one is found where there is none.
    """
    kernel, dtype = getattr(package, quantity.function), DTYPES[real]
    params = None if parameters is None else package.Params(*parameters)
    low, high = np.array(joint_box(robot)).T
    generator = np.random.default_rng(SEED)
    poses = reference.pose(robot, generator.uniform(low, high, (TARGETS, robot.dof)))[:, 0].astype(dtype)
    wanted = generator.uniform(low - 1, high + 1, (TARGETS, robot.dof)).astype(dtype)
    solutions, valid = kernel(poses, params=params)
    found, exists = kernel(poses, params=params, nearest=wanted)
    single = [kernel(*pair, params=params, nearest=near) for *pair, near in zip(poses[::10], wanted[::10], strict=True)]
    name = f"{robot.name}: {quantity} ({real}) with nearest="
    if not np.array_equal(exists, valid.any(axis=1)):
        raise ProofError(f"{name} does not report a solution exactly where one is valid")
    alone = np.array([((q - near) ** 2).sum() for (q, _), near in zip(single, wanted[::10], strict=True)])
    together = ((found - wanted) ** 2).sum(axis=1)[::10]
    if not np.allclose(alone, together, rtol=_SLACK[real], atol=_SLACK[real], equal_nan=True):
        raise ProofError(f"{name} gives another solution for one target than for a batch")
    limited = np.array([each.limits is not None for each in robot.variables])
    turns = [2 * math.pi / abs(float(joint.rate)) if joint.turns else math.inf for joint in family.axes.joints]
    room = rooms + 8 * np.finfo(dtype).eps * np.maximum(np.abs(low), np.abs(high))
    for row in np.flatnonzero(exists):
        q = found[row].astype(float)
        if not np.isfinite(q).all() or (limited & ((q < low - room) | (q > high + room))).any():
            raise ProofError(f"{name} breaks a limit: {_text(q)}")
        options = [
            _turned(turns, low, high, limited, solutions[row, branch].astype(float), wanted[row], rooms)
            for branch in np.flatnonzero(valid[row])
        ]
        apart = [float(((each - wanted[row]) ** 2).sum()) for each in options]
        best = options[int(np.argmin(apart))]
        if ((q - wanted[row]) ** 2).sum() > min(apart) * (1 + _SLACK[real]) + _SLACK[real]:
            raise ProofError(f"{name} gives {_text(q)} for {_text(wanted[row])}, but {_text(best)} is nearer")
        if min(float(np.abs(each - q).max()) for each in options) > _SLACK[real]:
            raise ProofError(f"{name} gives {_text(q)}, which is not one of the solutions with whole turns added")
    turning = [joint.number - 1 for joint in family.axes.joints if joint.turns]
    _require_none(name, kernel, poses, wanted, params, turning)


def _turned(
    turns: list[float],
    low: FloatArray,
    high: FloatArray,
    limited: NDArray[np.bool_],
    q: FloatArray,
    wanted: FloatArray,
    rooms: FloatArray,
) -> FloatArray:
    """A solution with those whole turns within the limits that bring each joint nearest to what is wanted."""
    nearest = q.copy()
    for index, turn in enumerate(turns):
        if math.isinf(turn):
            continue
        value, near = q[index], wanted[index]
        middle = round((near - value) / turn)
        counts = [0, *(middle + step for step in (-1, 0, 1))]
        if limited[index]:
            first, last = math.ceil((low[index] - value) / turn), math.floor((high[index] - value) / turn)
            counts += [first, first + 1, last - 1, last]
            least, most = low[index] - rooms[index], high[index] + rooms[index]
            counts = [count for count in counts if least <= value + count * turn <= most] or [0]
        nearest[index] = min((value + count * turn for count in counts), key=lambda each: abs(each - near))
    return nearest


def _require_none(name: str, kernel: Any, poses: Any, wanted: Any, params: Any, turning: list[int]) -> None:
    """Nothing is near to what is not a joint vector; the other rows of a batch are as they were."""
    usual = kernel(poses, params=params, nearest=wanted)[1]
    for value in _NONE:
        places = range(wanted.shape[1]) if not math.isfinite(value) else turning
        if not places:
            continue
        spoilt = wanted.copy()
        rows = np.arange(0, len(spoilt), 2)
        spoilt[rows, np.resize(places, len(rows))] = value
        found, exists = kernel(poses, params=params, nearest=spoilt)
        if exists[::2].any() or not np.array_equal(exists[1::2], usual[1::2]) or not np.isfinite(found[exists]).all():
            raise ProofError(f"{name} finds a solution near to a joint value of {value}")


def _text(q: Any) -> str:
    return f"({', '.join(f'{float(entry):.6g}' for entry in q)})"
