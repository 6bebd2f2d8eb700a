"""The eliminations that suit an arm: each of the orders is tried at some targets, with NumPy.

An order fails where two solutions always share an angle c, or where the equations lose rank; special arms have such
orders. The trial only says yes or no, by wide margins, so that every machine takes the same ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from kinegen import reference
from kinegen.emit.complete.screws import JOINTS, Screws, pose_of, refusal, refused, screws_of
from kinegen.emit.complete.tables import ORDERS, Elimination, carried, elimination, split, widened
from kinegen.robot.model import Robot

Floats = NDArray[np.float64]

USED = 2
"""Eliminations of an arm: where the first one leaves a doubt, the second one is made."""

SHIFTS = (0.3, 1.9)
"""The angle c is measured from here in the first and in the second elimination, in rad."""

_TRIALS = 12
_MISSES = 2
_NEAR = 1e-4
_SINGLE = 1e-9


@dataclass(frozen=True, slots=True)
class Complete:
    """What the complete inverse of an arm is computed from.

    Attributes:
        scale: What lengths are divided by.
        eliminations: Two of them; the same one twice where only one suits.
    """

    scale: float
    eliminations: tuple[Elimination, ...]


@lru_cache(maxsize=16)
def complete_of(robot: Robot) -> Complete:
    """The eliminations of an arm.

    Raises:
        KinegenError: If it has not six turning joints, or if none of the eliminations finds its solutions.
    """
    reason = refusal(robot)
    if reason:
        raise refused(robot, reason)
    with mpmath.workdps(reference.DIGITS):
        screws = screws_of(robot)
        found = []
        for order in ORDERS:
            candidate = elimination(screws, order)
            if _suits(screws, candidate):
                found.append(candidate)
            if len(found) == USED:
                break
    if not found:
        raise refused(robot, "its solutions share the angles that would separate them; take inverse")
    return Complete(screws.scale, (*found, found[0])[:USED])


def _suits(screws: Screws, candidate: Elimination) -> bool:
    """Whether the angle c of nearly every random target is a single root, with one null vector."""
    random = np.random.default_rng(1)
    missed = 0
    for q in random.uniform(-np.pi, np.pi, (_TRIALS, JOINTS)):
        polynomial = _polynomial(screws, candidate, q)
        try:
            roots = np.linalg.eigvals(_companion(candidate, polynomial))
        except np.linalg.LinAlgError:
            return False
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
    """The twelve equations as factors of t^2, t and 1, for the pose of a joint vector; each of shape (12, 12)."""
    target = pose_of(screws, list(map(mpmath.mpf, q.tolist())))
    closing = candidate.left * (target if candidate.backwards else mpmath.inverse(target)) * candidate.right
    rows = _equations(candidate, mpmath.inverse(closing))
    wide = np.array([[part for row in rows for part in widened(list(row[k]))] for k in range(3)], dtype=float)
    cosine, sine, rest = wide
    return rest - cosine, 2 * sine, rest + cosine


def _companion(candidate: Elimination, polynomial: tuple[Floats, Floats, Floats]) -> Floats:
    """The matrix whose eigenvalues are tan(c / 2), shape (16, 16)."""
    square, linear, constant = polynomial
    basis = np.array([[float(entry) for entry in vector] for vector in candidate.basis]).T
    real, pairs = candidate.real, 4 - candidate.real
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
    free = np.linalg.qr(along[:, :2], mode="complete")[0][:, 2:].T
    turned = np.linalg.qr(across, mode="complete")[0][:, 3].conj()
    table = np.array([[float(entry) for entry in row] for row in candidate.along])
    rows = free @ table
    rows[:, 26] -= free @ along[:, 2]
    other = turned @ np.array([[complex(entry) for entry in row] for row in candidate.across])
    return np.concatenate([rows, other.real[None], other.imag[None]]).reshape(6, 3, 9)
