"""Every operator and operand is printed in every language, from programs that never saw sympy."""

from __future__ import annotations

import ctypes
import math
import os
import subprocess
import sys
from collections import namedtuple
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.c.syntax import c_printer
from kinegen.backends.python.formula import emit_formula
from kinegen.backends.scalar_types import ScalarType
from kinegen.ir.program import Constant, Operator, Program, Statement, Temporary, Variable
from kinegen.runtime.extension import lay_out
from tests.emit.emitted import COMPILERS, ROOT, run
from tests.emit.handwritten import DEFAULTS, KERNELS, POSITION, ROBOT, STATEMENTS, ZERO, emit
from tests.signatures import positions

EMITTERS = [(lambda kernels: emit_kernel(kernels, ScalarType.DOUBLE), "C"), (emit_formula, "Python")]
WITHOUT_SYMPY = """
import runpy, sys
sys.modules["sympy"] = None  # so that importing it is an error
runpy.run_module("tests.emit.handwritten", run_name="__main__")
"""


def body(text: str, head: str) -> list[str]:
    """The lines of one function that do something."""
    lines = text.split(head)[1].split("\n{\n")[1].split("\n}", maxsplit=1)[0].splitlines()
    return [line.strip() for line in lines if line and not line.strip().startswith("/*")]


def test_the_programs_use_every_operator() -> None:
    assert {statement.operator for statement in STATEMENTS} == set(Operator)


@pytest.mark.parametrize(("real", "f"), [(ScalarType.DOUBLE, ""), (ScalarType.FLOAT, "F")])
def test_c_prints_every_operator(real: ScalarType, f: str) -> None:
    stem = "made_up" if real is ScalarType.DOUBLE else "made_up_f32"
    lines = body(emit()[f"{stem}.c"], f"void {stem}_position(")
    third = real.literal(Fraction(-1, 3))
    pair = f"KINEGEN_{stem.upper()}_SINCOS"

    assert lines == [
        f"const {real} q12 = q[0] + q[1];",
        f"{real} s1;",
        f"{real} c1;",
        f"{pair}(q[0], &s1, &c1);",
        f"{real} s12;",
        f"{real} c12;",
        f"{pair}(q12, &s12, &c12);",
        f"const {real} t0 = s1 - 0.5{f};",
        "base_p_tool[0] = t0;",
        f"const {real} t1 = c1 * ({third});",
        f"const {real} t2 = params->far / params->lambda;",
        f"const {real} t3 = -t1;",
        f"const {real} t4 = t2 * c12;",
        f"const {real} t5 = t4 + q[1];",
        "base_p_tool[2] = t5;",
        f"const {real} t6 = {stem}_sqrt(t2);",
        f"const {real} t7 = {stem}_atan2(t3, t6);",
        f"const {real} t8 = (q[0] < 0.5{f}) ? t3 : t7;",
        "base_p_tool[1] = t8;",
    ]


def test_python_prints_every_operator_with_the_same_names_in_the_same_order() -> None:
    text = emit()["_numpy.py"]
    lines = [line.strip() for line in text.split("def position(")[1].splitlines()]
    lines = [line for line in lines if line and not line.startswith("#")]

    assert lines[lines.index('"""', 2) + 1 :] == [
        "params = params._make(map(q.dtype.type, params))  # in the number type of q, as in the C files",
        "q12 = q[0] + q[1]",
        "s1, c1 = _sincos(q[0])",
        "_, c12 = _sincos(q12)",
        "t0 = s1 - 0.5",
        "t1 = c1 * -0.3333333333333333",
        "t2 = params.far / params.lambda_",
        "t3 = -t1",
        "t4 = t2 * c12",
        "t5 = t4 + q[1]",
        "t6 = _sqrt(t2)",
        "t7 = _atan2(t3, t6)",
        "t8 = np.where(q[0] < 0.5, t3, t7)",
        "return (",
        "t0,",
        "t8,",
        "t5,",
        ")",
    ]


def expected(q: tuple[float, float], far: float, last: float) -> list[float]:
    """What the program by hand computes."""
    third = math.cos(q[0]) / 3
    second = third if q[0] < 0.5 else math.atan2(third, math.sqrt(far / last))
    return [math.sin(q[0]) - 0.5, second, far / last * math.cos(q[0] + q[1]) + q[1]]


