"""The batch kernels: `puma560_batch.h` and `puma560_batch.c`, for the Python module and other hosts.

Poses are evaluated a tile at a time, joint by joint inside the tile, so that compilers turn the loop over the tile
into vector code; the last tile of a batch is filled up and goes through the same code.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.arguments import batch_arguments, computed, given, strides, tile_variables
from kinegen.backends.c.kernel import KernelContext, kernel_context
from kinegen.backends.c.loops import Pieces, batched_sincos, pieces
from kinegen.backends.c.syntax import c_printer
from kinegen.backends.c.tiles import Direct, Lanes, ParamRows, direct_way, firsts, lanes_of, param_rows, part
from kinegen.backends.descriptions import brief
from kinegen.backends.inverse import inverse_of, nearest_signature
from kinegen.backends.routines import function_templates, needs_bits
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import rendered
from kinegen.ir.program import Constant, Program
from kinegen.model.outputs import Array
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import c_file, companion, function, guard, params_type, prefix

TILE_BYTES = 128
"""Bytes of one row of a tile: two vectors of the widest kind."""

SHORT_TILE_BYTES = 64
"""The same where so many doubles are stored for a configuration that memory would idle while a tile is evaluated, and
the processor while it is stored: large results leave the caches, and go twice as fast in short bursts. Sines and
cosines in arrays have such tiles, too, so that the stack of a long chain stays what it is with a call for each."""

MOST_ROWS = 24
"""With more numbers than these a tile of doubles is a short one."""

TURNED = 8
"""From so many numbers of a configuration on, turning them in registers takes less time than storing one by one."""


@dataclass(frozen=True, slots=True)
class BatchInput:
    """Holds one input of a batch kernel, and the function that finds its tiles.

    Numbers read for each configuration are fewer than those from one configuration to the next, where last rows are
    stored.
    """

    name: str
    size: int
    stored: int
    finder: str


@dataclass(frozen=True, slots=True)
class BatchResult:
    """Holds one result of a batch kernel.

    Attributes:
        tile: Its rows of the result tile.
        rows: Computed numbers for each configuration.
        matrices: Matrices for each configuration; 0 where it holds none.
    """

    name: str
    tile: str
    rows: int
    matrices: int
    is_truth: bool

    @property
    def is_turned(self) -> bool:
        """Returns whether its numbers are turned in registers before they are stored, other than matrices."""
        return self.rows >= TURNED and not (self.matrices or self.is_truth)


@dataclass(frozen=True, slots=True)
class Tile:
    """Holds the number of configurations that are evaluated at once, and the functions that bring them in and out.

    Attributes:
        name: Constant that counts them.
        suffix: What the names of its functions end in.
        finders: Functions that find inputs: name, numbers read, numbers from one configuration to the next, and the
            first of each four numbers that are turned at once.
    """

    name: str
    count: int
    suffix: str
    finders: tuple[tuple[str, int, int, tuple[int, ...]], ...]
    has_matrices: bool
    has_others: bool
    has_truths: bool
    takes_params: bool


@dataclass(frozen=True, slots=True)
class BatchFunction:
    """Holds one batch kernel, printed.

    Attributes:
        size: Constant that counts the configurations of its tiles.
        suffix: What the names of the functions end in that bring them in and out.
        rows: Computed numbers for each configuration, of all results.
        params: The rows of a tile for the parameters; None where it reads none.
        pairs: The loops that take sines and cosines before that over the configurations of a tile; mostly none.
        body: Statements for one configuration of a tile, and the assignments to the result tile.
        pieces: The same in several loops, where they are very many; else None.
        constants: Assignments of the rows of the result tile that hold the same number for every configuration.
        direct: How results in rows are written without the tile; None where they are not.
    """

    name: str
    size: str
    suffix: str
    brief: str
    arguments: str
    rows: int
    inputs: tuple[BatchInput, ...]
    unused: tuple[str, ...]
    results: tuple[BatchResult, ...]
    has_matrices: bool
    params: ParamRows | None
    tile: str
    tile_arguments: str
    tile_values: str
    pairs: tuple[str, ...]
    body: tuple[str, ...]
    pieces: Pieces | None
    constants: tuple[str, ...]
    direct: Direct | None


@dataclass(frozen=True, slots=True)
class BatchContext:
    """Holds what `c/batch.h.jinja` and `c/batch.c.jinja` are given, besides the context of the scalar kernels."""

    kernel: KernelContext
    header: str
    source: str
    guard: str
    title: str
    tiles: tuple[Tile, ...]
    reads: bool
    routines: tuple[str, ...]
    needs_bits: bool
    has_direct: bool
    lanes: tuple[Lanes, ...]
    loads_lanes: bool
    stores_matrices: bool
    turns_numbers: bool
    turned: int
    functions: tuple[BatchFunction, ...]
    nearest_arguments: str


def emit_batch(kernels: RobotPrograms, real: ScalarType, *, most_calls: int | None = None) -> dict[str, str]:
    """Prints the header and the source of the batch kernels.

    Up to `most_calls` sines and cosines of a kernel are calls of their own, more are taken in a loop; None is as many
    as elsewhere.
    """
    robot = kernels.robot
    kernel, inverse = kernel_context(kernels, real), inverse_of(kernels)
    # The nearest solution has a batch too, with arguments of its own.
    near: tuple[str, ...] = ()
    if kernel.nearest and inverse:
        near = batch_arguments(*nearest_signature(inverse[0].signature), real, kernel.nearest.params_type)
    header = c_file(robot.name, "h", real, batch=True)
    functions = tuple(_function(kernels, program, real, most_calls) for program in kernels.programs)
    tiles = tuple(_tiles(functions, real))
    # A file has functions that turn vectors only where a kernel calls them.
    loads = any(finder[-1] for each in tiles for finder in each.finders)
    matrices = any(each.has_matrices for each in tiles)
    turns = any(result.is_turned for each in functions for result in each.results)
    context = BatchContext(
        kernel=kernel,
        header=header,
        source=c_file(robot.name, "c", real, batch=True),
        guard=guard(header),
        title=f"Batches: {kernel.title[0].lower()}{kernel.title[1:]}",
        tiles=tiles,
        reads=any(each.inputs for each in functions),
        routines=function_templates(kernels.programs, real, batch=True),
        needs_bits=needs_bits(kernels.programs, real, batch=True),
        has_direct=any(each.direct for each in functions),
        lanes=lanes_of(real) if loads or matrices or turns else (),
        loads_lanes=loads,
        stores_matrices=matrices,
        turns_numbers=turns,
        turned=TURNED,
        functions=functions,
        nearest_arguments=", ".join(near),
    )
    templates = {context.header: "c/batch.h", context.source: "c/batch.c"}
    return rendered(templates, b=context, k=kernel, prefix=kernel.prefix, qualifier=f"{kernel.prefix.upper()}_INLINE")


def _tiles(functions: tuple[BatchFunction, ...], real: ScalarType) -> Iterator[Tile]:
    bytes_each = real.size
    for name, suffix, size in (("TILE", "", TILE_BYTES), ("SHORT_TILE", "_short", SHORT_TILE_BYTES)):
        own = [each for each in functions if each.size == name and each.results]
        if own:
            inputs = {(given.finder, given.size, given.stored) for each in own for given in each.inputs}
            results = [result for each in own for result in each.results]
            yield Tile(
                name=name,
                count=size // bytes_each,
                suffix=suffix,
                finders=tuple((*finder, firsts(finder[1])) for finder in sorted(inputs)),
                has_matrices=any(result.matrices for result in results),
                has_others=any(not (result.matrices or result.is_truth) for result in results),
                has_truths=any(result.is_truth for result in results),
                takes_params=any(each.params for each in own),
            )


def _function(kernels: RobotPrograms, program: Program, real: ScalarType, most_calls: int | None) -> BatchFunction:
    stem, signature = prefix(kernels.robot.name, real), program.signature
    params = params_type(kernels.robot.name, real) if kernels.robot.runtime_parameters else ""
    parts, name = part(program), function(kernels.robot.name, program.quantity.function, real)
    variables = (*tile_variables(program), *(f"p[{row}][i]" for row in range(len(parts.rows))))
    printer = c_printer(real, f"{stem}_sincos", variables, stem, selects_bits=True)
    # Numbers that are the same for every configuration do not go through the loop.
    constants = {row: operand for row, operand in enumerate(program.outputs) if isinstance(operand, Constant)}
    places = [None if row in constants else f"t[{row}][i]" for row in range(len(program.outputs))]
    # Sines and cosines in arrays take stack, so such tiles are short.
    pairs = batched_sincos(program, parts.rest, most_calls)
    short = pairs is not None or (real is ScalarType.DOUBLE and len(program.outputs) > MOST_ROWS)
    size, suffix = ("SHORT_TILE", "_short") if short else ("TILE", "")
    loops = () if pairs is None else pairs.tile_lines(printer, real.value, f"{stem}_sincos", size)
    lines = partial(printer.lines, parts.rest) if pairs is None else partial(pairs.tile_body, printer)
    body = lines(places)
    read = tuple(array for array in given(program) if program.reads(array))
    results = tuple(_results(program))
    # The function of a tile sees the arrays that it reads alone.
    arguments = [f"const {real} *restrict {array.name}, {strides(array, 'ptrdiff_t ')}" for array in read]
    arguments += [f"const {real} (*restrict p)[{size}]"] * bool(parts.rows)
    values = [f"{array.name}_tile.first, {array.name}_tile.pose, {array.name}_tile.joint" for array in read]
    values += ["given"] * bool(parts.rows)
    tile_result, tile_value = f"{real} (*restrict t)[{size}]", "t"
    # Results that lie in rows need no tile; the same statements then store with another stride.
    few = len(program.outputs) <= MOST_ROWS
    direct = (
        direct_way(printer, (*loops, *body), program, size, constants, reads_params=bool(parts.rows)) if few else None
    )
    if direct is not None:
        body = lines([place and f"t[{row} * t_row + i]" for row, place in enumerate(places)])
        tile_result, tile_value = f"{real} *restrict t, ptrdiff_t t_row", f"&t[0][0], {size}"
    return BatchFunction(
        name=companion(name, "batch"),
        size=size,
        suffix=suffix,
        brief=brief(program.signature),
        arguments=", ".join(batch_arguments(signature.inputs, signature.results, real, params)),
        rows=len(program.outputs),
        inputs=tuple(BatchInput(array.name, array.size, array.stored, _finder(array) + suffix) for array in read),
        unused=tuple(_unused(program, read, bool(params) and not parts.rows)),
        results=results,
        has_matrices=any(result.matrices for result in results),
        params=param_rows(printer, parts, name, suffix) if parts.rows else None,
        tile=companion(name, "tile"),
        tile_arguments=", ".join([*arguments, tile_result]),
        tile_values=", ".join([*values, tile_value]),
        pairs=loops,
        body=body,
        pieces=pieces(printer, parts.rest, places, str(real)) if program.signature.branches else None,
        constants=tuple(printer.assignment(f"t[{row}][i]", operand) for row, operand in constants.items()),
        direct=direct,
    )


def _finder(array: Array) -> str:
    return f"find_tile_{array.size}" if array.size == array.stored else f"find_tile_{array.size}_of_{array.stored}"


def _results(program: Program) -> Iterator[BatchResult]:
    first = 0
    for array in computed(program):
        tile = f"results + {first}" if first else "results"
        yield BatchResult(array.name, tile, array.size, array.blocks if array.is_pose else 0, array.is_truth)
        first += array.size


def _unused(program: Program, read: tuple[Array, ...], spares_params: bool) -> Iterator[str]:
    """Yields the arguments that a function does not look at: of empty arrays, and of what no result depends on."""
    for array in program.signature.inputs:
        if array not in read:
            yield from (array.name, *strides(array).split(", "))
    # Rows of parameters are read before a tile is evaluated.
    yield from ("params", "params_stride") * spares_params
    for array in program.signature.results:
        if not array.size:
            yield from (array.name, f"{array.name}_stride")
    if not computed(program):
        yield from ("n", "layout")
