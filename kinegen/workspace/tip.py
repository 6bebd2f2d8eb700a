"""The tip of a robot as a function to call: its position kernel, compiled for this machine.

In: a robot with its position program. Out: a callable from joint vectors to points, both joint-major. The kernel is the
one that a build emits, so its sums and sines are proved there; here it is compiled and imported from a folder that
nobody else sees.
"""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from kinegen.emit.c.batch import emit_batch
from kinegen.emit.c.kernel import emit_kernel
from kinegen.emit.files import stamp_of
from kinegen.emit.kernels import Kernels
from kinegen.emit.python.formula import emit_formula
from kinegen.emit.python.package import emit_package
from kinegen.emit.reals import Real
from kinegen.errors import KinegenError, MissingToolError
from kinegen.ir.program import Program, Temporary, Variable
from kinegen.naming import EXTENSION
from kinegen.native.package import build_extension, interface_of, load_package

FloatArray = NDArray[np.float64]

_REALS = (Real.DOUBLE,)


@dataclass(frozen=True, slots=True)
class Tip:
    """One tip of a robot.

    Attributes:
        name: Its frame.
        dof: Length of the joint vector.
        movers: Places in the joint vector of those variables on which the tip's position depends.
        position: Joint vectors (dof, N), in radians and lengths, to points (3, N) in the base frame.
        backend: What evaluates: `c`, or `numpy` without a compiler.
    """

    name: str
    dof: int
    movers: tuple[int, ...]
    position: Callable[[FloatArray], FloatArray]
    backend: str


def find_tip(kernels: Kernels, name: str | None = None) -> Tip:
    """Compile the position kernel of a robot for one of its tips.

    Args:
        kernels: The robot and its position program, the only one.
        name: Which tip of a tree; a chain has but one.

    Returns:
        The tip.

    Raises:
        KinegenError: If there is no such tip, or there are several and none is named.
    """
    tips = kernels.robot.tips
    if name is None and len(tips) > 1:
        raise KinegenError(f"{kernels.robot.name} has {len(tips)} tips; choose one with --tip ({', '.join(tips)})")
    if name is not None and name not in tips:
        raise KinegenError(f"unknown tip {name!r} (expected {', '.join(tips)})")
    place = 0 if name is None else tips.index(name)
    package, kept = _package(kernels), slice(3 * place, 3 * place + 3)

    def position(q: FloatArray) -> FloatArray:
        points: FloatArray = package.position(q, layout="joint_major", threads=1)[kept]
        return points

    movers = _movers(kernels.programs[0], kept)
    return Tip(tips[place], kernels.robot.dof, movers, position, str(package.backend))


def _movers(program: Program, kept: slice) -> tuple[int, ...]:
    """The inputs that some of the outputs depend on, in order."""
    wanted = set(program.outputs[kept])
    for statement in reversed(program.statements):
        if Temporary(statement.name) in wanted:
            wanted.update(statement.operands)
    return tuple(sorted(operand.index for operand in wanted if isinstance(operand, Variable)))


def _package(kernels: Kernels) -> ModuleType:
    """The robot's package with this kernel alone; NumPy evaluates where there is no compiler."""
    sources: dict[str, str] = {}
    for real in _REALS:
        sources |= emit_kernel(kernels, real) | emit_batch(kernels, real)
    files = emit_formula(kernels) | emit_package(kernels, _REALS, stamp_of(sources))
    contents = {name: text.encode() for name, text in files.items()}
    with contextlib.suppress(MissingToolError):
        contents[EXTENSION] = build_extension(interface_of(kernels, _REALS), sources).content
    with tempfile.TemporaryDirectory(prefix="kinegen-") as staging:
        folder = Path(staging) / kernels.robot.name
        folder.mkdir()
        for name, content in contents.items():
            (folder / name).write_bytes(content)
        return load_package(folder)
