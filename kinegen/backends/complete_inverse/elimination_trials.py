"""The trial of an elimination at some targets, with NumPy: whether the angle that it finds is a single root there."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from kinegen.backends.complete_inverse.elimination import Elimination, carried, split, widened
from kinegen.backends.complete_inverse.screws import JOINTS, Screws, pose_of
from kinegen.model.joint_bounds import reach
from kinegen.model.robot import TOOL, Robot
from kinegen.verify import reference

Floats = NDArray[np.float64]

_TRIALS = 12
_MISSES = 2
_NEAR = 1e-4
_SINGLE = 1e-9


def singular(robot: Robot) -> str:
    """Say that an arm has no isolated solutions, if it is so."""
    q = np.random.default_rng(1).uniform(-np.pi, np.pi, (_TRIALS, JOINTS))
    jacobians = reference.Kinematics(robot, q).jacobian(TOOL)
    jacobians[:, :3] /= reach(robot, robot.tips)
    sizes = np.linalg.svd(jacobians, compute_uv=False)
    if (sizes[:, -1] > _SINGLE * sizes[:, 0]).any():
        return ""
    return "its Jacobian is singular at every joint vector, so no solution is isolated; take numeric_inverse"


def suits(screws: Screws, candidate: Elimination) -> bool:
    """Tell whether the angle c of nearly every random target is a single root, with one null vector."""
    random = np.random.default_rng(1)
    missed = 0
    for q in random.uniform(-np.pi, np.pi, (_TRIALS, JOINTS)):
        polynomial = _polynomial(screws, candidate, q)
        try:
            roots = np.linalg.eigvals(_companion(candidate, polynomial))
        except np.linalg.LinAlgError:
            return False
        # The angle c of the joint vector that made the target has to be among the roots, by itself.
        planted = -q[candidate.order[2]] if candidate.backwards else q[candidate.order[2]]
        apart = np.abs(np.exp(2j * np.arctan(roots)) - np.exp(1j * planted)).min()
        t = np.tan(planted / 2)
        square, linear, constant = polynomial
        sizes = np.linalg.svd((square * t**2 + linear * t + constant) / (1 + t**2), compute_uv=False)
        missed += not (apart < _NEAR and sizes[-2] > _SINGLE * sizes[0])
        if missed > _MISSES:
            return False
    return True


def _polynomial(screws: Screws, candidate: Elimination, q: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the twelve equations as factors of t^2, t and 1, for the pose of a joint vector; each is (12, 12)."""
    target = pose_of(screws, list(map(mpmath.mpf, q.tolist())))
    closing = candidate.left * (target if candidate.backwards else mpmath.inverse(target)) * candidate.right
    rows = _equations(candidate, mpmath.inverse(closing))
    wide = np.array([[part for row in rows for part in widened(list(row[k]))] for k in range(3)], dtype=float)
    cosine, sine, rest = wide
    return rest - cosine, 2 * sine, rest + cosine


def _companion(candidate: Elimination, polynomial: tuple[Floats, Floats, Floats]) -> Floats:
    """Return the matrix whose eigenvalues are tan(c / 2), shape (16, 16)."""
    square, linear, constant = polynomial
    basis = np.array([[float(entry) for entry in vector] for vector in candidate.basis]).T
    real, pairs = candidate.real, 4 - candidate.real
    # The eight roots t = +-i are divided out with the basis.
    re, im, more = np.split(basis[:, real:], [pairs, 2 * pairs], axis=1)
    lead = square @ basis
    tail = np.concatenate([-constant @ im, constant @ re, linear @ more, constant @ more], axis=1)
    found = np.zeros((16, 16))
    found[: 12 - real] = -np.linalg.solve(lead, tail)[real:]
    found[12 - real :, 2 * pairs : 2 * pairs + more.shape[1]] = np.eye(more.shape[1])
    return found


def _equations(candidate: Elimination, opened: Any) -> Floats:
    """Six equations in c, d and e, shape (6, 3, 9); `opened` is the inverse of the transform with the target."""
    start = [mpmath.mpf(entry) for entry in (0, 0, 1, *[0] * 11, 1)]
    first, last = (opened, candidate.fixed) if candidate.closes_first else (candidate.fixed, opened)
    cosine, sine, rest = split(carried(last, start))
    parts = [carried(first, part) for part in (cosine, [-entry for entry in sine], rest)]
    numbers = np.array([[float(entry) for entry in part] for part in parts]).T
    along, across = numbers[[2, 5, 8, 11, 12, 13]], numbers[[0, 3, 6, 9]] + 1j * numbers[[1, 4, 7, 10]]
    # The angles a and b are eliminated by what is orthogonal to their factors.
    free = np.linalg.qr(along[:, :2], mode="complete")[0][:, 2:].T
    turned = np.linalg.qr(across, mode="complete")[0][:, 3].conj()
    table = np.array([[float(entry) for entry in row] for row in candidate.along])
    rows = free @ table
    rows[:, 26] -= free @ along[:, 2]
    other = turned @ np.array([[complex(entry) for entry in row] for row in candidate.across])
    return np.concatenate([rows, other.real[None], other.imag[None]]).reshape(6, 3, 9)
