"""The routines, one source for every language: NumPy, C and the bits of both."""

from __future__ import annotations

import re
from collections import namedtuple
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.printing import CODE
from kinegen.backends.python.formula import emit_formula
from kinegen.backends.scalar_types import ScalarType
from kinegen.ir.program import Constant, Operator, Variable
from kinegen.ir.routine_notation import read_routine
from kinegen.model.outputs import Quantity, parse_quantity
from kinegen.runtime.compiler import find_compiler
from kinegen.verify.invocations import compile_plain
from kinegen.verify.samples import proof_samples
from tests.emit.emitted import ROOT, kernels
from tests.functions.library import COMPILERS, DTYPES, compile_functions

ROUTINES = [(real, operator) for real in ScalarType for operator in (Operator.SINCOS, Operator.ATAN2)]
SPECIAL = (0.0, -0.0, 1.0, -1.0, np.inf, -np.inf, np.nan, 1e-45, 1e-310, 5e-324, 1e-30, 1e30, 3e38, 1e300, 1.7e308)
ENDS = (12000.0, 12001.0, 1e5, 100001.0, np.pi / 4, np.pi / 2, np.pi, 29 * np.pi / 2)
BOTH = tuple(map(parse_quantity, ("rpy_zyx", "pose")))
KERNELS = [
    ("puma560", ("pose", "fk_jacobian", "rpy_zyx", "inverse")),
    ("ur5", ("pose", "inverse", "quaternion_wxyz")),
    ("scara", ("pose", "twist", "inverse")),
    ("hand", ("pose", "frames")),
    ("calibrated_2r", ("pose", "jacobian")),
    ("screw", ("pose",)),
]

needs_compiler = pytest.mark.skipif(not COMPILERS, reason="needs gcc or clang")


