"""The inverse along a path: `puma560_inverse_tracker.h` and `.c`, solutions that continue each other."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction

from kinegen.emit.c.arguments import wrapped_prototype
from kinegen.emit.c.kernel import model_macro
from kinegen.emit.c.nearest import Nearest, nearest_of
from kinegen.emit.c.tracker_words import speed_words, step_words
from kinegen.emit.environment import environment
from kinegen.emit.functions import ROUTINES, Routine
from kinegen.emit.inverse import allowed, branches_of
from kinegen.emit.kernels import Kernels, provenance
from kinegen.emit.reals import Real
from kinegen.emit.search import TUNING
from kinegen.emit.tracking import TRACKING, given_joint
from kinegen.ir.program import Operator
from kinegen.naming import c_file, comment_text, function, guard, macro, params_type, prefix, tracker_file
from kinegen.outputs import POSE_AND_JACOBIAN, Branches
from kinegen.robot.extent import reach
from kinegen.robot.model import JointType, Robot

_PI = Fraction(3.141592653589793)

_LONG_WAY = Fraction("0.50001")
"""A joint that turns by more than this part of a whole turn goes the long way round, which only a limit makes it do."""


@dataclass(frozen=True, slots=True)
class TrackerContext:
    """What the templates `c/inverse_tracker.h.jinja` and `c/inverse_tracker.c.jinja` are given."""

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


def emit_inverse_tracker(kernels: Kernels, real: Real) -> dict[str, str]:
    """Print the inverse along a path, of one number type.

    Args:
        kernels: The robot and its programs, the inverse and the pose with its Jacobian among them.
        real: The number type.

    Returns:
        The header and the source, by file name.
    """
    context = tracker_context(kernels, real)
    return {
        name: environment().get_template(template).render(k=context, prefix=context.prefix, qualifier="static")
        for name, template in (
            (context.header, "c/inverse_tracker.h.jinja"),
            (context.source, "c/inverse_tracker.c.jinja"),
        )
    }


def tracker_context(kernels: Kernels, real: Real) -> TrackerContext:
    """Everything the templates lay out, as finished text."""
    robot, branches, nearest = kernels.robot, branches_of(kernels), nearest_of(kernels, real)
    if branches is None or nearest is None:
        raise ValueError("arms without a closed form are refused before this")
    header, source = (tracker_file(robot.name, suffix, real) for suffix in "hc")
    params = params_type(robot.name, real) if robot.runtime_parameters else ""
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
        title=f"Inverse kinematics of {robot.name} along a path, {_precision(real)} precision",
        description=comment_text(robot.description),
        prefix=prefix(robot.name, real),
        upper=prefix(robot.name, real).upper(),
        model=model_macro(robot),
        real=real.value,
        format="f64" if real is Real.DOUBLE else "f32",
        length=robot.units.length,
        dof=robot.dof,
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


def _precision(real: Real) -> str:
    return "double" if real is Real.DOUBLE else "single"


def _prototypes(robot: Robot, real: Real, redundancy: str, params: str) -> tuple[str, ...]:
    """The three functions."""
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


def _joints(robot: Robot, branches: Branches, nearest: Nearest, real: Real) -> dict[str, str]:
    """What there is of each joint, as C text."""
    given = given_joint(robot, branches)
    turns = [Fraction(turn) if joint.turns else Fraction(0) for turn, joint in zip(branches.turns, nearest.joints)]
    return {
        "stride": _array(real.literal(each) for each in strides(robot)),
        "per_stride": _array(real.literal(1 / each) for each in strides(robot)),
        "lowest": _array(joint.lowest for joint in nearest.joints),
        "highest": _array(joint.highest for joint in nearest.joints),
        "farthest_joint": _array(joint.farthest for joint in nearest.joints),
        "turn_of": _array(joint.turn for joint in nearest.joints),
        "per_turn": _array(joint.per_turn for joint in nearest.joints),
        "longest": _array(real.literal(turn * _LONG_WAY) for turn in turns),
        "is_given": _array(str(int(index == given)) for index in range(robot.dof)),
    }


def strides(robot: Robot) -> tuple[Fraction, ...]:
    """What of each joint counts as much as an angle of 1 rad: 1 for an angle, a third of the reach for a stroke."""
    third = Fraction(reach(robot, robot.tips)) / 3
    return tuple(third if variable.type is JointType.PRISMATIC else Fraction(1) for variable in robot.variables)


def _numbers(robot: Robot, branches: Branches, real: Real) -> dict[str, str]:
    """The numbers of `TRACKING` as C text."""
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


def _array(items: Iterable[str] | Sequence[str]) -> str:
    return f"{{{', '.join(items)}}}"
