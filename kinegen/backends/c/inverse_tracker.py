"""The inverse along a path: `puma560_inverse_tracker.h` and `.c`, solutions that continue each other."""

from __future__ import annotations

import textwrap
from fractions import Fraction

from kinegen.backends.bundle import RobotPrograms, provenance
from kinegen.backends.c.arguments import braced, wrapped_prototype
from kinegen.backends.c.kernel import model_macro
from kinegen.backends.c.nearest import Nearest, nearest_of
from kinegen.backends.c.numeric_inverse import step_stack
from kinegen.backends.inverse import allowed, branches_of
from kinegen.backends.routines import LINE, ROUTINES, Routine
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.solver_parameters import TRACKING, TUNING, given_joint
from kinegen.backends.templates import rendered
from kinegen.ir.program import Operator
from kinegen.model.branches import Branches
from kinegen.model.joint_bounds import reach
from kinegen.model.outputs import POSE_AND_JACOBIAN
from kinegen.model.robot import JointType, Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import c_file, comment_text, function, guard, macro, params_type, prefix, tracker_file


def step_words(real: ScalarType) -> tuple[str, ...]:
    """Says in the header what a step does."""
    leap, far, kept = float(TRACKING.leap), float(TRACKING.long_step), f"{float(TRACKING.kept[real]):.0e}"
    return _wrapped(
        "The solution is the nearest one that the joints reach without a jump, with a preference for the tracker's "
        "branch, and with the whole turns that continue the joint values within their limits. A joint jumps if it "
        f"moves by more than half a turn, or if joints that move by more than {leap:g} rad take the tool off its path. "
        f"For a target more than {far:g} rad, or {far / 3:g} of the reach, away, the path is not known and the branch "
        "decides. On a path straight through a singularity the joints continue, although the name of the branch "
        "changes. Where the target leaves joints free, they move as little as it allows, and the tool may be off by "
        f"{kept} rad or third of the reach.",
        "With max_step, no joint changes by more. Limited joints move by that much towards the solution, and the "
        "others bring the tool as close to the target as they can. Further steps to the same target reach it.",
    )


def speed_words(branches: Branches, real: ScalarType) -> tuple[str, ...]:
    """Says in the header what joint speeds are."""
    most, near, least = float(TRACKING.speed_damping), float(TRACKING.near[real]), float(TRACKING.least_damping[real])
    words = (
        "qd = (J^T J + k)^-1 J^T twist, with lengths in thirds of the reach. "
        f"k = {most:.0e} (1 - w/w0)^2 + {least:.0e} for w < w0 = {near:.0e}, else 0, after Nakamura and Hanafusa "
        "(1986). "
        "w is the product of the squared sines at which each column of J meets those before it. "
    )
    if branches.redundancy:
        words += f"The speed of {branches.redundancy}, which is given with the target, is 0. "
    if not branches.reads_attitude:
        words += "Only the velocity of the origin is controlled; the residual still has all six numbers. "
    return _wrapped(words.strip())


def _wrapped(*texts: str) -> tuple[str, ...]:
    return tuple(line for text in texts for line in textwrap.wrap(text, LINE, break_on_hyphens=False))


_PI = Fraction(3.141592653589793)

_LONG_WAY = Fraction("0.50001")
"""A joint that turns by more than this part of a whole turn goes the long way round, which only a limit makes it do."""


@dataclass(frozen=True, slots=True)
class TrackerContext:
    """Holds what the templates `c/inverse_tracker.h.jinja` and `c/inverse_tracker.c.jinja` are given."""

    header: str
    source: str
    kernel_header: str
    guard: str
    provenance: str
    title: str
    description: str
    prefix: str
    upper: str
    model: tuple[str, str]
    real: str
    format: str
    length: str
    dof: int
    stack: int
    dof_macro: str
    branches: int
    rows: int
    kernel: str
    inverse: str
    nearest: Nearest
    nearest_name: str
    prototypes: tuple[str, ...]
    start: tuple[str, ...]
    step: tuple[str, ...]
    speeds: tuple[str, ...]
    params_type: str
    redundancy: str
    pass_params: str
    pass_params_declaration: str
    pass_redundancy: str
    pass_redundancy_declaration: str
    routines: tuple[Routine, ...]
    lines: tuple[str, ...]
    speed_lines: tuple[str, ...]
    stride: str
    per_stride: str
    length_weight: str
    lowest: str
    highest: str
    farthest_joint: str
    turn_of: str
    per_turn: str
    longest: str
    is_given: str
    steps: int
    polish: int
    passes: int
    leap: str
    long_step: str
    detour: str
    other_detour: str
    open: str
    singular: str
    kept: str
    kept_square: str
    matching: str
    damping: str
    least_damping: str
    held_damping: str
    per_near: str
    speed_damping: str
    rigid: str
    farthest: str
    half: str
    half_turn: str
    huge: str


def emit_inverse_tracker(kernels: RobotPrograms, real: ScalarType) -> dict[str, str]:
    """Prints the header and the source of the inverse along a path.

    The inverse and the kernel of pose and Jacobian are among the programs.
    """
    context = tracker_context(kernels, real)
    templates = {context.header: "c/inverse_tracker.h", context.source: "c/inverse_tracker.c"}
    return rendered(templates, k=context, prefix=context.prefix, qualifier="static")


