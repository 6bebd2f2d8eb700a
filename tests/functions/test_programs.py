"""Programs with roots, angles of points and selections give the same bits in every form, and are those of sympy."""

from __future__ import annotations

import re
from collections import namedtuple
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.batch import emit_batch
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.python.formula import emit_formula
from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.dispatch import derive
from kinegen.derive.expressions import Candidate, Expressions
from kinegen.errors import KinegenError
from kinegen.io.load import loads
from kinegen.ir.fixed_point.value_classes import find_kinds
from kinegen.ir.lower import lower, runtime_defaults
from kinegen.ir.program import Operator, Program, Statement, Temporary, Variable, count
from kinegen.model.outputs import Array, Quantity, Signature
from tests.functions.library import COMPILERS, DTYPES, compile_functions, run
from tests.functions.programs import DOF, ROBOT, Library, formula, kernels, programs, signature
from tests.sincos.test_form import STRICT

SEED = 1732050807
PLAIN = ("-O1", "-ffp-contract=off")
VECTOR = ("-O2", "-ffp-contract=off", "-march=native")

POINTS = np.random.default_rng(SEED).normal(size=(50, DOF))
Q = sp.symbols("q1:4")
EXPRESSIONS = (
    sp.sqrt(Q[0] ** 2 + 1),
    -sp.sqrt(4 * Q[0] * Q[1] + 90),
    1 / sp.sqrt(2 + sp.cos(Q[0])),
    (Q[0] ** 2 + Q[1] ** 2) ** sp.Rational(3, 2),
    (Q[0] ** 2 + 1) ** sp.Rational(-5, 2) * Q[2],
    sp.atan2(-Q[0], Q[1]),
    sp.atan2(Q[0] - Q[1], -Q[2]),
    sp.atan2(Q[0], sp.Rational(1, 3)),
    sp.atan2(sp.Integer(-2), Q[0]),
    sp.atan(Q[0] * Q[2]),
    sp.Abs(Q[0] - 2),
    sp.Piecewise((Q[0], Q[0] < Q[1]), (Q[1], True)),
    sp.Piecewise((-Q[0], Q[0] > sp.Rational(1, 5)), (sp.sqrt(2), True)),
    sp.Piecewise((sp.Integer(-1), -Q[0] < 0), (sp.Integer(1), True)),
    sp.sin(sp.atan2(Q[0], Q[1]) + sp.cos(Q[2])),
)

needs_a_compiler = pytest.mark.skipif(not COMPILERS, reason="needs gcc or clang")
Floats = NDArray[np.floating]


def joint_vectors(real: ScalarType = ScalarType.DOUBLE) -> Floats:
    """Random ones, some with zeros of both signs, equal entries or what is no number."""
    random = np.random.default_rng(SEED)
    q = random.normal(size=(40, DOF)) * 3
    q[:4, 0], q[4:8, 1], q[8:12, 2] = 0.0, -0.0, q[8:12, 0]
    q[12], q[13], q[14] = np.nan, np.inf, 0.0
    return q.astype(DTYPES[real])


def same(found: Floats, expected: Floats) -> None:
    """Equal numbers of one type; NumPy's root of a negative zero is one too, and ours is not."""
    np.testing.assert_array_equal(found, expected)
    assert found.dtype == expected.dtype


def same_bits(found: Floats, expected: Floats) -> None:
    """Equal bits, but for what is in a NaN."""
    same(found, expected)
    assert (np.signbit(found) == np.signbit(expected))[~np.isnan(found)].all()


# From program to code -------------------------------------------------------------------------------------------------


