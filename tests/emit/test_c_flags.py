"""Options that relax arithmetic are refused or change no bit, with every compiler at hand, in every C file."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

import pytest

from kinegen.backends.scalar_types import ScalarType
from kinegen.model.outputs import parse_quantity
from kinegen.support.naming import prefix
from tests.emit.emitted import COMPILERS, run, texts

pytestmark = pytest.mark.skipif(not COMPILERS, reason="needs gcc or clang")

ARM = "scara"
OUTPUTS = tuple(map(parse_quantity, ("pose", "quaternion_wxyz", "rpy_zyx", "inverse", "numeric_inverse")))
ENDINGS = ("", "_batch", "_numeric_inverse", "_numeric_inverse_batch", "_selftest")
"""The files: sine and cosine in all but the third, roots and arc tangents, selections, quotients."""

HARMLESS = ("-fno-trapping-math", "-fno-math-errno")
"""These may change instructions, but no result."""

GCC_FLAGS = (
    "-funsafe-math-optimizations",
    "-fassociative-math -fno-signed-zeros -fno-trapping-math",
    "-fno-signed-zeros",
    "-fno-trapping-math",
    "-freciprocal-math",
    "-ffinite-math-only",
    "-fsingle-precision-constant",
    "-ffast-math",
    "-Ofast",
    "-Ofast -fno-finite-math-only -fsingle-precision-constant",
    "-ffast-math -fno-associative-math",
    "-fno-math-errno",
)
CLANG_FLAGS = (
    *(flags for flags in GCC_FLAGS if "single" not in flags and flags not in HARMLESS),
    "-fassociative-math",
    "-fno-honor-nans -fno-honor-infinities -fapprox-func",
    "-ffp-model=fast",
)
FLAGS = {"gcc": GCC_FLAGS, "clang": CLANG_FLAGS}

CORTEX_M4 = "-mthumb -mcpu=cortex-m4 -mfloat-abi=hard -mfpu=fpv4-sp-d16"
CROSS = {
    "arm-none-eabi-gcc": (CORTEX_M4, GCC_FLAGS, tuple(ScalarType)),
    "riscv64-unknown-elf-gcc": ("-march=rv32imafc -mabi=ilp32f", GCC_FLAGS, tuple(ScalarType)),
    "avr-gcc": ("-mmcu=atmega2560", GCC_FLAGS, (ScalarType.FLOAT,)),
}

REFUSALS = re.compile(r"error: .*(breaks the sine and cosine|breaks the NaN guard|SINGLE_PRECISION_CONSTANT_IS_OFF)")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files of an arm with every kind of operation."""
    place = tmp_path_factory.mktemp(ARM)
    for name, text in texts(ARM, OUTPUTS).items():
        if name.endswith((".c", ".h")):
            (place / name).write_text(text, encoding="utf-8", newline="\n")
    return place


@pytest.fixture(scope="module")
def right(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[ScalarType], str]:
    """What the kernels return if nothing is relaxed."""

    @cache
    def bits(real: ScalarType) -> str:
        place = tmp_path_factory.mktemp("right")
        objects = [compiled(COMPILERS[0], ["-O1"], source, place) for source in sources(folder, real)]
        return printed(real, folder, [each for each in objects if isinstance(each, Path)], place)

    return bits


def sources(folder: Path, real: ScalarType) -> list[Path]:
    return [folder / f"{prefix(ARM, real)}{ending}.c" for ending in ENDINGS]


def compiled(compiler: str, flags: Sequence[str], source: Path, place: Path) -> Path | str:
    """The object file, or why the file was refused."""
    target = place / f"{source.stem}.o"
    command = [compiler, "-std=c99", *flags, "-c", source, "-o", target]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return target if done.returncode == 0 else done.stderr


def printed(real: ScalarType, folder: Path, objects: Sequence[Path], place: Path) -> str:
    """The bits of the results of these objects, linked with a caller that is compiled without any such option."""
    stem = prefix(ARM, real)
    headers = [f"{stem}_batch.h", f"{stem}_numeric_inverse.h", f"{stem}_vectors.h"]
    includes = [word for header in headers for word in ("-include", str(folder / header))]
    own = [f"-DREAL={real}", f"-DNAME(f)={stem}_##f", *includes, Path(__file__).with_name("bits.c")]
    run([COMPILERS[0], "-std=c99", "-O0", *own, *objects, "-o", place / "bits"])
    return run([place / "bits"])


