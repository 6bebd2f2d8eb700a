"""Which joints move which tips of a tree, and what follows for a search that stacks the errors of all tips.

In: a robot. Out: the joints of each tip, the groups of tips that share joints, and the smaller of the two forms of the
damped equations, with the zeros that its matrix has at every joint vector.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from kinegen.robot.expressions import Expression, names
from kinegen.robot.model import Robot, Step

ROWS = 6
"""Rows of the Jacobian of one tip."""


@dataclass(frozen=True, slots=True)
class Tips:
    """The structure of the stacked equations of a tree.

    Attributes:
        moving: For each tip the joints that move it, ascending.
        dof: Number of joint variables.
        tip_groups: The group of each tip. Tips of one group share joints, directly or by way of others; groups do not
            depend on each other.
        joint_groups: The group of each joint; the first one for a joint that moves no tip.
        by_joints: Whether the equations have a row for each joint instead of one for each row of the Jacobians.
        first: For each row of the lower half of their matrix, the first column that is not always zero. Rows of joints
            are in descending order, so that no zeros are lost when the matrix is divided into factors: a joint near
            the base comes after those that it carries (Featherstone, Rigid Body Dynamics Algorithms, 2008, 6.5).
    """

    moving: tuple[tuple[int, ...], ...]
    dof: int
    tip_groups: tuple[int, ...]
    joint_groups: tuple[int, ...]
    by_joints: bool
    first: tuple[int, ...]

    @property
    def groups(self) -> int:
        """Number of groups."""
        return max(self.tip_groups) + 1


def tips_of(robot: Robot) -> Tips:
    """The structure of a robot's stacked equations.

    Args:
        robot: A tree with joints.
    """
    moving = tuple(_moving(robot))
    tip_groups = _groups(moving)
    owners = {joint: tip_groups[tip] for tip, joints in enumerate(moving) for joint in joints}
    by_rows, by_joints = _first_of_rows(moving), _first_of_joints(moving, robot.dof)
    smaller = _work(by_joints) < _work(by_rows)
    return Tips(
        moving=moving,
        dof=robot.dof,
        tip_groups=tip_groups,
        joint_groups=tuple(owners.get(joint, 0) for joint in range(robot.dof)),
        by_joints=smaller,
        first=by_joints if smaller else by_rows,
    )


def _moving(robot: Robot) -> Iterator[tuple[int, ...]]:
    """The joint variables that the transforms between base and tip depend on, for each tip."""
    places = {variable.name: variable.index for variable in robot.variables}
    entries: dict[str, tuple[Expression | None, ...]] = {
        row.name: (row.alpha, row.a, row.d, row.theta, row.beta, *_values(row.steps)) for row in robot.rows
    }
    entries |= {frame.name: _values(frame.steps) for frame in robot.frames}
    parents = {row.name: row.parent for row in robot.rows} | {frame.name: frame.parent for frame in robot.frames}
    for tip in robot.tips:
        found, frame = set[int](), tip
        while frame in entries:
            used = (name for entry in entries[frame] if entry is not None for name in names(entry))
            found |= {places[name] for name in used if name in places}
            frame = parents[frame]
        yield tuple(sorted(found))


def _values(steps: tuple[Step, ...]) -> tuple[Expression, ...]:
    return tuple(step.value for step in steps)


def _groups(moving: tuple[tuple[int, ...], ...]) -> tuple[int, ...]:
    """The group of each tip, numbered in the order of their first tips."""
    sets: list[tuple[set[int], set[int]]] = []  # tips and their joints
    for tip, joints in enumerate(moving):
        tips, shared = {tip}, set(joints)
        for other in [each for each in sets if each[1] & shared]:
            sets.remove(other)
            tips, shared = tips | other[0], shared | other[1]
        sets.append((tips, shared))
    order = sorted(min(tips) for tips, _ in sets)
    return tuple(order.index(min(next(tips for tips, _ in sets if tip in tips))) for tip in range(len(moving)))


def _first_of_rows(moving: tuple[tuple[int, ...], ...]) -> tuple[int, ...]:
    """For equations with a row for each row of the Jacobians."""
    first = [
        next(other for other in range(tip + 1) if other == tip or set(moving[other]) & set(moving[tip]))
        for tip in range(len(moving))
    ]
    return tuple(ROWS * first[tip] for tip in range(len(moving)) for _ in range(ROWS))


def _first_of_joints(moving: tuple[tuple[int, ...], ...], dof: int) -> tuple[int, ...]:
    """For equations with a row for each joint, the last joint first."""
    sets = [set(joints) for joints in moving]
    return tuple(
        next(
            column
            for column in range(row + 1)
            if column == row or any({dof - 1 - row, dof - 1 - column} <= joints for joints in sets)
        )
        for row in range(dof)
    )


def _work(first: tuple[int, ...]) -> int:
    """About how many products it takes to make and to divide a matrix with these zeros."""
    widths = [row - start + 1 for row, start in enumerate(first)]
    return sum(ROWS * width + width * width for width in widths)
