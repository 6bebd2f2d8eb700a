"""The proof of the integer kernels: compiled as they are emitted, called, and held against the reference.

Joint vectors are integers here, so the reference computes with exactly what the kernels are given, and the results
have to be within the proven error; nothing is added for the rounding of inputs.
"""

from __future__ import annotations

import ctypes
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from kinegen import reference
from kinegen.emit.fixed import Q30
from kinegen.emit.fixed.kernels import FixedKernels
from kinegen.emit.fixed.manual import largest_errors
from kinegen.emit.fixed.vectors import FixedVectors, IntegerRow
from kinegen.ir.fixed.program import NUMBER_BITS, FixedProgram
from kinegen.ir.fixed.turns import TURN
from kinegen.naming import c_file, function, prefix
from kinegen.native.compiler import Compiler, find_compiler
from kinegen.outputs import Quantity
from kinegen.robot.extent import reach
from kinegen.robot.model import Dimension, JointType
from kinegen.verify.proof import Comparison, Proof, expected_results
from kinegen.verify.samples import SEED, proof_samples, vector_samples
from kinegen.verify.tolerances import TOLERANCES
from kinegen.verify.vectors import quantity_frames

Integers = NDArray[np.int32]
FloatArray = NDArray[np.float64]

ANYWHERE = 2_000
"""Joint vectors from the whole range of int32_t, on top of those within the joint limits."""

_FLAGS = ("-std=c99", "-O1", "-shared", "-fPIC")
_ENDS = (-(2**31), 2**31 - 1, -1, 0, 1, -(2**30), 2**30, 2**29, 2**29 - 1)


# Inputs ---------------------------------------------------------------------------------------------------------------


