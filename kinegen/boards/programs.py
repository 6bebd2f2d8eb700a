"""C programs around emitted kernels: one that shows their bits, one that shows what a call costs."""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

from kinegen.boards.examples import reachable_poses
from kinegen.boards.targets import Target
from kinegen.boards.toolchain import SOURCES, compile_object, link
from kinegen.emit.c.arguments import flat_call, given
from kinegen.emit.c.kernel import KernelContext, emit_kernel, kernel_context
from kinegen.emit.c.nearest import nearest_of
from kinegen.emit.c.numeric_inverse import emit_numeric_inverse, solver_context
from kinegen.emit.environment import environment
from kinegen.emit.fixed.kernel import FixedContext, emit_fixed, fixed_context
from kinegen.emit.fixed.kernels import fixed_kernels
from kinegen.emit.inverse import solved_chain
from kinegen.emit.kernels import Kernels
from kinegen.emit.reals import Real
from kinegen.emit.sincos import SINCOS
from kinegen.errors import KinegenError
from kinegen.naming import Q30, default_params, function
from kinegen.outputs import POSE_AND_JACOBIAN, Kind

NOTHING = "board_nothing"
"""The function that costs nothing, with the type of the kernel that is measured."""


@dataclass(frozen=True, slots=True)
class Printed:
    """The C of a robot's kernels in one number type.

    Attributes:
        files: Text by file name.
        header: Which of them declares the kernels.
        source: Which of them defines them.
        names: The kernels, in the order of the programs.
        prototypes: Their declarations.
        beyond: The smallest angle out of range, as a C literal; where every angle is in range, any number.
    """

    files: Mapping[str, str]
    header: str
    source: str
    names: tuple[str, ...]
    prototypes: tuple[str, ...]
    beyond: str


@dataclass(frozen=True, slots=True)
class TableEntry:
    """One kernel in the table of a program.

    Attributes:
        name: C name.
        declaration: Where no header declares it.
        call: The call, its arguments taken from arrays.
        joints: Entries of the joint vector.
        numbers: Entries of the result.
        beyond: The smallest angle out of range, as a C literal.
    """

    name: str
    declaration: str
    call: str
    joints: int
    numbers: int
    beyond: str


@dataclass(frozen=True, slots=True)
class Table:
    """What the template `boards/kernels.c.jinja` is given.

    Attributes:
        headers: The headers of the kernels.
        kernels: The kernels.
        joints: Room for any joint vector.
        numbers: Room for any result.
        examples: Inputs of the first kernel where random numbers will not do, as C literals.
    """

    headers: tuple[str, ...]
    kernels: tuple[TableEntry, ...]
    joints: int
    numbers: int
    examples: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Measured:
    """A program around one function that is measured.

    Attributes:
        files: Its C files.
        own: How many of these, from the first one on, a call of the function needs.
        name: The function.
        repeats: How often it is called between two readings of the clock.
    """

    files: tuple[Path, ...]
    own: int
    name: str
    repeats: int


def write_kernels(folder: Path, robots: Sequence[Kernels], real: str) -> tuple[Path, ...]:
    """Write the C of some robots and the table of their kernels.

    Args:
        folder: An existing folder.
        robots: The robots.
        real: The number type, a `Real` or `Q30`.

    Returns:
        The C files.
    """
    prints = [printed(kernels, real) for kernels in robots]
    entries = [entry for kernels, each in zip(robots, prints, strict=True) for entry in _entries(kernels, each, real)]
    return _write(folder, prints, entries)


def write_measured(folder: Path, kernels: Kernels, real: str) -> Measured:
    """Write the C of a single kernel, and the table with it and the function that does nothing.

    Args:
        folder: An existing folder.
        kernels: A robot with one program.
        real: The number type, a `Real` or `Q30`.

    Returns:
        The program.
    """
    kernel = printed(kernels, real)
    (entry,), (prototype,), (program,) = _entries(kernels, kernel, real), kernel.prototypes, kernels.programs
    is_inverse = program.quantity.kind is Kind.INVERSE
    examples = _examples(reachable_poses(solved_chain(kernels), starts=False, given=True), real) if is_inverse else ()
    files = _write(folder, [kernel], _with_nothing(folder, entry, prototype, kernel.header), examples)
    return Measured((*files, folder / "nothing.c"), 1, entry.name, 8)


