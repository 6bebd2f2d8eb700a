"""The bounds of the complete inverse, the same in C and in NumPy."""

from __future__ import annotations

import math
from dataclasses import dataclass

from kinegen.robot.extent import joint_box
from kinegen.robot.model import Robot

ACCEPTED = 1e-10
"""How far a solution may lead from the target: as a part of the reach, and in rad."""

MERGED = 1e-6
"""Solutions that differ by less in every joint count as one, in rad."""

NEARLY_REAL = 0.01
"""Roots t with a smaller |Im t| / (1 + |Re t|^2) are followed."""

ASIDES = (0.0, 0.0, 1e-3, -1e-3)
"""How far beside the target each elimination is made, in rad and as a part of the reach; the two take turns."""

LEAST_PIVOT = 1e-14
"""A matrix with a smaller pivot counts as singular."""

SMALL_PIVOT = 1e-9
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
    """The limits of an arm."""
    is_limited = tuple(variable.limits is not None for variable in robot.variables)
    box = joint_box(robot)
    ends = [each if limited else (-math.pi, math.pi) for each, limited in zip(box, is_limited, strict=True)]
    middle = tuple((low + high) / 2 if limited else 0.0 for (low, high), limited in zip(ends, is_limited, strict=True))
    return Limits(tuple(low for low, _ in ends), tuple(high for _, high in ends), middle, is_limited)