def quantised(fixed: FixedKernels, points: FloatArray) -> Integers:
    """Joint vectors (N, dof) as the kernels take them: the nearest integers, whole turns left out."""
    units = np.array([_unit(fixed, index) for index in range(fixed.robot.dof)])
    integers = np.rint(points / units).astype(np.int64) if len(units) else points.astype(np.int64)
    wrapped = (integers + TURN // 2) % TURN - TURN // 2
    return wrapped.astype(np.int32)


def _unit(fixed: FixedKernels, index: int) -> float:
    """What the last place of a joint variable is in radians or the file's length unit."""
    is_stroke = fixed.robot.variables[index].type is JointType.PRISMATIC
    return 0.5**fixed.scales.stroke if is_stroke else 2 * np.pi / TURN


def integer_samples(fixed: FixedKernels) -> Integers:
    """Joint vectors for the proof: those of every other kernel, and others from anywhere.

    Returns:
        Shape (N, dof).
    """
    generator = np.random.default_rng(SEED)
    shape = (ANYWHERE, fixed.robot.dof)
    anywhere = generator.integers(-(2**31), 2**31, shape, dtype=np.int64)
    ends = generator.choice(np.array(_ENDS, dtype=np.int64), shape)
    return np.concatenate([quantised(fixed, proof_samples(fixed.robot)), anywhere, ends]).astype(np.int32)


def _parameters(fixed: FixedKernels) -> dict[str, float]:
    """The values of the runtime parameters that the integers stand for."""
    units = {Dimension.ANGLE: 2 * np.pi / TURN, Dimension.LENGTH: 0.5**fixed.scales.parameter}
    pairs = zip(fixed.robot.runtime_parameters, fixed.defaults, strict=True)
    return {parameter.name: value * units[parameter.dimension] for parameter, value in pairs}


# The proof ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class IntegerLibrary:
    """The integer kernels of a robot, compiled.

    Attributes:
        fixed: The robot and its integer programs.
        library: The opened library.
    """

    fixed: FixedKernels
    library: ctypes.CDLL

    def call(self, quantity: Quantity, q: Integers) -> Integers:
        """Evaluate a kernel.

        Args:
            quantity: What to compute.
            q: Joint vectors (N, dof).

        Returns:
            (N, frames, 16 or 3), with the default parameters.
        """
        robot = self.fixed.robot
        kernel = self.library[function(robot.name, quantity.function, Q30)]
        kernel.restype = None
        extra: list[Any] = []
        if robot.runtime_parameters:
            extra = [
                ctypes.byref((ctypes.c_char * 0).in_dll(self.library, f"{prefix(robot.name, Q30)}_default_params"))
            ]
        frames = len(quantity_frames(robot, quantity))
        out = np.full((len(q), frames, 16 if quantity.is_pose else 3), -7, np.int32)
        rows = np.ascontiguousarray(q, np.int32)
        for row in range(len(rows)):
            inputs = [ctypes.c_void_p(rows.ctypes.data + row * rows.strides[0])] if robot.dof else []
            kernel(*inputs, *extra, ctypes.c_void_p(out.ctypes.data + row * out.strides[0]))
        return out


def compile_integers(
    fixed: FixedKernels, files: Mapping[str, str], folder: Path, compiler: Compiler, *flags: str
) -> IntegerLibrary:
    """Compile the emitted integer kernels to a library of this machine.

    Args:
        fixed: The robot and its integer programs.
        files: The emitted files by name.
        folder: Where to compile.
        compiler: The compiler.
        flags: Further flags.

    Returns:
        The opened library; `folder` may go when the process ends.

    Raises:
        CompileError: If the compiler refuses.
    """
    name = fixed.robot.name
    header, source = (c_file(name, suffix, Q30) for suffix in "hc")
    for file in (header, source):
        (folder / file).write_text(files[file], encoding="utf-8", newline="\n")
    library = folder / f"{prefix(name, Q30)}.so"
    compiler.run(folder, (*_FLAGS, *flags, source, "-o", library.name), source)
    return IntegerLibrary(fixed, ctypes.CDLL(str(library)))


def prove_fixed(fixed: FixedKernels, files: Mapping[str, str]) -> Proof:
    """Compile the integer kernels and compare them with the reference.

    Args:
        fixed: The robot and its integer programs.
        files: The emitted files by name.

    Returns:
        The proof, which holds.

    Raises:
        CompileError: If there is no compiler, or it refuses.
        ProofError: If a result is off by more than its proven error.
    """
    robot = fixed.robot
    with tempfile.TemporaryDirectory(prefix="kinegen-") as folder:
        library = compile_integers(fixed, files, Path(folder), find_compiler())
        proof = Proof(reach(robot), compare_integers(fixed, library))
    proof.require(robot)
    return proof


def compare_integers(fixed: FixedKernels, library: IntegerLibrary) -> tuple[Comparison, ...]:
    """Compare every integer kernel with the reference.

    Args:
        fixed: The robot and its integer programs.
        library: The kernels.

    Returns:
        One comparison for each kernel.
    """
    q = integer_samples(fixed)
    points = q * np.array([_unit(fixed, index) for index in range(fixed.robot.dof)])
    known = reference.frames(fixed.robot, points, _parameters(fixed))
    return tuple(
        _compare(fixed, program, points, library.call(program.program.quantity, q), known) for program in fixed.programs
    )


def _compare(
    fixed: FixedKernels, program: FixedProgram, points: FloatArray, result: Integers, known: dict[str, FloatArray]
) -> Comparison:
    robot, quantity = fixed.robot, program.program.quantity
    expected = expected_results(robot, quantity, known)
    extent = reach(robot, robot.frame_names)
    place, unit = 0.5**fixed.scales.length, 0.5**NUMBER_BITS
    rotation = np.zeros(expected.shape[:2])
    if quantity.is_pose:
        found = result.reshape(expected.shape)
        position = np.abs(found[..., :3, 3] * place - expected[..., :3, 3]).max(axis=2)
        rotation = np.abs(found[..., :3, :3] * unit - expected[..., :3, :3]).max(axis=(2, 3))
        rotation = np.maximum(rotation, np.abs(found[..., 3, :] * unit - (0.0, 0.0, 0.0, 1.0)).max(axis=2))
    else:
        position = np.abs(result * place - expected[..., :3, 3]).max(axis=2)
    errors, turned = largest_errors(program)
    # The reference rounds too, a hundred thousand times less.
    position_tolerance = max(errors) * place + TOLERANCES.double * extent
    rotation_tolerance = turned * unit + TOLERANCES.double
    row, column = np.unravel_index(
        np.argmax(np.maximum(position / position_tolerance, rotation / rotation_tolerance)), position.shape
    )
    return Comparison(
        target="C q30",
        quantity=quantity,
        poses=len(points),
        position_error=float(position.max()),
        rotation_error=float(rotation.max()),
        position_tolerance=position_tolerance,
        rotation_tolerance=rotation_tolerance,
        worst=tuple(float(entry) for entry in points[row]),
        frame=quantity_frames(robot, quantity)[int(column)],
    )


# Test vectors ---------------------------------------------------------------------------------------------------------


def fixed_vectors(fixed: FixedKernels) -> FixedVectors:
    """The test vectors of the integer kernels.

    Args:
        fixed: The robot and its integer programs.

    Returns:
        Joint vectors, those of the other kernels and the ends of the range of int32_t, and the rounded exact results.
    """
    robot = fixed.robot
    ends = np.repeat(np.array(_ENDS[:2], dtype=np.int32)[:, None], robot.dof, axis=1)
    inputs = np.concatenate([quantised(fixed, vector_samples(robot)), ends])[: None if robot.dof else 1]
    with mpmath.workdps(reference.DIGITS):
        known = [reference.frames_mp(robot, _exact_point(fixed, row), _exact_parameters(fixed)) for row in inputs]
        return FixedVectors(
            inputs=tuple(tuple(int(entry) for entry in row) for row in inputs),
            expected={
                program.program.quantity: tuple(_rounded(fixed, program, frames) for frames in known)
                for program in fixed.programs
            },
        )


def _exact_point(fixed: FixedKernels, row: NDArray[Any]) -> list[Any]:
    return [
        _exact(int(entry), None if variable.type is not JointType.PRISMATIC else fixed.scales.stroke)
        for entry, variable in zip(row, fixed.robot.variables, strict=True)
    ]


def _exact_parameters(fixed: FixedKernels) -> dict[str, Any]:
    pairs = zip(fixed.robot.runtime_parameters, fixed.defaults, strict=True)
    return {
        parameter.name: _exact(value, None if parameter.dimension is Dimension.ANGLE else fixed.scales.parameter)
        for parameter, value in pairs
    }


def _exact(value: int, bits: int | None) -> Any:
    """What an integer stands for: an angle, or a length with so many fraction bits."""
    return mpmath.ldexp(value, -bits) if bits is not None else mpmath.pi * value / 2**31


def _rounded(fixed: FixedKernels, program: FixedProgram, frames: Mapping[str, Any]) -> IntegerRow:
    quantity = program.program.quantity
    columns = range(4) if quantity.is_pose else (3,)
    entries = [
        frames[frame][row, column]
        for frame in quantity_frames(fixed.robot, quantity)
        for row in range(3)
        for column in columns
    ]
    return tuple(int(mpmath.nint(mpmath.ldexp(entry, bits))) for entry, bits in zip(entries, program.bits, strict=True))
