"""Names that reach C, C++, Python and file systems are safe there, and the rest is refused with a reason."""

from __future__ import annotations

import ast
import keyword
import shutil
import subprocess
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinegen.errors import KinegenError
from kinegen.io.load import loads
from kinegen.model.runtime_entries import with_runtime_entries
from kinegen.support import naming

KINDS = ("robot", "parameter", "joint", "frame")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["a", "puma560", "l_I", "Q1", "I", "beta", "x" * 40, "a_b_c"])
def test_ordinary_names_are_accepted(kind: str, name: str) -> None:
    naming.check_name(kind, name)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("", "is not an identifier"),
        ("1st", "is not an identifier"),
        ("_a", "is not an identifier"),
        ("a-b", "is not an identifier"),
        ("a b", "is not an identifier"),
        ("a\n", "is not an identifier"),
        ("../a", "is not an identifier"),
        ("ä", "is not an identifier"),
        ("a__b", "has an underscore at the end or two in a row"),
        ("a_", "has an underscore at the end or two in a row"),
        ("x" * 41, "has 41 characters (at most 40)"),
        ("while", "is a C keyword"),
        ("restrict", "is a C keyword"),
        ("namespace", "is a C++ keyword"),
        ("NULL", "is a macro"),
        ("linux", "is a macro"),
        ("q", "is a word of the robot file itself"),
        ("pi", "is a word of the robot file itself"),
        ("sqrt", "is a word of the robot file itself"),
        ("tool", "is a word of the robot file itself"),
    ],
)
def test_names_that_no_output_can_use_are_refused(kind: str, name: str, reason: str) -> None:
    with pytest.raises(KinegenError) as caught:
        naming.check_name(kind, name)

    assert str(caught.value).startswith(f"{kind} name ")
    assert reason in str(caught.value)


@pytest.mark.parametrize("name", "cupy jax numba numpy pandas pyarrow tensorflow test torch xarray zarr".split())
def test_modules_that_a_package_imports_are_no_names_of_robots(name: str) -> None:
    with pytest.raises(KinegenError, match=f"robot name '{name}' would hide the Python module of that name"):
        naming.check_name("robot", name)
    naming.check_name("frame", name)


@pytest.mark.parametrize(
    "name",
    "PI TWO_PI EULER LOW DEFAULT F_CPU B0 B1 B11111111 A0 A15 BIT3 PORTB PB1 SP TCNT1A GPIOA ADC1 SERIAL".split(),
)
def test_macros_of_boards_are_refused_where_they_would_be_members_of_a_struct(name: str) -> None:
    """As a constant of the file, or as a joint, they stand in no header by themselves."""
    with pytest.raises(KinegenError, match=f"^runtime parameter name '{name}' is a macro of Arduino, ESP-IDF, AVR"):
        naming.check_name("runtime parameter", name)
    for kind in ("parameter", "joint", "frame"):
        naming.check_name(kind, name)


@pytest.mark.parametrize("name", ["L1", "a2", "d4", "B2", "pi_2", "A", "P1", "offset", "low", "D1"])
def test_other_names_stay_open_to_runtime_parameters(name: str) -> None:
    naming.check_name("runtime parameter", name)


MACROS = """\
kinegen: 1
name: arm
convention: standard
units: {length: m, angle: rad}
parameters:
  PI: RUNTIME
joints:
  - {name: A1, theta: q, d: 0, a: PI, alpha: 0}
"""


def test_a_file_with_such_a_runtime_parameter_is_refused_with_its_line(tmp_path: Path) -> None:
    constant = loads(MACROS.replace("RUNTIME", "0.4"), "arm.yaml")

    assert [parameter.name for parameter in constant.parameters] == ["PI"]
    with pytest.raises(KinegenError, match="name 'PI' is a macro of Arduino"):
        with_runtime_entries(constant, ("PI",))
    with pytest.raises(KinegenError, match=r"arm\.yaml:6: runtime parameter name 'PI' is a macro of Arduino"):
        loads(MACROS.replace("RUNTIME", "{value: 0.4, runtime: true}"), "arm.yaml")


