"""The numeric inverse of many targets: `puma560_numeric_inverse_batch.h` and `.c`, a tile of targets in lock step.

A lane does the operations of the single search in the same order, so without contraction it has the same bits.
"""

from __future__ import annotations

from dataclasses import dataclass

from kinegen.emit.c.arguments import wrapped_prototype
from kinegen.emit.c.batch import TILE_BYTES
from kinegen.emit.c.lock_step import Steps, steps_of
from kinegen.emit.c.numeric_inverse import solver_context
from kinegen.emit.environment import environment
from kinegen.emit.functions import ROUTINES
from kinegen.emit.kernels import Kernels
from kinegen.emit.reals import Real
from kinegen.emit.search import TUNING
from kinegen.emit.tips import tips_of
from kinegen.ir.program import Operator
from kinegen.naming import c_file, function, guard, params_type, prefix, search_file
from kinegen.outputs import NUMERIC_INVERSE
from kinegen.robot.model import Robot


@dataclass(frozen=True, slots=True)
class SearchBatch:
    """What the templates `c/numeric_inverse_batch.*.jinja` are given beside the context of the single search.

    Attributes:
        header: Name of the header.
        source: Name of the source.
        guard: Include guard of the header.
        title: First line of both.
        kernel_header: Header of the kernel that evaluates a tile.
        declaration: The prototype as lines.
        routines: Templates of the functions that are called.
        tile: Targets in lock step.
        stack: About how much stack a call needs.
        steps: The statements for one target of a tile.
    """

    header: str
    source: str
    guard: str
    title: str
    kernel_header: str
    declaration: tuple[str, ...]
    routines: tuple[str, ...]
    tile: int
    stack: str
    steps: Steps


def emit_numeric_inverse_batch(kernels: Kernels, real: Real) -> dict[str, str]:
    """Print the search for the joint values of many targets, of one number type.

    Args:
        kernels: The robot and its programs, the pose with its Jacobian among them.
        real: The number type.

    Returns:
        The header and the source, by file name.
    """
    context, batch = solver_context(kernels, real), _batch(kernels, real)
    return {
        name: environment()
        .get_template(template)
        .render(k=context, b=batch, prefix=context.prefix, qualifier=f"{context.prefix.upper()}_INLINE")
        for name, template in (
            (batch.header, "c/numeric_inverse_batch.h.jinja"),
            (batch.source, f"c/numeric_inverse_{'tips_' if context.tips else ''}batch.c.jinja"),
        )
    }


def search_batch_arguments(symbol: str, real: str, *, parameters: bool, tips: bool) -> tuple[str, ...]:
    """The arguments of the search for many targets, each a declaration that ends in the name.

    Args:
        symbol: Name of the robot.
        real: Number type.
        parameters: Whether there are runtime parameters.
        tips: Whether the robot is a tree, with a target for each tip.
    """
    stem, target = prefix(symbol, real), "base_T_tips" if tips else "base_T_tool"
    return (
        "size_t n",
        *(f"const {real} *{target}", f"ptrdiff_t {target}_pose"),
        *(("ptrdiff_t base_T_tips_tip",) if tips else ()),
        f"ptrdiff_t {target}_joint",
        *(f"const {real} *start", "ptrdiff_t start_pose", "ptrdiff_t start_joint"),
        *((f"const {params_type(symbol, real)} *params", "ptrdiff_t params_stride") if parameters else ()),
        *(f"const {stem}_search *search", "size_t first", f"{real} *q", "ptrdiff_t q_stride"),
        *(f"{stem}_found *found", "unsigned char *solved", "int layout"),
    )


def _batch(kernels: Kernels, real: Real) -> SearchBatch:
    robot, bits = kernels.robot, "f64" if real is Real.DOUBLE else "f32"
    header, source = (search_file(robot.name, suffix, real, batch=True) for suffix in "hc")
    arguments = search_batch_arguments(robot.name, real, parameters=bool(robot.runtime_parameters), tips=robot.is_tree)
    name = function(robot.name, NUMERIC_INVERSE.function, real, batch=True)
    tile = TILE_BYTES // (8 if real is Real.DOUBLE else 4)
    precision = "double" if real is Real.DOUBLE else "single"
    called = (ROUTINES[real][operator].template for operator in (Operator.SQRT, Operator.ATAN2))
    return SearchBatch(
        header=header,
        source=source,
        guard=guard(header),
        title=f"Batches: numeric inverse kinematics of {robot.name}, {precision} precision",
        kernel_header=c_file(robot.name, "h", real, batch=True),
        declaration=wrapped_prototype(f"void {name}({', '.join(arguments)})"),
        routines=(*called, f"c/_select_{bits}.c.jinja"),
        tile=tile,
        stack=f"{_stack(robot)} KiB",
        steps=steps_of(real.value, real.literal(TUNING.damping), real.literal(TUNING.least_damping[real])),
    )


def _stack(robot: Robot) -> int:
    """KiB of the tile, of a step, and of the kernel that both call, which has as many rows as a step."""
    dof, tips = robot.dof, len(robot.tips)
    equations = 27
    if robot.is_tree:
        size = dof if tips_of(robot).by_joints else 6 * tips
        equations = size * (size + 1) // 2 + 2 * size
    own = (12 + 12 + 6 * dof + 6) * tips + 2 * dof + 6 * len(robot.tips)
    rows = own + (6 * dof * tips + 2 * dof + equations) + (dof + (12 + 6 * dof) * tips)
    return -(-rows * TILE_BYTES // 1024)
