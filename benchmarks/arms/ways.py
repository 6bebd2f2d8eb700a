"""The way in which kinegen gives all solutions of an arm, or why it gives none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kinegen.backends.complete_inverse.elimination_choice import complete_of
from kinegen.derive.inverse.axes import joint_axes
from kinegen.derive.inverse.classification import NotClosedForm, recognise
from kinegen.errors import KinegenError
from kinegen.model.joint_bounds import reach
from kinegen.model.robot import Robot
from kinegen.model.variants import ARM_ANGLE, JOINTS, with_redundancy

CLOSED, COMPLETE, GIVEN, NONE = "closed form", "complete inverse", "one given", "none"
NEARLY, BOTH = "nearly closed form", "nearly or complete"
"""Nearly of a family; with or without the complete inverse, which separates all solutions but those of wrists."""

SPHERICAL = 1e-6
"""How near to one point three axes pass that meet in it, as a part of the reach."""


@dataclass(frozen=True, slots=True)
class Way:
    """How all solutions are found.

    Attributes:
        kind: One of the six kinds.
        detail: The family, what is given, or the first reason.
        robots: The robot, with each redundancy that has a closed form.
        spherical: Which of `shoulder` and `wrist` are three axes that meet in one point.
    """

    kind: str
    detail: str
    robots: tuple[Robot, ...]
    spherical: tuple[str, ...]


def way_of(robot: Robot) -> Way:
    """The way for an arm."""
    meeting = tuple(name for name, first in (("shoulder", 0), ("wrist", robot.dof - 3)) if _meets(robot, first))
    if robot.dof == JOINTS:
        return _given(robot, meeting)
    family = recognise(robot)
    if not isinstance(family, NotClosedForm) and family.defect is None:
        return Way(CLOSED, family.name, (robot,), meeting)
    try:
        complete_of(robot)
    except KinegenError as error:
        if not isinstance(family, NotClosedForm):
            return Way(NEARLY, family.name, (robot,), meeting)
        return Way(NONE, f"{error}; {'; '.join(family.reasons)}", (), meeting)
    if isinstance(family, NotClosedForm):
        return Way(COMPLETE, "", (robot,), meeting)
    return Way(BOTH, family.name, (robot,), meeting)


def _given(robot: Robot, meeting: tuple[str, ...]) -> Way:
    """Seven joints: each redundancy that has a closed form."""
    names = (ARM_ANGLE, robot.variables[0].name, robot.variables[-1].name)
    tried = [(name, recognise(with_redundancy(robot, name))) for name in names]
    solved = [(name, family) for name, family in tried if not isinstance(family, NotClosedForm)]
    if not solved:
        reasons = [f"{name}: {family.reasons[0]}" for name, family in tried if isinstance(family, NotClosedForm)]
        return Way(NONE, "; ".join(reasons), (), meeting)
    detail = ", ".join(f"{name}{' (nearly)' if family.defect else ''}" for name, family in solved)
    return Way(GIVEN, detail, tuple(with_redundancy(robot, name) for name, _ in solved), meeting)


def _meets(robot: Robot, first: int) -> bool:
    """Whether three axes pass through one point: the least squares of their distances to it."""
    axes = joint_axes(robot)
    if isinstance(axes, tuple):
        return False
    rows, sides = [], []
    for joint in axes.joints[first : first + 3]:
        if not joint.turns:
            return False
        axis, point = (np.array([float(each) for each in part]) for part in (joint.direction, joint.point))
        across = np.eye(3) - np.outer(axis, axis)
        rows.append(across)
        sides.append(across @ point)
    matrix, side = np.concatenate(rows), np.concatenate(sides)
    centre = np.linalg.lstsq(matrix, side, rcond=None)[0]
    off = np.abs(matrix @ centre - side).max()
    return bool(np.linalg.matrix_rank(matrix, tol=1e-3) == 3 and off < SPHERICAL * reach(robot))