def write_nearest(folder: Path, kernels: Kernels, real: Real, rows: Sequence[Sequence[float]] = ()) -> Measured:
    """The same for the choice of the solution nearest to a joint vector, which is near one of them.

    Args:
        folder: An existing folder.
        kernels: A robot with one program, its inverse.
        real: The number type.
        rows: Targets and joint vectors; reachable ones if there are none.

    Returns:
        The program.
    """
    kernel, nearest, dof = printed(kernels, real), nearest_of(kernels, real), kernels.robot.dof
    if nearest is None:
        raise KinegenError(f"{kernels.robot.name} has no inverse to choose from")
    parameters = f"&{default_params(kernels.robot.name, real)}, " if nearest.params_type else ""
    given = f"q + 16, q + {16 + nearest.given}" if nearest.given else "q + 16"
    call = f"(void){nearest.name}(q, {given}, {parameters}result)"
    numbers = 16 + nearest.given + dof
    entry = TableEntry(nearest.name, "", call, numbers, dof, kernel.beyond)
    examples = _examples(rows or reachable_poses(solved_chain(kernels), starts=True, given=True), real)
    files = _write(folder, [kernel], _with_nothing(folder, entry, nearest.prototype, kernel.header), examples)
    return Measured((*files, folder / "nothing.c"), 1, nearest.name, 8)


def write_search(folder: Path, kernels: Kernels, real: Real, rows: Sequence[Sequence[float]] = ()) -> Measured:
    """The same for the numeric inverse, which starts close to a solution.

    Args:
        folder: An existing folder.
        kernels: A robot with the numeric inverse.
        real: The number type.
        rows: Targets and starts; reachable ones, and starts close to a solution, if there are none.

    Returns:
        The program.
    """
    solver = solver_context(kernels, real)
    needed = tuple(program for program in kernels.programs if program.quantity == POSE_AND_JACOBIAN)
    kernel = printed(replace(kernels, programs=needed), real)
    kernel = replace(kernel, files={**kernel.files, **emit_numeric_inverse(kernels, real)}, header=solver.header)
    parameters = f"&{solver.prefix}_default_params, " if solver.parameters else ""
    dof, numbers = kernels.robot.dof, 16 * len(kernels.robot.tips)
    arguments = f"q, q + {numbers}, {parameters}&{solver.prefix}_default_search, result, &found"
    call = f"static {solver.prefix}_found found; (void){solver.function}({arguments})"
    entry = TableEntry(solver.function, "", call, numbers + dof, dof, kernel.beyond)
    examples = _examples(rows or reachable_poses(kernels.robot, starts=True), real)
    files = _write(folder, [kernel], _with_nothing(folder, entry, solver.prototype, solver.header), examples)
    return Measured((files[0], folder / solver.source, *files[1:], folder / "nothing.c"), 2, solver.function, 1)


def _with_nothing(folder: Path, entry: TableEntry, prototype: str, header: str) -> list[TableEntry]:
    """An entry, and one of the same type that does nothing, whose file is written."""
    declaration = prototype.replace(entry.name, NOTHING, 1)
    result = "    return 0;\n" if declaration.startswith("int ") else ""
    body = f'#include "{header}"\n\n{declaration};\n\n{declaration}\n{{\n{result}}}\n'
    (folder / "nothing.c").write_text(body, "utf-8")
    nothing = replace(entry, name=NOTHING, declaration=declaration, call=entry.call.replace(entry.name, NOTHING, 1))
    return [entry, nothing]


def _examples(rows: Sequence[Sequence[float]], real: str) -> tuple[str, ...]:
    return tuple(", ".join(Real(real).literal(Fraction(number)) for number in row) for row in rows)


def compile_board(target: Target, folder: Path, main: Path, real: str, flags: Sequence[str]) -> tuple[Path, ...]:
    """Compile what a program for a board has besides its kernels.

    Args:
        target: The processor.
        folder: Where the objects are written.
        main: The file with the main function.
        real: The number type, a `Real` or `Q30`.
        flags: Optimisation.

    Returns:
        The objects, which suit every program with these flags.
    """
    files = (main, *(SOURCES / name for name in target.toolchain.sources))
    return compile_files(target, folder, files, real, flags)