def numpy_form(name: str, quantities: tuple[Quantity, ...], monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """The NumPy form of a robot, with the functions of C."""
    monkeypatch.setenv("KINEGEN_NUMPY_FUNCTIONS", "c")
    namespace: dict[str, Any] = {}
    exec(emit_formula(kernels(name, quantities))["_numpy.py"], namespace)  # noqa: S102 - our own output
    return namespace


def same_bits(found: NDArray[Any], wanted: NDArray[Any]) -> bool:
    """Whether all numbers are the same, signs of zeros included; one NaN is as good as another."""
    same = (found == wanted) & (np.signbit(found) == np.signbit(wanted))
    return bool(found.dtype == wanted.dtype and (same | (np.isnan(found) & np.isnan(wanted))).all())


def points(real: ScalarType) -> tuple[NDArray[Any], NDArray[Any]]:
    """Special and random numbers, in all pairs or at random."""
    random = np.random.default_rng(0)
    with np.errstate(over="ignore"):
        special = np.array([*SPECIAL, *ENDS], DTYPES[real])
    pairs = np.array([(a, b) for a in special for b in special]).T
    angles = random.uniform(-1, 1, (2, 40000)) * 10.0 ** random.uniform(-20, 6, (2, 40000))
    multiples = np.tile(np.arange(-9000, 9000) * (np.pi / 4), (2, 1))
    y, x = np.concatenate([pairs, angles.astype(DTYPES[real]), multiples.astype(DTYPES[real])], axis=1)
    return y, x


@needs_compiler
@pytest.mark.parametrize("real", list(ScalarType))
def test_numpy_computes_the_functions_of_c_on_request(
    real: ScalarType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiled = compile_functions(tmp_path / real, real, COMPILERS[0], "-O1", "-ffp-contract=off")
    form = numpy_form("puma560", BOTH, monkeypatch)
    y, x = points(real)
    with np.errstate(all="ignore"):
        pair, angle = form["_sincos"](x), form["_atan2"](y, x)

    for found, wanted in zip(pair, compiled.sincos(x), strict=True):
        assert same_bits(found, wanted)
    assert same_bits(angle, compiled.atan2(y, x))


@needs_compiler
def test_numpy_has_its_own_functions_unless_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("KINEGEN_NUMPY_FUNCTIONS", raising=False)
    namespace: dict[str, Any] = {}
    exec(emit_formula(kernels("puma560", BOTH))["_numpy.py"], namespace)  # noqa: S102 - our own output
    x = np.linspace(-3.0, 3.0, 1000)

    assert same_bits(namespace["_sincos"](x)[0], np.sin(x))


@needs_compiler
@pytest.mark.parametrize(("name", "outputs"), KERNELS, ids=[name for name, _ in KERNELS])
def test_whole_kernels_of_numpy_have_the_bits_of_c(
    name: str, outputs: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = kernels(name, tuple(map(parse_quantity, outputs)))
    form = numpy_form(name, tuple(map(parse_quantity, outputs)), monkeypatch)
    compiled = compile_plain(given, emit_kernel(given, ScalarType.DOUBLE), tmp_path, find_compiler())
    names = [each.name for each in given.robot.runtime_parameters]
    extra = [namedtuple("Params", names)(*map(float, given.defaults))] if names else []  # noqa: PYI024 - short
    q = proof_samples(given.robot)[:500]
    poses = compiled.call(next(each for each in given.programs if each.quantity == Quantity.POSE), (q,))[0]
    for program in given.programs:
        arrays = [poses if "T" in each.name else q for each in program.signature.inputs]
        rows = [array.reshape(len(array), -1).T[: each.size] for array, each in zip(arrays, program.signature.inputs)]
        with np.errstate(all="ignore"):
            found = [np.broadcast_to(row, len(q)) for row in form[program.quantity.function](*rows, *extra)]
        wanted = compiled.call(program, tuple(arrays))
        numbers = [
            array.reshape(len(q), result.blocks, -1)[:, :, : result.size // result.blocks].reshape(len(q), -1)
            for array, result in zip(wanted, program.signature.results, strict=True)
        ]

        assert same_bits(np.array(found).T, np.concatenate(numbers, axis=1)), program.quantity


@pytest.mark.parametrize(("real", "operator"), ROUTINES)
def test_numbers_are_what_c_reads(real: ScalarType, operator: Operator) -> None:
    """A NumPy form reads numbers of floats as doubles, and rounds again: to the same float."""
    for statement in CODE[real][operator].statements:
        for constant in (each for each in statement.operands if isinstance(each, Constant)):
            assert DTYPES[real](float(constant.value)) == real.round(constant.value)


HOLDERS = (
    *("c/_sincos_f32.c.jinja", "c/_sincos_f64.c.jinja", "c/_atan2_f32.c.jinja"),
    *("javascript/_sincos.js.jinja", "javascript/_atan2.js.jinja"),
)
"""The templates of functions whose statements are routines."""


@pytest.mark.parametrize("template", HOLDERS)
def test_templates_hold_no_copy_of_a_routine(template: str) -> None:
    text = (ROOT / "templates" / template).read_text(encoding="utf-8")

    assert not re.search(r"const .* = ", text)


def test_routines_are_read_as_they_are_written() -> None:
    routine = read_routine(
        "made_up",
        ("x",),
        """
        # First,
        # in two lines.
        a = x * -0.5
        b = -a

        # Then.
        c = a < b ? b : 1e-3
        return c
        """,
    )

    assert [passage.title for passage in routine.passages] == ["First,\nin two lines.", "Then."]
    assert [each.operator for each in routine.statements] == [Operator.MUL, Operator.NEG, Operator.SELECT_LT]
    assert routine.statements[0].operands == (Variable(0), Constant(Fraction(-1, 2)))
    assert routine.statements[2].operands[3] == Constant(Fraction(1, 1000))


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("a = x + 1.0\na = x + 2.0\nreturn a", "a is defined twice"),
        ("a = b + 1.0\nreturn a", r"\['b'\] are used before they are defined"),
        ("a = x + 1.0\nreturn x", r"\['a'\] are never used"),
        ("a = x + 1.0 + 2.0\nreturn a", "'a = x [+] 1.0 [+] 2.0' is not an operation"),
        ("a = sin(x)\nreturn a", "is not an operation"),
        ("a = x + 1.0", "made_up returns nothing"),
    ],
)
def test_unsound_routines_are_refused(code: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        read_routine("made_up", ("x",), code)
