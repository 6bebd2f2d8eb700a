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

from kinegen.backends.complete_inverse.elimination import ORDERS, Elimination, elimination
from kinegen.backends.complete_inverse.screws import Screws, beside, cross, dot, refusal, refused, screws_of
from kinegen.model.joint_bounds import joint_box
from kinegen.model.robot import Robot
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


USED = 2
"""Eliminations of an arm: where the first one leaves a doubt, the second one is made."""

SHIFTS = (0.3, 1.9)
"""The angle c is measured from here in the first and in the second elimination, in rad."""

BESIDE = 1e-7
"""How far beside an arm that none of the orders suits another one is taken: rad, and parts of the scale."""


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
    # NumPy is not needed before an arm is tried.
    from kinegen.backends.complete_inverse.elimination_trials import singular

    reason = refusal(robot) or singular(robot)
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


def _suiting(screws: Screws) -> list[Elimination]:
    """Return the first orders that suit an arm, as many as are used."""
    from kinegen.backends.complete_inverse.elimination_trials import suits

    found: list[Elimination] = []
    for order in ORDERS:
        candidate = elimination(screws, order)
        if suits(screws, candidate):
            found.append(candidate)
        if len(found) == USED:
            break
    return found
