"""What the emitters print for a few robots, once for all tests of a process, and how the C is compiled."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cache, lru_cache
from pathlib import Path

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.test_vectors import Vectors
from kinegen.backends.files import emit_files
from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.dispatch import derive
from kinegen.errors import KinegenError
from kinegen.io.load import load
from kinegen.ir.lower import lower, runtime_defaults
from kinegen.model.outputs import NUMERIC_INVERSE, USUAL, Kind, Quantity, every_quantity, with_needed
from kinegen.model.robot import Robot
from kinegen.support.naming import prefix
from kinegen.verify.vectors import compute_vectors

ROOT = Path(__file__).resolve().parents[2]
ROBOTS = ROOT / "robots"

NAMES = ("puma560", "ur5", "hand", "calibrated_2r", "blocks", "cartesian", "screw")
"""Arms; a tree with five tips; runtime parameters; no joint at all; no angle at all; an angle that is a length too."""

SMALL = ("puma560", "calibrated_2r", "blocks", "cartesian")
"""A few of these where compiling takes long: every kind of interface but the tree."""

COMPILERS = tuple(name for name in ("gcc", "clang") if shutil.which(name))

STRICT = {
    "gcc": "-std=c99 -Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wfloat-conversion -Wstrict-prototypes "
    "-Wmissing-prototypes -Wshadow -Wundef -Wcast-qual -Wvla -ffreestanding -Werror",
    # clang lists the declarations that C90 did not allow.
    "clang": "-std=c99 -Weverything -Wno-declaration-after-statement -ffreestanding -Werror",
}
"""The flags under which the C has to be silent."""

STRICT_AVR = f"{STRICT['gcc']} -mmcu=atmega2560 -Wsign-conversion -Wsign-compare -Os"
"""Those of avr-gcc, whose `int` has 16 bits."""


def robot(name: str) -> Robot:
    """A robot of `robots/`."""
    return load(ROBOTS / f"{name}.yaml")


@cache
def kernels(name: str, quantities: tuple[Quantity, ...] = USUAL) -> RobotPrograms:
    """Its programs, of the usual quantities or others."""
    arm = robot(name)
    programs = tuple(lower(derive(arm, quantity)) for quantity in with_needed(quantities))
    return RobotPrograms(arm, programs, runtime_defaults(arm), NUMERIC_INVERSE in quantities)


@lru_cache(maxsize=2)
def everything(name: str) -> RobotPrograms:
    """A robot with all quantities that it has and other languages print."""
    arm, programs = robot(name), []
    for quantity in every_quantity():
        if quantity.kind not in (Kind.NUMERIC_INVERSE, Kind.PARAMETER_JACOBIAN):
            with suppress(KinegenError):
                programs.append(lower(derive(arm, quantity)))
    return RobotPrograms(arm, tuple(programs), runtime_defaults(arm))


@cache
def vectors(name: str, quantities: tuple[Quantity, ...] = USUAL) -> Vectors:
    """Its test vectors."""
    return compute_vectors(kernels(name, quantities))


@cache
def texts(name: str, quantities: tuple[Quantity, ...] = USUAL) -> Mapping[str, str]:
    """Every text file of its package, by name."""
    return emit_files(kernels(name, quantities), tuple(ScalarType), vectors(name, quantities)).files


def c_kernels(name: str, real: ScalarType) -> tuple[str, str, str]:
    """The C files of one number type: scalar kernels, batch kernels, self-test."""
    stem = prefix(name, real)
    return f"{stem}.c", f"{stem}_batch.c", f"{stem}_selftest.c"


def tile(name: str, real: ScalarType) -> int:
    """How many configurations a batch kernel evaluates at once."""
    found = re.search(r"TILE = (\d+)", texts(name)[c_kernels(name, real)[1]])

    assert found
    return int(found.group(1))


def run(command: Sequence[str | Path], folder: Path | None = None) -> str:
    """Run a command that must succeed and say nothing on standard error."""
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)

    assert (done.returncode, done.stderr) == (0, ""), f"{command}\n{done.stdout}{done.stderr}"
    return done.stdout


def code(text: str) -> str:
    """C without its comments and the texts of its `#error` lines."""
    return re.sub(r"/\*.*?\*/|(?<=#error).*?$", "", text, flags=re.DOTALL | re.MULTILINE)
