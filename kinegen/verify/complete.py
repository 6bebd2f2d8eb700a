"""The proof of a complete inverse: the joint vector that made a pose is found, and all that is found leads there."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen import reference
from kinegen.errors import ProofError
from kinegen.outputs import COMPLETE_INVERSE, POSE_AND_JACOBIAN
from kinegen.robot.extent import joint_box, reach
from kinegen.robot.model import Robot
from kinegen.verify.impossible import unchecked
from kinegen.verify.samples import SEED
from kinegen.verify.solved import pose_errors
from kinegen.verify.ways import numpy_form

FloatArray = NDArray[np.float64]

TARGETS = 4000
"""Poses of random joint vectors that the compiled form is given."""

FEWER = 60
"""The same for the form in NumPy."""

PROBES = 8
"""Targets of each kind that has no solutions."""

PLANTED = 1e-4
"""How near to the joint vector that made a pose one of its solutions must be, in rad; double roots lie apart."""

ACCEPTED = 2e-10
"""How far a solution may lead from its target: as a part of the reach, and in rad. The templates accept half of it."""

APART = 1e-6
"""Solutions of one target must differ by more in some joint, in rad."""


@dataclass(frozen=True, slots=True)
class Completed:
    """One way to call a complete inverse, tried at many targets.

    Attributes:
        target: What was called.
        targets: Number of targets; each of them was found to have the solution that made it.
        solutions: Number of all solutions.
        most: The largest number of solutions of one target.
        position_error: Largest distance of a solution to its target.
        rotation_error: Largest angle of a solution to its target.
        position_tolerance: What was accepted of that.
        rotation_tolerance: What was accepted of that.
        worst: The solution that is farthest from its target.
    """

    target: str
    targets: int
    solutions: int
    most: int
    position_error: float
    rotation_error: float
    position_tolerance: float
    rotation_tolerance: float
    worst: tuple[float, ...]


def try_complete(robot: Robot, package: ModuleType) -> tuple[Completed, ...]:
    """Solve for the poses of many joint vectors in every way, and see where the solutions lead.

    Args:
        robot: The robot.
        package: Its generated package, imported.

    Returns:
        One record for each way to call it.

    Raises:
        ProofError: If a joint vector that made a pose is not among its solutions, if one breaks a limit or comes twice,
            or if what is not a pose has solutions.
    """
    compiled = package.complete_inverse
    ways = {"NumPy double": (complete_in_numpy(package, compiled), FEWER)}
    if compiled.backend == "c":
        ways = {"C double": (compiled, TARGETS)} | ways
    return tuple(_try(robot, target, package, solve, count) for target, (solve, count) in ways.items())


def complete_line(completed: Completed) -> str:
    """A record in one sentence."""
    return (
        f"complete inverse: the joint vectors of all {completed.targets:,} random poses are among their solutions, "
        f"{completed.solutions / completed.targets:.1f} on average and {completed.most} at most"
    )


def _try(robot: Robot, target: str, package: ModuleType, solve: Any, count: int) -> Completed:
    """Try one way at so many targets."""
    name = f"{robot.name}: {target} {COMPLETE_INVERSE}"
    low, high = np.array(joint_box(robot)).T
    q = np.random.default_rng(SEED).uniform(low, high, (count, robot.dof))
    targets = reference.pose(robot, q)[:, 0]
    solutions, valid = solve(targets)
    _require_found(robot, name, q, solutions, valid)
    _require_none(robot, name, package, solve, targets[:PROBES])
    errors = np.zeros((*valid.shape, 2))
    rows, places = np.nonzero(valid)
    errors[rows, places] = pose_errors(reference.pose(robot, solutions[rows, places])[:, 0], targets[rows])
    size = reach(robot, robot.tips)
    at = np.unravel_index((errors / [size, 1.0]).max(axis=2).argmax(), valid.shape)
    return Completed(
        target=target,
        targets=count,
        solutions=int(valid.sum()),
        most=int(valid.sum(axis=1).max()),
        position_error=float(errors[..., 0].max()),
        rotation_error=float(errors[..., 1].max()),
        position_tolerance=ACCEPTED * size,
        rotation_tolerance=ACCEPTED,
        worst=tuple(map(float, solutions[at])),
    )


def _require_found(robot: Robot, name: str, q: FloatArray, solutions: FloatArray, valid: NDArray[np.bool_]) -> None:
    """See that the planted joint vectors are there, that limits hold, and that no solution comes twice."""
    apart = np.abs((solutions - q[:, None] + np.pi) % (2 * np.pi) - np.pi).max(axis=2)
    missed = np.flatnonzero(np.where(valid, apart, np.inf).min(axis=1) > PLANTED)
    if len(missed):
        at = ", ".join(f"{entry:.6g}" for entry in q[missed[0]])
        raise ProofError(
            f"{name} misses the joint vectors of {len(missed):,} of {len(q):,} poses, such as ({at}); "
            "nothing was written"
        )
    low, high = np.array(joint_box(robot)).T
    limited = np.array([variable.limits is not None for variable in robot.variables])
    inside = ~limited | ((solutions >= low - 2e-9) & (solutions <= high + 2e-9))
    if not (inside.all(axis=2) | ~valid).all():
        raise ProofError(f"{name} gives joint vectors that break limits; nothing was written")
    between = np.abs((solutions[:, :, None] - solutions[:, None] + np.pi) % (2 * np.pi) - np.pi).max(axis=3)
    pairs = valid[:, :, None] & valid[:, None] & ~np.eye(valid.shape[1], dtype=bool)
    if (between[pairs] < APART).any():
        raise ProofError(f"{name} gives a solution twice; nothing was written")


def _require_none(robot: Robot, name: str, package: ModuleType, solve: Any, targets: FloatArray) -> None:
    """See that there are no solutions for what is not a pose, and for what is out of reach."""
    kinds = (("NaN", np.nan), ("an infinity", np.inf), ("no rotation", 2.0), ("a reflection", -1.0))
    for what, change in kinds:
        spoilt = targets.copy()
        spoilt[:, :3, 0 if abs(change) <= 2 else 3] *= change
        with unchecked(sys.modules[f"{package.__name__}._complete_inverse"]):
            if solve(spoilt).valid.any():
                raise ProofError(f"{name} has solutions for targets with {what}; nothing was written")
    far = targets.copy()
    far[:, :3, 3] += 3 * reach(robot, robot.tips)
    if solve(far).valid.any():
        raise ProofError(f"{name} has solutions for targets out of reach; nothing was written")


def complete_in_numpy(package: ModuleType, solve: Any) -> Any:
    """The same as it would be without the compiled extension."""
    return type(solve)(
        solve.__name__,
        module=package.__name__,
        symbol="",
        kernel=numpy_form(package, solve.kernel, POSE_AND_JACOBIAN),
        limits=solve.limits,
        tables=solve.tables,
        bounds=solve.bounds,
    )