def compile_files(
    target: Target, folder: Path, files: Sequence[Path], real: str, flags: Sequence[str]
) -> tuple[Path, ...]:
    """Compile C files that know the number type as REAL.

    Args:
        target: The processor.
        folder: Where headers are found and the objects are written.
        files: The C files.
        real: The number type, a `Real` or `Q30`.
        flags: Optimisation.

    Returns:
        The objects.
    """
    return tuple(compile_object(target, folder, file, (*flags, *_numbers(real))) for file in files)


def build_program(
    target: Target,
    folder: Path,
    files: Sequence[Path],
    main: Path,
    real: str,
    flags: Sequence[str],
    board: Sequence[Path] | None = None,
) -> Path:
    """Compile and link a program for a board.

    Args:
        target: The processor.
        folder: Where the C files are, and objects and program are written.
        files: The C files.
        main: The file with the main function.
        real: The number type, a `Real` or `Q30`.
        flags: Optimisation.
        board: What `compile_board` gave for the same main file and flags; it is compiled here if left out.

    Returns:
        The program.
    """
    objects = compile_files(target, folder, files, real, flags)
    board = compile_board(target, folder, main, real, flags) if board is None else board
    return link(target, folder, [*objects, *board], f"{main.stem}.elf")


def _numbers(real: str) -> tuple[str, ...]:
    return ("-DREAL=int32_t", "-DINTEGERS") if real == Q30 else (f"-DREAL={real}",)


def printed(kernels: Kernels, real: str) -> Printed:
    """The C of a robot's kernels.

    Args:
        kernels: The robot and its programs.
        real: The number type, a `Real` or `Q30`.

    Returns:
        The files, and what is in them.

    Raises:
        KinegenError: If integers cannot evaluate a program; the message says why.
    """
    names = tuple(function(kernels.robot.name, each.quantity.function, real) for each in kernels.programs)
    context: KernelContext | FixedContext
    if real == Q30:
        fixed = fixed_kernels(kernels)
        context, files, beyond = fixed_context(fixed), emit_fixed(fixed), "0"
    else:
        number = Real(real)
        context, files = kernel_context(kernels, number), emit_kernel(kernels, number)
        beyond = number.literal(Fraction(beyond_range(number)))
    prototypes = tuple(each.prototype for each in context.functions)
    return Printed(files, context.header, context.source, names, prototypes, beyond)


def _write(
    folder: Path, prints: Sequence[Printed], entries: Sequence[TableEntry], examples: tuple[str, ...] = ()
) -> tuple[Path, ...]:
    texts = {name: text for each in prints for name, text in each.files.items()}
    table = Table(
        headers=tuple(each.header for each in prints),
        kernels=tuple(entries),
        joints=max([1, *(entry.joints for entry in entries)]),
        numbers=max(entry.numbers for entry in entries),
        examples=examples,
    )
    texts["kernels.c"] = environment().get_template("boards/kernels.c.jinja").render(t=table)
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8", newline="\n")
    return (*(folder / each.source for each in prints), folder / "kernels.c")


def _entries(kernels: Kernels, each: Printed, real: str) -> list[TableEntry]:
    return [
        TableEntry(
            name=name,
            declaration="",
            call=flat_call(kernels, program, real, name, ("q", "result")),
            joints=sum(array.stored for array in given(program)),
            numbers=sum(array.stored * array.blocks for array in program.signature.results),
            beyond=each.beyond,
        )
        for program, name in zip(kernels.programs, each.names, strict=True)
    ]


def beyond_range(real: Real) -> float:
    """The smallest angle for which the emitted pair promises NaN."""
    limit = SINCOS[real].limit
    if real is Real.DOUBLE:
        return math.nextafter(limit, math.inf)
    (bits,) = struct.unpack("<I", struct.pack("<f", limit))
    (beyond,) = struct.unpack("<f", struct.pack("<I", bits + 1))
    return float(beyond)
