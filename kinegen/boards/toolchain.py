"""Commands of the cross toolchains: found, or named with the packages that bring them."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from kinegen.boards.targets import STRICT, Target
from kinegen.errors import MissingToolError
from kinegen.native.compiler import Compiler

SOURCES = Path(__file__).resolve().parent / "sources"
"""The C that comes with the boards."""


def missing(target: Target) -> dict[str, tuple[str, ...]]:
    """The commands that a target needs and this machine lacks, each with its Debian packages."""
    return {command: packages for command, packages in target.packages().items() if shutil.which(command) is None}


def require(command: str, packages: Sequence[str]) -> None:
    """Check that a command is there.

    Raises:
        MissingToolError: If it is not; the message names the packages to install.
    """
    if shutil.which(command) is None:
        raise MissingToolError(f"there is no {command}: install it, on Debian with `apt install {' '.join(packages)}`")


def find_cross_compiler(target: Target) -> Compiler:
    """The compiler of a target.

    Raises:
        MissingToolError: If it is not installed; the message names the packages to install.
    """
    name = f"{target.toolchain.prefix}gcc"
    require(name, target.toolchain.packages)
    return _compiler(name)


@cache
def _compiler(name: str) -> Compiler:
    return Compiler((name,), read_tool((name, "-dumpfullversion", "-dumpversion")).split()[0])


def compile_object(target: Target, folder: Path, source: Path, flags: Sequence[str]) -> Path:
    """Compile one file, each function in a section of its own.

    Args:
        target: The processor.
        folder: Where headers are found, and the object and its stack usage are written.
        source: The C file.
        flags: Optimisation, and whatever else differs between files.

    Returns:
        The object file; `NAME.su` beside it holds the stack usage.

    Raises:
        CompileError: If the compiler is missing or refuses the file.
    """
    made = folder / f"{source.stem}.o"
    fixed = (*target.flags, *STRICT, "-ffreestanding", "-ffunction-sections", "-fdata-sections", "-fstack-usage")
    paths = ("-I", str(folder), "-I", str(SOURCES), "-c", str(source), "-o", str(made))
    find_cross_compiler(target).run(folder, (*fixed, *flags, *paths), source.name)
    return made


def link(target: Target, folder: Path, objects: Sequence[Path], name: str, *, entry: str | None = None) -> Path:
    """Link objects, without what nothing refers to.

    Args:
        target: The processor.
        folder: Where the program is written.
        objects: Object files.
        name: Name of the program.
        entry: A function that is linked by itself, with what it needs; without it, a whole program for the board.

    Returns:
        The program.

    Raises:
        CompileError: If the linker refuses.
    """
    made = folder / name
    toolchain = target.toolchain
    start = ["-nostdlib"] if toolchain.layout else ["-nostartfiles"] if entry else []
    layout = ["-T", str(SOURCES / toolchain.layout)] if toolchain.layout else []
    memory = [f"-Wl,--defsym={symbol}={value:#x}" for symbol, value in target.memory.items()]
    only = [f"-Wl,-e,{entry}", f"-Wl,-u,{entry}"] if entry else []
    files = [*(str(each) for each in objects), *toolchain.libraries, "-o", str(made)]
    arguments = (*target.flags, *start, *memory, *layout, "-Wl,--gc-sections", *only, *files)
    find_cross_compiler(target).run(folder, arguments, name)
    return made


def read_tool(command: Sequence[str]) -> str:
    """What a command prints that came with a compiler and has no reason to fail."""
    return subprocess.run(command, capture_output=True, text=True, errors="replace", check=True).stdout
