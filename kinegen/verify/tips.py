"""A numeric inverse with several tips: targets of all of them, weights, and parts that are free.

In: a tree, and a way to call its search. Out: nothing, or the first thing that is wrong. For an arm the functions that
others call, `tip_targets` and `tip_errors`, give its one target.
"""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen import reference
from kinegen.errors import ProofError
from kinegen.robot.extent import joint_box, reach
from kinegen.robot.model import JointType, Robot
from kinegen.verify.impossible import unchecked
from kinegen.verify.samples import SEED
from kinegen.verify.solved import pose_errors
from kinegen.verify.tolerances import accepted_error
from kinegen.verify.ways import DTYPES

FloatArray = NDArray[np.float64]

TARGETS = 40
"""Targets of every check."""

LEAST_SHARE = 0.9
"""A search that solves less with free parts is broken."""

_ROUNDINGS = 2
"""A difference of poses may be off by so many times what a pose may be."""

_STEPS = 3
"""Steps after which two forms of a search are compared, from near starts: rounding has not grown yet."""

_APART = {"double": 1e-7, "float": 2e-3}
"""How far their joints may be apart then, in radians or parts of the reach."""

_FREE = ((1.0, 0.0), (0.0, 1.0), (0.5, 2.0), (0.0, 0.0))
"""Weights of position and rotation, in turn of the tips."""

_UNEQUAL = ((1.0, 0.5), (0.25, 2.0), (3.0, 1.0))
"""Weights that leave nothing free."""


def tip_targets(robot: Robot, q: FloatArray, values: Any = None) -> FloatArray:
    """The poses of joint vectors as a search is given them: (N, 4, 4) of an arm, (N, tips, 4, 4) of a tree."""
    poses = reference.pose(robot, q, values)
    return poses if robot.is_tree else poses[:, 0]


def tip_errors(robot: Robot, q: FloatArray, targets: FloatArray, values: Any = None) -> FloatArray:
    """Distances and angles between the poses of joint vectors and targets.

    Args:
        robot: The robot.
        q: Joint vectors (N, dof).
        targets: As `tip_targets` gives them.
        values: Values of the runtime parameters; those of the robot file if left out.

    Returns:
        Shape (N, 2, tips), in the length unit of the robot and in radians.
    """
    poses, tips = reference.pose(robot, q, values), len(robot.tips)
    goals = targets.reshape(-1, tips, 4, 4)
    return np.stack([pose_errors(poses[:, tip], goals[:, tip]) for tip in range(tips)], axis=2)


def turned_weights(robot: Robot) -> FloatArray:
    """Weights (tips, 2) with parts that are free."""
    return _in_turn(robot, _FREE)


def require_free_parts(robot: Robot, search: Any, module: ModuleType, real: str, name: str, params: Any) -> None:
    """See that a free part of a tip has no effect, and that the others are solved for and reported.

    Args:
        robot: The tree, with the values of the runtime parameters that are tried.
        search: A way to call its search.
        module: The module that checks targets, which does not in the meantime.
        real: The number type.
        name: What is called, for the message.
        params: The package's `Params`, or None.

    Raises:
        ProofError: If a bit changes with the target of a free part, errors are not those that there are, a target with
            NaN is searched for, or too few are solved.
    """
    starts, targets = _near(robot, real)
    weights = turned_weights(robot)
    free = ~(weights > 0)
    with unchecked(module):
        usual, *others = (
            search(_with_free(targets, free, value), starts, weights=weights, params=params)
            for value in (None, np.nan, np.inf, 1e20)
        )
        wrong = targets.copy()
        wrong[:, 0, 1, 3] = np.nan  # the position of the first tip is not free
        spoilt = search(wrong, starts, weights=weights, params=params)
    for other in others:
        for field, got, wanted in zip(usual._fields, other, usual, strict=True):
            if got.tobytes() != wanted.tobytes():
                raise ProofError(
                    f"{name} gives another {field} for another target of what is free; nothing was written"
                )
    if spoilt.solved.any() or spoilt.iterations.any():
        raise ProofError(f"{name} searches for targets with NaN of one tip; nothing was written")
    reported = np.stack([usual.position_error, usual.rotation_error], axis=1)
    true = tip_errors(robot, usual.q.astype(np.float64), targets.astype(np.float64)) * (weights.T > 0)
    most = accepted_error(robot, real) * _ROUNDINGS
    if (np.abs(reported - true) > most * np.array([[reach(robot, robot.tips)], [1]])).any():
        raise ProofError(f"{name} with weights reports errors that are not those that there are; nothing was written")
    if usual.solved.mean() < LEAST_SHARE:
        solved = f"{int(usual.solved.sum())} of {TARGETS} targets"
        raise ProofError(f"{name} solves only {solved} with parts that are free; nothing was written")


def require_same_steps(robot: Robot, search: Any, other: Any, real: str, name: str, params: Any) -> None:
    """See that a search takes the steps of another form of it, with unequal weights.

    Args:
        robot: The tree.
        search: The compiled search.
        other: The search in NumPy.
        real: The number type.
        name: What is called, for the message.
        params: The package's `Params`, or None.

    Raises:
        ProofError: If the joints after some steps are not the same but for rounding.
    """
    starts, targets = _near(robot, real)
    options = {"weights": _in_turn(robot, _UNEQUAL), "restarts": 0, "steps": _STEPS, "params": params}
    found, wanted = search(targets, starts, **options), other(targets, starts, **options)
    sizes = [reach(robot) if each.type is JointType.PRISMATIC else 1.0 for each in robot.variables]
    apart = np.abs(found.q - wanted.q) / np.array(sizes)
    if apart.max() > _APART[real]:
        raise ProofError(f"{name} takes other steps than NumPy does with weights; nothing was written")


def _near(robot: Robot, real: str) -> tuple[Any, Any]:
    """Targets away from limits, after starts near them."""
    low, high = np.array(joint_box(robot)).T
    random = np.random.default_rng(SEED)
    q = random.uniform(low + (high - low) / 4, high - (high - low) / 4, (TARGETS, robot.dof))
    starts = q + random.uniform(-0.1, 0.1, q.shape) * (high - low) / 4
    return starts.astype(DTYPES[real]), tip_targets(robot, q).astype(DTYPES[real])


def _with_free(targets: Any, free: NDArray[np.bool_], value: float | None) -> Any:
    """Targets with a value in everything that is free; themselves without one."""
    found = targets.copy()
    if value is not None:
        for tip, (position, rotation) in enumerate(free):
            if position:
                found[:, tip, :3, 3] = value
            if rotation:
                found[:, tip, :3, :3] = value
    return found


def _in_turn(robot: Robot, weights: tuple[tuple[float, float], ...]) -> FloatArray:
    return np.array([weights[tip % len(weights)] for tip in range(len(robot.tips))])
