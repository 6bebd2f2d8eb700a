"""A numeric inverse in batches and with several tips, weights and free parts: a target has one result everywhere.

Lanes of a tile share nothing but the instructions. So lengths below two tiles, parts, threads and blocks may not change
a bit of a result, nor may neighbours that are no poses, that are out of reach, or that take all restarts. Without
contraction the results have the bits of the search for one target, too.

For an arm the functions that others call, `tip_targets` and `tip_errors`, give its one target.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import numpy as np

from kinegen.errors import ProofError
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.outputs import NUMERIC_INVERSE
from kinegen.model.robot import JointType, Robot
from kinegen.runtime.extension import runnable_variants, select_variant
from kinegen.verify import reference
from kinegen.verify.bit_consistency import LONGEST
from kinegen.verify.inverse_targets import pose_errors, unchecked
from kinegen.verify.invocations import DTYPES
from kinegen.verify.samples import SEED, FloatArray, Truths
from kinegen.verify.tolerances import accepted_error

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
    """Returns the poses of joint vectors as a search is given them: (N, 4, 4) of an arm, (N, tips, 4, 4) of a tree."""
    poses = reference.pose(robot, q, values)
    return poses if robot.is_tree else poses[:, 0]


def tip_errors(robot: Robot, q: FloatArray, targets: FloatArray, values: Any = None) -> FloatArray:
    """Distances and angles between the poses of joint vectors and targets.

    `q`: joint vectors (N, dof); `targets`: as `tip_targets` gives them; `values`: values of the runtime parameters;
    those of the robot file if left out. Returns shape (N, 2, tips), in the length unit of the robot and in radians.
    """
    poses, tips = reference.pose(robot, q, values), len(robot.tips)
    goals = targets.reshape(-1, tips, 4, 4)
    return np.stack([pose_errors(poses[:, tip], goals[:, tip]) for tip in range(tips)], axis=2)


def turned_weights(robot: Robot) -> FloatArray:
    """Weights (tips, 2) with parts that are free."""
    return _in_turn(robot, _FREE)


def require_free_parts(robot: Robot, search: Any, module: ModuleType, real: str, name: str, params: Any) -> None:
    """See that a free part of a tip has no effect, and that the others are solved for and reported.

    `robot`: the tree, with the values of the runtime parameters that are tried; `module`: the module that checks
    targets, which does not in the meantime; `params`: the package's `Params`, or None. Raises `ProofError` if a bit
    changes with the target of a free part, errors are not those that there are, a target with NaN is searched for, or
    too few are solved.
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

    `params`: the package's `Params`, or None. Raises `ProofError` if the joints after some steps are not the same but
    for rounding.
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


def _with_free(targets: Any, free: Truths, value: float | None) -> Any:
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


LONG = 1100
"""More than threads take in one turn."""

_RESTARTS = 2
_STEP = 2654435761
"""From the seed of one target to that of the next, modulo 2^32."""


def require_search_batches(robot: Robot, package: ModuleType, real: str, params: Any = None) -> None:
    """Search for batches in several ways, and refuse a search that gives other bits in one of them.

    `robot`: the robot, with the values of the runtime parameters that are tried; `params`: the package's `Params`; None
    where there are none, or for those of the robot file. Raises `ProofError` naming the way that gives something else.
    """
    targets, starts = _mixed(robot, LONG, real)
    weights = {"weights": turned_weights(robot)} if robot.is_tree else {}
    with unchecked(sys.modules[type(package.numeric_inverse).__module__]):
        for variant in runnable_variants(package) or ("",):
            if variant:
                select_variant(package, variant)
            _require_same(robot, package, real, _Case(package.numeric_inverse, targets, starts, params, weights))


class _Case:
    """Targets of all kinds, and the search for a part of them."""

    def __init__(self, search: Any, targets: Any, starts: Any, params: Any, more: dict[str, Any]) -> None:
        self._search, self._targets, self._starts = search, targets, starts
        self._usual = {"restarts": _RESTARTS, "params": params, **more}

    def part(self, first: int, last: int, **options: Any) -> Any:
        """Returns the results of some targets as one batch that begins with the first of them."""
        return self._search(self._targets[first:last], self._starts[first:last], **{**self._usual, **options})

    def one(self, index: int, seed: int) -> Any:
        """Returns the result of a target by itself."""
        return self._search(self._targets[index], self._starts[index], seed=seed, **self._usual)


def _require_same(robot: Robot, package: ModuleType, real: str, case: _Case) -> None:
    name = f"{robot.name}: C {real}, batch {NUMERIC_INVERSE}"
    whole = case.part(0, LONG)
    for way, found, first in _ways(case, _contracts(package)):
        for field, got, wanted in zip(whole._fields, found, whole, strict=True):
            if got.tobytes() != wanted[first : first + len(got)].tobytes():
                raise ProofError(f"{name} gives another {field} {way}; nothing was written")


def _ways(case: _Case, contracts: bool) -> Iterator[tuple[str, Any, int]]:
    """Yields what differs, the results, and where their targets begin."""
    for length in range(LONGEST + 1):
        yield f"in a batch of {length}", case.part(0, length), 0
    yield "with two threads", case.part(0, LONG, threads=2), 0
    for first in (1, 7, LONGEST):
        yield "for a part of the batch", case.part(first, 2 * LONGEST, seed=1 + first * _STEP), first
    for index in range(0 if contracts else LONGEST):
        alone = case.one(index, 1 + index * _STEP)
        yield "than for one target", type(alone)(*(np.asarray(entry)[None] for entry in alone)), index


def _contracts(package: ModuleType) -> bool:
    """Returns whether a product and a sum may be one operation, so that two copies of a kernel may differ."""
    native: Any = getattr(package, "_native")  # noqa: B009 - what the package calls its own
    return "reproducible" not in native.ffi.string(native.lib.kinegen_variant()).decode()


def _mixed(robot: Robot, count: int, real: str) -> tuple[Any, Any]:
    """Targets and starts (N, dof): most can be reached, and every seventh is of another kind, by its first tip."""
    low, high = np.array(joint_box(robot)).T
    q, starts = np.random.default_rng(SEED).uniform(low, high, (2, count, robot.dof))
    targets = tip_targets(robot, q)
    first = targets.reshape(count, -1, 4, 4)[:, 0]
    kinds = np.where(np.arange(count) % 7 == 3, np.arange(count) // 7 % 4, -1)
    first[kinds == 0, 0, 3] = np.nan
    first[kinds == 1, 1, 1] = np.inf
    first[kinds == 2, :3, 3] *= 5  # out of reach: all restarts are taken
    starts[kinds == 3, -1] = np.nan
    return targets.astype(DTYPES[real]), starts.astype(DTYPES[real])
