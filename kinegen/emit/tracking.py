"""The numbers of the inverse along a path, and the arms that have one.

The NumPy form, `native/runtime/_tracking.py`, is copied into packages and repeats them; a test compares the two.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from types import MappingProxyType

from kinegen.emit.reals import Real
from kinegen.errors import KinegenError
from kinegen.outputs import Branches
from kinegen.robot.model import Robot

ByType = Mapping[Real, Fraction]


@dataclass(frozen=True, slots=True)
class Tracking:
    """How a path is followed. Lengths count in thirds of the reach, angles in radians.

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
    passes: Mapping[Real, int]
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


def _by_type(double: str, single: str) -> ByType:
    return MappingProxyType({Real.DOUBLE: Fraction(double), Real.FLOAT: Fraction(single)})


TRACKING = Tracking(
    steps=8,
    polish=4,
    passes=MappingProxyType({Real.DOUBLE: 2, Real.FLOAT: 6}),
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
    """Index of the joint that is given with the target; None where none is.

    Args:
        robot: The robot.
        branches: The words of its inverse.
    """
    names = [variable.name for variable in robot.variables]
    return names.index(branches.redundancy) if branches.redundancy in names else None


def require_trackable(robot: Robot, branches: Branches | None) -> None:
    """Refuse an arm whose inverse cannot follow a path.

    Args:
        robot: The robot.
        branches: The words of its inverse; None where there is none.

    Raises:
        KinegenError: In one line, with the reason.
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
