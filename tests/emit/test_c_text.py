"""What stands in the emitted C, and what never does."""

from __future__ import annotations

import datetime as dt
import getpass
import platform
import re
import socket
from pathlib import Path

import pytest

from kinegen import __version__
from kinegen.backends.scalar_types import ScalarType
from kinegen.ir.program import count
from kinegen.support.naming import prefix, sincos_macro
from tests.emit.emitted import NAMES, ROOT, c_kernels, code, kernels, texts

FORBIDDEN = (
    r"\bpow\w*\s*\(",
    r"\bM_PI\b",
    r"\bmath\.h\b",
    r"\b(?:malloc|calloc|realloc|free|alloca)\b",
    r"\b(?:sin|cos|sqrt|fabs)f?\s*\(",
    r"\b(?:goto|while|do|switch|volatile|register|long|unsigned)\b",
    (
        r"#pragma (?!float_control\(precise, on\)|clang fp re\w+\(off\)|GCC optimize\(\"no-associative-math\"|"
        r"clang diagnostic ignored \"-Wpass-failed\"$)"
    ),
    r"__(?:TIME|DATE|FILE|LINE)__",
)
"""Never in a kernel, comments left aside."""

NUMBER = r"\d+(?:\.\d+)?(?:e[+-]\d+)?"
STATIC_STATE = re.compile(r"^\s*static\s+(?!const\b|inline\b|void\b)(?!\w+ \w+\()", re.MULTILINE)


def operand(real: ScalarType, index: str = "") -> str:
    """How an operand looks; `index` follows an entry of the joint vector."""
    suffix = "F" if real is ScalarType.FLOAT else ""
    return rf"(?:[a-z]\w*|q\[\d+\]{index}|params->\w+|{NUMBER}{suffix}|\(-{NUMBER}{suffix}\))"


def statements(text: str) -> list[str]:
    """The lines of all function bodies but the sine-cosine's, without comments."""
    lines = code(text).splitlines()
    bodies: list[str] = []
    inside = False
    for line in lines:
        if line == "{":
            inside = True
        elif line == "}":
            inside = False
        elif inside and line.strip():
            bodies.append(line.strip())
    return bodies


def kernel_part(name: str, real: ScalarType) -> str:
    """The scalar file from its first kernel to its last one, with digits for names of lengths."""
    text = texts(name)[c_kernels(name, real)[0]]
    first = text.index(f"\nvoid {prefix(name, real)}_")
    head, kernels = text[:first], text[first:]
    for length, literal in re.findall(r"#define (\w+) (\d\S*) /\*", head):
        kernels = re.sub(rf"\b{length}\b", literal, re.sub(rf"-{length}\b", f"(-{literal})", kernels))
    return kernels.partition(f"\nconst {real} {prefix(name, real).upper()}_LIMITS_LOW")[0]


def operations(lines: list[str], real: ScalarType) -> list[str]:
    """The lines that compute; how a joint value is addressed and who takes the sines is left aside."""
    plain = [re.sub(r"q\[(?:i \* q_pose \+ )?(\d+)(?: \* q_joint)?\]", r"q[\1]", line) for line in lines]
    plain = [re.sub(r"^\w+_sincos\(", "sincos(", line, flags=re.IGNORECASE) for line in plain]
    return [line for line in plain if re.match(rf"const {real} [a-z]+\d\w* = |sincos\(", line)]


def test_every_statement_of_a_kernel_holds_one_operation(name: str, real: ScalarType) -> None:
    """So no compiler may fuse two of them, and the bits are the same everywhere."""
    one, macro = operand(real), sincos_macro(name, real)
    forms = re.compile(
        "|".join(
            [
                rf"const {real} [a-z]\w* = {one} [-+*/] {one};",
                rf"const {real} [a-z]\w* = -{one};",
                rf"{real} [sc]\w+;",
                rf"{macro}\({one}, &s\w+, &c\w+\);",
                rf"base_[Tp]_\w+(?:\[\d+\])?\[\d+\] = -?{one};",
                r"\(void\)(?:q|params);",
            ]
        )
    )
    lines = statements(kernel_part(name, real))

    assert [line for line in lines if not forms.fullmatch(line)] == []
    assert lines


@pytest.mark.parametrize("arm", ["puma560", "hand", "screw"])
def test_batch_kernels_hold_the_same_operations_in_the_same_order(arm: str, real: ScalarType) -> None:
    batch = statements(texts(arm)[c_kernels(arm, real)[1]])
    scalar = operations(statements(kernel_part(arm, real)), real)

    assert operations(batch, real)[-len(scalar) :] == scalar
    assert len(scalar) > 3


def body(text: str, function: str, real: ScalarType) -> list[str]:
    """The operations of one function, the configuration of a tile left aside."""
    found = re.search(rf"{function}\([^;{{]*\)\n(\{{\n.*?\n\}}\n)", text, re.DOTALL)
    assert found
    return operations(statements(found[1]), real)


@pytest.mark.parametrize("quantity", ["fk", "frames", "position"])
def test_what_follows_from_parameters_alone_comes_before_the_rest_of_a_batch_kernel(
    quantity: str, real: ScalarType
) -> None:
    """The operations are those of the scalar kernel, and both parts keep their order."""
    head = f"{prefix('calibrated_2r', real)}_{quantity}"
    scalar_file, batch_file = (texts("calibrated_2r")[file] for file in c_kernels("calibrated_2r", real)[:2])
    comment = batch_file[: batch_file.index(f"static void {head}_params(")].rpartition("/*")[2]
    rows = dict(re.findall(r"p\[(\d+)\] (\w+)", comment))
    named = re.sub(r"\bp\[(\d+)\]\[i\]", lambda row: rows.get(row[1], ""), code(batch_file))
    scalar = body(code(scalar_file).replace("params->", ""), head, real)
    first, rest = (body(named, f"{head}_{part}", real) for part in ("from_params", "tile"))

    assert list(rows.values())[:5] == ["L1", "L2", "tilt", "skew", "zero_2"]
    assert sorted(first + rest) == sorted(scalar)
    assert [line for line in scalar if line in first] == first
    assert [line for line in scalar if line in rest] == rest
    assert len([line for line in first if line.startswith("sincos(")]) == 2


