"""The kernels touch the memory they are given and nothing else: a driver under the address and undefined sanitizers."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.batch import emit_batch
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.scalar_types import ScalarType
from kinegen.ir.program import Program
from kinegen.model.outputs import USUAL, Array, Quantity
from kinegen.runtime.flags import Flags, Variant
from kinegen.support.naming import prefix
from tests.emit.emitted import COMPILERS, kernels, run
from tests.emit.quantities import SEVERAL

FLAGS = (
    "-std=c99 -Wall -Wextra -Werror -O0 -g -ffp-contract=off -fsanitize=address,undefined,float-cast-overflow "
    "-fno-sanitize-recover=all"
).split()
PROCESSOR = Path("/proc/cpuinfo").read_text(encoding="utf-8").split() if Path("/proc/cpuinfo").exists() else []
LAST = {"avx2": "bmi2", "avx512": "avx512vl"}
WIDE = [each for each in Flags(portable=True).variants if each.features and LAST[each.name] in PROCESSOR]
"""The variants that turn numbers in registers, as far as this processor runs them."""

CASES = [(arm, real, USUAL) for arm in ("puma560", "calibrated_2r", "blocks", "cartesian") for real in ScalarType]
CASES.append(("hand", ScalarType.DOUBLE, USUAL))  # several tips; it compiles long
CASES += [(arm, ScalarType.DOUBLE, SEVERAL) for arm in ("planar_3r", "blocks", "thumb")]
CASES += [("calibrated_2r", ScalarType.FLOAT, SEVERAL)]

HEAD = """
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const int counts[] = {{0, 1, {tile} - 1, {tile}, 2 * {tile} + 1}};
"""

# Arrays of exactly the length that is needed; nothing is read of an array without numbers.
INPUT = """
    const ptrdiff_t {name}_joint = joint_major ? n + gap : 1;
    const ptrdiff_t {name}_pose = (backwards ? -1 : 1) * (joint_major ? 1 : {stored} + gap);
    const size_t {name}_length = ({size} == 0 || n == 0) ? 0
        : (size_t)((n - 1) * llabs({name}_pose) + ({size} - 1) * {name}_joint + 1);
    {real} *const {name}_memory = ({size} == 0) ? NULL : malloc({name}_length * sizeof({real}) + ({name}_length == 0));
    for (size_t i = 0; i < {name}_length; i++) {{
        {name}_memory[i] = ({real})((int)(i * 37u % 101u) - 50) / 16;
    }}
    const {real} *const {name} = {name}_memory - ((backwards && {name}_length > 0) ? (n - 1) * {name}_pose : 0);
    {real} {name}_single[{stored} + 1];
"""

RESULT = """
    const int {name}_block = (layout == 0) ? {stored} : {entries};
    const int {name}_numbers = {blocks} * {name}_block;
    const ptrdiff_t {name}_stride = ((layout == 2) ? n : {name}_numbers) + gap;
    const size_t {name}_length = (n == 0 || {name}_numbers == 0) ? 0 : (size_t)((layout == 2)
        ? ({name}_numbers - 1) * {name}_stride + n : (n - 1) * {name}_stride + {name}_numbers);
    {real} *const {name} = malloc({name}_length * sizeof({real}) + ({name}_length == 0));
    {real} {name}_expected[{blocks} * {stored} + 1];
"""

# A set of parameters for each configuration, each another one, or one for all.
SETS = """
    const ptrdiff_t params_stride = (gap > 0) ? 2 : joint_major;
    const size_t sets = (n == 0) ? 0 : (size_t)((n - 1) * params_stride + 1);
    {stem}_params *const params = malloc(sets * sizeof({stem}_params) + (sets == 0));
    for (size_t i = 0; i < sets; i++) {{
        params[i] = {stem}_default_params;
        for (size_t j = 0; j < sizeof({stem}_params) / sizeof({real}); j++) {{
            (({real} *)&params[i])[j] += ({real})(int)((i + j) * 37u % 101u) / 64;
        }}
    }}
"""

ONE = """
        for (int j = 0; j < {size}; j++) {{
            {name}_single[j] = {name}[i * {name}_pose + j * {name}_joint];
        }}
        (void){name}_single;
"""

COMPARE = """
        (void){name}_expected;
        for (int number = 0; number < {blocks} * {entries}; number++) {{
            const {real} want = {name}_expected[number / {entries} * {stored} + number % {entries}];
            const ptrdiff_t place = (layout == 2) ? number * {name}_stride + i
                : i * {name}_stride + number / {entries} * {name}_block + number % {entries};
            if (memcmp(&want, &{name}[place], sizeof(want)) != 0) {{
                (void)printf("{function} n=%d layout=%d gap=%d: number %d of {name}, configuration %d\\n", n, layout,
                    (int)gap, number, i);
                exit(1);
            }}
        }}
