"""What the emitted files say, and how: no floating point, one operation a statement, the same order as the floats."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import jinja2.meta
import pytest

from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.fixed_point.files import emit_fixed, fixed_context
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import environment
from kinegen.support.naming import Q30, c_file
from tests.fixed.kernels import ROBOTS, arm, fixed, planned, texts

ROOT = ROBOTS.parent


def code(text: str) -> str:
    """C without its comments and the digest of the model."""
    return re.sub(r"/\*.*?\*/|\b0x[0-9a-f]{16}U\b", "", text, flags=re.DOTALL)


def body(text: str, name: str) -> str:
    """The statements of a function."""
    found = re.search(rf"^void {name}\([^)]*\)\n\{{\n(.*?)^\}}", text, re.MULTILINE | re.DOTALL)
    assert found
    return found[1]


def test_there_is_no_floating_point(name: str) -> None:
    for text in texts(name).values():
        assert not re.search(r"\b(?:float|double|math\.h|sinf?|cosf?)\b|\d\.\d|\d[eE][-+]?\d", code(text))


def test_only_the_header_of_integers_is_included(name: str) -> None:
    found = re.findall(r"#include (<.*>)", texts(name)[c_file(name, "h", Q30)] + texts(name)[c_file(name, "c", Q30)])

    assert found == ["<stdint.h>"]


def test_every_statement_is_one_operation(name: str) -> None:
    """Casts and the names of arrays aside."""
    text = code(texts(name)[c_file(name, "c", Q30)])
    for quantity in ("fk", "frames", "position"):
        for line in body(text, f"{name}_q30_{quantity}").splitlines():
            right = re.sub(r"\(u?int32_t\)|\w+\[\d+\](?:\[\d+\])?|params->\w+", "x", line.partition(" = ")[2])
            operations = re.findall(r"(?<=[\w)]) [-+*/] |\w+\(|(?<![\w)] )-(?=\w)(?!\d)", right)
            assert len(operations) <= 1, line


def test_every_value_is_constant_and_defined_once(name: str) -> None:
    text = code(texts(name)[c_file(name, "c", Q30)])
    for quantity in ("fk", "frames", "position"):
        lines = body(text, f"{name}_q30_{quantity}")
        declared = re.findall(r"^    (const )?u?int32_t (\w+)( =|;)", lines, re.MULTILINE)
        assert all(bool(const) == (sign == " =") for const, _, sign in declared)
        names = [declared_name for _, declared_name, _ in declared]
        assert len(names) == len(set(names))


@pytest.mark.parametrize("name", ["puma560", "hand", "jaco2", "blocks"])
def test_statements_are_those_of_the_floating_point_kernels_in_their_order(name: str) -> None:
    floats = emit_kernel(fixed(name).kernels, ScalarType.DOUBLE)[c_file(name, "c")]
    integers = texts(name)[c_file(name, "c", Q30)]
    for quantity in ("fk", "frames", "position"):
        both = [
            re.findall(r"^    (?:const )?(?:double|u?int32_t) (\w+)|^    (base_\w+[\[\]\d]+)", part, re.MULTILINE)
            for part in (body(floats, f"{name}_{quantity}"), body(integers, f"{name}_q30_{quantity}"))
        ]
        assert both[0] == both[1]


def test_the_header_tells_scales_units_and_errors() -> None:
    header = texts("stanford")[c_file("stanford", "h", Q30)]

    assert "#define STANFORD_Q30_LENGTH_BITS 30\n#define STANFORD_Q30_STROKE_BITS 31\n" in header
    assert "lengths           in 1/2^STANFORD_Q30_LENGTH_BITS m\n" in header
    assert "in 1/2^STANFORD_Q30_STROKE_BITS m, up to 1 m either way\n" in header
    assert "void stanford_q30_fk(const int32_t q[STANFORD_DOF], int32_t base_T_tool[16]);" in header
    assert re.search(r"q\[2\]  joint_3  prismatic  1/2\^31 m  ", header)
    assert re.search(
        r"Proven error: \|px\| <= 6\.\de-9 m, \|py\| <= 6\.\de-9 m, \|pz\| <= \d\.\de-9 m, rotation", header
    )
    assert "it is proven that no operation overflows" in header


def test_the_header_tells_limits_in_the_units_of_the_inputs() -> None:
    header = texts("puma560")[c_file("puma560", "h", Q30)]

    assert "q[0]  waist       revolute   1/2^32 turn  -1908874354 to 1908874354\n" in header
    assert "q[2]  elbow       revolute   1/2^32 turn  no limits\n" in header


def test_parameters_are_integers_with_their_units() -> None:
    header, source = (texts("calibrated_2r")[c_file("calibrated_2r", suffix, Q30)] for suffix in "hc")

    assert "L1  [1/2^31 m]  859422956\n" in header
    assert "tilt  [1/2^32 turn]  357914\n" in header
    assert "#define CALIBRATED_2R_Q30_PARAM_BITS 31\n" in header
    assert "typedef struct {\n    int32_t L1;\n" in header
    assert "    -238609, /* skew */\n" in source


def test_lines_of_comments_are_no_longer_than_others(name: str) -> None:
    for text in texts(name).values():
        comments = "\n".join(re.findall(r"/\*.*?\*/", text, re.DOTALL))
        assert max(len(line) for line in comments.splitlines()) <= 120


def test_files_end_with_one_newline_and_have_no_loose_blanks(name: str) -> None:
    for text in texts(name).values():
        assert text.endswith("\n")
        assert not text.endswith("\n\n")
        assert not re.search(r"[ \t]$", text, re.MULTILINE)
        assert "\n\n\n" not in text


def test_rare_operations_have_their_forms() -> None:
    """A coarse literal, angles turned round, three times an angle, and a part of one."""
    text = (
        "joints:\n"
        "  - {name: j1, theta: 90 - q, d: 0, a: 0.1, alpha: 90, limits: [-90, 90]}\n"
        "  - {name: j2, theta: 3*q + j1, d: 0, a: 0.2, alpha: 30}\n"
        "  - {name: j3, theta: 2/3*j1, d: 0, a: 0.2, alpha: 0}\n"
        "  - {name: lift, theta: 0, d: 2.5*q, a: 0, alpha: 0, limits: [0, 0.2]}\n"
    )
    robot = arm(text)
    source = emit_fixed(planned(robot))[c_file("arm", "c", Q30)]

    assert re.search(r"const uint32_t \w+ = \(uint32_t\)q\[1\] \* 3u;", source)
    assert re.search(r"const uint32_t \w+ = arm_q30_part30\(q\[0\], -?715827883\);", source)
    assert re.search(r"const int32_t \w+ = arm_q30_mul28\(\w+, \d+\);", source)
    assert "static inline int32_t arm_q30_mul28(const int32_t a, const int32_t b)" in source


def test_templates_use_the_context_and_no_more() -> None:
    for template in ("kernel.h", "kernel.c", "_arithmetic.c", "_sincos.c", "vectors.h", "selftest.c"):
        loader = environment().loader
        assert loader is not None
        source = loader.get_source(environment(), f"fixed_point/{template}.jinja")[0]
        assert jinja2.meta.find_undeclared_variables(environment().parse(source)) <= {"k", "prefix"}
    assert fixed_context(fixed("puma560")).multiplies


def test_the_bytes_do_not_depend_on_the_process(tmp_path: Path) -> None:
    script = (
        "import sys; from tests.fixed.kernels import texts\n"
        "for name in ('stanford', 'jaco2'): sys.stdout.writelines(texts(name).values())\n"
    )
    found = set()
    for seed, locale in (("0", "C"), ("12345", "C.UTF-8")):
        environ = os.environ | {"PYTHONHASHSEED": seed, "LC_ALL": locale, "PYTHONPATH": str(ROOT)}
        done = subprocess.run(
            [sys.executable, "-c", script], cwd=tmp_path, env=environ, capture_output=True, text=True, check=True
        )
        found.add(done.stdout)

    assert found == {"".join(text for name in ("stanford", "jaco2") for text in texts(name).values())}
