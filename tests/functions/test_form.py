"""The emitted square root and arc tangent are C that firmware takes: strict, silent, branch-free, the same bits."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from kinegen.backends.scalar_types import ScalarType
from tests.functions.library import CALLS, COMPILERS, DTYPES, LOOP, compile_functions, run, source

STRICT = {
    "gcc": "-std=c99 -Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wfloat-conversion -Wstrict-prototypes "
    "-Wmissing-prototypes -Wshadow -Wundef -Wcast-qual -Wvla -ffreestanding -Werror",
    "clang": "-std=c99 -Weverything -Wno-declaration-after-statement -ffreestanding -Werror",
    "g++": "-x c++ -std=c++11 -Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wshadow -Wundef "
    "-Wold-style-cast -ffreestanding -Werror",
}
CORTEX_M4F = "-mthumb -mcpu=cortex-m4 -mfloat-abi=hard -mfpu=fpv4-sp-d16 -std=c99 -ffreestanding -Os".split()
BIT_FLAGS = [("-O0",), ("-O1",), ("-O2",), ("-O3", "-march=native"), ("-O3", "-march=haswell")]
NAMES = ("sqrt", "atan2", "select")

REAL = r"(?:double|float|uint\d\d_t|kg_bits)"
VALUE = r"[-\w.]+(?:[eE][+-]\d+F?)?"
SIMPLE = re.compile(
    rf"(?:const {REAL} \w+|\w+\.\w+) = "
    rf"(?:{VALUE} [-+*/&|^] {VALUE}|{VALUE} (?:>>|<<) \d+|[-~]?{VALUE}|\({VALUE} [<>]=? {VALUE}\) \? {VALUE} : {VALUE})"
    rf"|kg_bits \w+|return {VALUE}(?: \* {VALUE})?|return __builtin_sqrtf?\(number\)"
)
"""A declaration, or one operation."""


@pytest.fixture(params=list(ScalarType))
def real(request: pytest.FixtureRequest) -> ScalarType:
    """Both number types."""
    return ScalarType(request.param)


def loops(real: ScalarType, *names: str) -> str:
    """The functions, and a loop over each."""
    return source(real, *names) + "".join(LOOP.format(name=name, real=real, call=CALLS[name]) for name in names)


@pytest.fixture
def code(tmp_path: Path, real: ScalarType) -> Path:
    """A file with all functions and the loops that call them."""
    path = tmp_path / f"{real}.c"
    path.write_text(loops(real, *NAMES), encoding="utf-8")
    return path


@pytest.mark.parametrize("name", NAMES)
def test_every_statement_holds_one_operation(name: str, real: ScalarType) -> None:
    """So that no compiler fuses a product and a sum unless it is told to."""
    body = re.sub(r"/\*.*?\*/", "", source(real, name), flags=re.DOTALL).split(")\n{", 1)[1]
    statements = [line.strip().removesuffix(";") for line in body.splitlines() if line.strip().endswith(";")]

    assert [statement for statement in statements if not SIMPLE.fullmatch(statement)] == []
    assert len(statements) >= 12
    assert max(map(len, body.splitlines())) <= 120


@pytest.mark.parametrize("level", ["-O0", "-O2", "-Os"])
@pytest.mark.parametrize("compiler", STRICT)
def test_strict_compilers_are_silent_and_nothing_is_missing(
    compiler: str, level: str, code: Path, real: ScalarType, tmp_path: Path
) -> None:
    if shutil.which(compiler) is None:
        pytest.skip(f"needs {compiler}")
    flags = STRICT[compiler].split()
    if compiler == "gcc" and real is ScalarType.FLOAT:
        flags.append("-Wunsuffixed-float-constants")  # would ask a suffix of doubles too
    run([compiler, *flags, level, "-c", code, "-o", tmp_path / "functions.o"])

    assert run(["nm", "-u", tmp_path / "functions.o"]) == ""


@pytest.mark.skipif(shutil.which("cppcheck") is None, reason="needs cppcheck")
def test_the_misra_addon_of_cppcheck_finds_unions_alone(code: Path) -> None:
    """Rule 19.2, advisory: C99 defines what reading the other member means, and C has no other way to the bits."""
    harness = ("unusedFunction", "misra-c2012-8.4", "misra-c2012-8.7", "unmatchedSuppression", "missingIncludeSystem")
    command = ["cppcheck", "--quiet", "--std=c99", "--enable=all", "--inconclusive", "--addon=misra"]
    suppressed = [f"--suppress={name}" for name in (*harness, "misra-c2012-19.2")]
    run([*command, *suppressed, "--error-exitcode=2", code])


@pytest.mark.skipif(not COMPILERS, reason="needs gcc or clang")
def test_every_compiler_and_level_gives_the_same_bits(real: ScalarType, tmp_path: Path) -> None:
    """Scalar or vector code, with contraction off."""
    random = np.random.default_rng(27182818)
    y, x = (random.normal(size=(2, 100_000)) * np.exp(random.uniform(-60, 60, (2, 100_000)))).astype(DTYPES[real])
    builds = [(compiler, flags) for compiler in COMPILERS for flags in BIT_FLAGS]
    outcomes = set()
    for number, (compiler, flags) in enumerate(builds):
        if flags[-1] == "-march=haswell" and "avx2" not in Path("/proc/cpuinfo").read_text(encoding="utf-8"):
            continue
        functions = compile_functions(tmp_path / str(number), real, compiler, "-ffp-contract=off", *flags)
        results = (functions.sqrt(abs(y)), functions.atan2(y, x), functions.larger(y, x))
        outcomes.add(b"".join(result.tobytes() for result in results))

    assert len(outcomes) == 1


@pytest.mark.parametrize("compiler", COMPILERS)
def test_the_root_of_the_processor_has_the_same_bits(compiler: str, real: ScalarType, tmp_path: Path) -> None:
    """And takes its place where no one reads errno, without a call."""
    own = compile_functions(tmp_path / "own", real, compiler, "-O2")
    other = compile_functions(tmp_path / "other", real, compiler, "-O2", "-fno-math-errno")
    numbers = np.concatenate([np.exp(np.linspace(-700, 700, 100_001)), [0.0, -0.0, np.inf, -1.0, np.nan]])
    with np.errstate(over="ignore", under="ignore"):
        roots = [functions.sqrt(numbers) for functions in (own, other)]
    code = tmp_path / "other" / "functions.c"
    listing = run([compiler, "-std=c99", "-O0", "-fno-math-errno", "-S", "-o", "-", code])

    np.testing.assert_array_equal(*roots)
    assert (np.signbit(roots[0]) == np.signbit(roots[1]))[:-2].all()
    assert re.search(r"\bv?f?sqrt(?:[sp][sd])?\b", listing)
    assert not re.search(r"\bcall\w*\s+sqrt", listing)


@pytest.mark.skipif("gcc" not in COMPILERS, reason="needs gcc")
def test_the_sanitizers_find_no_undefined_behaviour(real: ScalarType, tmp_path: Path) -> None:
    values = "0, -0.0, 1, -1, 1e-30, 1e-38, -1e-38, 3e38, -3e38, INFINITY, -INFINITY, NAN"
    main = f"""
