"""Packages on disk, and the tools that build them."""

from __future__ import annotations

import math
import re
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from kinegen.backends.firmware.ecosystem import Ecosystem
from kinegen.backends.firmware.project import emit_project
from kinegen.backends.scalar_types import ScalarType
from kinegen.support.files.write import write_files
from kinegen.support.naming import Q30
from kinegen.verify import reference
from tests.emit.emitted import kernels, texts, vectors
from tests.fixed.kernels import fixed
from tests.fixed.kernels import texts as integer_texts

STUBS = Path(__file__).resolve().parent / "stubs"

INTEGERS = ((Q30,), (ScalarType.FLOAT, Q30))
"""Packages with kernels in integers, alone and beside others."""

ROBOTS = ("puma560", "hand", "calibrated_2r", "blocks")
"""An arm; a tree with five tips; runtime parameters; no joint at all."""

DEBIAN = {
    "cmake": "cmake",
    "arm-none-eabi-gcc": "gcc-arm-none-eabi",
    "avr-gcc": "gcc-avr",
    "simavr": "simavr",
    "g++": "g++",
    "gcc": "gcc",
}
"""What to install for a program, on Debian."""


@cache
def project(robot: str, ecosystem: Ecosystem, reals: tuple[str, ...] = ()) -> Mapping[str, str]:
    """The files of a package; with its usual number types unless others are named, `Q30` among them."""
    floats = tuple(ScalarType(real) for real in reals if real != Q30) if reals else ecosystem.reals
    integers = Q30 in reals
    files = {**texts(robot), **(integer_texts(robot) if integers else {})}
    fixed_kernels = fixed(robot) if integers else None
    return emit_project(kernels(robot), vectors(robot), files, floats, ecosystem, fixed_kernels)


def write_package(place: Path, robot: str, ecosystem: Ecosystem, reals: tuple[str, ...] = ()) -> Path:
    """Write a package into a folder that bears the robot's name, and return that folder."""
    write_files(place / robot, project(robot, ecosystem, reals))
    return place / robot


def need(*programs: str) -> None:
    """Skip the test where a program is missing, and say how to get it."""
    for program in programs:
        if shutil.which(program) is None:
            pytest.skip(f"{program} is not installed (Debian: apt-get install {DEBIAN[program]})")


def run(command: Sequence[str | Path], folder: Path, **variables: str) -> str:
    """Run a program and return what it prints; the test fails with its words if it does."""
    environment = {"PATH": _path(), "LC_ALL": "C", **variables}
    done = subprocess.run(
        command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False
    )
    assert done.returncode == 0, f"{' '.join(map(str, command))}\n{done.stdout}"
    return done.stdout


def _path() -> str:
    """The folders of the programs in use, without the environment of the tests."""
    found = (shutil.which(program) for program in ("cmake", "make", "gcc", "arm-none-eabi-gcc", "avr-gcc", "sh"))
    return ":".join(dict.fromkeys(str(Path(program).parent) for program in found if program))


def example_joints(text: str) -> list[float]:
    """The joint vector that stands in an example, in radians and the file's unit."""
    vector = re.search(r" q\[.*?\};", text, re.S)
    found = re.findall(r"^ +(-?\d\S*?)F?,? /\* \w+ \[(?:1/2\^(\d+) )?(\w+)\]", vector[0], re.M) if vector else []
    return [
        float(word) * 0.5 ** int(bits or 0) * (2 * math.pi if unit == "turn" else 1.0) for word, bits, unit in found
    ]


def example_pose(robot: str, text: str) -> NDArray[np.float64]:
    """What an example must print: the first three rows of the first tip's pose, from the reference."""
    pose: NDArray[np.float64] = reference.pose(kernels(robot).robot, [example_joints(text)])[0, 0, :3]
    return pose


def last_rows(text: str, count: int = 3) -> NDArray[np.float64]:
    """The last rows of numbers that a program printed."""
    rows = [line.split() for line in text.splitlines() if line.strip()]
    return np.array([[float(word) for word in row] for row in rows[-count:]])


def is_semantic_version(version: str) -> bool:
    """Whether a version is one of https://semver.org."""
    return re.fullmatch(r"(0|[1-9]\d*)(\.(0|[1-9]\d*)){2}(-[0-9A-Za-z.-]+)?(\+[0-9A-Za-z.-]+)?", version) is not None
