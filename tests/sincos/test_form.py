"""The emitted sine-cosine pairs are C that firmware takes: strict, silent, branch-free, the same bits everywhere."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from kinegen.backends.scalar_types import ScalarType
from tests.sincos.library import COMPILERS, DTYPES, compile_pairs, run, source

STRICT = {
    "gcc": "-std=c99 -Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wfloat-conversion -Wstrict-prototypes "
    "-Wmissing-prototypes -Wshadow -Wundef -Wcast-qual -Wvla -ffreestanding -Werror",
    "clang": "-std=c99 -Weverything -Wno-declaration-after-statement -ffreestanding -Werror",
}
CORTEX_M4F = "-mthumb -mcpu=cortex-m4 -mfloat-abi=hard -mfpu=fpv4-sp-d16 -std=c99 -ffreestanding".split()
BIT_FLAGS = [
    ("-O0",),
    ("-O2",),
    ("-O3", "-march=native"),
    ("-O3", "-march=haswell"),
]
CALL = """
void kg_probe(const {real} x, {real} *s, {real} *c);

void kg_probe(const {real} x, {real} *s, {real} *c)
{{
    kg_sincos(x, s, c);
}}
"""


@pytest.fixture(params=list(ScalarType))
def real(request: pytest.FixtureRequest) -> ScalarType:
    """Both number types."""
    return ScalarType(request.param)


@pytest.fixture
def code(tmp_path: Path, real: ScalarType) -> Path:
    """A file with the pair and a function that calls it."""
    path = tmp_path / f"{real}.c"
    path.write_text(source(real) + CALL.format(real=real), encoding="utf-8")
    return path


def assembly(code: Path, compiler: str, *flags: str) -> str:
    """What a compiler makes of the pair."""
    return run([compiler, *flags, "-S", "-o", "-", code])


def test_every_statement_holds_one_operation(real: ScalarType) -> None:
    """So that no compiler fuses a product and a sum unless it is told to."""
    body = re.sub(r"/\*.*?\*/", "", source(real), flags=re.DOTALL).split("{", 1)[1]
    statements = [line.strip() for line in body.splitlines() if line.strip().endswith(";")]
    number = r"-?[\w.]+(?:[eE][+-]\d+F?)?"
    simple = re.compile(rf"(?:const {real} \w+|\*[sc]) = {number} [-+*] {number};")

    assert [line for line in statements if not simple.fullmatch(line)] == []
    assert len(statements) >= 48


@pytest.mark.parametrize("level", ["-O0", "-O2", "-Os"])
@pytest.mark.parametrize("compiler", COMPILERS)
def test_strict_compilers_are_silent_and_nothing_is_missing(
    compiler: str, level: str, code: Path, real: ScalarType, tmp_path: Path
) -> None:
    flags = STRICT[compiler].split()
    if compiler == "gcc" and real is ScalarType.FLOAT:
        flags.append("-Wunsuffixed-float-constants")  # would ask a suffix of doubles too
    run([compiler, *flags, level, "-c", code, "-o", tmp_path / "pair.o"])

    assert run(["nm", "-u", tmp_path / "pair.o"]) == ""


@pytest.mark.skipif(shutil.which("cppcheck") is None, reason="needs cppcheck")
def test_the_misra_addon_of_cppcheck_finds_nothing(code: Path) -> None:
    harness = ("unusedFunction", "misra-c2012-8.4", "unmatchedSuppression")
    command = ["cppcheck", "--quiet", "--std=c99", "--enable=all", "--inconclusive", "--addon=misra"]
    run([*command, *(f"--suppress={name}" for name in harness), "--error-exitcode=2", code])


@pytest.mark.skipif(not COMPILERS, reason="needs gcc or clang")
def test_every_compiler_and_level_gives_the_same_bits(real: ScalarType, tmp_path: Path) -> None:
    """Scalar or vector code, with contraction off."""
    random = np.random.default_rng(27182818)
    reach = np.repeat([1e-3, 7.0, 100.0, 1e5 if real is ScalarType.DOUBLE else 12000.0], 50_000)
    angles = random.uniform(-reach, reach).astype(DTYPES[real])
    builds = [(compiler, flags) for compiler in COMPILERS for flags in BIT_FLAGS]
    outcomes = set()
    for number, (compiler, flags) in enumerate(builds):
        pairs = compile_pairs(tmp_path / str(number), real, compiler, "-ffp-contract=off", *flags)
        if flags[-1] == "-march=haswell" and "avx2" not in Path("/proc/cpuinfo").read_text(encoding="utf-8"):
            continue
        outcomes.add(b"".join(results.tobytes() for results in pairs(angles)))

    assert len(outcomes) == 1


@pytest.mark.skipif("gcc" not in COMPILERS, reason="needs gcc")
def test_the_sanitizers_find_no_undefined_behaviour(code: Path, real: ScalarType, tmp_path: Path) -> None:
    values = "0, 1, -1, 1e-30, 1e4, -1e4, 12001, 1e6, -1e6, 3e9, 1e30, 3e38, INFINITY, -INFINITY, NAN"
    main = f"""