def test_python_computes_every_operator() -> None:
    namespace: dict[str, Any] = {}
    exec(emit()["_numpy.py"], namespace)  # noqa: S102 - our own output
    params = namedtuple("Params", "far lambda_")(2.0, 5.0)  # noqa: PYI024 - short
    q = np.array([[0.3, -1.0, 2.0], [0.7, 0.1, -3.0]])
    found = np.array(namespace["position"](q, params)).T

    np.testing.assert_allclose(found, [expected((a, b), 2.0, 5.0) for a, b in q.T], rtol=1e-15, atol=1e-15)


@pytest.mark.skipif(not COMPILERS, reason="needs gcc or clang")
def test_c_computes_every_operator(tmp_path: Path) -> None:
    lay_out(tmp_path, emit())
    library = tmp_path / "made_up.so"
    run([COMPILERS[0], "-std=c99", "-shared", "-fPIC", tmp_path / "made_up.c", "-o", library])
    params, out = (ctypes.c_double * 2)(2.0, 5.0), (ctypes.c_double * 3)()
    for q in ((0.3, 0.7), (0.7, 0.3)):
        ctypes.CDLL(str(library)).made_up_position((ctypes.c_double * 2)(*q), params, out)

        assert list(out) == pytest.approx(expected(q, 2.0, 5.0), rel=1e-15)


def test_outputs_may_be_inputs_and_constants() -> None:
    lines = body(emit()["made_up.c"], "void made_up_fk(")

    assert lines == [
        "base_T_tool[0] = 0.0;",
        "base_T_tool[1] = 0.5;",
        "base_T_tool[2] = -0.3333333333333333;",
        "base_T_tool[3] = params->far;",
        "base_T_tool[4] = q[1];",
        *(f"base_T_tool[{entry}] = 0.0;" for entry in range(5, 15)),
        "base_T_tool[15] = 1.0;",
    ]


def constants_only(parameters: bool) -> Program:
    return Program(positions(2), ("far", "lambda") if parameters else (), (), (), (ZERO, ZERO, ZERO))


def test_arguments_that_nothing_reads_are_named_so() -> None:
    kernels = RobotPrograms(ROBOT, (constants_only(True),), DEFAULTS)
    c = body(emit_kernel(kernels, ScalarType.DOUBLE)["made_up.c"], "void made_up_position(")
    python = emit_formula(kernels)["_numpy.py"]

    assert c[:2] == ["(void)q;", "(void)params;"]
    assert "    del q\n    del params\n" in python
    assert "_sincos" not in python


def with_statement(statement: Statement) -> RobotPrograms:
    program = replace(POSITION, statements=(statement,), outputs=(Temporary("t0"), ZERO, ZERO), angles=())
    return RobotPrograms(ROBOT, (program,), DEFAULTS)


class Strange:
    """No operand that any language knows."""

    def __repr__(self) -> str:
        return "Strange()"


@pytest.mark.parametrize(
    ("emitter", "language"), [(lambda k: emit_kernel(k, ScalarType.DOUBLE), "C"), (emit_formula, "Python")]
)
def test_an_operand_that_a_language_does_not_know_is_an_error(emitter: Any, language: str) -> None:
    kernels = with_statement(Statement(("t0",), Operator.NEG, (Strange(),)))  # type: ignore[arg-type]

    with pytest.raises(TypeError, match=rf"{language} has no form for the operand Strange\(\)"):
        emitter(kernels)


class Root(str):
    """An operator that no language knows yet."""

    arity = 2
    results = 1


@pytest.mark.parametrize(
    ("emitter", "language"), [(lambda k: emit_kernel(k, ScalarType.DOUBLE), "C"), (emit_formula, "Python")]
)
def test_an_operator_that_a_language_does_not_know_is_an_error(emitter: Any, language: str) -> None:
    kernels = with_statement(Statement(("t0",), Root("root"), (Variable(0), Variable(1))))  # type: ignore[arg-type]

    with pytest.raises(TypeError, match=rf"{language} has no form for the operator 'root'"):
        emitter(kernels)


@pytest.mark.parametrize("real", list(ScalarType))
def test_a_negative_number_stands_in_brackets_behind_an_operator_and_without_them_alone(real: ScalarType) -> None:
    printer = c_printer(real, "sincos", (), "made_up")
    f = "F" if real is ScalarType.FLOAT else ""

    assert printer.operand(Constant(Fraction(-1, 2))) == f"(-0.5{f})"
    assert printer.assignment("out[0]", Constant(Fraction(-1, 2))) == f"out[0] = -0.5{f};"


def test_emitting_needs_no_sympy() -> None:
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_SYMPY], cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )

    assert done.stderr == ""
    assert done.stdout.split()[0] == str(len(emit()))
    assert KERNELS.robot.name == "made_up"
