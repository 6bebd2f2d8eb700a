"""The integer kernels of a few robots, once for all tests of a process."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.fixed_point.files import emit_fixed
from kinegen.backends.fixed_point.kernels import FixedKernels, fixed_kernels
from kinegen.backends.fixed_point.vectors import emit_fixed_vectors
from kinegen.io.load import load, loads
from kinegen.ir.lower import as_derived, runtime_defaults
from kinegen.model.outputs import USUAL
from kinegen.model.robot import Robot
from kinegen.verify.fixed_point_vectors import fixed_vectors

ROBOTS = Path(__file__).resolve().parents[2] / "robots"

NAMES = ("puma560", "stanford", "hand", "calibrated_2r", "jaco2", "cartesian", "blocks")
"""An arm; a sliding joint; a tree in millimetres with joints that follow; runtime parameters; twists that are no right
angles; no angle; no joint."""

COMPILERS = tuple(name for name in ("gcc", "clang") if shutil.which(name))

UNDEFINED = {
    "gcc": ("-fsanitize=undefined", "-fsanitize-undefined-trap-on-error"),
    "clang": ("-fsanitize=undefined", "-fsanitize-trap=undefined"),
}
"""A trap where something undefined happens; it needs no library."""

SPLIT = "-DKINEGEN_Q30_SPLIT"


def planned(robot: Robot) -> FixedKernels:
    """All kernels of a robot in integers."""
    programs = tuple(as_derived(robot, quantity) for quantity in USUAL)
    return fixed_kernels(RobotPrograms(robot, programs, runtime_defaults(robot)))


def arm(text: str, length: str = "m") -> Robot:
    """A robot of some rows, and whatever else stands in the text."""
    head = f"kinegen: 1\nname: arm\nconvention: standard\nunits: {{length: {length}, angle: deg}}\n"
    return loads(f"{head}{text}", "arm.yaml")


@cache
def fixed(name: str) -> FixedKernels:
    """The kernels of a robot of ours."""
    return planned(load(ROBOTS / f"{name}.yaml"))


@cache
def texts(name: str) -> Mapping[str, str]:
    """What is emitted for it, by file name."""
    kernels = fixed(name)
    return emit_fixed(kernels) | emit_fixed_vectors(kernels, fixed_vectors(kernels))


def run(command: Sequence[str | Path], folder: Path | None = None) -> str:
    """Run a command that must succeed and say nothing on standard error."""
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)

    assert (done.returncode, done.stderr) == (0, ""), f"{command}\n{done.stdout}{done.stderr}"
    return done.stdout
