"""The proof of the integer kernels: compiled as they are emitted, called, and held against the reference.

Joint vectors are integers here, so the reference computes with exactly what the kernels are given, and the results have
to be within the proven error; nothing is added for the rounding of inputs.
"""

from __future__ import annotations

import ctypes
import math
import tempfile
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from kinegen.backends.fixed_point.kernels import FixedKernels, largest
from kinegen.errors import ProofError
from kinegen.ir.fixed_point.program import NUMBER_BITS, FixedProgram
from kinegen.model.joint_bounds import reach
from kinegen.model.outputs import Quantity
from kinegen.model.robot import Robot
from kinegen.runtime.compiler import Compiler, find_compiler
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import Q30, c_file, default_params, function, prefix, sincos_macro
from kinegen.verify import reference
from kinegen.verify.c_library import Spoilable, compile_probe
from kinegen.verify.files import SPOILT, header_macros, require_macros
from kinegen.verify.fixed_point_vectors import Integers, integer_samples, parameters, unit
from kinegen.verify.isolation import GuardedRows, calling, isolated
from kinegen.verify.records import Comparison, Invocation, Proof
from kinegen.verify.reference_cache import quantity_frames
from kinegen.verify.samples import FloatArray
from kinegen.verify.selftests import require_accepted, require_selftest

BOARD = "board_trig.h"

EXACT_BITS = 31
"""With so many bits both are rounded to nearest."""

WORST = """
#include <math.h>
#include <stdint.h>

/* As far off as is allowed, to one side or the other by a hash of the angle. */
static inline int32_t board_off(double exact, uint32_t angle, uint32_t bit)
{
    const uint32_t mixed = (angle ^ (angle >> 15)) * 2654435761u;
    const double step = ldexp(1.0, 30 - BITS);
    return (int32_t)floor(ldexp(exact, 30) + ((((mixed >> bit) & 1u) != 0u) ? step - 0.5 : 0.5 - step) + 0.5);
}

static inline void board_sincos(uint32_t angle, int32_t *s, int32_t *c)
{
    const double radians = (double)angle * 1.4629180792671596e-9;
    *s = board_off(sin(radians), angle, 31u);
    *c = board_off(cos(radians), angle, 30u);
}
"""
"""Sine and cosine that are off by 2^-BITS."""


def board_text(robot: Robot) -> str:
    """Returns the header of a board with the pair above."""
    return f"{WORST}#define {sincos_macro(robot.name, Q30)}(angle, s, c) board_sincos((angle), (s), (c))\n"


def board_flags(folder: Path, bits: int) -> tuple[str, ...]:
    """Flags that put the pair in the place of the emitted one. `bits`: sines and cosines are off by 2^-bits."""
    return "-include", str(folder / BOARD), f"-DBITS={bits}", "-lm"


_REFERENCE = 1e-13
"""What the reference in float64 may lose, a hundred thousand times less than the kernels."""

COARSE_STRIDE = 7
"""A coarse pair is tried at every so many of the samples."""

_UNSET = 0x5A5A5A5A

SPLIT = "-DKINEGEN_Q30_SPLIT"

_FLAGS = ("-std=c99", "-O1", "-shared", "-fPIC")


@dataclass(frozen=True, slots=True)
class IntegerLibrary:
    """The integer kernels of a robot, compiled."""

    fixed: FixedKernels
    library: ctypes.CDLL

    def call(self, quantity: Quantity, q: Integers) -> Integers:
        """Evaluate a kernel. `q`: joint vectors (N, dof). Returns (N, frames, 16 or 3), with the default parameters."""
        robot = self.fixed.robot
        kernel = self.library[function(robot.name, quantity.function, Q30)]
        kernel.restype = None
        extra: list[Any] = []
        if robot.runtime_parameters:
            extra = [ctypes.byref((ctypes.c_char * 0).in_dll(self.library, default_params(robot.name, Q30)))]
        frames = len(quantity_frames(robot, quantity))
        found = GuardedRows.of(len(q), (frames, 16 if quantity.is_pose else 3), np.int32, used=len(q))
        out, rows = found.cells, np.array(q, np.int32, order="C")
        out[...] = _UNSET
        calling(f"C q30 {quantity}")
        for row in range(len(rows)):
            inputs = [ctypes.c_void_p(rows.ctypes.data + row * rows.strides[0])] if robot.dof else []
            kernel(*inputs, *extra, ctypes.c_void_p(out.ctypes.data + row * out.strides[0]))
        found.require(robot.name)
        if not np.array_equal(rows, q):
            raise ProofError(f"{robot.name}: C q30 {quantity} changes its inputs; nothing was written")
        return out