#include <math.h>
int main(void)
{{
    volatile {real} angles[] = {{{values}}};
    {real} s, c;
    for (unsigned i = 0; i < sizeof angles / sizeof angles[0]; i++) {{
        kg_sincos(angles[i], &s, &c);
    }}
    return 0;
}}
"""
    program = tmp_path / "main.c"
    program.write_text(source(real) + main, encoding="utf-8")
    checks = "-fsanitize=undefined,address,float-cast-overflow,float-divide-by-zero"
    run(["gcc", "-O1", checks, "-fno-sanitize-recover=all", program, "-o", tmp_path / "main"])

    assert run([tmp_path / "main"]) == ""


@pytest.mark.skipif("gcc" not in COMPILERS, reason="needs gcc")
def test_wider_registers_are_refused(code: Path, real: ScalarType) -> None:
    """The x87 unit would round the multiples of pi/2 to 64 bits instead of integers; s390x keeps float in double."""
    done = subprocess.run(
        ["gcc", "-m32", "-mfpmath=387", "-fsyntax-only", code], capture_output=True, text=True, check=False
    )

    assert done.returncode != 0
    assert "kept in a wider register" in done.stderr
    assert "x86: -mfpmath=sse" in done.stderr
    assert ("s390x: -std=gnu99" in done.stderr) == (real is ScalarType.FLOAT)


@pytest.mark.parametrize("compiler", [*COMPILERS, "aarch64-linux-gnu-gcc"])
def test_a_loop_over_it_becomes_vector_code(compiler: str, real: ScalarType, tmp_path: Path) -> None:
    if shutil.which(compiler) is None:
        pytest.skip(f"needs {compiler}")
    loop = tmp_path / "loop.c"
    loop.write_text(
        source(real, "static inline")
        + f"void tile(const {real} *restrict x, {real} *restrict s, {real} *restrict c);\n"
        + f"void tile(const {real} *restrict x, {real} *restrict s, {real} *restrict c)\n"
        + "{\n    for (int i = 0; i < 64; i++) {\n        kg_sincos(x[i], &s[i], &c[i]);\n    }\n}\n",
        encoding="utf-8",
    )
    text = assembly(loop, compiler, "-std=c99", "-O3")
    vector, scalar = {
        (False, ScalarType.DOUBLE): (r"\bmulpd\b", r"\bmulsd\b"),
        (False, ScalarType.FLOAT): (r"\bmulps\b", r"\bmulss\b"),
        (True, ScalarType.DOUBLE): (r"\bfmul\s+v\d+\.2d", r"\bfmul\s+d\d"),
        (True, ScalarType.FLOAT): (r"\bfmul\s+v\d+\.4s", r"\bfmul\s+s\d"),
    }[compiler.startswith("aarch64"), real]

    assert len(re.findall(vector, text)) >= 20
    assert re.findall(scalar, text) == []


@pytest.mark.skipif(shutil.which("arm-none-eabi-gcc") is None, reason="needs arm-none-eabi-gcc")
def test_a_cortex_m4f_takes_few_instructions_and_no_branch(tmp_path: Path) -> None:
    code = tmp_path / "m4f.c"
    code.write_text(source(ScalarType.FLOAT) + CALL.format(real=ScalarType.FLOAT), encoding="utf-8")
    text = assembly(code, "arm-none-eabi-gcc", *CORTEX_M4F, "-Os")
    instructions = [line.split()[0] for line in text.splitlines() if re.match(r"\t[a-z]", line)]

    assert len(instructions) <= 60
    assert [name for name in instructions if name.startswith(("b", "c"))] == ["bx"]
