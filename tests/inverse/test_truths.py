"""Validity in C: bytes of 1 and 0 by branch, solutions by branch and joint, in the scalar kernel and in batches."""

from __future__ import annotations

import subprocess
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path

import pytest

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.batch import emit_batch
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.c.syntax import truth_places, truths_of
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import lower_file
from kinegen.errors import KinegenError
from kinegen.ir.program import Constant, Operator, Program, Statement, Temporary
from kinegen.model.outputs import Kind, Quantity
from kinegen.verify.frama_c.claims import subjects
from tests.emit.emitted import COMPILERS, STRICT, run

ROBOTS = Path(__file__).parents[2] / "robots"
INVERSE = Quantity(Kind.INVERSE)


@cache
def kernels(name: str) -> RobotPrograms:
    return lower_file(ROBOTS / f"{name}.yaml", (Quantity.POSE, INVERSE))


def program(name: str) -> Program:
    return kernels(name).programs[-1]


@cache
def solved() -> tuple[str, ...]:
    """The robots with a closed-form inverse."""
    found = []
    for path in sorted(ROBOTS.glob("*.yaml")):
        try:
            kernels(path.stem)
        except KinegenError:
            continue
        found.append(path.stem)
    return tuple(found)


def test_every_validity_is_a_truth_value_from_its_first_condition_on() -> None:
    assert len(solved()) > 15
    for name in solved():
        truths = truths_of(program(name))
        made = {statement.name: statement for statement in program(name).statements if len(statement.results) == 1}
        outputs = [
            each for each, holds in zip(program(name).outputs, truth_places(program(name)), strict=True) if holds
        ]

        assert all(isinstance(each, Temporary) and each.name in truths for each in outputs), name
        assert {made[each].operator for each in truths} <= {Operator.SELECT_LT, Operator.MUL}, name
        for statement in program(name).statements:
            compared = statement.operands[:2] if statement.operator is Operator.SELECT_LT else statement.operands
            used = {each.name for each in compared if isinstance(each, Temporary)} & truths
            assert not used or (statement.operator is Operator.MUL and statement.name in truths), (name, statement)


def test_a_result_that_is_no_truth_value_is_refused() -> None:
    whole = program("scara")
    number = whole.outputs[0]
    spoilt = replace(whole, outputs=(*whole.outputs[:-1], number))

    with pytest.raises(ValueError, match="declared as a Boolean is not one"):
        truths_of(spoilt)


def test_a_condition_that_is_also_a_number_is_refused() -> None:
    """Bytes are not added to numbers: that would be a conversion which the operations do not count."""
    whole = program("scara")
    first, holds = whole.outputs[0], whole.outputs[-1]
    added = Statement(("added",), Operator.ADD, (first, holds))
    mixed = replace(whole, statements=(*whole.statements, added), outputs=(Temporary("added"), *whole.outputs[1:]))

    assert isinstance(holds, Temporary)
    assert holds.name in truths_of(whole)
    with pytest.raises(ValueError, match="is not one"):
        truths_of(mixed)


def test_constants_are_truth_values_only_as_one_and_zero() -> None:
    whole = program("scara")

    assert truths_of(replace(whole, outputs=(*whole.outputs[:-1], Constant(Fraction(1))))) == truths_of(whole)
    with pytest.raises(ValueError, match="is not one"):
        truths_of(replace(whole, outputs=(*whole.outputs[:-1], Constant(Fraction(2)))))


@pytest.mark.parametrize("real", list(ScalarType))
def test_headers_name_the_shape_and_the_type(real: ScalarType) -> None:
    stem = "puma560" if real is ScalarType.DOUBLE else "puma560_f32"
    scalar = " ".join(emit_kernel(kernels("puma560"), real)[f"{stem}.h"].split())
    batch = emit_batch(kernels("puma560"), real)[f"{stem}_batch.h"]

    assert "#include <stdint.h>" in scalar
    assert f"{real} solutions[PUMA560_BRANCHES][PUMA560_DOF], uint8_t valid[PUMA560_BRANCHES]);" in scalar
    assert f"{real} *solutions, ptrdiff_t solutions_stride, uint8_t *valid, ptrdiff_t valid_stride" in batch
    assert f"{real} *q, ptrdiff_t q_stride, uint8_t *exists, ptrdiff_t exists_stride" in batch


def test_headers_without_an_inverse_include_nothing_new() -> None:
    pose = replace(kernels("puma560"), programs=kernels("puma560").programs[:1])

    assert "#include" not in emit_kernel(pose, ScalarType.DOUBLE)["puma560.h"]


def test_no_truth_value_is_computed_in_floating_point() -> None:
    for name in solved():
        text = emit_kernel(kernels(name), ScalarType.FLOAT)[f"{name}_f32.c"].partition(f"{name}_f32_inverse(")[2]
        body = text.partition("\n}\n")[0]
        assert "? 1.0F : 0.0F" not in body, name
        assert "uint8_t" in body, name


