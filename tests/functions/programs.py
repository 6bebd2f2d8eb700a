"""Programs with roots, angles of points and selections: drawn, written, compiled and run."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.batch import emit_batch
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.python.formula import emit_formula
from kinegen.backends.scalar_types import ScalarType
from kinegen.io.load import loads
from kinegen.ir.program import AngleSum, Constant, Operand, Operator, Program, Statement, Temporary, Variable
from kinegen.model.outputs import Array, Kind, Quantity, Signature
from kinegen.support.naming import function
from tests.functions.library import DTYPES, Functions, run

DOF = 3
ROBOT = loads(
    """
kinegen: 1
name: drawn
convention: standard
units: {length: m, angle: rad}
joints:
  - {name: one, theta: q, d: 0, a: 1, alpha: 0}
  - {name: two, theta: q, d: 0, a: 1, alpha: 0}
  - {name: three, theta: q, d: 0, a: 1, alpha: 0}
""",
    "drawn.yaml",
)
CONSTANTS = tuple(Constant(Fraction(value)) for value in ("-2", "-1/2", "0", "1/4", "1", "3"))
"""Numbers that both types hold exactly, so that NumPy's constants are those of C."""


def signature(name: str, numbers: int) -> Signature:
    """That of a program which makes some numbers of the joint vector; its name tells it from others in one file."""
    quantity = Quantity(Kind.TWIST, frame=name)
    return Signature(quantity, (name,), DOF, (Array("q", (DOF,)),), (Array("twist", (numbers,)),))


@st.composite
def programs(draw: st.DrawFn, name: str) -> Program:
    """A program of any operations, in which every value is computed from inputs and earlier values."""
    values: list[Operand] = [Variable(index) for index in range(DOF)]
    statements: list[Statement] = []
    outputs: list[Operand] = []
    angles: dict[Operand, str] = {}
    for number in range(draw(st.integers(4, 14))):
        operator = draw(st.sampled_from(Operator))
        first = draw(st.sampled_from(values))
        # Compilers fold constants, which no kernel has: the first operand is none.
        others = [draw(st.sampled_from([*values, *CONSTANTS])) for _ in range(operator.arity - 1)]
        results: tuple[str, ...] = (f"t{number}",)
        if operator is Operator.SINCOS:
            if first in angles:
                continue
            label = angles.setdefault(first, f"u{len(angles) + 1}")
            results = (f"s{label}", f"c{label}")
        statements.append(Statement(results, operator, (first, *others)))
        # Of a pair both results are used, or one of them.
        kept = draw(st.sampled_from((results, *((name,) for name in results))))
        values += map(Temporary, kept)
        outputs += map(Temporary, kept)
    sums = tuple(AngleSum(label, "...", False) for label in angles.values())
    return Program(signature(name, len(outputs)), (), sums, tuple(statements), tuple(outputs))


def kernels(*programs: Program) -> RobotPrograms:
    """Some programs of the robot above."""
    return RobotPrograms(ROBOT, programs, ())


class Library:
    """The compiled kernels of one number type."""

    def __init__(
        self, folder: Path, kernels: RobotPrograms, real: ScalarType, scalar: Sequence[str], batch: Sequence[str]
    ) -> None:
        """Compile them.

        Args:
            folder: A folder of their own.
            kernels: The programs.
            real: The number type.
            scalar: Compiler and flags for the scalar kernels.
            batch: The same for the batch kernels.
        """
        self.real = real
        objects = []
        for texts, (compiler, *flags) in ((emit_kernel(kernels, real), scalar), (emit_batch(kernels, real), batch)):
            for name, text in texts.items():
                (folder / name).write_text(text, encoding="utf-8")
            code = next(folder / name for name in texts if name.endswith(".c"))
            objects.append(code.with_suffix(".o"))
            run([compiler, "-std=c99", "-fPIC", *flags, "-c", code, "-o", objects[-1]])
        run([scalar[0], "-shared", *objects, "-o", folder / f"drawn_{real}.so"])
        self.library = ctypes.CDLL(str(folder / f"drawn_{real}.so"))

    def one_by_one(self, program: Program, q: NDArray[np.floating]) -> NDArray[np.floating]:
        """The results of the scalar kernel, (N, numbers), for joint vectors (N, dof)."""
        call = self.library[function(ROBOT.name, program.quantity.function, self.real)]
        given = np.ascontiguousarray(q, dtype=DTYPES[self.real])
        found = np.empty((len(q), len(program.outputs)), dtype=given.dtype)
        for row, result in zip(given, found, strict=True):
            call(row.ctypes.data_as(ctypes.c_void_p), result.ctypes.data_as(ctypes.c_void_p))
        return found

    def at_once(self, program: Program, q: NDArray[np.floating]) -> NDArray[np.floating]:
        """The same from the batch kernel."""
        call = self.library[function(ROBOT.name, program.quantity.function, self.real, batch=True)]
        given = np.ascontiguousarray(q, dtype=DTYPES[self.real])
        found = np.empty((len(q), len(program.outputs)), dtype=given.dtype)
        size, number = ctypes.c_size_t, ctypes.c_ssize_t
        arrays = [array.ctypes.data_as(ctypes.c_void_p) for array in (given, found)]
        call(size(len(q)), arrays[0], number(DOF), number(1), arrays[1], number(len(program.outputs)), ctypes.c_int(0))
        return found


def formula(
    kernels: RobotPrograms, program: Program, q: NDArray[np.floating], own: Functions | None = None
) -> NDArray[Any]:
    """The results of the NumPy form, (N, numbers); with the functions of the C files in place of NumPy's if given."""
    namespace: dict[str, Any] = {}
    exec(emit_formula(kernels)["_numpy.py"], namespace)  # noqa: S102 - our own output
    if own is not None:
        namespace |= {"_sincos": own.sincos, "_atan2": own.atan2}
    with np.errstate(all="ignore"):
        results = namespace[program.quantity.function](np.ascontiguousarray(q.T))
    return np.array([np.broadcast_to(result, len(q)) for result in results]).T
