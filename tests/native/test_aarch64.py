"""Kernels for 64-bit ARM, compiled here and run by an emulator: without contraction, the bits of this machine."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from kinegen.runtime.cffi_interface import HEADER, glue
from kinegen.runtime.compiler import Processor
from kinegen.runtime.dispatch import dispatch
from kinegen.runtime.flags import Flags
from kinegen.support.naming import prefix
from tests.emit.emitted import COMPILERS
from tests.native.arrays import bits
from tests.native.packages import POSES, programs, sources
from tests.native.sample import Sample

GCC, EMULATOR = "aarch64-linux-gnu-gcc", "qemu-aarch64"
ARM = Processor("aarch64", "")
HERE = Path(__file__).parent

# The compiler, the processor, and what the emulator is told of it.
TARGETS = {
    "gcc": ((GCC,), "armv8-a", "cortex-a53"),
    "gcc, vectors of any length": ((GCC,), "armv8.2-a+sve", "max"),
    "clang": (("clang", "--target=aarch64-linux-gnu"), "armv8-a", "cortex-a53"),
}

pytestmark = pytest.mark.skipif(
    not (shutil.which(GCC) and shutil.which(EMULATOR) and COMPILERS),
    reason=f"needs {GCC} and {EMULATOR} (Debian: gcc-aarch64-linux-gnu, libc6-dev-arm64-cross and qemu-user)",
)


def configurations(real: str) -> bytes:
    """Inside the range and at its end, beyond it, and no numbers at all."""
    q = np.random.default_rng(10).uniform(-7, 7, (331, 6))
    q[0], q[1] = 0, np.pi / 2
    q[50, 2], q[60, 0], q[70, 5], q[80, 1], q[90, 3] = 12000, 1e5, 1e30, np.nan, -np.inf
    return q.astype("f8" if real == "double" else "f4").tobytes()


def compile_and_run(folder: Path, compiler: tuple[str, ...], flags: Flags, real: str, *run: str) -> bytes:
    """Compile the kernels as a build does, and evaluate."""
    stem = prefix("puma560", real)
    for name, text in sources(programs("puma560", POSES)).items():
        (folder / name).write_text(text, encoding="utf-8")
    macros = (f"-DREAL={real}", f"-DKERNEL(x)={stem}_##x", f'-DHEADER="{stem}_batch.h"')
    for name, arguments in (
        (f"{stem}.c", flags.arguments()),
        (f"{stem}_batch.c", flags.arguments(batch=True)),
        (str(HERE / "bits.c"), ("-std=c99", "-O1", *macros)),
    ):
        target = f"{Path(name).stem}.o"
        subprocess.run([*compiler, *arguments, "-I.", "-c", name, "-o", target], cwd=folder, check=True)
    objects = [f"{stem}.o", f"{stem}_batch.o", "bits.o"]
    subprocess.run([*compiler, "-static", *objects, "-o", "program"], cwd=folder, check=True)
    return subprocess.run([*run, "./program"], cwd=folder, input=configurations(real), stdout=-1, check=True).stdout


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """What this machine computes."""
    compiler = (COMPILERS[0],)
    flags = Flags(contraction=False)
    return {
        real: compile_and_run(tmp_path_factory.mktemp("here"), compiler, flags, real) for real in ("double", "float")
    }


@pytest.mark.parametrize("real", ["double", "float"])
@pytest.mark.parametrize("target", TARGETS)
def test_the_bits_are_those_of_this_machine(
    target: str, real: str, expected: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Scalar kernels, and batches in every layout."""
    compiler, march, model = TARGETS[target]
    if not shutil.which(compiler[0]):
        pytest.skip(f"needs {compiler[0]}")
    monkeypatch.setattr("kinegen.runtime.flags.processor", lambda: ARM)
    flags = Flags(march, contraction=False)

    found = compile_and_run(tmp_path, compiler, flags, real, EMULATOR, "-cpu", model)

    dtype = np.dtype("f8" if real == "double" else "f4")
    assert len(found) == 331 * (16 + 16 + 12 + 12 + 12) * dtype.itemsize
    np.testing.assert_array_equal(bits(np.frombuffer(found, dtype)), bits(np.frombuffer(expected[real], dtype)))


def asking(march: str, folder: Path) -> Path:
    """A program that asks whether the processor can run kernels compiled for `march`."""
    sample = Sample("chain", reals=("double",))
    for name, text in {
        **sample.sources(),
        **dispatch(sample.interface, Flags()),
        **glue(sample.interface, "0"),
    }.items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "main.c").write_text(f'#include "{HEADER}"\nint main(void) {{ return kinegen_select(""); }}\n')
    subprocess.run([GCC, f"-march={march}", "-c", "kinegen_needs.c"], cwd=folder, check=True)
    subprocess.run(
        [GCC, "-static", "main.c", "kinegen_processor.c", "kinegen_needs.o", "-o", "asks"], cwd=folder, check=True
    )
    return folder / "asks"


@pytest.mark.parametrize(
    ("march", "model", "answer"),
    [
        ("armv8-a", "cortex-a53", 1),
        ("armv8.2-a+sve", "cortex-a53", 0),
        ("armv8.2-a+sve", "max", 1),
        ("armv8.5-a+sve2", "cortex-a76", 0),
        ("armv8.3-a", "cortex-a57", 0),
        ("armv9-a", "max", 1),
    ],
)
def test_a_processor_with_fewer_instructions_is_told(tmp_path: Path, march: str, model: str, answer: int) -> None:
    """The extension is then left unused, with a word, instead of ending the process."""
    done = subprocess.run([EMULATOR, "-cpu", model, asking(march, tmp_path)], check=False)

    assert done.returncode == answer
