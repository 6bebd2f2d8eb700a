"""The numeric inverse: `puma560_numeric_inverse.h` and `.c`, a search on the kernel of pose and Jacobian.

Stacks are estimated from the frames of gcc 12 for x86-64 and Cortex-M4 at -O1 to -Os, which follow the arrays: so many
numbers for each joint and each tip, and a constant part. What is called in the file of the kernels is not in them.
"""

from __future__ import annotations

import textwrap
from fractions import Fraction

from kinegen.backends.bundle import RobotPrograms, provenance
from kinegen.backends.c.arguments import braced, wrapped_prototype
from kinegen.backends.c.kernel import model_macro
from kinegen.backends.routines import LINE, ROUTINES, Routine
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.solver_parameters import ROWS, TUNING, tips_of
from kinegen.backends.templates import rendered
from kinegen.ir.program import Operator
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.outputs import NUMERIC_INVERSE, POSE_AND_JACOBIAN
from kinegen.model.robot import JointType, Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import c_file, comment_text, function, guard, macro, params_type, prefix, search_file

_STEP = 100
"""Bytes to which the number is rounded up."""


def search_stack(robot: Robot, real: ScalarType) -> int:
    """Estimates the bytes of stack of a call of the numeric inverse, without the kernel; a multiple of 100."""
    dof, tips = robot.dof, len(robot.tips)
    if not robot.is_tree:
        return _bytes(160 + 13 * dof, 120, real)
    size = dof if tips_of(robot).by_joints else 6 * tips
    return _bytes(12 * dof * tips + 42 * tips + size * (size + 2) + 8 * dof + 60, 0, real)


def step_stack(robot: Robot, real: ScalarType) -> int:
    """Estimates the bytes of stack of a step of the tracker, without the inverse and the kernel; a multiple of 100."""
    return _bytes(52 * robot.dof, 500, real)