@pytest.mark.parametrize("name", ["lambda", "in", "math", "numpy", "json", "cffi", "test", "kinegen", "aux", "Com3"])
def test_a_robot_becomes_a_module_and_a_folder(name: str) -> None:
    with pytest.raises(KinegenError):
        naming.check_name("robot", name)

    naming.check_name("parameter", name)


def test_python_keywords_get_an_underscore_in_python_alone() -> None:
    assert naming.python_identifier("lambda") == "lambda_"
    assert naming.python_identifier("elbow") == "elbow"


@pytest.mark.parametrize("compiler", ["gcc", "g++", "clang", "clang++"])
def test_no_word_that_compilers_reserve_is_accepted(compiler: str, tmp_path: Path) -> None:
    """Every accepted word of a long list compiles as a variable, a structure member and an argument."""
    if shutil.which(compiler) is None:
        pytest.skip(f"{compiler} is not installed")
    words = [*keyword.kwlist, "I", "S", "Q", "bool", "complex", "far", "near", "interrupt", "huge", "beta", "import_as"]
    accepted = [word for word in words if accepts(word)]
    lines = [f"struct s_{word} {{ double {word}; }}; double f_{word}(double {word});" for word in accepted]
    suffix, standard = (".cpp", "-std=gnu++20") if "+" in compiler else (".c", "-std=gnu99")
    source = tmp_path / f"words{suffix}"
    source.write_text("#include <stddef.h>\n#include <math.h>\n" + "\n".join(lines) + "\n", encoding="utf-8")

    assert len(accepted) > 20
    subprocess.run([compiler, standard, "-fsyntax-only", "-Wall", "-Werror", str(source)], check=True)


def accepts(word: str) -> bool:
    """Whether a parameter may have this name."""
    try:
        naming.check_name("parameter", word)
    except KinegenError:
        return False
    return True


def test_identifiers_and_file_names() -> None:
    assert naming.function("puma560", "fk") == "puma560_fk"
    assert naming.function("puma560", "frames", "float", batch=True) == "puma560_f32_frames_batch"
    assert naming.macro("puma560", "dof") == "PUMA560_DOF"
    assert naming.c_file("puma560", "h") == "puma560.h"
    assert naming.c_file("puma560", "c", "float", batch=True) == "puma560_f32_batch.c"
    assert naming.guard("puma560_f32.h") == "KINEGEN_PUMA560_F32_H_INCLUDED"


TRICKY = st.text(alphabet=["*", "/", "\\", "?", '"', "'", " ", "x", "ä", "{"], max_size=12)


@given(TRICKY)
def test_a_description_cannot_leave_its_c_comment(text: str) -> None:
    safe = naming.comment_text(text)
    block = f"/* {safe} */"

    assert block.index("*/") == len(block) - 2
    assert "/*" not in block[2:]
    assert not safe.endswith("\\")
    assert "??/" not in safe


@pytest.mark.parametrize("text", ["*/ int x; /*", "ends in \\", "trigraph ??/", "**//", "/*/", "*/*/", "\\\\", "/"])
def test_compilers_agree_that_comments_are_safe(text: str, tmp_path: Path) -> None:
    if shutil.which("gcc") is None:
        pytest.skip("gcc is not installed")
    safe = naming.comment_text(text)
    source = tmp_path / "comment.c"
    source.write_text(f"/* {safe} */\n// {safe}\nint one(void);\nint two(int *one);\n", encoding="utf-8")

    subprocess.run(["gcc", "-std=c99", "-trigraphs", "-Wall", "-Werror", "-fsyntax-only", str(source)], check=True)


@given(TRICKY.filter(lambda text: "\\" in text or '"' in text))
def test_a_description_cannot_leave_its_docstring(text: str) -> None:
    assert ast.literal_eval(f'"""{naming.docstring_text(text)}"""') == text
    assert ast.literal_eval(f'"""{naming.docstring_text(text)}\n"""') == text + "\n"


def test_what_belongs_to_a_function_has_a_name_that_no_other_function_may_have() -> None:
    """`RobotPrograms` refuses outputs of such names, so a part that is missing in the table is an error."""
    assert naming.companion("puma560_fk", "tile") == "puma560_fk_tile"
    assert naming.function("puma560", "fk", "float", batch=True) == "puma560_f32_fk_batch"
    with pytest.raises(ValueError, match="table is not among the parts of a function"):
        naming.companion("puma560_fk", "table")
