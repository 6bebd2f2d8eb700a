"""The inverse as a kernel: a pose in, the joint vectors of all branches out."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import sympy as sp

from kinegen.errors import KinegenError
from kinegen.outputs import Allowance, Array, Branches, Quantity, redundancy_arrays
from kinegen.robot.extent import reach
from kinegen.robot.model import Robot
from kinegen.robot.redundancy import given_units
from kinegen.symbolic.expressions import Expressions, Tape, number_of
from kinegen.symbolic.fold import Vector
from kinegen.symbolic.inverse.family import Family
from kinegen.symbolic.inverse.own_chain import own_chain
from kinegen.symbolic.inverse.recognise import Unknown, recognise
from kinegen.symbolic.inverse.redundancy import given, moved_back, tool_moved_back
from kinegen.symbolic.inverse.refine import nearly_solved
from kinegen.symbolic.inverse.solutions import joint_values
from kinegen.symbolic.inverse.solve import reads_attitude, solve
from kinegen.symbolic.inverse.steps import ZERO, Steps
from kinegen.symbolic.inverse.target import Target
from kinegen.symbolic.inverse.thresholds import RIGID, thresholds_of
from kinegen.symbolic.signatures import parameter_symbols, pose_array, signature
from kinegen.symbolic.transforms import symbols
from kinegen.tables.seen import chain_of


def derive_inverse(robot: Robot, quantity: Quantity) -> Expressions:
    """All joint vectors that put the tool into a pose.

    A branch is valid (1) where the target is a pose within reach and every joint is within its limits, each as near as
    `thresholds` says; else its number is 0 and its joint values mean nothing: any number, or NaN. A valid branch is
    finite.

    Args:
        robot: The robot.
        quantity: The quantity, with the frames of tool and workpiece where they are not tool and base.

    Returns:
        `solutions` (branches, dof), in the order of the family's branches, and `valid` (branches,).

    Raises:
        KinegenError: If the arm is of no family; the message says which conditions fail.
    """
    if quantity.frame and not robot.is_tree:
        raise KinegenError(f"{quantity}: {robot.name} has one tip, whose inverse is called inverse", robot.source)
    chain = chain_of(robot, quantity)
    family = family_of(chain)
    names = [[sp.Dummy(f"r{row}{column}", real=True) for column in "123"] for row in "123"]
    rotation: tuple[Vector, ...] = tuple((row[0], row[1], row[2]) for row in names)
    position = (sp.Dummy("px", real=True), sp.Dummy("py", real=True), sp.Dummy("pz", real=True))
    tape = Tape()
    steps = Steps(tape, family.axes.value, thresholds_of(family, size_of(chain, family)))
    extra = tuple(sp.Dummy("redundancy", real=True) for _ in robot.given)
    value = extra[0] if extra else ZERO
    tool = Target((rotation[0], rotation[1], rotation[2]), position)
    held = given(steps, family, extra)
    if family.defect is None:
        solutions = solve(steps, family, moved_back(steps, family, tool, extra), value)
    else:
        solutions = nearly_solved(steps, family, family.defect, tool_moved_back(steps, family, tool, extra))
    found = [joint_values(steps, solution, held) for solution in solutions]
    branches = len(family.branches)
    joints = Array("solutions", (branches, robot.dof), per_branch=True)
    inputs = (_target(robot, quantity), *redundancy_arrays(given_units(robot)))
    results = (joints, Array("valid", (branches,), is_truth=True))
    return Expressions(
        signature=replace(signature(robot, quantity, inputs, *results), branches=branches_of(chain, family)),
        variables=(*(entry for row, place in zip(names, position, strict=True) for entry in (*row, place)), *extra),
        parameters=parameter_symbols(robot, symbols(robot, keep_parameters=False)),
        definitions=tuple(tape.definitions),
        entries=(*(value for values, _ in found for value in values), *(valid for _, valid in found)),
    )


def _target(robot: Robot, quantity: Quantity) -> Array:
    """The pose of the tool; that of another frame, or seen from another one, in words of its own."""
    array = pose_array(robot, quantity)
    if not quantity.frame:
        return array
    seen = f"frame {quantity.seen_from}" if quantity.seen_from else "the base frame"
    words = f"pose of frame {quantity.frame} in {seen}, 4x4 matrix, row by row, its rotation orthonormal"
    return replace(array, words=words)


def branches_of(robot: Robot, family: Family) -> Branches:
    """The branches of a family in words and numbers, which go with the kernel from here on."""
    near, joints = thresholds_of(family, size_of(robot, family)), family.joints
    return Branches(
        family=family.name,
        names=family.branches,
        meanings=family.meanings,
        conditions=family.conditions,
        turns=tuple(2 * math.pi / abs(float(joint.rate)) if joint.turns else math.inf for joint in joints),
        rooms=tuple(_allowance(near.room(joint)) for joint in joints),
        rigid=_allowance(RIGID),
        reads_attitude=reads_attitude(family),
        redundancy=family.redundancy,
    )


def size_of(robot: Robot, family: Family) -> float:
    """The reach of an arm, without the huge lengths that cancel in the table of a calibrated arm."""
    return reach(robot) if family.defect is None else own_chain(family.defect.axes).reach


def singular_below(robot: Robot, family: Family) -> float:
    """The least singular value of the Jacobian, lengths by the reach, below which branches of an arm may merge.

    0 where the arm is one of its family.
    """
    return 0.0 if family.defect is None else family.defect.singular_below(size_of(robot, family))


def _allowance(bound: sp.Expr) -> Allowance:
    return Allowance(*(number_of(bound, single=single) for single in (False, True)))


@lru_cache(maxsize=32)
def family_of(robot: Robot) -> Family:
    """The family of a robot; a build and its proof ask for the same one.

    Raises:
        KinegenError: If it is of none.
    """
    family = recognise(robot)
    if isinstance(family, Unknown):
        first, *others = family.reasons
        more = f" (and {len(others)} more, which `kinegen inspect` lists)" if others else ""
        several = "; numeric_inverse takes targets of all tips, inverse@TOOL/WORKPIECE those of one tip"
        instead = "; numeric_inverse works for every arm" if robot.is_arm else several * bool(robot.dof)
        raise KinegenError(f"{robot.name} has no closed-form inverse: {first}{more}{instead}", robot.source)
    return family