def compile_integers(
    fixed: FixedKernels, files: Mapping[str, str], folder: Path, compiler: Compiler, *flags: str
) -> IntegerLibrary:
    """Compile the emitted integer kernels to a library of this machine.

    Returns the opened library; `folder` may go when the process ends. Raises `CompileError` if the compiler refuses.
    """
    name = fixed.robot.name
    header, source = (c_file(name, suffix, Q30) for suffix in "hc")
    for file in (header, source):
        (folder / file).write_text(files[file], encoding="utf-8", newline="\n")
    library = folder / f"{prefix(name, Q30)}.so"
    compiler.run(folder, (*_FLAGS, *flags, source, "-o", library.name), source)
    return IntegerLibrary(fixed, ctypes.CDLL(str(library)))


def prove_fixed(fixed: FixedKernels, files: Mapping[str, str]) -> Proof:
    """Compile the integer kernels and compare them with the reference, in a process of their own.

    Returns:
        The proof, which holds.

    Raises:
        CompileError: If there is no compiler, or it refuses.
        ProofError: If a result is off by more than its proven error, or a macro or the self-test is wrong.
    """
    return isolated(fixed.robot.name, partial(_prove, fixed, files))


def _prove(fixed: FixedKernels, files: Mapping[str, str]) -> Proof:
    robot = fixed.robot
    with tempfile.TemporaryDirectory(prefix="kinegen-") as folder:
        library = compile_integers(fixed, files, Path(folder), find_compiler())
        proof = Proof(reach(robot), compare_integers(fixed, library))
        proof.require(robot)
        _require_files(fixed, files, Path(folder))
        require_coarse(fixed, files, Path(folder) / "coarse")
    return proof


def _require_files(fixed: FixedKernels, files: Mapping[str, str], folder: Path) -> None:
    """The macros of the header, and the self-test with right and with wrong kernels."""
    robot, quantities = fixed.robot, tuple(program.program.quantity for program in fixed.programs)
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8", newline="\n")
    macros = {**header_macros(robot, quantities), "Q30_LENGTH_BITS": fixed.scales.length}
    kernels = _spoilables(fixed)
    probe = compile_probe(robot, folder, Q30, kernels, tuple(macros), find_compiler())
    require_macros(robot, probe, macros)
    deltas = [tuple((float(SPOILT),) * size for size in kernel.results) for kernel in kernels]
    require_selftest(robot, probe, quantities, kernels, deltas)


def _spoilables(fixed: FixedKernels) -> list[Spoilable]:
    """Returns the kernels of the self-test."""
    robot, quantities = fixed.robot, [program.program.quantity for program in fixed.programs]
    sizes = [(16 if quantity.is_pose else 3) * len(quantity_frames(robot, quantity)) for quantity in quantities]
    return [
        Spoilable(quantity.function, min(1, robot.dof), (size,))
        for quantity, size in zip(quantities, sizes, strict=True)
    ]


