"""The batch kernels: `puma560_batch.h` and `puma560_batch.c`, for the Python module and other hosts.

Poses are evaluated a tile at a time, joint by joint inside the tile, so that compilers turn the loop over the tile
into vector code; the last tile of a batch is filled up and goes through the same code.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from kinegen.emit.c.arguments import computed, given, tile_variables
from kinegen.emit.c.kernel import KernelContext, kernel_context
from kinegen.emit.c.statements import CPrinter
from kinegen.emit.environment import environment
from kinegen.emit.functions import uses
from kinegen.emit.kernels import Kernels
from kinegen.emit.reals import Real
from kinegen.emit.words import brief
from kinegen.ir.program import Constant, Operator, Program
from kinegen.naming import c_file, function, guard, prefix
from kinegen.outputs import Array

TILE_BYTES = 128
"""Bytes of one row of a tile."""

_STRIDES = ("pose", "joint")
"""What the strides of an input are called, from one configuration to the next and from one number to the next."""


@dataclass(frozen=True, slots=True)
class BatchInput:
    """One input of a batch kernel.

    Attributes:
        name: Its name.
        size: Numbers that are read for each configuration.
        finder: Name of the function that finds its tiles.
    """

    name: str
    size: int
    finder: str


@dataclass(frozen=True, slots=True)
class BatchResult:
    """One result of a batch kernel.

    Attributes:
        name: Its name.
        tile: Its rows of the result tile.
        rows: Computed numbers for each configuration.
        matrices: Matrices for each configuration; 0 where it holds none.
    """

    name: str
    tile: str
    rows: int
    matrices: int


@dataclass(frozen=True, slots=True)
class BatchFunction:
    """One batch kernel, printed.

    Attributes:
        name: C name.
        brief: What it computes.
        arguments: Its arguments.
        rows: Computed numbers for each configuration, of all results.
        inputs: What it reads.
        unused: Arguments for arrays without numbers.
        results: What it writes.
        has_matrices: Whether there are matrices among them.
        tile: Name of the function that evaluates a tile.
        tile_arguments: Its arguments.
        tile_values: What is passed for them.
        body: Statements for one configuration of a tile, and the assignments to the result tile.
        constants: Assignments of the rows of the result tile that hold the same number for every configuration.
    """

    name: str
    brief: str
    arguments: str
    rows: int
    inputs: tuple[BatchInput, ...]
    unused: tuple[str, ...]
    results: tuple[BatchResult, ...]
    has_matrices: bool
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
    has_matrices: bool
    has_others: bool
    selects: bool
    finders: tuple[tuple[str, int, int], ...]
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
    functions = tuple(_function(kernels, program, real) for program in kernels.programs)
    context = BatchContext(
        kernel=kernel,
        header=header,
        source=c_file(robot.name, "c", real, batch=True),
        guard=guard(header),
        title=f"Batches: {kernel.title[0].lower()}{kernel.title[1:]}",
        tile=TILE_BYTES // (8 if real is Real.DOUBLE else 4),
        has_matrices=any(result.matrices for function in functions for result in function.results),
        selects=uses(kernels.programs, Operator.SELECT_LT),
        has_others=any(not result.matrices for function in functions for result in function.results),
        finders=tuple(sorted({found for program in kernels.programs for found in _finders(program)})),
        functions=functions,
    )
    return {
        name: environment()
        .get_template(template)
        .render(b=context, k=kernel, prefix=kernel.prefix, qualifier="static inline")
        for name, template in ((context.header, "c/batch.h.jinja"), (context.source, "c/batch.c.jinja"))
    }


def batch_arguments(inputs: tuple[Array, ...], results: tuple[Array, ...], real: str, params: str) -> tuple[str, ...]:
    """The arguments of a batch kernel, each a declaration that ends in the name.

    Args:
        inputs: What it is given.
        results: What it gives.
        real: Number type.
        params: Type of the runtime parameters; empty where there are none.
    """
    arguments = ["size_t n"]
    for array in inputs:
        arguments += [f"const {real} *{array.name}", f"ptrdiff_t {array.name}_pose", f"ptrdiff_t {array.name}_joint"]
    if params:
        arguments.append(f"const {params} *params")
    for array in results:
        arguments += [f"{real} *{array.name}", f"ptrdiff_t {array.name}_stride"]
    return (*arguments, "int layout")


def _function(kernels: Kernels, program: Program, real: Real) -> BatchFunction:
    stem = prefix(kernels.robot.name, real)
    params = f"{stem}_params" if kernels.robot.runtime_parameters else ""
    printer = CPrinter(real, f"{stem}_sincos", tile_variables(program), stem, selects_bits=True)
    signature = program.signature
    inputs, passed = [], []
    for array in given(program):
        inputs += [f"const {real} *restrict {array.name}", *(f"ptrdiff_t {array.name}_{word}" for word in _STRIDES)]
        passed += [f"{array.name}_tile.{word}" for word in ("first", *_STRIDES)]
    if params:
        inputs.append(f"const {params} *params")
        passed.append("params")
    places = [f"t[{row}][i]" for row in range(len(program.outputs))]
    results = tuple(_results(program))
    constants = {row: operand for row, operand in enumerate(program.outputs) if isinstance(operand, Constant)}
    return BatchFunction(
        name=function(kernels.robot.name, program.quantity.function, real, batch=True),
        brief=brief(program.quantity),
        arguments=", ".join(batch_arguments(signature.inputs, signature.results, real, params)),
        rows=len(program.outputs),
        inputs=tuple(BatchInput(array.name, array.size, _finder(array)) for array in given(program)),
        unused=tuple(_unused(program, bool(params))),
        results=results,
        has_matrices=any(result.matrices for result in results),
        tile=f"{function(kernels.robot.name, program.quantity.function, real)}_tile",
        tile_arguments=", ".join([*inputs, f"{real} (*restrict t)[TILE]"]),
        tile_values=", ".join([*passed, "t"]),
        body=printer.lines(program, [None if row in constants else place for row, place in enumerate(places)]),
        constants=tuple(printer.assignment(places[row], operand) for row, operand in constants.items()),
    )


def _results(program: Program) -> Iterator[BatchResult]:
    first = 0
    for array in computed(program):
        tile = f"results + {first}" if first else "results"
        yield BatchResult(array.name, tile, array.size, array.blocks if array.is_pose else 0)
        first += array.size


def _finders(program: Program) -> Iterator[tuple[str, int, int]]:
    """The functions that find tiles: name, numbers that are read, numbers from one configuration to the next."""
    if computed(program):
        yield from ((_finder(array), array.size, array.stored) for array in given(program))


def _finder(array: Array) -> str:
    return f"find_tile_{array.size}" if array.size == array.stored else f"find_tile_{array.size}_of_{array.stored}"


def _unused(program: Program, has_parameters: bool) -> Iterator[str]:
    """The arguments that the function does not look at: those of empty arrays, or all where all results are."""
    idle = not computed(program)
    yield from ("n",) * idle
    for array in program.signature.inputs:
        if idle or not array.size:
            yield from (array.name, *(f"{array.name}_{word}" for word in _STRIDES))
    yield from ("params",) * (idle and has_parameters)
    for array in program.signature.results:
        if not array.size:
            yield from (array.name, f"{array.name}_stride")
    yield from ("layout",) * idle
