"""The eliminations that suit an arm: each of the orders is tried at some targets, with NumPy; and the bounds.

An order fails where two solutions always share an angle c, or where the equations lose rank; special arms have such
orders. Where none suits, as before a spherical wrist, whose flips share the first three angles, those of an arm a
little beside are taken: its solutions are apart, and the Newton steps of the arm itself lead on from them. The trial
only says yes or no, by wide margins, so that every machine takes the same ones.

The bounds are the same in C and in NumPy. Whether an arm has the closed form of a spherical wrist is read off the lines
of its axes alone; `kinegen.derive` knows the closed forms, and nothing here may import it.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from kinegen.backends.complete_inverse.elimination import ORDERS, Elimination, carried, elimination, split, widened
from kinegen.backends.complete_inverse.screws import (
    JOINTS,
    Screws,
    beside,
    cross,
    dot,
    pose_of,
    refusal,
    refused,
    screws_of,
)
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.robot import TOOL, Robot
from kinegen.support.dataclass import dataclass
from kinegen.verify import reference

ACCEPTED = 1e-10
"""How far a solution may lead from the target: as a part of the reach, and in rad."""

MERGED = 1e-6
"""Solutions that differ by less in every joint count as one, in rad."""

NEARLY_REAL = 0.01
"""Roots t with a smaller |Im t| / (1 + |Re t|^2) are followed."""

ASIDES = (0.0, 1e-5, -1e-4, 1e-3)
"""How far beside the target each elimination is made, in rad and as a part of the reach; the two take turns.

Solutions that share an angle at a special target do so no more at 1e-5 from it, and Newton steps lead back from there
wherever a solution is regular.
"""

LEAST_PIVOT = 1e-14
"""A matrix with a smaller pivot counts as singular."""

SMALL_PIVOT = 1e-6
"""With a smaller pivot, the roots may have lost so many digits that another elimination is made."""

ROOM = 1e-9
"""How far outside its limits a joint of a solution may be, in rad."""

RIGID = 3e-6
"""How far the columns of a target may be from those of a rotation: the root of the sum of all squares."""

FARTHEST = 1e15
"""The largest squared distance of a target from the base."""

HUGE = 1e30
"""An error that every other one is smaller than."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Where each joint may be, in rad; a joint without limits has a full turn around 0."""

    lowest: tuple[float, ...]
    highest: tuple[float, ...]
    middle: tuple[float, ...]
    is_limited: tuple[bool, ...]


def limits_of(robot: Robot) -> Limits:
    """Return the limits of an arm."""
    is_limited = tuple(variable.limits is not None for variable in robot.variables)
    box = joint_box(robot)
    ends = [each if limited else (-math.pi, math.pi) for each, limited in zip(box, is_limited, strict=True)]
    middle = tuple((low + high) / 2 if limited else 0.0 for (low, high), limited in zip(ends, is_limited, strict=True))
    return Limits(tuple(low for low, _ in ends), tuple(high for _, high in ends), middle, is_limited)


_EXACT = mpmath.mpf(10) ** -12

Line = tuple[Any, Any]


def has_closed_form(screws: Screws) -> bool:
    """Tell whether the last or first three axes are a spherical wrist, and two of the others parallel or meeting."""
    frame, lines = mpmath.eye(4), []
    for link in (mpmath.eye(4), *screws.links):
        frame = frame * link
        lines.append((frame[:3, 2], frame[:3, 3]))
    return _is_closed(lines) or _is_closed(lines[::-1])


def _is_closed(lines: list[Line]) -> bool:
    first, second, third, *wrist = lines
    middle = wrist[1]
    square = all(abs(dot(middle[0], other[0])) < _EXACT for other in (wrist[0], wrist[2]))
    # Lines at right angles that meet do so at the foot of one's point on the other.
    centre = _foot(wrist[0], middle)
    concurrent = all(_apart(centre, line) < _EXACT for line in wrist)
    return square and concurrent and (_parallel(second, third) or _meet(first, second))


def _foot(line: Line, other: Line) -> Any:
    """Return the point of a line that is nearest to another one at right angles."""
    (direction, point), (_, far) = line, other
    return point + direction * dot(direction, far - point)


def _apart(point: Any, line: Line) -> Any:
    return mpmath.norm(cross(line[0], point - line[1]))


def _parallel(one: Line, other: Line) -> bool:
    return bool(mpmath.norm(cross(one[0], other[0])) < _EXACT)


def _meet(one: Line, other: Line) -> bool:
    return not _parallel(one, other) and bool(abs(dot(other[1] - one[1], cross(one[0], other[0]))) < _EXACT)


Floats = NDArray[np.float64]

USED = 2
"""Eliminations of an arm: where the first one leaves a doubt, the second one is made."""

SHIFTS = (0.3, 1.9)
"""The angle c is measured from here in the first and in the second elimination, in rad."""

BESIDE = 1e-7
"""How far beside an arm that none of the orders suits another one is taken: rad, and parts of the scale."""

_TRIALS = 12
_MISSES = 2
_NEAR = 1e-4
_SINGLE = 1e-9


@dataclass(frozen=True, slots=True)
class Complete:
    """The two eliminations that the complete inverse is computed from, the same one twice where only one suits.

    Lengths are divided by `scale`.
    """

    scale: float
    eliminations: tuple[Elimination, ...]


@lru_cache(maxsize=16)
def complete_of(robot: Robot) -> Complete:
    """Return the eliminations of an arm.

    Raises:
        KinegenError: If it has not six turning joints, or if none of the eliminations finds its solutions.
    """
    reason = refusal(robot) or _singular(robot)
    if reason:
        raise refused(robot, reason)
    with mpmath.workdps(reference.DIGITS):
        screws = screws_of(robot)
        found = _suiting(screws)
        if not found:
            if has_closed_form(screws):
                raise refused(robot, "its solutions share the angles that would separate them; take inverse")
            found = _suiting(beside(screws, BESIDE))
    if not found:
        raise refused(robot, "its solutions share the angles that would separate them; take numeric_inverse")
    return Complete(screws.scale, (*found, found[0])[:USED])


def _singular(robot: Robot) -> str:
    """Say that an arm has no isolated solutions, if it is so."""
    q = np.random.default_rng(1).uniform(-np.pi, np.pi, (_TRIALS, JOINTS))
    jacobians = reference.Kinematics(robot, q).jacobian(TOOL)
    jacobians[:, :3] /= reach(robot, robot.tips)
    sizes = np.linalg.svd(jacobians, compute_uv=False)
    if (sizes[:, -1] > _SINGLE * sizes[:, 0]).any():
        return ""
    return "its Jacobian is singular at every joint vector, so no solution is isolated; take numeric_inverse"


def _suiting(screws: Screws) -> list[Elimination]:
    """Return the first orders that suit an arm, as many as are used."""
    found: list[Elimination] = []
    for order in ORDERS:
        candidate = elimination(screws, order)
        if _suits(screws, candidate):
            found.append(candidate)
        if len(found) == USED:
            break
    return found


def _suits(screws: Screws, candidate: Elimination) -> bool:
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
