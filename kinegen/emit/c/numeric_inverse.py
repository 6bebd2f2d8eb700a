"""The numeric inverse: `puma560_numeric_inverse.h` and `.c`, a search on the kernel of pose and Jacobian."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction

from kinegen.emit.c.arguments import wrapped_prototype
from kinegen.emit.c.kernel import model_macro
from kinegen.emit.environment import environment
from kinegen.emit.functions import LINE, ROUTINES, Routine
from kinegen.emit.kernels import Kernels, provenance
from kinegen.emit.reals import Real
from kinegen.ir.program import Operator
from kinegen.naming import c_file, comment_text, function, guard, macro, prefix, search_file
from kinegen.outputs import NUMERIC_INVERSE, POSE_AND_JACOBIAN
from kinegen.robot.extent import joint_box, reach
from kinegen.robot.model import JointType, Robot

TOLERANCES = {Real.DOUBLE: Fraction(1, 10**9), Real.FLOAT: Fraction(1, 10**5)}
"""Accepted errors by default: of a rotation in radians, of a position as a part of the reach."""

MOST_RESTARTS = 16
"""From this restart on the number of random joint vectors stays the same."""

DEFAULT_RESTARTS = 10
"""Restarts of the default search."""

ITERATIONS = 60
"""Steps of one descent at most."""

RIGID = {Real.DOUBLE: Fraction(3, 10**6), Real.FLOAT: Fraction(3, 10**4)}
"""How far the columns of a target may be from those of a rotation: the root of the sum of all squares."""

_SAMPLES = 20
_PI = Fraction(3.141592653589793)


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
    rigid: str
    farthest: str
    costs: tuple[str, ...]


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
            (context.source, "c/numeric_inverse.c.jinja"),
        )
    }


def solver_context(kernels: Kernels, real: Real) -> SolverContext:
    """Everything the templates lay out, as finished text."""
    robot = kernels.robot
    stem = prefix(robot.name, real)
    header, source = (search_file(robot.name, suffix, real) for suffix in "hc")
    parameters = bool(robot.runtime_parameters)
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
        pass_params_declaration=f" const {stem}_params *params," if parameters else "",
        routines=tuple(ROUTINES[real][operator] for operator in (Operator.SQRT, Operator.ATAN2)),
        most_restarts=MOST_RESTARTS,
        most_samples=_SAMPLES * MOST_RESTARTS**2,
        iterations=ITERATIONS,
        costs=_cost_lines(function(robot.name, POSE_AND_JACOBIAN.function, real), f"{float(RIGID[real]):.0e}"),
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
        "margin": real.literal(Fraction(2, 5)),
        "damping": real.literal(Fraction(1, 10)),
        "least_damping": real.literal(Fraction(1, 10**12) if real is Real.DOUBLE else Fraction(1, 10**7)),
        "longest_step": real.literal(Fraction(4, 5)),
        "per_draw": real.literal(Fraction(1, 2**24)),
        "half": real.literal(Fraction(1, 2)),
        "half_turn": real.literal(_PI),
        "turn": real.literal(2 * _PI),
        "huge": real.literal(Fraction(10**30)),
        "rigid": real.literal(RIGID[real] ** 2),
        "farthest": real.literal(Fraction(10**15)),
    }


def _arguments(kernels: Kernels, real: Real) -> str:
    robot = kernels.robot
    stem, dof = prefix(robot.name, real), macro(robot.name, "DOF")
    return ", ".join(
        (
            f"const {real} base_T_tool[16]",
            f"const {real} start[{dof}]",
            *((f"const {stem}_params *params",) if robot.runtime_parameters else ()),
            f"const {stem}_search *search",
            f"{real} q[{dof}]",
            f"{stem}_found *found",
        )
    )


def tolerances(robot: Robot, real: Real) -> tuple[Fraction, Fraction]:
    """What is accepted by default: a position error in the file's length unit, one digit; a rotation error in rad."""
    position = TOLERANCES[real] * Fraction(reach(robot, robot.tips))
    return Fraction(f"{float(position):.0e}"), TOLERANCES[real]


def worst_cost(restarts: int) -> int:
    """How often a call evaluates the kernel at most: once for each step, and once for each random joint vector."""
    samples = (_SAMPLES * min(restart, MOST_RESTARTS) ** 2 for restart in range(1, restarts + 1))
    return ITERATIONS * (restarts + 1) + sum(samples)


def _cost_lines(kernel: str, rigid: str) -> tuple[str, ...]:
    """What a call costs at most, as lines of a comment."""
    worst = ", ".join(f"{worst_cost(restarts):,} for {restarts}" for restarts in (0, 1, DEFAULT_RESTARTS))
    text = (
        f"Worst case: nearly all of the time goes into evaluations of {kernel}, one for each step and one for each "
        f"random joint vector. There are at most {ITERATIONS} steps a descent, and before restart r {_SAMPLES} r^2 "
        f"joint vectors ({_SAMPLES * MOST_RESTARTS**2:,} at most). A target out of reach takes all of them: {worst} "
        "restarts. The member budget of a search bounds the evaluations of a call, and steps "
        "bounds those of a descent. A target that is not a pose takes none: one that is not finite, or whose rotation "
        f"misses being orthonormal and right-handed by {rigid} or more, as the root of a sum of squares."
    )
    return tuple(textwrap.wrap(text, LINE, break_long_words=False, break_on_hyphens=False))


def _array(items: Iterable[str]) -> str:
    return f"{{{', '.join(items)}}}"
