"""The self-test kills every mutant of the kernels: a sign flipped, a constant or an angle a little off, one at a time.

All mutants of a file are compiled at once. Each place reads a variable that names the mutant, and multiplies by one or
adds zero, which is exact, as long as it is not its turn.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.c.vectors import emit_vectors
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import lower_file
from kinegen.model.outputs import parse_quantity
from kinegen.support.naming import prefix
from kinegen.verify.vectors import compute_vectors
from tests.builds.workshop import write_robot
from tests.emit.emitted import COMPILERS, ROBOTS, run

pytestmark = pytest.mark.skipif(not COMPILERS, reason="needs gcc or clang")

CRANE = """\
kinegen: 1
name: crane
convention: standard
units: {length: mm, angle: deg}
joints:
  - {name: slew, theta: q, d: 2500, a: 300, alpha: 90, limits: [-180, 180]}
  - {name: boom, theta: q, d: 0, a: 5200, alpha: 0, limits: [-10, 80]}
  - {name: jib, theta: q - 90, d: 0, a: 210, alpha: 97.3, limits: [-60, 60]}
  - {name: extension, theta: 33, d: q, a: 0, alpha: -90, limits: [2400, 6500]}
  - {name: rotator, theta: q, d: 350, a: 0, alpha: 0, limits: [-170, 170]}
"""
"""Twelve metres in millimetres, with a skew and a fixed turn."""

OUTPUTS = ("pose", "frames", "position", "jacobian", "twist")
OFF, LEAST = 0.0005, 0.05
"""What an angle is off by in rad, and a constant by as a part of itself; lengths in mm by 0.05 at least."""

SWITCH = """
static int mutant;
#define SIGN(number) ((mutant == (number)) ? -one : one)
#define PART(number, part) ((mutant == (number)) ? one + (part) : one)
#define SHIFT(number) ((mutant == (number)) ? {off} : 0 * one)
static const {real} one = 1;
"""
MAIN = """
#include <stdio.h>

int main(void)
{{
    for (mutant = 0; mutant <= {count}; mutant++) {{
        const {real} worst = {stem}_selftest();
        if ((worst >= 0) && (worst <= {limit})) {{
            printf("%d\\n", mutant);
        }}
    }}
    return 0;
}}
"""


@cache
def emitted(name: str, folder: Path) -> RobotPrograms:
    path = write_robot(folder, CRANE) if name == "crane" else ROBOTS / f"{name}.yaml"
    return lower_file(path, tuple(map(parse_quantity, OUTPUTS)))


def mutated(source: str) -> tuple[str, list[str]]:
    """A kernel with a switch at each place, and the lines by number; the first one is for nothing."""
    head, _, bodies = source.partition("\nvoid ")
    for name, literal in re.findall(r"#define (\w+) (\d\S*) /\*", head):
        bodies = re.sub(rf"\b{name}\b", literal, bodies)  # each use is a mutant of its own
    places = [""]
    lines = [_switched(line, places) for line in bodies.splitlines()]
    return f"{head}\nvoid " + "\n".join(lines), places


def _switched(line: str, places: list[str]) -> str:
    """One line; places grows by one entry for each of its mutants."""

    def number() -> int:
        places.append(line.strip())
        return len(places) - 1

    if not re.match(r"    (const )?\w+ ?.*=|    KINEGEN_\w+\(", line):
        return line  # no statement
    if re.search(r"\[1[234]\] = 0", line):  # of the constant last row of a matrix
        return line.replace(";", f" + SHIFT({number()});")
    line = re.sub(r"(?<![\w.])\d+\.\d+(e[+-]\d+)?F?", lambda m: _constant(m.group(), number), line)
    line = re.sub(r" ([+-]) ", lambda m: f" {m.group(1)} SIGN({number()}) * ", line)
    line = re.sub(r"= -(?=[a-z])", lambda _: f"= -SIGN({number()}) * ", line)
    return re.sub(r"_SINCOS\(([^,]+),", lambda m: f"_SINCOS({m.group(1)} + SHIFT({number()}),", line)


def _constant(literal: str, number: Callable[[], int]) -> str:
    value = float(literal.rstrip("F"))
    part = max(OFF, LEAST / value) if value > 1 else OFF
    return literal if value == 0 else f"({literal} * PART({number()}, {part:.6f}{literal.lstrip('0123456789.e+-')}))"


@pytest.mark.parametrize("real", list(ScalarType))
@pytest.mark.parametrize("name", ["puma560", "puma560_mm", "crane"])
def test_every_mutant_is_killed(name: str, real: ScalarType, tmp_path: Path) -> None:
    of = emitted(name, tmp_path)
    stem = prefix(name, real)
    files = emit_kernel(of, real) | emit_vectors(of, compute_vectors(of), real)
    kernel, places = mutated(files[f"{stem}.c"])
    switch = SWITCH.format(off=f"{OFF}{'F' if real is ScalarType.FLOAT else ''}", real=real)
    main = MAIN.format(count=len(places) - 1, real=real, stem=stem, limit=f"{stem.upper()}_TOLERANCE")
    for file, text in files.items():
        (tmp_path / file).write_text(text, encoding="utf-8")
    again = f"#define {name.upper()}_SINGLE_PRECISION_CONSTANT_IS_OFF {name.upper()}_IT_IS_STILL_OFF"
    (tmp_path / "mutants.c").write_text(
        f'{switch}{kernel}\n{again}\n#include "{stem}_selftest.c"\n{main}', encoding="utf-8"
    )
    run([COMPILERS[0], "-std=c99", "-O0", "mutants.c", "-o", "mutants"], tmp_path)
    survivors = [int(line) for line in run([tmp_path / "mutants"]).split()]

    assert len(places) > 150
    assert [places[number] for number in survivors] == [""], "only the one without a change passes"
