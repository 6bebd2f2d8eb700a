"""The numbers of the solvers, which every language prints, and the structure of the equations of a tree."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction
from types import MappingProxyType

from kinegen.backends.scalar_types import ScalarType
from kinegen.errors import KinegenError
from kinegen.model.branches import Branches
from kinegen.model.expression_parser import Expression, names
from kinegen.model.robot import Robot, Step
from kinegen.support.dataclass import dataclass

ByType = Mapping[ScalarType, Fraction]


@dataclass(frozen=True, slots=True)
class Tuning:
    """Holds how a search proceeds.

    Attributes:
        iterations: Steps of one descent at most.
        stall: After so many steps the squared error must have halved.
        samples: Random joint vectors before the first restart; before restart r there are r * r times as many.
        most_restarts: From this restart on their number stays the same.
        restarts: Restarts by default.
        tolerances: Accepted errors by default: of a rotation in radians, of a position as a part of the reach.
        rigid: How far the columns of a target may be from those of a rotation: the root of the sum of all squares.
        margin: Joints slow down in this part of their range before a limit.
        damping: The part of the squared error that damps a step.
        least_damping: Damping where there is no error left.
        longest_step: The largest turn of a joint in one step, in radians.
        huge: An error that every other one is smaller than.
        farthest: The largest squared distance of a target from the base.
        heaviest: The largest weight of a tip.
    """

    iterations: int
    stall: int
    samples: int
    most_restarts: int
    restarts: int
    tolerances: ByType
    rigid: ByType
    margin: Fraction
    damping: Fraction
    least_damping: ByType
    longest_step: Fraction
    huge: Fraction
    farthest: Fraction
    heaviest: Fraction

    @property
    def most_samples(self) -> int:
        """Random joint vectors before one restart at most."""
        return self.samples * self.most_restarts**2


def _by_type(double: str, single: str) -> ByType:
    return MappingProxyType({ScalarType.DOUBLE: Fraction(double), ScalarType.FLOAT: Fraction(single)})


TUNING = Tuning(
    iterations=60,
    stall=8,
    samples=20,
    most_restarts=16,
    restarts=10,
    tolerances=_by_type("1e-9", "1e-5"),
    rigid=_by_type("3e-6", "3e-4"),
    margin=Fraction(2, 5),
    damping=Fraction(1, 10),
    least_damping=_by_type("1e-12", "1e-7"),
    longest_step=Fraction(4, 5),
    huge=Fraction(10**30),
    farthest=Fraction(10**15),
    heaviest=Fraction(10**6),
)


@dataclass(frozen=True, slots=True)
class Tracking:
    """Holds how a path is followed. Lengths count in thirds of the reach, angles in radians.

    Attributes:
        steps: Steps of damped least squares where the closed form does not continue the path.
        polish: The same for joints that are not held back.
        passes: Passes of one solution of joint speeds that are not damped.
        leap: A joint that moves by less has not leapt.
        long_step: The way to a target further away than this is not known.
        detour: The tool may take a way so many times as long as the straight one, in the same branch.
        other_detour: The same where the branch changes.
        open: A change by less is taken from the closed form, at a singularity too.
        singular: Product of squared sines between the columns of the Jacobian below which a joint vector is singular.
        kept: How far the tool may be off where joints that a target leaves open are kept.
        matching: How far a joint vector may be from the solution that is its branch, as a squared distance.
        damping: The part of the squared error that damps a step.
        least_damping: Damping where there is no error left.
        held_damping: Damping while some joints are held.
        near: Joint speeds are damped where the product of squared sines is less than this.
        speed_damping: Their damping at the singularity itself.
    """

    steps: int
    polish: int
    passes: Mapping[ScalarType, int]
    leap: Fraction
    long_step: Fraction
    detour: Fraction
    other_detour: Fraction
    open: ByType
    singular: ByType
    kept: ByType
    matching: ByType
    damping: Fraction
    least_damping: ByType
    held_damping: Fraction
    near: ByType
    speed_damping: Fraction


TRACKING = Tracking(
    steps=8,
    polish=4,
    passes=MappingProxyType({ScalarType.DOUBLE: 2, ScalarType.FLOAT: 6}),
    leap=Fraction(1, 5),
    long_step=Fraction(3, 10),
    detour=Fraction(3, 2),
    other_detour=Fraction(7, 5),
    open=_by_type("0.01", "0.1"),
    singular=_by_type("1e-14", "1e-8"),
    kept=_by_type("1e-7", "1e-4"),
    matching=_by_type("1e-6", "1e-3"),
    damping=Fraction(1, 10),
    least_damping=_by_type("1e-12", "1e-5"),
    held_damping=Fraction(1, 10**4),
    near=_by_type("1e-4", "1e-3"),
    speed_damping=Fraction(1, 10**4),
)


def given_joint(robot: Robot, branches: Branches) -> int | None:
    """Return the index of the joint that is given with the target; None where none is."""
    names = [variable.name for variable in robot.variables]
    return names.index(branches.redundancy) if branches.redundancy in names else None


def require_trackable(robot: Robot, branches: Branches | None) -> None:
    """Refuse an arm whose inverse cannot follow a path.

    Raises KinegenError in one line, with the reason.
    """
    reason = "it has no closed-form inverse" if branches is None else ""
    if len(robot.given) > 1:
        reason = f"its inverse is given {len(robot.given)} values ({robot.redundancy}), and a tracker takes one"
    elif robot.is_tree:
        reason = "it has several tips"
    elif branches is not None and branches.redundancy and given_joint(robot, branches) is None:
        reason = "an arm angle is given; give a joint instead, as --redundancy joint_7 does"
    if reason:
        raise KinegenError(f"no inverse tracker for {robot.name}: {reason}", robot.source)


ROWS = 6
"""Rows of the Jacobian of one tip."""


@dataclass(frozen=True, slots=True)
class Tips:
    """The structure of the stacked equations of a tree.

    `moving`: for each tip the joints that move it, ascending. `dof`: number of joint variables. `tip_groups`: the group
    of each tip. Tips of one group share joints, directly or by way of others; groups do not depend on each other.
    `joint_groups`: the group of each joint; the first one for a joint that moves no tip. `by_joints`: whether the
    equations have a row for each joint instead of one for each row of the Jacobians. `first`: for each row of the lower
    half of their matrix, the first column that is not always zero. Rows of joints are in descending order, so that no
    zeros are lost when the matrix is divided into factors: a joint near the base comes after those that it carries
    (Featherstone, Rigid Body Dynamics Algorithms, 2008, 6.5).
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
    """Return the structure of a robot's stacked equations."""
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
    """Yield the joint variables that the transforms between base and tip depend on, for each tip."""
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
    """Return the group of each tip, numbered in the order of their first tips."""
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
    """Estimate how many products it takes to make and to divide a matrix with these zeros."""
    widths = [row - start + 1 for row, start in enumerate(first)]
    return sum(ROWS * width + width * width for width in widths)
