"""The batch kernels: `puma560_batch.h` and `puma560_batch.c`, for the Python module and other hosts.

Poses are evaluated a tile at a time, joint by joint inside the tile, so that compilers turn the loop over the tile
into vector code; the last tile of a batch is filled up and goes through the same code.
"""

from __future__ import annotations

from dataclasses import dataclass

from kinegen.emit.c.kernel import KernelContext, kernel_context
from kinegen.emit.c.statements import CPrinter
from kinegen.emit.environment import environment
from kinegen.emit.kernels import QUANTITY_TEXT, Kernels
from kinegen.emit.reals import Real
from kinegen.ir.program import Constant, Program
from kinegen.naming import c_file, function, guard, prefix

TILE_BYTES = 128
"""Bytes of one row of a tile."""


@dataclass(frozen=True, slots=True)
class BatchFunction:
    """One batch kernel, printed.

    Attributes:
        name: C name.
        brief: What it computes.
        rows: Computed numbers for each configuration.
        frames: Frames for each configuration.
        is_pose: Whether the row-major result has the constant last rows.
        tile: Name of the function that evaluates a tile.
        tile_arguments: Its arguments.
        tile_values: What is passed for them.
        body: Statements for one configuration of a tile, and the assignments to the result tile.
        constants: Assignments of the rows of the result tile that hold the same number for every configuration.
    """

    name: str
    brief: str
    rows: int
    frames: int
    is_pose: bool
    tile: str
    tile_arguments: str
    tile_values: str
    body: tuple[str, ...]
    constants: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class BatchContext:
    """What the templates `c/batch.h.jinja` and `c/batch.c.jinja` are given, besides that of the scalar kernels."""

    kernel: KernelContext
    header: str
    source: str
    guard: str
    title: str
    tile: int
    has_poses: bool
    has_points: bool
    functions: tuple[BatchFunction, ...]


def emit_batch(kernels: Kernels, real: Real) -> dict[str, str]:
    """Print the batch kernels of one number type.

    Args:
        kernels: The robot and its programs.
        real: The number type.

    Returns:
        The header and the source, by file name.
    """
    robot = kernels.robot
    kernel = kernel_context(kernels, real)
    header = c_file(robot.name, "h", real, batch=True)
    context = BatchContext(
        kernel=kernel,
        header=header,
        source=c_file(robot.name, "c", real, batch=True),
        guard=guard(header),
        title=f"Batches: {kernel.title[0].lower()}{kernel.title[1:]}",
        tile=TILE_BYTES // (8 if real is Real.DOUBLE else 4),
        has_poses=any(program.quantity.is_pose for program in kernels.programs),
        has_points=any(not program.quantity.is_pose for program in kernels.programs),
        functions=tuple(_function(kernels, program, real) for program in kernels.programs),
    )
    return {
        name: environment()
        .get_template(template)
        .render(b=context, k=kernel, prefix=kernel.prefix, qualifier="static inline")
        for name, template in ((context.header, "c/batch.h.jinja"), (context.source, "c/batch.c.jinja"))
    }


def _function(kernels: Kernels, program: Program, real: Real) -> BatchFunction:
    robot = kernels.robot
    stem = prefix(robot.name, real)
    printer = CPrinter(real, f"{stem}_sincos", variable="q[i * pose + {} * joint]")
    inputs = [f"const {real} *restrict q", "ptrdiff_t pose", "ptrdiff_t joint"] if robot.dof else []
    passed = ["inputs.q", "inputs.pose", "inputs.joint"] if robot.dof else []
    if robot.runtime_parameters:
        inputs.append(f"const {stem}_params *params")
        passed.append("params")
    places = [f"t[{row}][i]" for row in range(len(program.outputs))]
    constants = {row: operand for row, operand in enumerate(program.outputs) if isinstance(operand, Constant)}
    return BatchFunction(
        name=function(robot.name, program.quantity.function, real, batch=True),
        brief=QUANTITY_TEXT[program.quantity],
        rows=len(program.outputs),
        frames=len(program.frames),
        is_pose=program.quantity.is_pose,
        tile=f"{function(robot.name, program.quantity.function, real)}_tile",
        tile_arguments=", ".join([*inputs, f"{real} (*restrict t)[TILE]"]),
        tile_values=", ".join([*passed, "t"]),
        body=printer.lines(program, [None if row in constants else place for row, place in enumerate(places)]),
        constants=tuple(printer.assignment(places[row], operand) for row, operand in constants.items()),
    )