def require_coarse(fixed: FixedKernels, files: Mapping[str, str], folder: Path) -> None:
    """See that what is said of a coarse pair holds: the errors in the header, and what the self-test then accepts.

    `folder`: where to compile; it is made. Raises `CompileError` if the compiler refuses; `ProofError` if an error is
    larger than the header says, or the self-test accepts more or less than that.
    """
    robot, coarse = fixed.robot, fixed.coarse
    if coarse is None:
        return
    folder.mkdir()
    for name, text in {**files, BOARD: board_text(robot)}.items():
        (folder / name).write_text(text, encoding="utf-8", newline="\n")
    for bits, more in ((coarse.bits, ()), (coarse.halves, (SPLIT,))):
        own = folder / f"pair{len(more)}"
        own.mkdir()
        library = compile_integers(fixed, files, own, find_compiler(), *board_flags(folder, bits), *more)
        Proof(reach(robot), compare_integers(fixed, library, coarse.errors, COARSE_STRIDE)).require(robot)
        if all(each.holds for each in compare_integers(fixed, library, stride=COARSE_STRIDE)):
            reason = f"{sincos_macro(robot.name, Q30)} changes nothing, so it is not used"
            raise ProofError(f"{robot.name}: {reason}; nothing was written")
    kernels = _spoilables(fixed)
    probe = compile_probe(robot, folder, Q30, kernels, (), find_compiler(), board_flags(folder, EXACT_BITS))
    fine = max(error for program in fixed.programs for error in program.errors)
    require_accepted(robot, probe, kernels, max(map(max, coarse.errors)), math.ceil(fine) + 1)


def compare_integers(
    fixed: FixedKernels,
    library: IntegerLibrary,
    errors: Sequence[Sequence[float]] | None = None,
    stride: int = 1,
) -> tuple[Comparison, ...]:
    """Compare every integer kernel with the reference.

    `errors`: proven errors of each program, where they are not those of the emitted pair; `stride`: takes every so many
    of the samples. Returns one comparison for each kernel.
    """
    q = integer_samples(fixed)[::stride]
    points = q * np.array([unit(fixed, index) for index in range(fixed.robot.dof)])
    known = reference.frames(fixed.robot, points, parameters(fixed))
    bounds = [program.errors for program in fixed.programs] if errors is None else errors
    return tuple(
        _compare(fixed, program, bound, points, library.call(program.program.quantity, q), known)
        for program, bound in zip(fixed.programs, bounds, strict=True)
    )


def _compare(
    fixed: FixedKernels,
    program: FixedProgram,
    errors: Sequence[float],
    points: FloatArray,
    result: Integers,
    known: dict[str, FloatArray],
) -> Comparison:
    robot, quantity = fixed.robot, program.program.quantity
    expected = np.stack([known[frame] for frame in quantity_frames(robot, quantity)], axis=1)
    extent = reach(robot, robot.frame_names)
    length, number = 0.5**fixed.scales.length, 0.5**NUMBER_BITS
    rotation = np.zeros(expected.shape[:2])
    if quantity.is_pose:
        found = result.reshape(expected.shape)
        position = np.abs(found[..., :3, 3] * length - expected[..., :3, 3]).max(axis=2)
        rotation = np.abs(found[..., :3, :3] * number - expected[..., :3, :3]).max(axis=(2, 3))
        is_last = (found[..., 3, :] == (0, 0, 0, 2**NUMBER_BITS)).all(axis=2)
        rotation = np.where(is_last, rotation, np.inf)  # constants have no error
    else:
        position = np.abs(result * length - expected[..., :3, 3]).max(axis=2)
    along, turned = largest(program, errors)
    position_tolerance = max(along) * length + _REFERENCE * extent
    rotation_tolerance = turned * number + _REFERENCE
    row, column = np.unravel_index(
        np.argmax(np.maximum(position / position_tolerance, rotation / rotation_tolerance)), position.shape
    )
    return Comparison(
        invocation=Invocation("C", "q30"),
        quantity=quantity,
        poses=len(points),
        position_error=float(position.max()),
        rotation_error=float(rotation.max()),
        position_tolerance=position_tolerance,
        rotation_tolerance=rotation_tolerance,
        worst=tuple(float(entry) for entry in points[row]),
        frame=quantity_frames(robot, quantity)[int(column)],
    )