"""

MAIN = """
int main(void)
{{
    for (size_t c = 0; c < sizeof(counts) / sizeof(counts[0]); c++) {{
        for (int layout = 0; layout < 3; layout++) {{
            for (int way = 0; way < 8; way++) {{
{calls}
            }}
        }}
    }}
    (void)printf("clean\\n");
    return 0;
}}
"""


def words(array: Array, real: ScalarType, function: str) -> dict[str, object]:
    """What the texts above say of an array; one without numbers has blocks of one that are never looked at."""
    entries = max(array.size // array.blocks, 1)
    return {
        "name": array.name,
        "real": real,
        "function": function,
        "size": array.size,
        "stored": max(array.stored, 1),
        "entries": entries,
        "blocks": array.blocks if array.size else 0,
    }


def check(given: RobotPrograms, program: Program, real: ScalarType) -> Iterator[str]:
    """The function that calls one kernel in one way."""
    stem = prefix(given.robot.name, real)
    name, signature = program.quantity.function, program.signature
    function = f"{stem}_{name}"
    inputs = [words(array, real, function) for array in signature.inputs]
    results = [words(array, real, function) for array in signature.results]
    batch = ["(size_t)n"]
    batch += [f"{array.name}, {array.name}_pose, {array.name}_joint" for array in signature.inputs]
    batch += [
        *["params, params_stride"] * bool(given.defaults),
        *(f"{array.name}, {array.name}_stride" for array in signature.results),
        "layout",
    ]
    single = [f"{array.name}_single" for array in signature.inputs if array.size]
    single += ["params + i * params_stride"] * bool(given.defaults)
    for array in signature.results:
        cast = f"({real} (*)[{array.stored}])" if array.per_frame else ""
        single += [f"{cast}{array.name}_expected"] * bool(array.size)
    yield f"static void check_{name}(int n, ptrdiff_t gap, int joint_major, int backwards, int layout)\n{{"
    yield from (INPUT.format(**each) for each in inputs)
    yield from (RESULT.format(**each) for each in results)
    yield SETS.format(stem=stem, real=real) * bool(given.defaults)
    yield f"    {function}_batch({', '.join(batch)});\n    for (int i = 0; i < n; i++) {{"
    yield from (ONE.format(**each) for each in inputs)
    yield f"        {function}({', '.join(single)});"
    yield from (COMPARE.format(**each) for each in results)
    yield "    }\n"
    yield from (f"    free({array.name}_memory);\n" for array in signature.inputs)
    yield from (f"    free({array.name});\n" for array in signature.results)
    yield "    free(params);\n" * bool(given.defaults)
    yield "}\n"


def driver(given: RobotPrograms, real: ScalarType, batch: str) -> str:
    """A program that calls every kernel of a robot in every way."""
    tile = re.search(r"TILE = (\d+)", batch)
    assert tile
    parts = [f'#include "{prefix(given.robot.name, real)}_batch.h"\n', HEAD.format(tile=tile.group(1))]
    for program in given.programs:
        parts += check(given, program, real)
    way = "counts[c], (way & 1) * 3, (way & 2) != 0, (way & 4) != 0, layout"
    calls = "\n".join(f"{' ' * 16}check_{program.quantity.function}({way});" for program in given.programs)
    return "".join([*parts, MAIN.format(calls=calls)])


@pytest.mark.skipif("gcc" not in COMPILERS, reason="needs gcc")
@pytest.mark.parametrize(("arm", "real", "quantities"), CASES)
def test_no_kernel_touches_what_it_was_not_given(
    arm: str, real: ScalarType, quantities: tuple[Quantity, ...], tmp_path: Path
) -> None:
    """No configuration, one, and around a whole tile; gaps, any order of the numbers, every layout."""
    assert checked(kernels(arm, quantities), real, tmp_path) == "clean\n"


@pytest.mark.skipif("gcc" not in COMPILERS, reason="needs gcc")
@pytest.mark.parametrize("variant", WIDE, ids=lambda each: each.name)
@pytest.mark.parametrize(("arm", "real"), [("puma560", real) for real in ScalarType] + [("blocks", ScalarType.DOUBLE)])
def test_neither_do_kernels_that_turn_numbers_in_registers(
    arm: str, real: ScalarType, variant: Variant, tmp_path: Path
) -> None:
    """Joint vectors of six numbers are read four at a time, the last four sharing two with the first."""
    assert checked(kernels(arm, USUAL), real, tmp_path, *variant.arguments()) == "clean\n"


def checked(given: RobotPrograms, real: ScalarType, folder: Path, *flags: str) -> str:
    """What the program with all kernels of a robot prints."""
    files = emit_kernel(given, real) | emit_batch(given, real)
    files["driver.c"] = driver(given, real, files[f"{prefix(given.robot.name, real)}_batch.c"])
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    sources = (folder / name for name in files if name.endswith(".c"))
    run(["gcc", *FLAGS, *flags, *sources, "-o", folder / "driver"])
    return run([folder / "driver"])