@needs_a_compiler
@pytest.mark.parametrize("real", list(ScalarType))
@settings(max_examples=2, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_every_form_of_a_program_gives_the_same_bits(
    real: ScalarType, data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Scalar and batch kernels, and the NumPy form once it takes sines, cosines and angles from them."""
    drawn = [data.draw(programs(f"p{number}")) for number in range(8)]
    folder, every = tmp_path_factory.mktemp("drawn"), kernels(*drawn)
    library = Library(folder, every, real, [COMPILERS[0], *PLAIN], [COMPILERS[-1], *VECTOR])
    own = compile_functions(folder, real, COMPILERS[0], *PLAIN)
    q = joint_vectors(real)
    for program in drawn:
        scalar = library.one_by_one(program, q)

        same_bits(library.at_once(program, q), scalar)
        same(formula(every, program, q, own), scalar)


@needs_a_compiler
@pytest.mark.parametrize("real", list(ScalarType))
def test_the_angles_of_numpy_are_those_of_c(real: ScalarType, tmp_path: Path) -> None:
    """The same where zeros, infinities and NaN decide, and elsewhere but for the last places."""
    own = compile_functions(tmp_path, real, COMPILERS[0], *PLAIN)
    program = Program(
        signature("angle", 1),
        (),
        (),
        (Statement(("t0",), Operator.ATAN2, (Variable(0), Variable(1))),),
        (Temporary("t0"),),
    )
    special = np.array([0.0, -0.0, 1.0, -1.0, np.inf, -np.inf, np.nan, 3.0, 1e-20])
    random = np.random.default_rng(SEED).normal(size=(2, 10_000))
    y, x = (
        np.concatenate([part.ravel(), more]) for part, more in zip(np.meshgrid(special, special), random, strict=True)
    )
    q = np.stack([y, x, x], axis=1).astype(DTYPES[real])
    found = formula(kernels(program), program, q)[:, 0]
    expected = own.atan2(q[:, 0], q[:, 1])

    assert found.dtype == DTYPES[real]
    np.testing.assert_allclose(found, expected, rtol=4 * np.finfo(found.dtype).eps)
    np.testing.assert_array_equal(
        found[(y == 0) | np.isinf(y) | np.isinf(x)], expected[(y == 0) | np.isinf(y) | np.isinf(x)]
    )


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("real", list(ScalarType))
@pytest.mark.parametrize("extra", [(), ("-march=haswell",)], ids=["plain", "avx2"])
def test_tile_loops_with_selections_become_vector_code(
    compiler: str, real: ScalarType, extra: tuple[str, ...], tmp_path: Path
) -> None:
    """Both sides of the selections are computed for them alone, which makes gcc branch where it can."""
    a, b, c = Q
    one, other = sp.symbols("one other")
    definitions = (
        (one, sp.Piecewise((sp.sqrt(a * a + 1) * c, a < b), (a + b * c, True))),
        (other, sp.Piecewise((1, one > 2), (0, True))),
    )
    program = lower(
        Expressions(signature("made", 2), Q, (), (Candidate("", definitions, (one, other * sp.atan2(one, b))),))
    )
    for name, text in (emit_kernel(kernels(program), real) | emit_batch(kernels(program), real)).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    stem = "drawn" if real is ScalarType.DOUBLE else "drawn_f32"
    flags = ["-std=c99", "-O3", *extra, "-S", "-o", "-"]
    listing = run([compiler, *flags, tmp_path / f"{stem}_batch.c"])
    packed = "pd" if real is ScalarType.DOUBLE else "ps"

    assert len(re.findall(rf"\bv?div{packed}\b", listing)) >= 1
    if compiler == "gcc":  # clang keeps scalar loops too, for arrays that overlap
        assert re.findall(rf"\bv?(?:mul|div)s{packed[1]}\b", listing) == []


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("real", list(ScalarType))
def test_the_files_of_a_program_compile_silently(compiler: str, real: ScalarType, tmp_path: Path) -> None:
    program = lowered(*EXPRESSIONS)
    for name, text in (emit_kernel(kernels(program), real) | emit_batch(kernels(program), real)).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
        assert max(len(line) for line in text.splitlines() if line.startswith(" *")) <= 120
        if name.endswith(".c"):
            for level in ("-O0", "-O2"):
                run([compiler, *STRICT[compiler].split(), level, "-c", tmp_path / name, "-o", tmp_path / "kernel.o"])
                assert run(["nm", "-u", tmp_path / "kernel.o"]) == ""


def test_files_hold_the_functions_that_they_use_alone() -> None:
    a, b, _ = Q
    texts = {
        name: emit_kernel(kernels(lowered(expression)), ScalarType.DOUBLE)["drawn.c"]
        for name, expression in (("sqrt", sp.sqrt(a)), ("atan2", sp.atan2(a, b)), ("neither", a * b))
    }

    assert [name for name, text in texts.items() if " drawn_sqrt(" in text] == ["sqrt"]
    assert [name for name, text in texts.items() if " drawn_atan2(" in text] == ["atan2"]
    assert [name for name, text in texts.items() if "stdint.h" in text] == ["sqrt", "atan2"]
    assert [name for name, text in texts.items() if "wider register" in text] == ["sqrt", "atan2"]


def test_manuals_say_what_functions_promise() -> None:
    a, b, c = Q
    program = lowered(sp.sqrt(a), sp.atan2(a, b), sp.Piecewise((a, a < c), (b, True)))
    header = " ".join(emit_kernel(kernels(program), ScalarType.DOUBLE)["drawn.h"].replace("\n *", " ").split())

    assert "Square roots are correctly rounded; that of a negative number is NaN." in header
    assert "Arc tangents of two numbers are within 1.6 units in the last place; that of two zeros is 0" in header
    assert "Costs 1 square root, 1 arc tangent, 1 selection." in header
    assert "No bound is derived for functions with roots, arc tangents or selections." in header
    assert str(count(program)) == "0 mul + 0 add + 1 sqrt + 1 atan2 + 1 select"


# From sympy to program ------------------------------------------------------------------------------------------------


def lowered(*entries: sp.Expr) -> Program:
    """The program that computes some expressions in Q."""
    return lower(Expressions(signature("made", len(entries)), Q, (), (Candidate("", (), entries),)))


def evaluated(*entries: sp.Expr) -> Floats:
    """What sympy makes of the same expressions, by way of NumPy."""
    with np.errstate(all="ignore"):
        results = sp.lambdify(Q, entries, "numpy")(*POINTS.T)
    return np.array([np.broadcast_to(result, len(POINTS)) for result in results]).T


def test_expressions_become_programs() -> None:
    program = lowered(*EXPRESSIONS)

    np.testing.assert_allclose(formula(kernels(program), program, POINTS), evaluated(*EXPRESSIONS), rtol=1e-12)


@st.composite
def signed(draw: st.DrawFn, depth: int = 3) -> sp.Expr:
    """An expression full of signs that could get lost."""
    if depth == 0:
        return draw(st.sampled_from([*Q, -Q[0], -Q[1], sp.Integer(-2), Q[0] - Q[1], -Q[1] - Q[2]]))
    first, second = draw(signed(depth - 1)), draw(signed(depth - 1))
    sign = draw(st.sampled_from([1, -1]))
    match draw(st.integers(0, 6)):
        case 0:
            return sign * sp.sqrt(1 + first**2)
        case 1:
            return sign * sp.atan2(first, second)
        case 2:
            return sign * sp.Piecewise((first, Q[0] < Q[1]), (second, True), evaluate=False)
        case 3:
            return sp.Piecewise((-first, -Q[0] > -Q[2]), (-second, True), evaluate=False)
        case 4:
            return sign * sp.sin(first) * sp.cos(second)
        case 5:
            return sign * first * second
        case _:
            return first - second


@settings(max_examples=40, deadline=None)
@given(st.lists(signed(), min_size=1, max_size=4))
def test_no_sign_is_lost(entries: list[sp.Expr]) -> None:
    program = lowered(*entries)

    np.testing.assert_allclose(
        formula(kernels(program), program, POINTS), evaluated(*entries), rtol=1e-9, atol=1e-9, err_msg=str(entries)
    )


def test_angles_may_be_computed_from_sines() -> None:
    """Pairs that depend on others come after them, with names that no joint has."""
    a, b, c = Q
    angle = sp.atan2(sp.sin(a), b) + c
    program = lowered(sp.sin(angle), sp.cos(angle) * sp.cos(a))
    names = [name for statement in program.statements for name in statement.results]

    assert [each.label for each in program.angles] == ["1", "u1"]
    assert names.index("s1") < names.index("qu1") < names.index("su1")
    np.testing.assert_allclose(
        formula(kernels(program), program, POINTS), evaluated(sp.sin(angle), sp.cos(angle) * sp.cos(a)), rtol=1e-12
    )


def test_both_signs_of_a_selection_stand_before_it() -> None:
    a, b, _ = Q
    program = lowered(sp.Piecewise((-a, -a < -b), (-b, True)), 3 - sp.Piecewise((-a, a > b), (-b, True)))

    assert [statement.operator for statement in program.statements].count(Operator.SELECT_LT) == 1
    assert Operator.NEG not in {statement.operator for statement in program.statements[:-2]}


@pytest.mark.parametrize(
    "expression",
    [
        sp.Piecewise((1, sp.Symbol("q1") <= 0), (2, True)),
        sp.Piecewise((1, sp.Symbol("q1") < 0), (2, sp.Symbol("q1") < 1), (3, True)),
        sp.Piecewise((1, sp.Symbol("q1") < 0)),
        sp.Symbol("q1") ** sp.Rational(1, 3),
        sp.asin(sp.Symbol("q1")),
    ],
    ids=str,
)
def test_what_no_kernel_has_is_refused_in_words(expression: sp.Expr) -> None:
    with pytest.raises(KinegenError, match="a kernel cannot evaluate '"):
        lowered(expression)


def test_integer_kernels_are_refused_in_words() -> None:
    """A position with an arc tangent in it, as roots of runtime parameters may bring along."""
    position = Signature(Quantity.POSITION, ("tool",), DOF, (Array("q", (DOF,)),), (Array("base_p_tool", (3,)),))
    program = lower(Expressions(position, Q, (), (Candidate("", (), (sp.atan2(Q[0], 2), sp.S.Zero, sp.S.One)),)))

    with pytest.raises(KinegenError, match="no q30 kernels for drawn: integers have no roots, arc tangents and select"):
        find_kinds(ROBOT, program)


def test_runtime_parameters_may_stand_under_a_root() -> None:
    text = """
kinegen: 1
name: diagonal
convention: standard
units: {length: m, angle: rad}
parameters:
  width: {value: 0.3, runtime: true}
  height: {value: 0.4, runtime: true}
joints:
  - {name: one, theta: q, d: 0, a: sqrt(width*width + height*height), alpha: 0}
"""
    robot = loads(text, "diagonal.yaml")
    program = lower(derive(robot, Quantity.POSITION))
    namespace: dict[str, Any] = {}
    exec(emit_formula(RobotPrograms(robot, (program,), runtime_defaults(robot)))["_numpy.py"], namespace)  # noqa: S102 - ours
    params = namedtuple("Params", "width height")(0.3, 0.4)  # noqa: PYI024 - short
    q = np.array([[0.0, 1.0]])

    assert count(program).roots == 1
    np.testing.assert_allclose(
        namespace["position"](q, params)[:2], [0.5 * np.cos(q[0]), 0.5 * np.sin(q[0])], rtol=1e-15
    )
