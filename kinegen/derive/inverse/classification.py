"""From a robot to the family of its inverse, or to the conditions that fail.

The axes of the joints decide, not the table: any convention, base, tool and offset of the variables may have led to
them. All conditions are exact but for the noise of floating point, see `rounded`. An arm of six turning joints that
misses some by a little, such as a calibrated one, is nearly of the family of the nearest arm that meets them; what it
is apart from that goes with the family. The same is true of six joints that are left of seven, one of which is given.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from itertools import product
from pathlib import PurePath

from kinegen.derive.inverse.axes import Axes, JointAxis, joint_axes, still_axis
from kinegen.derive.inverse.compact_chain import own_chain
from kinegen.derive.inverse.exact_geometry import is_null, minus, turned
from kinegen.derive.inverse.families import Conditions, Refusal, flat_arm, point_arm, triple_arm, wrist_arm
from kinegen.derive.inverse.family import Aim, Family, SphericalArm
from kinegen.derive.inverse.family_words import aligned
from kinegen.derive.inverse.geometry import Wrist, flat_frame, wrist_of
from kinegen.derive.inverse.nearest_family import Defect, rounded, special_arms
from kinegen.derive.inverse.target_pose import held_joints, with_held, without_joints
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import Robot
from kinegen.model.variants import ARM_ANGLE, given_units
from kinegen.support.dataclass import dataclass

_NAME = "S-R-S type: spherical shoulder, elbow and spherical wrist, arm angle given"
_CHOICES = (
    ("elbow left", "elbow right"),
    ("shoulder no-flip", "shoulder flip"),
    ("wrist no-flip", "wrist flip"),
)
_ELBOW = "elbow left: with axis 4 towards the viewer, the elbow is to the left of the line from shoulder to wrist"
_MEANINGS = (
    _ELBOW,
    "shoulder no-flip: axis 3 is rotated by 0 to 180 deg about axis 2, measured from where it coincides with axis 1",
    "wrist no-flip: axis 7 is rotated by 0 to 180 deg about axis 6, measured from the aligned wrist",
)
_ARM_ANGLE = (
    "redundancy is the arm angle in rad: the angle of the elbow about the line from the shoulder's centre to the "
    "wrist's, by the right-hand rule, from the half plane of that line which contains the direction of axis 1 (about "
    "which joint 1 turns); at 0 the elbow is above the line if axis 1 points up (Kreutz-Delgado, Long and Seraji 1992)"
)
_UPRIGHT = (
    "where that line is on axis 1, the half plane is that of the line after a small positive rotation of joint 2, "
    "with joint 1 at 0 (or its limit nearest to 0)"
)


def spherical_arm(axes: Axes) -> Family:
    """Recognise seven joints that turn: three axes meet in the shoulder, three in the wrist."""
    elbow = axes.joints[3]
    shoulder, wrist = _meeting(axes, 0), _meeting(axes, 4)
    frame = flat_frame(elbow)
    upper = turned(frame, minus(elbow.point, shoulder.centre))
    lower = turned(frame, minus(wrist.centre, elbow.point))
    if is_null(upper[:2]) or is_null(lower[:2]):
        raise Refusal(f"axis {elbow.number} passes through the centre of the shoulder or of the wrist")
    if upper[2] + lower[2] != 0:
        raise Refusal(f"the centres of shoulder and wrist are not in one plane square to axis {elbow.number}")
    build = SphericalArm(shoulder, elbow, wrist, frame, upper[:2], lower[:2])
    names = tuple(", ".join(each) for each in product(*_CHOICES))
    conditions = (_ARM_ANGLE, _UPRIGHT, aligned(shoulder), aligned(wrist))
    return Family(_NAME, build, axes, Aim.POSE, names, _MEANINGS, conditions, ARM_ANGLE)


def _meeting(axes: Axes, first: int) -> Wrist:
    """Return three joints whose axes meet, neighbours at right angles."""
    joints: tuple[JointAxis, ...] = axes.joints[first : first + 3]
    one, two, three = (joints[0].forward, *joints[1:])
    conditions = Conditions(axes)
    conditions.square(one, two)
    conditions.square(two, three)
    conditions.check()
    centre = conditions.meet((one, two, three))
    conditions.check()
    return wrist_of(one, two, three, centre)


ANGLE = 0.005
"""How far an axis may be turned from that of the nearest arm of a family, in radians."""

LENGTH = 0.005
"""How far it may be shifted, relative to the reach."""

Recogniser = Callable[[Axes], Family]


@dataclass(frozen=True, slots=True)
class NotClosedForm:
    """An arm without a closed form here, with the conditions that fail, one line each."""

    reasons: tuple[str, ...]


def recognise(robot: Robot) -> Family | NotClosedForm:
    """Find the family of a robot's closed-form inverse with its constants, or the reasons why there is none."""
    axes = joint_axes(robot)
    if isinstance(axes, tuple):
        return NotClosedForm(axes)
    clean = rounded(axes)
    found = _redundant(robot, clean.axes) if robot.redundancy else _known(clean.axes)
    if isinstance(found, Family) and clean.changed:
        return replace(found, conditions=(*found.conditions, clean.words(robot.units.length)))
    return found


def _known(axes: Axes) -> Family | NotClosedForm:
    """Return the family of an arm, or the one that it is nearly of."""
    found = _family_of(axes)
    return found if isinstance(found, Family) else (nearest_family(axes) or found)


