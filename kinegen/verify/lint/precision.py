"""Finds robots for which a number type is visibly too coarse, and says what to do.

In: programs. Out: one note for each number type whose proven error is large beside the distances that the tips really
cover. That happens when long lengths cancel, as in calibrated tables: between nearly parallel axes the common normal,
and with it d, runs away to hundreds of metres.
"""

from __future__ import annotations

import numpy as np

from kinegen.backends.accuracy import error_bound, fraction_box, two_digits
from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.routines import SINCOS
from kinegen.backends.scalar_types import ScalarType
from kinegen.ir.error_analysis import Ranges, has_rules, largest_angle
from kinegen.model.joint_bounds import SMALLEST_REACH, joint_box, reach
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import Robot
from kinegen.verify import reference

COARSE = 1e-5
"""Largest error beside the distance covered that passes without a note: 10 um for a metre. Arms of six or seven joints
stay below 1e-6 in float, a chain of twenty-one joints below 3e-6."""

CANCELLED = 10
"""Lengths that add up to more than so many times the distance covered cancel."""

POSES = 256
SEED = 20240229


def precision_notes(kernels: RobotPrograms, reals: tuple[ScalarType, ...]) -> tuple[str, ...]:
    """Returns what a user should know about the precision of the kernels.

    Returns:
        Sentences; none for most robots.
    """
    robot = kernels.robot
    covered = _covered(robot)
    unit = robot.units.length
    # Where links are far from each other on paper, their frames are; what matters is where tips are.
    places = [program for program in kernels.programs if program.quantity.kind in (Kind.POSE, Kind.POSITION)]
    programs = places or [program for program in kernels.programs if program.quantity == Quantity.FRAMES]
    notes = []
    ranges = Ranges(fraction_box(robot), kernels.defaults)
    angle = float(max((largest_angle(program, ranges) for program in programs if has_rules(program)), default=0))
    for real in reals:
        if angle > SINCOS[real].limit:
            notes.append(_beyond(real, angle))
            continue
        bounds = [error_bound(kernels, program, real) for program in programs if has_rules(program)]
        worst = max((max(each.position) for each in bounds), default=0.0)
        if worst > COARSE * covered:
            found = f"{real} results may be off by {two_digits(worst)} {unit}"
            where = f"where the end effector covers {covered:.3g} {unit}"
            notes.append(f"{found} {where}: {_advice(robot, real, covered)}")
    return tuple(notes)


def _beyond(real: ScalarType, angle: float) -> str:
    """Limits that allow larger angles than the sine and cosine take."""
    wider = [other for other in ScalarType if SINCOS[other].limit >= angle]
    advice = f"use the {wider[0]} kernels" if wider else "narrower limits avoid that"
    limit = SINCOS[real].limit
    return f"{real} results are NaN where angles add up to more than {limit:.6g} rad; here {angle:.3g} rad: {advice}"


def _advice(robot: Robot, real: ScalarType, covered: float) -> str:
    better = ["use the double kernels"] if real is ScalarType.FLOAT else []
    total = reach(robot, robot.frame_names)
    if total <= CANCELLED * covered:
        return " or ".join(better or ["no number type has more digits"])
    better.append("describe nearly parallel axes by Hayati rows")
    return f"lengths of {total:.4g} {robot.units.length} cancel; {', or '.join(better)}"


def _covered(robot: Robot) -> float:
    """Returns how far from the base tips get, over random poses; unlike the reach this does not add up what cancels."""
    box = np.array(joint_box(robot)).reshape(robot.dof, 2)
    q = np.random.default_rng(SEED).uniform(box[:, 0], box[:, 1], (POSES, robot.dof))
    places = reference.pose(robot, q)[..., :3, 3]
    return max(SMALLEST_REACH, float(np.linalg.norm(places, axis=-1).max()))
