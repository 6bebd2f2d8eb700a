"""Whether the `inverse` that a robot file gives for its actuators undoes what the same file says of the joints.

In: a robot and a joint vector. Out: what is wrong, in words; empty where the two agree. Where they do not, a kernel
that differs from the reference is not to blame.
"""

from __future__ import annotations

from collections.abc import Sequence

import mpmath

from kinegen.model.robot import JointType, Robot
from kinegen.verify.reference import DIGITS
from kinegen.verify.reference.actuators import Actuation, readings

_AGREED = 1e-25
"""How far joints that 50 digits bring back may be from where they began, as a share of them or of 1."""


def inverse_defect(robot: Robot, joints: Sequence[float]) -> str:
    """Find what the `inverse` of a file does wrong at a joint vector.

    `joints`: a joint vector that they can bring about, in radians and the length unit of the robot. Returns the joint
    that does not come back, and the readings, in one line; empty if all do, or without an `inverse`.
    """
    if not robot.actuators.inverse:
        return ""
    found = readings(robot, joints)
    with mpmath.workdps(DIGITS):
        back = Actuation(robot, found, exact=True).joints[0]
        apart = [
            abs(one - other) / max(1, abs(other)) for one, other in zip(back, map(mpmath.mpf, joints), strict=True)
        ]
    worst = next((place for place, share in enumerate(apart) if not share <= _AGREED), None)
    if worst is None:
        return ""
    names = [reading.name for reading in robot.actuators.readings]
    given = ", ".join(f"{name} = {float(value):.6g}" for name, value in zip(names, found[0], strict=True))
    joint = robot.variables[worst]
    unit = robot.units.length if joint.type is JointType.PRISMATIC else "rad"
    return (
        f"actuators: inverse does not undo the values of the joints: for {joint.name} = {joints[worst]:.6g} {unit} "
        f"it gives {given}, at which {joint.name} is {float(back[worst]):.6g} {unit}"
    )
