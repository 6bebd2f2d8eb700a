"""C programs around emitted kernels: one that shows their bits, one that shows what a call costs."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

from kinegen.boards.targets import Target
from kinegen.boards.toolchain import SOURCES, compile_object, link
from kinegen.emit.c.arguments import flat_call, given
from kinegen.emit.c.kernel import emit_kernel, kernel_context
from kinegen.emit.environment import environment
from kinegen.emit.kernels import Kernels
from kinegen.emit.reals import Real
from kinegen.emit.sincos import SINCOS
from kinegen.ir.program import Program

NOTHING = "board_nothing"
"""The function that costs nothing, with the type of the kernel that is measured."""


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
    """

    headers: tuple[str, ...]
    kernels: tuple[TableEntry, ...]
    joints: int
    numbers: int


def write_kernels(folder: Path, robots: Sequence[Kernels], real: Real) -> tuple[Path, ...]:
    """Write the C of some robots and the table of their kernels.

    Args:
        folder: An existing folder.
        robots: The robots.
        real: The number type.

    Returns:
        The C files.
    """
    entries = [entry for kernels in robots for entry in _entries(kernels, real)]
    return _write(folder, robots, real, entries)


def write_measured(folder: Path, kernels: Kernels, real: Real) -> tuple[Path, ...]:
    """Write the C of a single kernel, and the table with it and the function that does nothing.

    Args:
        folder: An existing folder.
        kernels: A robot with one program.
        real: The number type.

    Returns:
        The C files, that of the kernel first.
    """
    (entry,) = _entries(kernels, real)
    (function,) = kernel_context(kernels, real).functions
    declaration = function.prototype.replace(entry.name, NOTHING, 1)
    nothing = replace(entry, name=NOTHING, declaration=declaration, call=entry.call.replace(entry.name, NOTHING, 1))
    files = _write(folder, (kernels,), real, [entry, nothing])
    header = kernel_context(kernels, real).header
    (folder / "nothing.c").write_text(f'#include "{header}"\n\n{declaration};\n\n{declaration}\n{{\n}}\n', "utf-8")
    return (*files, folder / "nothing.c")


def build_program(
    target: Target, folder: Path, files: Sequence[Path], main: Path, real: Real, flags: Sequence[str]
) -> Path:
    """Compile and link a program for a board.

    Args:
        target: The processor.
        folder: Where the C files are, and objects and program are written.
        files: The C files.
        main: The file with the main function.
        real: The number type.
        flags: Optimisation.

    Returns:
        The program.
    """
    own = (main, *(SOURCES / name for name in target.toolchain.sources))
    objects = [compile_object(target, folder, file, (*flags, f"-DREAL={real}")) for file in (*files, *own)]
    return link(target, folder, objects, f"{main.stem}.elf")


def _write(folder: Path, robots: Sequence[Kernels], real: Real, entries: Sequence[TableEntry]) -> tuple[Path, ...]:
    contexts = [kernel_context(kernels, real) for kernels in robots]
    texts = {name: text for kernels in robots for name, text in emit_kernel(kernels, real).items()}
    table = Table(
        headers=tuple(context.header for context in contexts),
        kernels=tuple(entries),
        joints=max([1, *(entry.joints for entry in entries)]),
        numbers=max(entry.numbers for entry in entries),
    )
    texts["kernels.c"] = environment().get_template("boards/kernels.c.jinja").render(t=table)
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8", newline="\n")
    return (*(folder / context.source for context in contexts), folder / "kernels.c")


def _entries(kernels: Kernels, real: Real) -> list[TableEntry]:
    context = kernel_context(kernels, real)
    return [
        _entry(kernels, program, function.name, real)
        for program, function in zip(kernels.programs, context.functions, strict=True)
    ]


def _entry(kernels: Kernels, program: Program, name: str, real: Real) -> TableEntry:
    return TableEntry(
        name=name,
        declaration="",
        call=f"{name}({flat_call(kernels, program, real, 'q', 'result')})",
        joints=sum(array.stored for array in given(program)),
        numbers=sum(array.stored * array.blocks for array in program.signature.results),
        beyond=real.literal(Fraction(beyond_range(real))),
    )


def beyond_range(real: Real) -> float:
    """The smallest angle for which the emitted pair promises NaN."""
    limit = SINCOS[real].limit
    if real is Real.DOUBLE:
        return math.nextafter(limit, math.inf)
    (bits,) = struct.unpack("<I", struct.pack("<f", limit))
    (beyond,) = struct.unpack("<f", struct.pack("<I", bits + 1))
    return float(beyond)
