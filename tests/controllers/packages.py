"""Packages for controllers on disk, arms that are in no file of `robots/`, and C compiled for this machine."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.controllers.controller import Controller
from kinegen.backends.controllers.kernel_calls import needed
from kinegen.backends.controllers.machine import Machine, machine_of
from kinegen.backends.controllers.project import emit_controller
from kinegen.backends.files import emit_files
from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.dispatch import derive
from kinegen.io.load import load
from kinegen.ir.lower import lower, runtime_defaults
from kinegen.support.files.write import write_files
from kinegen.verify.vectors import compute_vectors
from tests.controllers.paths import joints_of
from tests.emit.emitted import ROOT

HERE = Path(__file__).resolve().parent
ARMS = HERE / "robots"

DEBIAN = {"halrun": "linuxcnc-uspace", "halcompile": "linuxcnc-uspace-dev", "g++": "g++", "gcc": "gcc", "make": "make"}
"""What to install for a program, on Debian."""

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror")


def file_of(name: str) -> Path:
    """The file of a robot, of these tests or of `robots/`."""
    here = ARMS / f"{name}.yaml"
    return here if here.exists() else ROOT / "robots" / f"{name}.yaml"


@cache
def kernels(name: str, controller: Controller = Controller.GRBLHAL) -> RobotPrograms:
    """A robot with the programs that a controller calls."""
    arm = load(file_of(name))
    return RobotPrograms(
        arm, tuple(lower(derive(arm, each)) for each in needed(arm, controller)), runtime_defaults(arm)
    )


@cache
def machine(name: str, controller: Controller) -> Machine:
    """A robot as a controller sees it."""
    return machine_of(kernels(name), controller)


@cache
def project(name: str, controller: Controller) -> Mapping[str, str]:
    """The files of a package."""
    made = kernels(name, controller)
    files = emit_files(made, controller.reals, compute_vectors(made)).files
    return emit_controller(made, files, controller)


def write_package(place: Path, name: str, controller: Controller) -> Path:
    """Write a package into a folder that bears the robot's name, and return that folder."""
    write_files(place / name, project(name, controller))
    return place / name


def need(*programs: str) -> None:
    """Skip the test where a program is missing, and say how to get it."""
    for program in programs:
        if shutil.which(program) is None:
            pytest.skip(f"{program} is not installed (Debian: apt-get install {DEBIAN[program]})")


def run(command: Sequence[str | Path], folder: Path) -> str:
    """Run a program and return what it prints; the test fails with its words if it does."""
    done = subprocess.run(
        command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False, timeout=300
    )
    assert done.returncode == 0, f"{' '.join(map(str, command))}\n{done.stdout}"
    return done.stdout


def run_with(program: Path, text: str) -> str:
    """Run a program with a text on its standard input, and return what it prints."""
    done = subprocess.run([program], input=text, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def joints_at(name: str, controller: Controller, motors: Sequence[float] | NDArray[np.float64]) -> NDArray[np.float64]:
    """Joint values in the units of kernels for motors in degrees and mm, by the reference."""
    return joints_of(kernels(name, controller).robot, machine(name, controller), np.atleast_2d(motors))[0]


class Follower:
    """The compiled inverse that follows a path, of one package."""

    def __init__(self, folder: Path, name: str, real: ScalarType, where: str = "") -> None:
        need("gcc")
        stem = name if real is ScalarType.DOUBLE else f"{name}_f32"
        sources = [folder / where / f"{stem}.c", folder / where / f"{stem}_follow.c"]
        library = folder / "follow.so"
        run(["gcc", *FLAGS, "-shared", "-fPIC", f"-I{folder / where}", *sources, "-o", library], folder)
        loaded = ctypes.CDLL(str(library))
        self._type = ctypes.c_double if real is ScalarType.DOUBLE else ctypes.c_float
        self._follow, self._fk = getattr(loaded, f"{stem}_follow"), getattr(loaded, f"{stem}_fk")
        arm = kernels(name).robot
        self._dof, count = arm.dof, len(arm.runtime_parameters)
        # The struct of the runtime parameters has a number for each.
        usual = (self._type * count).in_dll(loaded, f"{stem}_default_params") if count else ()
        self.params = tuple(map(float, usual))

    def _given(self) -> tuple[Any, ...]:
        return ((self._type * len(self.params))(*self.params),) if self.params else ()

    def pose(self, q: Sequence[float] | NDArray[np.float64]) -> NDArray[np.float64]:
        """The pose (4, 4) at joint values."""
        result = (self._type * 16)()
        self._fk((self._type * self._dof)(*map(float, q)), *self._given(), result)
        return np.array(result, dtype=np.float64).reshape(4, 4)

    def follow(
        self, target: NDArray[np.float64], q0: Sequence[float] | NDArray[np.float64]
    ) -> tuple[int, NDArray[np.float64]]:
        """What the function returns, and the joint values."""
        q = (self._type * self._dof)()
        pose = (self._type * 16)(*map(float, target.ravel()))
        result = self._follow(pose, (self._type * self._dof)(*map(float, q0)), *self._given(), q)
        return result, np.array(q, dtype=np.float64)