USER = """
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "NAME.h"
#include "NAME_batch.h"

enum { COUNT = 11, B = NAME_BRANCHES, J = NAME_DOF };

int main(void)
{
    static double poses[COUNT][16], all[COUNT][B][J];
    static unsigned char holds[COUNT * B + 2], rows[B * COUNT], exists[COUNT + 2];
    static double flat[B * J * COUNT], near[COUNT][J], chosen[COUNT][J];
    int wrong = 0, found = 0;
    memset(holds, 77, sizeof holds);
    memset(exists, 77, sizeof exists);
    for (int i = 0; i < COUNT; i++) {
        for (int j = 0; j < J; j++) near[i][j] = 0.1 * (i + 1) * (j - 1);
        NAME_fk(near[i], poses[i]);
    }
    poses[3][3] = (double)NAN;
    poses[4][7] = (double)INFINITY;
    poses[5][3] = 1e6;
    NAME_inverse_batch(COUNT, &poses[0][0], 16, 1, &all[0][0][0], B * J, holds + 1, B, 0);
    NAME_inverse_batch(COUNT, &poses[0][0], 16, 1, flat, COUNT, rows, COUNT, 2);
    NAME_inverse_nearest_batch(COUNT, &poses[0][0], 16, 1, &near[0][0], J, 1, &chosen[0][0], J, exists + 1, 1, 0);
    wrong += (holds[0] != 77) + (holds[COUNT * B + 1] != 77) + (exists[0] != 77) + (exists[COUNT + 1] != 77);
    for (int i = 0; i < COUNT; i++) {
        double solutions[NAME_BRANCHES][NAME_DOF];
        uint8_t valid[NAME_BRANCHES];
        double q[J];
        memset(valid, 77, sizeof valid);
        NAME_inverse(poses[i], solutions, valid);
        wrong += NAME_inverse_nearest(poses[i], near[i], q) != exists[1 + i];
        for (int branch = 0; branch < B; branch++) {
            const int bad = (i >= 3) && (i <= 5) && valid[branch] != 0;
            wrong += bad + (valid[branch] > 1) + (valid[branch] != holds[1 + i * B + branch]);
            wrong += valid[branch] != rows[branch * COUNT + i];
            found += valid[branch];
            for (int joint = 0; (joint < J) && (valid[branch] != 0); joint++) {
                wrong += !(fabs(solutions[branch][joint] - all[i][branch][joint]) < 1e-12);
                wrong += !(fabs(solutions[branch][joint] - flat[(branch * J + joint) * COUNT + i]) < 1e-12);
            }
        }
    }
    printf("%d %d\\n", wrong, found > COUNT / 2);
    return 0;
}
"""


@pytest.mark.parametrize("name", ["puma560", "scara", "al5d"])
@pytest.mark.parametrize("language", ["c99", "c++11"])
@pytest.mark.parametrize("compiler", COMPILERS)
def test_a_user_indexes_by_branch_and_joint(compiler: str, language: str, name: str, tmp_path: Path) -> None:
    """In C and C++; NaN, infinity and targets out of reach have no solution, and no byte beyond is written."""
    for file, text in {
        **emit_kernel(kernels(name), ScalarType.DOUBLE),
        **emit_batch(kernels(name), ScalarType.DOUBLE),
    }.items():
        (tmp_path / file).write_text(text, encoding="utf-8")
    main = USER.replace("NAME_BRANCHES", f"{name.upper()}_BRANCHES").replace("NAME_DOF", f"{name.upper()}_DOF")
    (tmp_path / "main.c").write_text(main.replace("NAME", name), encoding="utf-8")
    for file in (f"{name}.c", f"{name}_batch.c"):
        run([compiler, *STRICT[compiler].split(), "-O1", "-c", file], tmp_path)
    kind = "c" if language == "c99" else "c++"
    run([compiler, "-x", kind, f"-std={language}", "-Wall", "-Wextra", "-Werror", "-c", "main.c"], tmp_path)
    run([compiler, "main.o", f"{name}.o", f"{name}_batch.o", "-lm", "-o", "main"], tmp_path)

    assert subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=True).stdout == "0 1\n"


@pytest.mark.parametrize("compiler", COMPILERS)
def test_the_page_shows_a_call_that_compiles(compiler: str, tmp_path: Path) -> None:
    page = (ROBOTS.parent / "docs" / "inverse.md").read_text(encoding="utf-8")
    (shown,) = (part for part in page.split("```c\n")[1:] if part.startswith("float solutions["))
    body = shown.partition("```")[0]
    head = '#include "puma560_f32.h"\nvoid consider(const float q[PUMA560_DOF]);\nvoid solve(const float *target);\n'
    (tmp_path / "puma560_f32.h").write_text(emit_kernel(kernels("puma560"), ScalarType.FLOAT)["puma560_f32.h"], "utf-8")
    (tmp_path / "main.c").write_text(f"{head}void solve(const float *target)\n{{\n{body}}}\n", "utf-8")

    run([compiler, *STRICT[compiler].split(), "-c", "main.c"], tmp_path)


def test_frama_c_is_asked_whether_each_is_one_or_zero() -> None:
    (inverse,) = (
        each for each in subjects(kernels("scara"), (ScalarType.FLOAT,), integers=False) if each.called == "inverse"
    )
    main = inverse.driver.files["main.c"]

    assert "uint8_t valid[SCARA_BRANCHES];" in main
    assert "float solutions[SCARA_BRANCHES][SCARA_DOF];" in main
    assert "assert \\initialized(&entry1[i]) && entry1[i] <= 1;" in main
