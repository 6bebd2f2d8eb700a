"""The numeric inverse: `puma560_numeric_inverse.h` and `.c`, a search on the kernel of pose and Jacobian."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction

from kinegen.emit.c.arguments import wrapped_prototype
from kinegen.emit.c.kernel import model_macro
from kinegen.emit.c.numeric_inverse_tips import TipsContext, tips_context
from kinegen.emit.environment import environment
from kinegen.emit.functions import LINE, ROUTINES, Routine
from kinegen.emit.kernels import Kernels, provenance
from kinegen.emit.reals import Real
from kinegen.emit.search import TUNING
from kinegen.ir.program import Operator
from kinegen.naming import c_file, comment_text, function, guard, macro, params_type, prefix, search_file
from kinegen.outputs import NUMERIC_INVERSE, POSE_AND_JACOBIAN
from kinegen.robot.extent import joint_box, reach
from kinegen.robot.model import JointType, Robot

_PI = Fraction(3.141592653589793)

_OPTIONS = "int32_t restarts;", "uint32_t seed;", "int32_t budget;", "int32_t steps;"
_COUNTS = "int32_t iterations;", "int32_t descents;"


@dataclass(frozen=True, slots=True)
class SolverContext:
    """What the templates `c/numeric_inverse.h.jinja` and `c/numeric_inverse.c.jinja` are given."""

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


def emit_numeric_inverse(kernels: Kernels, real: Real) -> dict[str, str]:
    """Print the search for joint values, of one number type.

    Args:
        kernels: The robot and its programs, the pose with its Jacobian among them.
        real: The number type.

    Returns:
        The header and the source, by file name.
    """
    context = solver_context(kernels, real)
    return {
        name: environment().get_template(template).render(k=context, prefix=context.prefix, qualifier="static")
        for name, template in (
            (context.header, "c/numeric_inverse.h.jinja"),
            (context.source, "c/numeric_inverse_tips.c.jinja" if context.tips else "c/numeric_inverse.c.jinja"),
        )
    }


def solver_context(kernels: Kernels, real: Real) -> SolverContext:
    """Everything the templates lay out, as finished text."""
    robot = kernels.robot
    stem = prefix(robot.name, real)
    header, source = (search_file(robot.name, suffix, real) for suffix in "hc")
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
        title=f"Numeric inverse kinematics of {robot.name}, {'double' if real is Real.DOUBLE else 'single'} precision",
        description=comment_text(robot.description),
        prefix=stem,
        model=model_macro(robot),
        real=real.value,
        format="f64" if real is Real.DOUBLE else "f32",
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
        costs=_cost_lines(function(robot.name, POSE_AND_JACOBIAN.function, real), f"{float(TUNING.rigid[real]):.0e}"),
        tips=tips_context(robot, real),
    )


def _numbers(robot: Robot, real: Real) -> dict[str, str]:
    """The numbers of the search as C text."""
    box = joint_box(robot)
    position, rotation = tolerances(robot, real)
    angles = [variable.type is not JointType.PRISMATIC for variable in robot.variables]
    third = Fraction(reach(robot, robot.tips)) / 3
    return {
        "lowest": _array(real.literal(Fraction(low)) for low, _ in box),
        "highest": _array(real.literal(Fraction(high)) for _, high in box),
        "is_limited": _array(f"{int(variable.limits is not None)}" for variable in robot.variables),
        "is_angle": _array(f"{int(turns)}" for turns in angles),
        "stride": _array(real.literal(Fraction(1) if turns else third) for turns in angles),
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
    """Members of a struct, as long as the errors or tolerances above them, so that comments begin in one column."""
    return tuple(member.ljust(len(above)) for member in members)


def _arguments(kernels: Kernels, real: Real) -> str:
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
    """What the targets of a search are called in every language."""
    return "base_T_tips" if robot.is_tree else "base_T_tool"


def tolerances(robot: Robot, real: Real) -> tuple[Fraction, Fraction]:
    """What is accepted by default: a position error in the file's length unit, one digit; a rotation error in rad."""
    position = TUNING.tolerances[real] * Fraction(reach(robot, robot.tips))
    return Fraction(f"{float(position):.0e}"), TUNING.tolerances[real]


def worst_cost(restarts: int) -> int:
    """How often a call evaluates the kernel at most: once for each step, and once for each random joint vector."""
    samples = (TUNING.samples * min(restart, TUNING.most_restarts) ** 2 for restart in range(1, restarts + 1))
    return TUNING.iterations * (restarts + 1) + sum(samples)


def _cost_lines(kernel: str, rigid: str) -> tuple[str, ...]:
    """What a call costs at most, as lines of a comment."""
    worst = ", ".join(f"{worst_cost(restarts):,} for {restarts}" for restarts in (0, 1, TUNING.restarts))
    text = (
        f"Worst case: nearly all of the time goes into evaluations of {kernel}, one for each step and one for each "
        f"random joint vector. There are at most {TUNING.iterations} steps a descent, and before restart r "
        f"{TUNING.samples} r^2 joint vectors ({TUNING.most_samples:,} at most). A target out of reach takes all "
        f"of them: {worst} restarts. The member budget of a search bounds the evaluations of a call, and steps "
        "bounds those of a descent. A target that is not a pose takes none: one that is not finite, or whose rotation "
        f"misses being orthonormal and right-handed by {rigid} or more, as the root of a sum of squares."
    )
    return tuple(textwrap.wrap(text, LINE, break_long_words=False, break_on_hyphens=False))


def _array(items: Iterable[str]) -> str:
    return f"{{{', '.join(items)}}}"
