"""The inverse as a kernel: a pose in, the joint vectors of all branches out."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import sympy as sp

from kinegen.derive.expressions import Expressions, LetBindings, parameter_symbols, pose_array, signature
from kinegen.derive.folding import Vector
from kinegen.derive.inverse.classification import NotClosedForm, recognise, snap_hint
from kinegen.derive.inverse.compact_chain import own_chain
from kinegen.derive.inverse.family import Family
from kinegen.derive.inverse.joint_wrapping import branch_results, joint_values
from kinegen.derive.inverse.newton_refinement import nearly_solved
from kinegen.derive.inverse.singular_configurations import allowance, free_end, in_line
from kinegen.derive.inverse.solve import reads_attitude, solve
from kinegen.derive.inverse.straight_line_operations import ZERO, OperationBuilder
from kinegen.derive.inverse.target_pose import Target, given, moved_back, tool_moved_back
from kinegen.derive.inverse.tolerances import RIGID, thresholds_of
from kinegen.derive.transforms import symbols
from kinegen.errors import KinegenError
from kinegen.model.branches import Branches
from kinegen.model.dh_conversion.elementary_transforms import chain_of
from kinegen.model.joint_bounds import reach
from kinegen.model.outputs import Array, Quantity, redundancy_arrays
from kinegen.model.robot import Robot
from kinegen.model.variants import given_units


def derive_inverse(robot: Robot, quantity: Quantity) -> Expressions:
    """Derive all joint vectors that put the tool into a pose.

    A branch is valid (1) where the target is a pose within reach and every joint is within its limits, each as near as
    `tolerances` says; else its number is 0 and its joint values mean nothing: any number, or NaN. A valid branch is
    finite. The quantity has the frames of tool and workpiece where they are not tool and base.

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
    bindings = LetBindings()
    # Symbols of the target come first: rotation by rows, position, and what is given.
    steps = OperationBuilder(bindings, family.axes.value, thresholds_of(family, size_of(chain, family)))
    extra = tuple(sp.Dummy("redundancy", real=True) for _ in robot.given)
    value = extra[0] if extra else ZERO
    tool = Target((rotation[0], rotation[1], rotation[2]), position)
    held = given(steps, family, extra)
    # Only the arm of a family has a closed form; one that is nearly so is led on by Newton steps.
    if family.defect is None:
        solutions = solve(steps, family, moved_back(steps, family, tool, extra), value)
    else:
        solutions = nearly_solved(steps, family, family.defect, tool_moved_back(steps, family, tool, extra))
    # Limits of the joints are seen to last, alike for all families.
    found = [joint_values(steps, solution, held) for solution in solutions]
    branches = len(family.branches)
    joints = Array("solutions", (branches, robot.dof), per_branch=True)
    inputs = (_target(robot, quantity), *redundancy_arrays(given_units(robot)))
    results = (joints, Array("valid", (branches,), is_truth=True))
    return Expressions(
        signature=replace(signature(robot, quantity, inputs, *results), branches=branches_of(chain, family)),
        variables=(*(entry for row, place in zip(names, position, strict=True) for entry in (*row, place)), *extra),
        parameters=parameter_symbols(robot, symbols(robot, keep_parameters=False)),
        ways=(branch_results(bindings, found),),
    )


def _target(robot: Robot, quantity: Quantity) -> Array:
    """Return the pose of the tool; that of another frame, or seen from another one, is described in its own words."""
    array = pose_array(robot, quantity)
    if not quantity.frame:
        return array
    seen = f"frame {quantity.seen_from}" if quantity.seen_from else "the base frame"
    words = f"pose of frame {quantity.frame} in {seen}, 4x4 matrix, row by row, its rotation orthonormal"
    return replace(array, words=words)


def branches_of(robot: Robot, family: Family) -> Branches:
    """Describe the branches of a family in words and numbers, which go with the kernel from here on."""
    near, joints = thresholds_of(family, size_of(robot, family)), family.joints
    return Branches(
        family=family.name,
        names=family.branches,
        meanings=family.meanings,
        conditions=family.conditions,
        turns=tuple(2 * math.pi / abs(float(joint.rate)) if joint.turns else math.inf for joint in joints),
        rooms=tuple(allowance(near.room(joint)) for joint in joints),
        rigid=allowance(RIGID),
        reads_attitude=reads_attitude(family),
        redundancy=family.redundancy,
        in_line=in_line(family),
        free_end=free_end(family),
    )


def size_of(robot: Robot, family: Family) -> float:
    """Return the reach of an arm, without the huge lengths that cancel in the table of a calibrated arm."""
    return reach(robot) if family.defect is None else own_chain(family.defect.axes).reach


def singular_below(robot: Robot, family: Family) -> float:
    """Return the least singular value of the Jacobian, lengths by the reach, below which branches of an arm may merge.

    It is 0 where the arm is one of its family.
    """
    return 0.0 if family.defect is None else family.defect.singular_below(size_of(robot, family))


@lru_cache(maxsize=32)
def family_of(robot: Robot) -> Family:
    """Return the family of a robot, once for a build and its proof; raise `KinegenError` if it is of none."""
    family = recognise(robot)
    if isinstance(family, NotClosedForm):
        first, *others = family.reasons
        more = f" (and {len(others)} more, which `kinegen inspect` lists)" if others else ""
        several = "; numeric_inverse takes targets of all tips, inverse@TOOL/WORKPIECE those of one tip"
        more += f"; {hint}" if (hint := snap_hint(robot, family)) else ""
        instead = "; numeric_inverse works for every arm" if robot.is_arm else several * bool(robot.dof)
        raise KinegenError(f"{robot.name} has no closed-form inverse: {first}{more}{instead}", robot.source)
    return family