#include <math.h>
int main(void)
{{
    volatile {real} numbers[] = {{{values}}};
    volatile {real} sum = 0;
    for (unsigned i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {{
        sum += kg_sqrt(numbers[i]);
        for (unsigned j = 0; j < sizeof numbers / sizeof numbers[0]; j++) {{
            sum += kg_atan2(numbers[i], numbers[j]);
            sum += kg_select_lt(numbers[i], numbers[j], numbers[j], numbers[i]);
        }}
    }}
    return 0;
}}
"""
    program = tmp_path / "main.c"
    program.write_text(source(real, *NAMES) + main, encoding="utf-8")
    checks = "-fsanitize=undefined,address,float-cast-overflow,float-divide-by-zero"
    run(["gcc", "-O1", checks, "-fno-sanitize-recover=all", program, "-o", tmp_path / "main"])

    assert run([tmp_path / "main"]) == ""


@pytest.mark.skipif("gcc" not in COMPILERS, reason="needs gcc")
def test_wider_registers_are_refused(code: Path) -> None:
    command = ["gcc", "-m32", "-mfpmath=387", "-ffreestanding", "-fsyntax-only", code]
    done = subprocess.run(command, capture_output=True, text=True, check=False)

    assert done.returncode != 0
    assert "kept in a wider register" in done.stderr


@pytest.mark.parametrize("march", ["", "-march=haswell"])
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("compiler", COMPILERS)
def test_a_loop_over_it_becomes_vector_code(
    compiler: str, name: str, march: str, real: ScalarType, tmp_path: Path
) -> None:
    """With plain -O3, and without leave to forget about traps."""
    arguments = {"sqrt": "x[i]", "atan2": "x[i], y[i]", "select_lt": "x[i], y[i], y[i] * y[i], x[i]"}
    function = "select_lt" if name == "select" else name
    text = source(real, name, qualifier="static inline") + (
        f"void tile(const {real} *restrict x, const {real} *restrict y, {real} *restrict out);\n"
        f"void tile(const {real} *restrict x, const {real} *restrict y, {real} *restrict out)\n"
        f"{{\n    for (int i = 0; i < 64; i++) {{\n        out[i] = kg_{function}({arguments[function]});\n    }}\n}}\n"
    )
    (tmp_path / "loop.c").write_text(text, encoding="utf-8")
    flags = ["-std=c99", "-O3", *([march] if march else [])]
    listing = run([compiler, *flags, "-S", "-o", "-", tmp_path / "loop.c"])
    packed, single = ("pd", "sd") if real is ScalarType.DOUBLE else ("ps", "ss")

    assert re.findall(rf"\bv?(?:mul|fn?madd\d+|fn?msub\d+){packed}\b", listing)
    assert re.findall(rf"\bv?(?:mul|add|sub|div|fn?madd\d+|fn?msub\d+){single}\b", listing) == []


@pytest.mark.skipif(shutil.which("arm-none-eabi-gcc") is None, reason="needs arm-none-eabi-gcc")
@pytest.mark.parametrize(("name", "most"), [("sqrt", 66), ("atan2", 72)])
def test_a_cortex_m4f_takes_few_instructions(name: str, most: int, tmp_path: Path) -> None:
    """No loop, no call; selections of two constants may be a jump over one instruction."""
    arguments = {"sqrt": "const float x", "atan2": "const float y, const float x"}[name]
    code = source(ScalarType.FLOAT, name, qualifier="") + f"float kg_{name}({arguments});\n"
    (tmp_path / "m4f.c").write_text(code, encoding="utf-8")
    listing = run(["arm-none-eabi-gcc", *CORTEX_M4F, "-S", "-o", "-", tmp_path / "m4f.c"])
    instructions = [line.split()[0] for line in listing.splitlines() if re.match(r"\t[a-z]", line)]

    assert len(instructions) <= most
    assert not [name for name in instructions if name in ("bl", "blx")]