def nearest_family(axes: Axes) -> Family | None:
    """Return the family of the nearest special arm, if there is one within the limits of `ANGLE` and `LENGTH`."""
    if not all(joint.turns for joint in axes.joints) or len(axes.joints) != 6 or axes.defaults:
        return None
    if axes.numbers != tuple(range(1, 7)):
        return None  # the steps of a correction go by the places of the joints in the joint vector
    size = own_chain(axes).reach
    # An arm may be nearly of several families; the nearest leaves the least to Newton steps.
    near = [each for each in special_arms(axes) if each.angle < ANGLE and each.length < LENGTH * size]
    for special in sorted(near, key=lambda each: max(each.angle, each.length / size)):
        found = _family_of(special.axes)
        if isinstance(found, Family):
            defect = Defect(axes, special.failing, special.angle, special.length)
            below = defect.singular_below(size)
            merging = (
                "the arm is only nearly of its class: a branch that merges with another one may be invalid "
                "where the smallest singular value of the Jacobian, with lengths divided by the reach of the arm "
                f"({size:.4g}), is below {below:.2g}, and solutions there may be in each other's branch; "
                "complete_inverse looks for what is missing there"
            )
            conditions = (*found.conditions, merging)
            return replace(found, name=f"nearly {found.name}", conditions=conditions, defect=defect)
    return None


def _redundant(robot: Robot, axes: Axes) -> Family | NotClosedForm:
    """Return the family of an arm of which some joints, or the arm angle, are given."""
    if robot.redundancy == ARM_ANGLE and all(joint.turns and joint.name != ARM_ANGLE for joint in axes.joints):
        try:
            return spherical_arm(axes)
        except Refusal as refusal:
            return NotClosedForm(tuple(f"not an arm with an arm angle: {reason}" for reason in refusal.reasons))
    # Joints that are given leave the chain, or never were on it.
    moving = [joint.name for joint in axes.joints]
    variables = {variable.name: variable for variable in robot.variables}
    unknown = [name for name in robot.given if name not in variables]
    if unknown:
        return NotClosedForm((f"no closed form has the redundancy {unknown[0]}",))
    beside = tuple(still_axis(robot, variables[name]) for name in robot.given if name not in moving)
    held = held_joints(axes, robot.given, beside)
    if isinstance(held, tuple):
        return NotClosedForm(held)
    found = _known(without_joints(axes, held))
    if isinstance(found, Family):
        whole = with_held(found, held, given_units(robot))
        return NotClosedForm(whole) if isinstance(whole, tuple) else whole
    return found


def _family_of(axes: Axes) -> Family | NotClosedForm:
    letters = "".join("R" if joint.turns else "P" for joint in axes.joints)
    tries = [(candidate, axes) for candidate in _candidates(letters)]
    # What the base is to the tool, the families with such joints from the tool to the base solve for.
    if len(letters) == 6 and all(entry.is_number for row in axes.rotation for entry in row):
        tries += [(candidate, axes.reversed()) for candidate in _candidates(letters[::-1])]
    if not tries:
        return NotClosedForm((f"no closed form has the joints {letters}",))
    # Reasons of all candidates are told, since any of them may be the one that was meant.
    reasons: list[str] = []
    for candidate, chain in tries:
        try:
            return candidate(chain)
        except Refusal as refusal:
            start = f"{_KINDS[candidate]}{', seen from the tool' if chain.is_reversed else ''}"
            reasons += [f"{start}: {reason}" for reason in refusal.reasons]
    return NotClosedForm(tuple(reasons))


_KINDS: dict[Recogniser, str] = {
    point_arm: "not an arm for the position of a point",
    wrist_arm: "not an arm with a spherical wrist",
    flat_arm: "not a planar or SCARA arm",
    triple_arm: "not an arm with three parallel axes",
}


def _candidates(letters: str) -> tuple[Recogniser, ...]:
    """Return the families with such joints, the most usual first."""
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


_OFF = re.compile(r"off by ([0-9.]+(?:e-[0-9]+)?) rad")
_MOST, _MOST_WRITTEN = 0.01, 1e-4
"""How large an angle may be that is no calibration: of files that are converted, and of those that people write."""

_CONVERTED = (".urdf", ".xacro", ".mjcf", ".xml")


def snap_hint(robot: Robot, found: Family | NotClosedForm) -> str:
    """Tell how to take the angles that fail a condition by a little as exact; empty if there are none."""
    if isinstance(found, NotClosedForm):
        off = [float(match) for reason in found.reasons for match in _OFF.findall(reason)]
    else:
        off = [each.amount for each in found.defect.failing if each.is_angle] if found.defect else []
    # Digits of converted files come from a program, those of other files from a person who can write more.
    is_converted = PurePath(robot.source).suffix.lower() in _CONVERTED
    if not off or max(off) > (_MOST if is_converted else _MOST_WRITTEN):
        return ""
    within = f"{10.0 ** math.ceil(math.log10(max(off))):.0e}"
    if is_converted:
        return f"--snap {within} takes angles within {within} rad of a multiple of 15 degrees as that multiple"
    return "if the axes are meant to be parallel or square, write the angles in the file with more digits, or as pi/2"


def with_usual_inverse(robot: Robot, quantities: tuple[Quantity, ...]) -> tuple[Quantity, ...]:
    """Leave the inverse out of the outputs that are usual for any robot, if the arm has none in closed form.

    That of an arm which is only nearly of a family is left out too: it is refined by Newton steps, whose kernel takes
    minutes to build.
    """
    if not has_closed_inverse(robot):
        return tuple(quantity for quantity in quantities if quantity.kind is not Kind.INVERSE)
    return quantities


def has_closed_inverse(robot: Robot) -> bool:
    """Tell whether an arm is exactly of a family whose inverse has a closed form."""
    family = recognise(robot)
    return isinstance(family, Family) and family.defect is None
