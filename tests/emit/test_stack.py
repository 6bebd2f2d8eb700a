"""The stack that headers of searches state, against what compilers reserve for the frames of all their functions."""

from __future__ import annotations

import re
import shutil
import subprocess
from functools import cache
from pathlib import Path

import pytest

from kinegen.backends.c.inverse_tracker import emit_inverse_tracker
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.c.numeric_inverse import emit_numeric_inverse
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import lower_file
from kinegen.model.outputs import INVERSE_TRACKER, NUMERIC_INVERSE, Quantity
from tests.builds.workshop import ROBOTS

COMPILERS = {
    "gcc": "gcc",
    "arm": "arm-none-eabi-gcc -mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard",
}
FOUND = [name for name, command in COMPILERS.items() if shutil.which(command.split()[0])]
EMIT = {NUMERIC_INVERSE: emit_numeric_inverse, INVERSE_TRACKER: emit_inverse_tracker}
REAL = {"double": ScalarType.DOUBLE, "float": ScalarType.FLOAT}


@pytest.mark.parametrize("level", ["-O3", "-Os"])
@pytest.mark.parametrize("compiler", FOUND)
@pytest.mark.parametrize("real", REAL)
@pytest.mark.parametrize(
    ("arm", "output", "called"),
    [
        ("planar_3r", NUMERIC_INVERSE, "planar_3r_numeric_inverse"),
        ("panda", NUMERIC_INVERSE, "panda_numeric_inverse"),
        ("hand", NUMERIC_INVERSE, "hand_numeric_inverse"),
        ("scara", INVERSE_TRACKER, "scara_tracker_step"),
        ("ur5", INVERSE_TRACKER, "ur5_tracker_step"),
    ],
    ids=["planar_3r", "panda", "hand", "scara_tracker", "ur5_tracker"],
)
def test_a_search_takes_the_stack_that_its_header_states(
    arm: str, output: Quantity, called: str, real: str, compiler: str, level: str, tmp_path: Path
) -> None:
    files = emitted(arm, output, REAL[real])
    for name, text in files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    source = next(name for name in files if name.endswith((f"{output.kind.value}.c", "inverse_tracker.c")))
    text = " ".join(files[source.replace(".c", ".h")].replace("\n *", " ").split())
    (stated,) = map(int, re.findall(r"takes about (\d+) bytes of stack, without those of", text))
    called = called if real == "double" else called.replace(arm, f"{arm}_f32")

    assert 0.5 * stated < depth(tmp_path, source, f"{COMPILERS[compiler]} {level}", called) <= stated


@cache
def emitted(arm: str, output: Quantity, real: ScalarType) -> dict[str, str]:
    """The C files of one number type."""
    kernels = lower_file(ROBOTS / f"{arm}.yaml", (output,))
    return {**emit_kernel(kernels, real), **EMIT[output](kernels, real)}


def depth(folder: Path, source: str, command: str, called: str) -> int:
    """Bytes of the frames along the deepest path of calls inside one file."""
    flags = "-std=c99 -ffp-contract=off -ffreestanding -fcallgraph-info=su -c"
    subprocess.run([*command.split(), *flags.split(), source], cwd=folder, check=True)
    text = (folder / source.replace(".c", ".ci")).read_text(encoding="utf-8")
    # A static function has its file before its name; a function of another file has no bytes.
    nodes = re.findall(r'node: \{ title: "(?:[^":]*:)?(\w+)" label: "[^"]*?(\d+) bytes', text)
    edges = re.findall(r'source\w+: "(?:[^":]*:)?(\w+)" targetname: "(?:[^":]*:)?(\w+)"', text)
    frames = {title: int(taken) for title, taken in nodes}

    def below(function: str) -> int:
        return frames.get(function, 0) + max((below(target) for first, target in edges if first == function), default=0)

    return below(called)
