"""From a robot to the family of its inverse, or to the conditions that fail.

The axes of the joints decide, not the table: any convention, base, tool and offset of the variables may have led to
them. All conditions are exact. An arm of six turning joints that misses some by a little, such as a calibrated one, is
nearly of the family of the nearest arm that meets them; what it is apart from that goes with the family. The same is
true of six joints that are left of seven, one of which is given.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from kinegen.robot.model import Robot
from kinegen.robot.redundancy import ARM_ANGLE, given_units
from kinegen.symbolic.inverse.arms import flat_arm, point_arm, triple_arm, wrist_arm
from kinegen.symbolic.inverse.axes import Axes, joint_axes, still_axis
from kinegen.symbolic.inverse.conditions import Refusal
from kinegen.symbolic.inverse.defect import Defect
from kinegen.symbolic.inverse.family import Family, GimbalArm, WristArm
from kinegen.symbolic.inverse.own_chain import own_chain
from kinegen.symbolic.inverse.redundancy import held_joints, with_held, without_joints
from kinegen.symbolic.inverse.special import special_arms
from kinegen.symbolic.inverse.spherical import spherical_arm

ANGLE = 0.005
"""How far an axis may be turned from that of the nearest arm of a family, in radians."""

LENGTH = 0.005
"""How far it may be shifted, relative to the reach."""

Recogniser = Callable[[Axes], Family]


@dataclass(frozen=True, slots=True)
class Unknown:
    """An arm without a closed form here.

    Attributes:
        reasons: Which conditions fail, one line each.
    """

    reasons: tuple[str, ...]


def recognise(robot: Robot) -> Family | Unknown:
    """Find the family of a robot's closed-form inverse.

    Args:
        robot: The robot.

    Returns:
        The family with its constants; or the reasons why there is none.
    """
    axes = joint_axes(robot)
    if isinstance(axes, tuple):
        return Unknown(axes)
    if robot.redundancy:
        return _redundant(robot, axes)
    found = _family_of(axes)
    return found if isinstance(found, Family) else (nearest_family(axes) or found)


def nearest_family(axes: Axes) -> Family | None:
    """The family of the nearest special arm, if there is one within the limits of `ANGLE` and `LENGTH`."""
    if not all(joint.turns for joint in axes.joints) or len(axes.joints) != 6 or axes.defaults:
        return None
    if axes.numbers != tuple(range(1, 7)):
        return None  # the steps of a correction go by the places of the joints in the joint vector
    size = own_chain(axes).reach
    near = [each for each in special_arms(axes) if each.angle < ANGLE and each.length < LENGTH * size]
    for special in sorted(near, key=lambda each: max(each.angle, each.length / size)):
        found = _family_of(special.axes)
        if isinstance(found, Family):
            of_four = isinstance(found.build, WristArm) and isinstance(found.build.arm, GimbalArm)
            defect = Defect(axes, special.failing, special.angle, special.length, of_four)
            below = defect.singular_below(size)
            merging = (
                "the arm is only nearly of its family: a branch that merges with another one is invalid, and may be "
                "where the least singular value of the Jacobian, lengths divided by the reach of the arm "
                f"({size:.4g}), is below {below:.1g}"
            )
            conditions = (*found.conditions, merging)
            return replace(found, name=f"nearly {found.name}", conditions=conditions, defect=defect)
    return None


def _redundant(robot: Robot, axes: Axes) -> Family | Unknown:
    """The family of an arm of which some joints, or the arm angle, are given."""
    if robot.redundancy == ARM_ANGLE and all(joint.turns and joint.name != ARM_ANGLE for joint in axes.joints):
        try:
            return spherical_arm(axes)
        except Refusal as refusal:
            return Unknown(tuple(f"not an arm with an arm angle: {reason}" for reason in refusal.reasons))
    moving = [joint.name for joint in axes.joints]
    variables = {variable.name: variable for variable in robot.variables}
    unknown = [name for name in robot.given if name not in variables]
    if unknown:
        return Unknown((f"no family of closed forms has the redundancy {unknown[0]}",))
    beside = tuple(still_axis(variables[name]) for name in robot.given if name not in moving)
    held = held_joints(axes, robot.given, beside)
    if isinstance(held, tuple):
        return Unknown(held)
    rest = without_joints(axes, held)
    found = _family_of(rest)
    if isinstance(found, Unknown):
        found = nearest_family(rest) or found
    if isinstance(found, Family):
        whole = with_held(found, held, given_units(robot))
        return Unknown(whole) if isinstance(whole, tuple) else whole
    return found


def _family_of(axes: Axes) -> Family | Unknown:
    letters = "".join("R" if joint.turns else "P" for joint in axes.joints)
    tries = [(candidate, axes) for candidate in _candidates(letters)]
    if all(entry.is_number for row in axes.rotation for entry in row):
        tries += [(candidate, axes.reversed()) for candidate in _seen_from_tool(letters[::-1])]
    if not tries:
        return Unknown((f"no family of closed forms has the joints {letters}",))
    reasons: list[str] = []
    for candidate, chain in tries:
        try:
            return candidate(chain)
        except Refusal as refusal:
            start = f"{_KINDS[candidate]}{', seen from the tool' if chain.is_reversed else ''}"
            reasons += [f"{start}: {reason}" for reason in refusal.reasons]
    return Unknown(tuple(reasons))


_KINDS: dict[Recogniser, str] = {
    point_arm: "not an arm for the position of a point",
    wrist_arm: "not an arm with a spherical wrist",
    flat_arm: "not a planar or SCARA arm",
    triple_arm: "not an arm with three parallel axes",
}


def _seen_from_tool(letters: str) -> tuple[Recogniser, ...]:
    """The families with such joints from the tool to the base: what the base is to the tool, they solve for."""
    return _candidates(letters) if len(letters) == 6 else ()


def _candidates(letters: str) -> tuple[Recogniser, ...]:
    """The families with such joints, the most usual first."""
    flat = letters.replace("P", "", 1)
    if len(letters) == 6 and letters.endswith("RRR"):
        return (wrist_arm, triple_arm) if letters == "RRRRRR" else (wrist_arm,)
    if letters == "RRRRR":
        return (triple_arm,)
    if flat in ("RR", "RRR") and len(letters) > 2:
        return (flat_arm, point_arm) if len(letters) == 3 else (flat_arm,)
    if letters == "RR":
        return (flat_arm,)
    if len(letters) == 3:
        return (point_arm,)
    return ()