def _bytes(numbers: int, others: int, real: ScalarType) -> int:
    return -(-(numbers * real.size + others) // _STEP) * _STEP


@dataclass(frozen=True, slots=True)
class TipsContext:
    """Holds the structure of a tree as C text.

    Attributes:
        groups: Number of groups of tips that share joints.
        size: Rows of the damped equations.
        by_joints: Whether these have a row for each joint.
        first: For each row of their matrix, the first entry that is not always zero.
        ones: A weight of 1 for each part of each tip.
        greatest: The largest weight as text for readers.
    """

    count: int
    macro: str
    groups: int
    size: int
    by_joints: bool
    is_moved: str
    tip_groups: str
    joint_groups: str
    first: str
    ones: str
    heaviest: str
    greatest: str


def tips_context(robot: Robot, real: ScalarType) -> TipsContext | None:
    """Writes the structure of a tree; None for an arm, whose search has one target."""
    if not robot.is_tree:
        return None
    tips, one = tips_of(robot), real.literal(Fraction(1))
    return TipsContext(
        count=len(tips.moving),
        macro=macro(robot.name, "TIPS"),
        groups=tips.groups,
        size=robot.dof if tips.by_joints else ROWS * len(tips.moving),
        by_joints=tips.by_joints,
        is_moved=braced(braced(f"{int(j in joints)}U" for j in range(robot.dof)) for joints in tips.moving),
        tip_groups=braced(f"{group}U" for group in tips.tip_groups),
        joint_groups=braced(f"{group}U" for group in tips.joint_groups),
        first=braced(f"{column}U" for column in tips.first),
        ones=braced(f"{{{one}, {one}}}" for _ in tips.moving),
        heaviest=real.literal(TUNING.heaviest),
        greatest=f"{float(TUNING.heaviest):.0e}",
    )


_PI = Fraction(3.141592653589793)

_OPTIONS = "int32_t restarts;", "uint32_t seed;", "int32_t budget;", "int32_t steps;"
_COUNTS = "int32_t iterations;", "int32_t descents;"


@dataclass(frozen=True, slots=True)
class SolverContext:
    """Holds what the templates `c/numeric_inverse.h.jinja` and `c/numeric_inverse.c.jinja` are given."""

    header: str
    source: str
    kernel_header: str
    guard: str
    provenance: str
    title: str
    description: str
    prefix: str
    model: tuple[str, str]
    real: str
    format: str
    length: str
    dof: int
    function: str
    kernel: str
    prototype: str
    declaration: tuple[str, ...]
    parameters: bool
    pass_params: str
    pass_params_declaration: str
    routines: tuple[Routine, ...]
    lowest: str
    highest: str
    is_limited: str
    is_angle: str
    stride: str
    tolerances: str
    position_tolerance: str
    rotation_tolerance: str
    length_weight: str
    margin: str
    damping: str
    least_damping: str
    longest_step: str
    per_draw: str
    half: str
    half_turn: str
    turn: str
    huge: str
    most_restarts: int
    most_samples: int
    iterations: int
    stall: int
    samples: int
    restarts: int
    options: tuple[str, ...]
    counts: tuple[str, ...]
    rigid: str
    farthest: str
    costs: tuple[str, ...]
    tips: TipsContext | None


def emit_numeric_inverse(kernels: RobotPrograms, real: ScalarType) -> dict[str, str]:
    """Prints the header and the source of the search for joint values.

    The kernel of pose and Jacobian is among the programs.
    """
    context = solver_context(kernels, real)
    source = "c/numeric_inverse_tips.c" if context.tips else "c/numeric_inverse.c"
    templates = {context.header: "c/numeric_inverse.h", context.source: source}
    return rendered(templates, k=context, prefix=context.prefix, qualifier="static")


def solver_context(kernels: RobotPrograms, real: ScalarType) -> SolverContext:
    """Returns everything the templates lay out, as finished text."""
    robot = kernels.robot
    stem = prefix(robot.name, real)
    header, source = (search_file(robot.name, suffix, real) for suffix in "hc")
    # Templates pass parameters on without asking whether there are any.
    parameters = bool(robot.runtime_parameters)
    extent = f"[{macro(robot.name, 'TIPS')}]" if robot.is_tree else ""
    prototype = f"int {function(robot.name, NUMERIC_INVERSE.function, real)}({_arguments(kernels, real)})"
    return SolverContext(
        **_numbers(robot, real),
        header=header,
        source=source,
        kernel_header=c_file(robot.name, "h", real),
        guard=guard(header),
        provenance=provenance(robot),
        title=f"Numeric inverse kinematics of {robot.name}, {real.precision} precision",
        description=comment_text(robot.description),
        prefix=stem,
        model=model_macro(robot),
        real=real.value,
        format="f64" if real is ScalarType.DOUBLE else "f32",
        length=robot.units.length,
        dof=robot.dof,
        function=function(robot.name, NUMERIC_INVERSE.function, real),
        kernel=function(robot.name, POSE_AND_JACOBIAN.function, real),
        prototype=prototype,
        declaration=wrapped_prototype(prototype),
        parameters=parameters,
        pass_params=" params," if parameters else "",
        pass_params_declaration=f" const {params_type(robot.name, real)} *params," if parameters else "",
        routines=tuple(ROUTINES[real][operator] for operator in (Operator.SQRT, Operator.ATAN2)),
        most_restarts=TUNING.most_restarts,
        most_samples=TUNING.most_samples,
        iterations=TUNING.iterations,
        stall=TUNING.stall,
        samples=TUNING.samples,
        restarts=TUNING.restarts,
        options=_members(_OPTIONS, f"{real} position_tolerance;"),
        counts=_members(_COUNTS, f"{real} position_error{extent};"),
        costs=_cost_lines(
            function(robot.name, POSE_AND_JACOBIAN.function, real),
            f"{float(TUNING.rigid[real]):.0e}",
            search_stack(robot, real),
        ),
        tips=tips_context(robot, real),
    )


def _numbers(robot: Robot, real: ScalarType) -> dict[str, str]:
    box = joint_box(robot)
    position, rotation = tolerances(robot, real)
    angles = [variable.type is not JointType.PRISMATIC for variable in robot.variables]
    # An angle of 1 rad counts as much as a third of the reach.
    third = Fraction(reach(robot, robot.tips)) / 3
    return {
        "lowest": braced(real.literal(Fraction(low)) for low, _ in box),
        "highest": braced(real.literal(Fraction(high)) for _, high in box),
        "is_limited": braced(f"{int(variable.limits is not None)}" for variable in robot.variables),
        "is_angle": braced(f"{int(turns)}" for turns in angles),
        "stride": braced(real.literal(Fraction(1) if turns else third) for turns in angles),
        "tolerances": f"{float(position):.0e} {robot.units.length} and {float(rotation):.0e} rad",
        "position_tolerance": real.literal(position),
        "rotation_tolerance": real.literal(rotation),
        "length_weight": real.literal(1 / third),
        "margin": real.literal(TUNING.margin),
        "damping": real.literal(TUNING.damping),
        "least_damping": real.literal(TUNING.least_damping[real]),
        "longest_step": real.literal(TUNING.longest_step),
        "per_draw": real.literal(Fraction(1, 2**24)),
        "half": real.literal(Fraction(1, 2)),
        "half_turn": real.literal(_PI),
        "turn": real.literal(2 * _PI),
        "huge": real.literal(TUNING.huge),
        "rigid": real.literal(TUNING.rigid[real] ** 2),
        "farthest": real.literal(TUNING.farthest),
    }


def _members(members: tuple[str, ...], above: str) -> tuple[str, ...]:
    """Pads members of a struct to the line above them, so that comments begin in one column."""
    return tuple(member.ljust(len(above)) for member in members)


def _arguments(kernels: RobotPrograms, real: ScalarType) -> str:
    robot = kernels.robot
    stem, dof = prefix(robot.name, real), macro(robot.name, "DOF")
    # Of many matrices a pointer: some compilers warn of `&targets[0][0]` for an array of numbers, others of arrays.
    target = f"*{target_name(robot)}" if robot.is_tree else f"{target_name(robot)}[16]"
    return ", ".join(
        (
            f"const {real} {target}",
            f"const {real} start[{dof}]",
            *((f"const {params_type(robot.name, real)} *params",) if robot.runtime_parameters else ()),
            f"const {stem}_search *search",
            f"{real} q[{dof}]",
            f"{stem}_found *found",
        )
    )


def target_name(robot: Robot) -> str:
    """Names the targets of a search, as every language does."""
    return "base_T_tips" if robot.is_tree else "base_T_tool"


def tolerances(robot: Robot, real: ScalarType) -> tuple[Fraction, Fraction]:
    """Returns what is accepted by default: a position error in the file's length unit, one digit.

    A rotation error in rad.
    """
    position = TUNING.tolerances[real] * Fraction(reach(robot, robot.tips))
    return Fraction(f"{float(position):.0e}"), TUNING.tolerances[real]


def worst_cost(restarts: int) -> int:
    """Counts the evaluations of the kernel at most: one for each step, and one for each random joint vector."""
    samples = (TUNING.samples * min(restart, TUNING.most_restarts) ** 2 for restart in range(1, restarts + 1))
    return TUNING.iterations * (restarts + 1) + sum(samples)


def _cost_lines(kernel: str, rigid: str, stack: int) -> tuple[str, ...]:
    worst = ", ".join(f"{worst_cost(restarts):,} for {restarts}" for restarts in (0, 1, TUNING.restarts))
    text = (
        f"Worst case: nearly all of the time goes into evaluations of {kernel}, one for each step and one for each "
        f"random joint vector. There are at most {TUNING.iterations} steps a descent, and before restart r "
        f"{TUNING.samples} r^2 joint vectors ({TUNING.most_samples:,} at most). A target out of reach takes all "
        f"of them: {worst} restarts. The member budget of a search bounds the evaluations of a call, and steps "
        "bounds those of a descent. A target that is not a pose takes none: one that is not finite, or whose rotation "
        f"misses being orthonormal and right-handed by {rigid} or more, as the root of a sum of squares. A call "
        f"takes about {stack} bytes of stack, without those of {kernel}."
    )
    return tuple(textwrap.wrap(text, LINE, break_long_words=False, break_on_hyphens=False))
