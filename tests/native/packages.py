"""Packages of real robots, as a build writes them, without the proof that a build ends with."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.batch import emit_batch
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.files import stamp_of
from kinegen.backends.python.formula import emit_formula
from kinegen.backends.python.package import emit_package
from kinegen.backends.scalar_types import ScalarType
from kinegen.model.outputs import USUAL, Quantity
from kinegen.runtime.extension import build_extension, interface_of, lay_out
from kinegen.runtime.flags import Flags
from kinegen.support.naming import EXTENSION
from tests.emit.emitted import kernels

REALS = tuple(ScalarType)
POSES = (Quantity.POSE,)
"""Where compiling takes long, poses alone."""

FLAGS = {
    "default": Flags(),
    "reproducible": Flags(contraction=False),
    "portable": Flags(portable=True),
    "portable, reproducible": Flags(portable=True, contraction=False),
}


@cache
def programs(name: str, quantities: tuple[Quantity, ...] = USUAL) -> RobotPrograms:
    """A robot of `robots/` and its programs of some quantities."""
    full = kernels(name)
    return replace(full, programs=tuple(program for program in full.programs if program.quantity in quantities))


def sources(robot: RobotPrograms) -> dict[str, str]:
    """Its C files, in both number types."""
    found: dict[str, str] = {}
    for real in REALS:
        found |= emit_kernel(robot, real) | emit_batch(robot, real)
    return found


def write_package(name: str, flags: Flags | None, folder: Path, cache_folder: Path) -> Path:
    """Write a package with its extension.

    Args:
        name: A robot of `robots/`.
        flags: How to compile; None for no extension. Portable packages compute poses alone.
        folder: Where the package folder goes.
        cache_folder: Cache of compiled extensions.

    Returns:
        The package folder.
    """
    package = folder / name
    robot = programs(name, POSES) if flags is not None and flags.portable else programs(name)
    texts = sources(robot)
    modules = emit_formula(robot) | emit_package(robot, REALS, stamp_of(texts))
    lay_out(package, modules)
    if flags is not None:
        extension = build_extension(interface_of(robot, REALS), texts, flags, cache_folder)
        extension.keep()
        (package / EXTENSION).write_bytes(extension.content)
    return package