def test_the_statements_are_those_that_are_counted(name: str, real: ScalarType) -> None:
    text = kernel_part(name, real)
    counts = [count(program) for program in kernels(name).programs]

    for symbol, expected in (
        (" * ", sum(each.multiplications for each in counts)),
        (" / ", sum(each.divisions for each in counts)),
        ("&s", sum(each.sine_cosines for each in counts)),
    ):
        assert sum(symbol in line for line in statements(text)) == expected
    assert len(re.findall(r"= \S+ [-+] ", code(text))) == sum(each.additions for each in counts)
    assert len(re.findall(rf"const {real} \w+ = -", text)) == sum(each.negations for each in counts)


def test_every_output_entry_is_written_once(name: str, real: ScalarType) -> None:
    for program in kernels(name).programs:
        function = f"void {prefix(name, real)}_{program.quantity.function}("
        text = texts(name)[c_kernels(name, real)[0]].split(function)[1].split("\n}")[0]
        places = re.findall(r"^    (base_\S+) = ", text, re.MULTILINE)
        entries = 16 if program.quantity.is_pose else 3

        assert len(places) == len(set(places)) == entries * len(program.frames)


@pytest.mark.parametrize("pattern", FORBIDDEN)
def test_forbidden_patterns_are_absent(pattern: str, name: str) -> None:
    found = []
    for file, text in texts(name).items():
        if file.endswith((".c", ".h")) and not re.search("_selftest|_vectors", file):
            found += [(file, match.group()) for match in re.finditer(pattern, code(text), re.MULTILINE)]

    assert found == []


def test_nothing_in_a_file_changes_while_the_program_runs(name: str) -> None:
    for file, text in texts(name).items():
        if file.endswith((".c", ".h")):
            assert STATIC_STATE.search(code(text)) is None, file


def test_float_kernels_do_not_know_double(name: str) -> None:
    for suffix in (".h", ".c", "_batch.h", "_batch.c"):
        text = code(texts(name)[f"{name}_f32{suffix}"])

        assert "double" not in text
        assert [number for number in fractions(text) if not number.endswith("F")] == []


def test_double_kernels_do_not_know_float(name: str) -> None:
    for suffix in (".h", ".c", "_batch.h", "_batch.c"):
        text = code(texts(name)[f"{name}{suffix}"])

        assert re.search(r"\bfloat\b(?!\.h)", text) is None
        assert [number for number in fractions(text) if number.endswith("F")] == []


def fractions(text: str) -> list[str]:
    """The numbers with a point or an exponent, with their suffixes."""
    numbers = re.findall(r"(?<![\w.])\d[\w.]*(?:(?<=e)[+-]\w+)?", text)
    return [number for number in numbers if not number.startswith("0x") and ("." in number or "e" in number)]


def test_nothing_of_this_machine_day_or_user_gets_into_a_file(name: str) -> None:
    words = {str(ROOT), str(Path.home()), socket.gethostname(), platform.platform(), platform.python_version()}
    words |= {"/tmp", "/work", "/home"}  # noqa: S108 - looked for
    year = re.compile(rf"(?<![\d.]){dt.datetime.now(tz=dt.UTC).year}(?![\d.])")
    if len(getpass.getuser()) > 4:
        words.add(getpass.getuser())
    for file, text in texts(name).items():
        assert [word for word in words if re.search(rf"(?<!\w){re.escape(word)}(?!\w)", text)] == [], file
        assert year.search(text) is None, file


def test_every_file_says_where_it_comes_from_and_that_it_is_the_users(name: str) -> None:
    digest = kernels(name).robot.digest
    for file, text in texts(name).items():
        if file == "py.typed":
            continue

        shared = file.startswith("_runtime/")
        source = ", the same for every robot." if shared else f" from {name}.yaml, model {digest}."
        assert f"Generated by kinegen {__version__}{source}" in text, file
        assert "SPDX-License-Identifier: 0BSD" in text, file


def test_files_are_plain_text(name: str) -> None:
    for file, text in texts(name).items():
        assert "\r" not in text, file
        assert not text or (text.endswith("\n") and not text.endswith("\n\n")), file
        assert re.search(r"[ \t]+$", text, re.MULTILINE) is None, file
        if file.endswith((".c", ".h")):
            assert "\n\n\n" not in text, file


def test_each_header_is_the_manual_of_its_kernels() -> None:
    text = texts("calibrated_2r")["calibrated_2r.h"]

    for phrase in (
        "Units: angles in rad, lengths in m.",
        "row by row, with the last row 0 0 0 1",
        "q[1]  joint_2  revolute   rad  -2.618 to 2.618",
        "L1      m    0.4002",
        "tilt    rad  0.000523599",
        "Inputs and outputs must not overlap",
        "threads",
        "@param[out] base_T_tool",
        "27 multiplications, 12 additions, 4 sine-cosine pairs",
    ):
        assert phrase in text, phrase


def test_two_robots_share_no_macro_guard_or_function() -> None:
    symbols: dict[str, str] = {}
    for name in NAMES:
        for file, text in texts(name).items():
            if file.endswith(".h"):
                for symbol in re.findall(r"^#define (\w+)|^void (\w+)", text, re.MULTILINE):
                    owner = symbols.setdefault("".join(symbol), name)

                    assert owner == name
