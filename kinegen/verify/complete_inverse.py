"""The proof of a complete inverse: the joint vector that made a pose is found, and all that is found leads there."""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any

import numpy as np

from kinegen.errors import ProofError
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.outputs import POSE_AND_JACOBIAN, Quantity
from kinegen.model.robot import Robot
from kinegen.support.naming import RUNTIME
from kinegen.verify import reference
from kinegen.verify.inverse_targets import point_text, pose_errors, unchecked, within_limits
from kinegen.verify.invocations import numpy_form
from kinegen.verify.records import NUMPY, Comparison, Invocation, solver_comparison
from kinegen.verify.samples import SEED, FloatArray, Truths, random_joints, singular_values

STEPS = (90, 45, 30)
"""Each third of the joint vectors consists of multiples of one of these, in degrees."""

REGULAR = 1e-3
"""The least singular value of the Jacobian, lengths by the reach, above which a joint vector counts as regular."""

_TRIED = 8
"""Times as many are drawn as are wanted, for some are singular."""


def multiples(robot: Robot, count: int, seed: int) -> FloatArray:
    """Regular joint vectors of multiples of 90, 45 and 30 degrees, within the limits.

    `robot`: an arm whose joints turn. Returns joint vectors (n, dof) without repetition; n is smaller than `count`
    where the arm has not as many.
    """
    random = np.random.default_rng(seed)
    parts = [_regular(robot, drawn_multiples(robot, step, _TRIED * count, random)) for step in STEPS]
    return np.concatenate([part[: -(-count // len(STEPS))] for part in parts])


def least_singular_values(robot: Robot, q: FloatArray) -> FloatArray:
    """Returns the least singular value of the Jacobian at joint vectors (n, dof), lengths by the reach."""
    return singular_values(robot, q, reach(robot, robot.tips))[:, -1]


def _regular(robot: Robot, q: FloatArray) -> FloatArray:
    return q[least_singular_values(robot, q) > REGULAR]


def drawn_multiples(robot: Robot, step: int, count: int, random: np.random.Generator) -> FloatArray:
    """Random joint vectors of multiples of a step; a joint whose limits contain none is in their middle."""
    columns = []
    for low, high in joint_box(robot):
        first, last = (np.degrees(end) / step for end in (low, high))
        values = np.radians(step * np.arange(np.ceil(first - 1e-9), np.floor(last + 1e-9) + 1))
        values = np.clip(values, low, high) if len(values) else np.array([(low + high) / 2])
        columns.append(values[random.integers(0, len(values), count)])
    q = np.stack(columns, axis=1)
    return q[np.sort(np.unique(q, axis=0, return_index=True)[1])]


TARGETS = 4000
"""Poses of random joint vectors that the compiled form is given."""

FEWER = 60
"""The same for the form in NumPy."""

SPECIAL = 3000
"""Regular poses at multiples of 90, 45 and 30 degrees that the compiled form is given."""

FEWER_SPECIAL = 60
"""The same for the form in NumPy."""

BESIDE = 1e-6
"""How far beside each of these poses the solutions are compared with: in rad, and as a part of the reach."""

PROBES = 8
"""Targets of each kind that has no solutions."""

PLANTED = 1e-4
"""How near to the joint vector that made a pose one of its solutions must be, in rad; double roots lie apart."""

ACCEPTED = 2e-10
"""How far a solution may lead from its target: as a part of the reach, and in rad. The templates accept half of it."""

APART = 1e-6
"""Solutions of one target must differ by more in some joint, in rad."""


def try_complete(
    robot: Robot, package: ModuleType, quantity: Quantity, _real: str, _parameters: Any = None
) -> tuple[list[Comparison], str]:
    """Solve for the poses of many joint vectors in every way, and see where the solutions lead.

    Returns a comparison for each way to call it, and how much was tried in one sentence. Raises `ProofError` if a joint
    vector that made a pose is not among its solutions, if one breaks a limit or comes twice, if a regular pose has
    fewer solutions than one beside it, or if what is not a pose has solutions.
    """
    compiled = package.complete_inverse
    ways = {Invocation(NUMPY, "double"): (complete_in_numpy(package, compiled), FEWER, FEWER_SPECIAL)}
    if compiled.backend == "c":
        ways = {Invocation("C", "double"): (compiled, TARGETS, SPECIAL)} | ways
    found = [_try(robot, quantity, way, package, solve, counts) for way, (solve, *counts) in ways.items()]
    return [comparison for comparison, _ in found], found[0][1]


def _try(
    robot: Robot, quantity: Quantity, invocation: Invocation, package: ModuleType, solve: Any, counts: list[int]
) -> tuple[Comparison, str]:
    """Try one way at so many random and special targets."""
    count, special = counts
    name = f"{robot.name}: {invocation} {quantity}"
    q = random_joints(robot, count)
    targets = reference.pose(robot, q)[:, 0]
    solutions, valid = solve(targets)
    _require_found(robot, name, q, solutions, valid)
    special = _require_special(robot, name, solve, special)
    _require_none(robot, name, package, solve, targets[:PROBES])
    errors = np.zeros((*valid.shape, 2))
    rows, places = np.nonzero(valid)
    errors[rows, places] = pose_errors(reference.pose(robot, solutions[rows, places])[:, 0], targets[rows])
    size = reach(robot, robot.tips)
    at = np.unravel_index((errors / [size, 1.0]).max(axis=2).argmax(), valid.shape)
    accepted = ACCEPTED * size, ACCEPTED
    comparison = solver_comparison(
        invocation, "all solutions", quantity, count, errors.max(axis=(0, 1)), accepted, solutions[at]
    )
    return comparison, (
        f"complete inverse: the joint vectors of all {count:,} random poses are among their solutions, "
        f"{valid.sum() / count:.1f} on average and {valid.sum(axis=1).max()} at most; so are those of all "
        f"{special:,} regular poses at multiples of 30, 45 and 90 degrees"
    )


def _require_found(robot: Robot, name: str, q: FloatArray, solutions: FloatArray, valid: Truths) -> None:
    """See that the planted joint vectors are there, that limits hold, and that no solution comes twice."""
    apart = np.abs((solutions - q[:, None] + np.pi) % (2 * np.pi) - np.pi).max(axis=2)
    missed = np.flatnonzero(np.where(valid, apart, np.inf).min(axis=1) > PLANTED)
    if len(missed):
        raise ProofError(
            f"{name} misses the joint vectors of {len(missed):,} of {len(q):,} poses, such as "
            f"{point_text(q[missed[0]])}; nothing was written"
        )
    if not (within_limits(robot, solutions, 2e-9).all(axis=2) | ~valid).all():
        raise ProofError(f"{name} gives joint vectors that break limits; nothing was written")
    between = np.abs((solutions[:, :, None] - solutions[:, None] + np.pi) % (2 * np.pi) - np.pi).max(axis=3)
    pairs = valid[:, :, None] & valid[:, None] & ~np.eye(valid.shape[1], dtype=bool)
    if (between[pairs] < APART).any():
        raise ProofError(f"{name} gives a solution twice; nothing was written")


def _require_special(robot: Robot, name: str, solve: Any, count: int) -> int:
    """See that regular poses at multiples of 90, 45 and 30 degrees have all solutions; returns how many there were.

    The joint vector that made a pose must be found, and whatever regular joint vector leads to a pose beside it.
    """
    q = multiples(robot, count, SEED)
    if not len(q):
        return 0
    targets = reference.pose(robot, q)[:, 0]
    solutions, valid = solve(targets)
    _require_found(robot, name, q, solutions, valid)
    others, there = solve(_moved(targets, BESIDE, reach(robot, robot.tips)))
    rows, places = np.nonzero(there & _clear_of_limits(robot, others))
    beside = others[rows, places]
    regular = least_singular_values(robot, beside) > REGULAR
    rows, beside = rows[regular], beside[regular]
    apart = np.abs((solutions[rows] - beside[:, None] + np.pi) % (2 * np.pi) - np.pi).max(axis=2)
    lost = np.flatnonzero(np.where(valid[rows], apart, np.inf).min(axis=1) > 10 * BESIDE / REGULAR)
    if len(lost):
        at = point_text(q[rows[lost[0]]])
        reason = f"finds fewer solutions for the pose of {at} than {BESIDE:g} beside it"
        raise ProofError(f"{name} {reason}; nothing was written")
    return len(q)


def _moved(targets: FloatArray, angle: float, size: float) -> FloatArray:
    """Poses turned and shifted a little, all alike."""
    turn = angle * np.array([[0, 0.64, 0.48], [-0.64, 0, -0.6], [-0.48, 0.6, 0]])
    moved = targets.copy()
    moved[:, :3, :3] = (np.eye(3) + turn + turn @ turn / 2) @ targets[:, :3, :3]
    moved[:, :3, 3] += angle * size * np.array([0.6, 0.48, -0.64])
    return moved


def _clear_of_limits(robot: Robot, q: FloatArray) -> Truths:
    """Returns which joint vectors are so far within the limits that those of a pose beside theirs are, too."""
    return np.asarray(within_limits(robot, q, -10 * BESIDE / REGULAR).all(axis=-1))


def _require_none(robot: Robot, name: str, package: ModuleType, solve: Any, targets: FloatArray) -> None:
    """See that there are no solutions for what is not a pose, and for what is out of reach."""
    kinds = (("NaN", np.nan), ("an infinity", np.inf), ("no rotation", 2.0), ("a reflection", -1.0))
    for what, change in kinds:
        spoilt = targets.copy()
        spoilt[:, :3, 0 if abs(change) <= 2 else 3] *= change
        with unchecked(sys.modules[f"{package.__name__}.{RUNTIME}._complete_inverse"]):
            if solve(spoilt).valid.any():
                raise ProofError(f"{name} has solutions for targets with {what}; nothing was written")
    far = targets.copy()
    far[:, :3, 3] += 3 * reach(robot, robot.tips)
    if solve(far).valid.any():
        raise ProofError(f"{name} has solutions for targets out of reach; nothing was written")


def complete_in_numpy(package: ModuleType, solve: Any) -> Any:
    """Returns the same as it would be without the compiled extension."""
    return type(solve)(
        solve.__name__,
        module=package.__name__,
        symbol="",
        kernel=numpy_form(package, solve.kernel, POSE_AND_JACOBIAN),
        limits=solve.limits,
        tables=solve.tables,
        bounds=solve.bounds,
    )
