"""The emitted C of a robot as a shared library, called through ctypes without anything of kinegen in between."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.scalar_types import ScalarType
from kinegen.ir.program import Program
from kinegen.model.outputs import USUAL, Quantity
from kinegen.support.naming import prefix
from tests.emit.emitted import kernels, run

Floats = NDArray[np.floating[Any]]

DTYPES = {ScalarType.DOUBLE: np.dtype(np.float64), ScalarType.FLOAT: np.dtype(np.float32)}
LAYOUTS = (0, 1, 2)


@dataclass(frozen=True, slots=True)
class Library:
    """Both number types of a robot, compiled.

    Attributes:
        robot: Its name.
        library: The opened library.
    """

    robot: str
    library: ctypes.CDLL

    @property
    def kernels(self) -> RobotPrograms:
        """The robot and its programs."""
        return kernels(self.robot)

    def program(self, quantity: Quantity) -> Program:
        """The program of a quantity."""
        return self.kernels.programs[list(USUAL).index(quantity)]

    def scalar(self, quantity: Quantity, q: Floats) -> Floats:
        """Every configuration of q (N, dof) by itself: (N, frames, 16) or (N, frames, 3)."""
        function, arguments = self._function(quantity, q)
        frames = len(self.program(quantity).frames)
        out = np.full((len(q), frames, 16 if quantity.is_pose else 3), -7, q.dtype)
        for row, target in zip(np.ascontiguousarray(q), out, strict=True):
            inputs = [row.ctypes.data_as(ctypes.c_void_p)] * bool(row.size)
            function(*inputs, *arguments, target.ctypes.data_as(ctypes.c_void_p))
        return out

    def batch(self, quantity: Quantity, q: Floats, layout: int = 0, gap: int = 0) -> Floats:
        """A whole batch; q may have any strides.

        Args:
            quantity: What to compute.
            q: Joint vectors (N, dof).
            layout: As the batch kernels number them.
            gap: Numbers between two configurations, or two rows, of the result; they must stay as they are.

        Returns:
            (N, frames, 16 or 12 or 3), or (rows, N) in layout 2.
        """
        function, arguments = self._function(quantity, q, batch=True)
        entries = (16 if layout == 0 else 12) if quantity.is_pose else 3
        numbers = len(self.program(quantity).frames) * entries
        shape = (numbers, len(q)) if layout == 2 else (len(q), numbers)
        stride = shape[1] + gap
        memory = np.full((shape[0], stride), -7, q.dtype)
        strides = [ctypes.c_ssize_t(each // q.itemsize) for each in q.strides]
        pointers = [ctypes.c_void_p(array.ctypes.data) for array in (q, memory)]
        function(
            ctypes.c_size_t(len(q)), pointers[0], *strides, *arguments, pointers[1], ctypes.c_ssize_t(stride), layout
        )

        assert (memory[:, shape[1] :] == -7).all(), "the gaps were written to"
        found = memory[:, : shape[1]]
        return found if layout == 2 else found.reshape(len(q), numbers // entries, entries)

    def _function(self, quantity: Quantity, q: Floats, *, batch: bool = False) -> tuple[Any, list[Any]]:
        real = ScalarType.DOUBLE if q.dtype == np.float64 else ScalarType.FLOAT
        stem = prefix(self.robot, real)
        function = getattr(self.library, f"{stem}_{quantity.function}{'_batch' if batch else ''}")
        function.restype = None
        parameters = self.kernels.robot.runtime_parameters
        defaults = (ctypes.c_char * 0).in_dll(self.library, f"{stem}_default_params") if parameters else None
        one_for_all = [ctypes.c_ssize_t(0)] * batch
        return function, [ctypes.byref(defaults), *one_for_all] if parameters else []


def compile_library(folder: Path, files: Path, robot: str, compiler: str, *flags: str) -> Library:
    """Compile a robot's kernels of both number types.

    Args:
        folder: Where the library goes.
        files: Its files.
        robot: Its name.
        compiler: `gcc` or `clang`.
        flags: How to compile; contraction is off.

    Returns:
        The opened library.
    """
    target = folder / f"lib{robot}{compiler}{''.join(flags)}.so"
    sources = [files / f"{prefix(robot, real)}{batch}.c" for real in ScalarType for batch in ("", "_batch")]
    run([compiler, "-std=c99", "-ffp-contract=off", "-shared", "-fPIC", *flags, *sources, "-o", target])
    return Library(robot, ctypes.CDLL(str(target)))


def full(scalar: Floats) -> Floats:
    """Results of the scalar kernels (N, frames, 16 or 3) as those of layout 1: without the last rows."""
    return scalar[..., :12] if scalar.shape[-1] == 16 else scalar


def rows(scalar: Floats) -> Floats:
    """The same as layout 2: (rows, N)."""
    return full(scalar).reshape(len(scalar), -1).T


def bits(numbers: Floats) -> NDArray[Any]:
    """The bits of an array; every NaN has the same, since its payload is nobody's promise."""
    plain = np.where(np.isnan(numbers), np.array(np.nan, numbers.dtype), numbers)
    return plain.view(np.uint64 if numbers.dtype == np.float64 else np.uint32)
