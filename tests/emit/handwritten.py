"""Programs written by hand, with every operator and every kind of operand; made without sympy.

Imported by tests, and run as a program by one of them, in a process that cannot import sympy.
"""

from __future__ import annotations

import sys
from fractions import Fraction

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.batch import emit_batch
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.python.formula import emit_formula
from kinegen.backends.python.package import emit_package
from kinegen.backends.scalar_types import ScalarType
from kinegen.io.load import loads
from kinegen.ir.program import (
    AngleSum,
    Constant,
    Operator,
    Program,
    RuntimeParameter,
    Statement,
    Temporary,
    Variable,
)
from kinegen.model.outputs import Array, Quantity, Signature
from tests.signatures import positions

ROBOT = loads(
    """
kinegen: 1
name: made_up
description: A robot whose programs are written by hand
convention: standard
units: {length: m, angle: rad}
parameters:
  far: {value: 1/2, runtime: true}
  lambda: {value: 1/4, runtime: true}
joints:
  - {name: one, theta: q, d: far, a: lambda, alpha: 0}
  - {name: two, theta: 0, d: q, a: 0, alpha: 0}
""",
    "made_up.yaml",
)
DEFAULTS = (Fraction(1, 2), Fraction(1, 4))

ZERO, HALF, THIRD = Constant(Fraction(0)), Constant(Fraction(1, 2)), Constant(Fraction(-1, 3))
FAR, LAMBDA = RuntimeParameter("far"), RuntimeParameter("lambda")

STATEMENTS = (
    Statement(("q12",), Operator.ADD, (Variable(0), Variable(1))),
    Statement(("s1", "c1"), Operator.SINCOS, (Variable(0),)),
    Statement(("s12", "c12"), Operator.SINCOS, (Temporary("q12"),)),
    Statement(("t0",), Operator.SUB, (Temporary("s1"), HALF)),
    Statement(("t1",), Operator.MUL, (Temporary("c1"), THIRD)),
    Statement(("t2",), Operator.DIV, (FAR, LAMBDA)),
    Statement(("t3",), Operator.NEG, (Temporary("t1"),)),
    Statement(("t4",), Operator.MUL, (Temporary("t2"), Temporary("c12"))),
    Statement(("t5",), Operator.ADD, (Temporary("t4"), Variable(1))),
    Statement(("t6",), Operator.SQRT, (Temporary("t2"),)),
    Statement(("t7",), Operator.ATAN2, (Temporary("t3"), Temporary("t6"))),
    Statement(("t8",), Operator.SELECT_LT, (Variable(0), HALF, Temporary("t3"), Temporary("t7"))),
)
Q = Array("q", (2,))
POSITION = Program(
    signature=positions(2),
    parameters=("far", "lambda"),
    angles=(AngleSum("1", "q1", False), AngleSum("12", "q1 + q2", True)),
    statements=STATEMENTS,
    outputs=(Temporary("t0"), Temporary("t8"), Temporary("t5")),
)
POSE = Program(
    signature=Signature(Quantity.POSE, ("tool",), 2, (Q,), (Array("base_T_tool", (4, 4), is_pose=True),)),
    parameters=("far", "lambda"),
    angles=(),
    statements=(),
    outputs=(ZERO, HALF, THIRD, FAR, Variable(1), *[ZERO] * 7),
)
KERNELS = RobotPrograms(ROBOT, (POSE, POSITION), DEFAULTS)


def emit() -> dict[str, str]:
    """Everything that is printed from the programs alone."""
    files = emit_formula(KERNELS) | emit_package(KERNELS, tuple(ScalarType), "0123456789abcdef")
    for real in ScalarType:
        files |= emit_kernel(KERNELS, real) | emit_batch(KERNELS, real)
    return files


if __name__ == "__main__":
    print(len(emit()), "sympy" in sys.modules)
