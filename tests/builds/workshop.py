"""Small robots, quick builds and pictures of folders, for the tests of builds and proofs."""

from __future__ import annotations

import os
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from kinegen.backends.c.batch import emit_batch
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.files import stamp_of
from kinegen.backends.python.formula import emit_formula
from kinegen.backends.python.package import emit_package
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import build, lower_file
from kinegen.driver.results import BuildOptions, BuildResult, Stage
from kinegen.model.outputs import USUAL, Quantity
from kinegen.runtime.extension import build_extension, interface_of, load_package
from kinegen.runtime.flags import Flags
from kinegen.support.files.write import write_files
from kinegen.support.naming import EXTENSION

ROOT = Path(__file__).resolve().parents[2]
ROBOTS = ROOT / "robots"

ARM = """\
kinegen: 1
name: arm
convention: standard
units: {length: m, angle: deg}
parameters:
  near: {value: 0.5, runtime: true}
  far: {value: 0.5, runtime: true}
joints:
  - {name: shoulder, theta: q, d: 0.25, a: near, alpha: 90, limits: [-170, 170]}
  - {name: elbow, theta: q, d: 0, a: far, alpha: 30, limits: [-120, 120]}
"""
"""Two joints and two runtime parameters, which differ in nothing but their names."""

TREE = """\
kinegen: 1
name: arm
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: body, theta: q, d: 0.25, a: 0, alpha: 90}
  - {name: left, parent: body, theta: q, d: 0, a: 0.5, alpha: 0}
  - {name: right, parent: body, theta: q, d: 0, a: 0.75, alpha: 0}
"""
"""Two tips."""

QUICK = Flags(march=None, contraction=False, optimisation="0")

Picture = dict[str, tuple[bytes, int, int]]
"""Of each file its content, the time of its last change, and its number on the disk."""


def set_machine(patch: pytest.MonkeyPatch, cache_home: Path) -> None:
    """A cache of these tests alone; no cross compiler to measure costs with, and no compiler named by the user."""
    patch.setenv("XDG_CACHE_HOME", str(cache_home))
    patch.delenv("CC", raising=False)
    patch.setattr("kinegen.driver.pipeline.can_measure", lambda: False)


def write_robot(folder: Path, text: str = ARM, name: str = "arm.yaml") -> Path:
    """Write a robot file."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def make(path: Path, output: Path, report: Any = None, **options: Any) -> BuildResult:
    """Build as quickly as possible: without optimisation, and by default the pose alone."""
    chosen = {"quantities": (Quantity.POSE,), "flags": QUICK} | options
    stages: list[Stage] = []
    return build(path, BuildOptions(output=output, **chosen), report or stages.append)


def assemble(name: str, folder: Path, *, compiled: bool, quantities: tuple[Quantity, ...] = USUAL) -> ModuleType:
    """A package of a robot of `robots/`, without test vectors and without a proof, which take long for large ones."""
    kernels = lower_file(ROBOTS / f"{name}.yaml", quantities)
    reals = tuple(ScalarType)
    sources: dict[str, str] = {}
    for real in reals:
        sources |= emit_kernel(kernels, real) | emit_batch(kernels, real)
    files: dict[str, str | bytes] = {**emit_formula(kernels), **emit_package(kernels, reals, stamp_of(sources))}
    if compiled:
        extension = build_extension(interface_of(kernels, reals), sources, QUICK)
        extension.keep()
        files[EXTENSION] = extension.content
    write_files(folder / name, files)
    return load_package(folder / name)


def picture(folder: Path) -> Picture:
    """Everything in a folder, hidden files too; Python's own caches left aside."""
    found = {}
    for root, _, files in os.walk(folder):
        for file in files:
            path = Path(root) / file
            if "__pycache__" not in path.parts:
                status = path.stat()
                found[str(path.relative_to(folder))] = (path.read_bytes(), status.st_mtime_ns, status.st_ino)
    return found


def contents(folder: Path) -> dict[str, bytes]:
    """The content of each file."""
    return {name: content for name, (content, _, _) in picture(folder).items()}