@pytest.mark.parametrize(
    ("compiler", "flags"),
    [
        pytest.param(compiler, flags, marks=[pytest.mark.long] * (compiler != COMPILERS[0]))
        for compiler in COMPILERS
        for flags in FLAGS[compiler]
    ],
)
def test_relaxed_arithmetic_is_refused_or_changes_no_bit(
    compiler: str, flags: str, real: ScalarType, folder: Path, right: Callable[[ScalarType], str], tmp_path: Path
) -> None:
    files = sources(folder, real)
    results = [compiled(compiler, ["-O2", *flags.split()], source, tmp_path) for source in files]
    objects = [each for each in results if isinstance(each, Path)]

    for refused in results:
        assert isinstance(refused, Path) or REFUSALS.search(refused), refused
    if objects:
        assert len(objects) == len(files), "a flag is refused in all files, or in none"
        assert printed(real, folder, objects, tmp_path) == right(real)


@pytest.mark.long
@pytest.mark.skipif("clang" not in COMPILERS, reason="needs clang")
@pytest.mark.parametrize(
    "flags", ["-funsafe-math-optimizations", "-fassociative-math", "-freciprocal-math -fno-signed-zeros"]
)
def test_clang_changes_no_bit_on_other_processors(
    flags: str, real: ScalarType, folder: Path, right: Callable[[ScalarType], str], tmp_path: Path
) -> None:
    """On x86 it has a pragma of its own, which is left out here."""
    others = ["-O2", "-ffreestanding", "-U__x86_64__", *flags.split()]
    results = [compiled("clang", others, source, tmp_path) for source in sources(folder, real)]
    objects = [each for each in results if isinstance(each, Path)]

    for refused in results:
        assert isinstance(refused, Path) or REFUSALS.search(refused), refused
    assert not objects or printed(real, folder, objects, tmp_path) == right(real)


@pytest.mark.skipif("clang" not in COMPILERS, reason="needs clang")
@pytest.mark.parametrize("ending", ENDINGS)
def test_clang_reorders_no_sum_on_a_cortex_m(ending: str, real: ScalarType, folder: Path) -> None:
    machine = [
        "--target=arm-none-eabi",
        *CORTEX_M4.split(),
        "-std=c99",
        "-ffreestanding",
        "-Werror",
        "-emit-llvm",
        "-S",
    ]
    source = folder / f"{prefix(ARM, real)}{ending}.c"
    code = run(["clang", *machine, "-O1", "-funsafe-math-optimizations", source, "-o", "-"])

    assert re.search(r"= f(add|sub|mul) ", code)
    assert not re.search(r"= f(add|sub|mul) .*\breassoc\b", code)


@pytest.mark.boards
@pytest.mark.parametrize("compiler", CROSS)
def test_a_cross_compiler_refuses_it_or_writes_the_same_instructions(
    compiler: str, folder: Path, tmp_path: Path
) -> None:
    if shutil.which(compiler) is None:
        pytest.skip(f"needs {compiler}")
    machine, flags, reals = CROSS[compiler]

    for source in (source for real in reals for source in sources(folder, real) if "batch" not in source.name):
        plain = instructions(compiler, machine, "", source)
        for relaxed in (each for each in flags if each not in HARMLESS):
            text = instructions(compiler, machine, relaxed, source)
            assert text == plain or REFUSALS.search(text), f"{compiler} {relaxed} {source.name}"


def instructions(compiler: str, machine: str, flags: str, source: Path) -> str:
    """The assembly, without remarks of the compiler; or why the file was refused."""
    command = [compiler, *machine.split(), "-std=c99", "-ffreestanding", *flags.split(), "-O2", "-S", source, "-o", "-"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        return done.stderr
    kept = [
        line for line in done.stdout.splitlines() if not re.match(r"\s*(@|#|;|//|\.(file|ident|eabi_attribute))", line)
    ]
    return "\n".join(kept)


@pytest.mark.skipif("gcc" not in COMPILERS, reason="needs gcc")
@pytest.mark.parametrize("ending", ENDINGS)
def test_what_is_refused_is_named(ending: str, folder: Path, tmp_path: Path) -> None:
    for flags, words in (
        ("-ffast-math", "-ffast-math breaks the sine and cosine"),
        ("-funsafe-math-optimizations", "and so do -funsafe-math-optimizations, -fassociative-math"),
        ("-ffinite-math-only", "-ffinite-math-only breaks the NaN guard"),
        ("-fsingle-precision-constant", "SCARA_SINGLE_PRECISION_CONSTANT_IS_OFF"),
    ):
        refusal = compiled("gcc", flags.split(), folder / f"{ARM}{ending}.c", tmp_path)

        assert words in str(refusal)


@pytest.mark.skipif(shutil.which("avr-gcc") is None, reason="needs avr-gcc")
@pytest.mark.parametrize("ending", ENDINGS)
def test_every_file_says_that_a_double_of_32_bits_is_too_short(ending: str, folder: Path, tmp_path: Path) -> None:
    flags = ["-mmcu=atmega2560", "-ffreestanding"]
    refusal = compiled("avr-gcc", flags, folder / f"{ARM}{ending}.c", tmp_path)

    assert 'error: #error "these kernels need a double of 64 bits' in str(refusal)
