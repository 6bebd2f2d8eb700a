"""The robots whose kernels run on boards, and what a machine must have for that."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

import pytest

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import lower_file
from kinegen.model.outputs import USUAL, Quantity, parse_quantity
from kinegen.verify.boards.programs import write_kernels
from kinegen.verify.boards.targets import SOURCES, STRICT, Target, missing

ROBOTS = Path(__file__).parents[2] / "robots"
NAMES = ("puma560", "ur5", "scara", "panda", "thumb")


OTHERS = tuple(map(parse_quantity, ("fk_jacobian", "twist", "quaternion_wxyz")))
"""What one of them computes besides: two results; two inputs; a square root, a quotient and selections."""


@cache
def kernels(name: str, *quantities: Quantity) -> RobotPrograms:
    """A robot of ours with all its programs, or with some."""
    return lower_file(ROBOTS / f"{name}.yaml", quantities or USUAL)


def checked(name: str) -> RobotPrograms:
    """A robot of ours with the programs whose bits are compared."""
    return kernels(name, *USUAL, *(OTHERS if name == NAMES[0] else ()))


def require(target: Target) -> None:
    """Skip, and say what is missing, where a target's programs cannot be built and run."""
    for command, packages in missing(target).items():
        pytest.skip(f"needs {command} (apt install {' '.join(packages)})")


def run_on_host(folder: Path, real: ScalarType, compiler: str, level: str) -> list[str]:
    """What the program that shows bits prints on this machine."""
    if shutil.which(compiler) is None:
        pytest.skip(f"needs {compiler} (apt install {compiler})")
    return run_files(folder, write_kernels(folder, [checked(name) for name in NAMES], real), real, compiler, level)


def run_files(folder: Path, files: Sequence[Path], real: ScalarType, compiler: str, level: str) -> list[str]:
    """The same for kernels that are written already."""
    own = (SOURCES / "bits.c", SOURCES / "host.c")
    program = folder / "bits"
    command = [compiler, *STRICT, level, f"-DREAL={real}", "-I", folder, "-I", SOURCES, *files, *own, "-o", program]
    subprocess.run(command, check=True)
    return subprocess.run([program], capture_output=True, text=True, check=True).stdout.splitlines()


@pytest.fixture(scope="session")
def host_lines(tmp_path_factory: pytest.TempPathFactory) -> Callable[[ScalarType], list[str]]:
    """What the program that shows bits prints on this machine, compiled with gcc -O2."""

    @cache
    def lines(real: ScalarType) -> list[str]:
        return run_on_host(tmp_path_factory.mktemp("host"), real, "gcc", "-O2")

    return lines