def tracker_context(kernels: RobotPrograms, real: ScalarType) -> TrackerContext:
    """Returns everything the templates lay out, as finished text."""
    robot, branches, nearest = kernels.robot, branches_of(kernels), nearest_of(kernels, real)
    if branches is None or nearest is None:
        raise ValueError("arms without a closed form are refused before this")
    header, source = (tracker_file(robot.name, suffix, real) for suffix in "hc")
    params = params_type(robot.name, real) if robot.runtime_parameters else ""
    # Templates pass what is given on without asking whether there is any.
    given = f" const {real} redundancy[1]," if branches.redundancy else ""
    prototypes = _prototypes(robot, real, given, f" const {params} *params," if params else "")
    start, step, speeds = map(wrapped_prototype, prototypes)
    return TrackerContext(
        **_numbers(robot, branches, real),
        **_joints(robot, branches, nearest, real),
        header=header,
        source=source,
        kernel_header=c_file(robot.name, "h", real),
        guard=guard(header),
        provenance=provenance(robot),
        title=f"Inverse kinematics of {robot.name} along a path, {real.precision} precision",
        description=comment_text(robot.description),
        prefix=prefix(robot.name, real),
        upper=prefix(robot.name, real).upper(),
        model=model_macro(robot),
        real=real.value,
        format="f64" if real is ScalarType.DOUBLE else "f32",
        length=robot.units.length,
        dof=robot.dof,
        stack=step_stack(robot, real),
        dof_macro=macro(robot.name, "DOF"),
        branches=len(branches.names),
        rows=6 if branches.reads_attitude else 3,
        kernel=function(robot.name, POSE_AND_JACOBIAN.function, real),
        inverse=nearest.inverse,
        nearest=nearest,
        nearest_name=nearest.name,
        prototypes=prototypes,
        start=start,
        step=step,
        speeds=speeds,
        params_type=params,
        redundancy=branches.redundancy,
        pass_params=" params," if params else "",
        pass_params_declaration=f" const {params} *params," if params else "",
        pass_redundancy=" redundancy," if branches.redundancy else "",
        pass_redundancy_declaration=given,
        routines=tuple(
            ROUTINES[real][operator] for operator in (Operator.SQRT, *[Operator.ATAN2] * branches.reads_attitude)
        ),
        steps=TRACKING.steps,
        polish=TRACKING.polish,
        passes=TRACKING.passes[real],
        lines=step_words(real),
        speed_lines=speed_words(branches, real),
    )


def _prototypes(robot: Robot, real: ScalarType, redundancy: str, params: str) -> tuple[str, ...]:
    stem, dof = prefix(robot.name, real), macro(robot.name, "DOF")
    start, step, speeds = (function(robot.name, f"tracker_{part}", real) for part in ("start", "step", "speeds"))
    begun = f"{stem}_tracker *tracker, const {real} q[{dof}],{redundancy}{params}".removesuffix(",")
    stepped = f"{redundancy}{params} const {real} max_step[{dof}], {stem}_tracked *report"
    bounds = f"{params} const {real} max_speed[{dof}], {real} qd[{dof}], {real} residual[6]"
    return (
        f"int {start}({begun})",
        f"int {step}({stem}_tracker *tracker, const {real} base_T_tool[16],{stepped})",
        f"{real} {speeds}(const {stem}_tracker *tracker, const {real} twist[6],{bounds})",
    )


def _joints(robot: Robot, branches: Branches, nearest: Nearest, real: ScalarType) -> dict[str, str]:
    given = given_joint(robot, branches)
    # A stroke has no turn, and no way round.
    turns = [Fraction(turn) if joint.turns else Fraction(0) for turn, joint in zip(branches.turns, nearest.joints)]
    return {
        "stride": braced(real.literal(each) for each in strides(robot)),
        "per_stride": braced(real.literal(1 / each) for each in strides(robot)),
        "lowest": braced(joint.lowest for joint in nearest.joints),
        "highest": braced(joint.highest for joint in nearest.joints),
        "farthest_joint": braced(joint.farthest for joint in nearest.joints),
        "turn_of": braced(joint.turn for joint in nearest.joints),
        "per_turn": braced(joint.per_turn for joint in nearest.joints),
        "longest": braced(real.literal(turn * _LONG_WAY) for turn in turns),
        "is_given": braced(str(int(index == given)) for index in range(robot.dof)),
    }


def strides(robot: Robot) -> tuple[Fraction, ...]:
    """Returns what of each joint counts as much as 1 rad: 1 for an angle, a third of the reach for a stroke."""
    third = Fraction(reach(robot, robot.tips)) / 3
    return tuple(third if variable.type is JointType.PRISMATIC else Fraction(1) for variable in robot.variables)


def _numbers(robot: Robot, branches: Branches, real: ScalarType) -> dict[str, str]:
    return {
        "length_weight": real.literal(3 / Fraction(reach(robot, robot.tips))),
        "leap": real.literal(TRACKING.leap),
        "long_step": real.literal(TRACKING.long_step),
        "detour": real.literal(TRACKING.detour),
        "other_detour": real.literal(TRACKING.other_detour),
        "open": real.literal(TRACKING.open[real]),
        "singular": real.literal(TRACKING.singular[real]),
        "kept": real.literal(TRACKING.kept[real]),
        "kept_square": real.literal(TRACKING.kept[real] ** 2),
        "matching": real.literal(TRACKING.matching[real]),
        "damping": real.literal(TRACKING.damping),
        "least_damping": real.literal(TRACKING.least_damping[real]),
        "held_damping": real.literal(TRACKING.held_damping),
        "per_near": real.literal(1 / TRACKING.near[real]),
        "speed_damping": real.literal(TRACKING.speed_damping),
        "rigid": real.literal(Fraction(allowed(branches.rigid, real)) ** 2),
        "farthest": real.literal(TUNING.farthest),
        "half": real.literal(Fraction(1, 2)),
        "half_turn": real.literal(_PI),
        "huge": real.literal(TUNING.huge),
    }
