"""Instructions of one pose, counted by callgrind: the same on every run, however busy the machine is.

Counted are the scalar kernels and the closed form with libm, and with AVX2 (valgrind knows no wider vectors) the batch
kernels and the closed form vectorised by hand. Each program runs twice, with more and with fewer poses; the difference
leaves the start of the program out.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.speed.arm import Arm
from benchmarks.speed.c_text import closed_form_text, kernel_text, plain_text, tiled_text
from benchmarks.speed.library import TILED_FLAGS, default_build
from kinegen.backends.scalar_types import ScalarType
from kinegen.support.naming import c_file, function

FEW, MANY = 200, 1000
"""Poses of the two runs."""

PLAIN_FLAGS = ("-std=gnu99", "-O2")
"""For every processor of the family; libm picks its own form for the processor at hand all the same."""

AVX2_FLAGS = ("-std=gnu99", "-O3", "-mavx2", "-mfma", "-ffp-contract=fast")
"""For the processors that have the widest vectors that valgrind knows."""

TILED_AVX2_FLAGS = (*TILED_FLAGS[:1], "-mavx2", "-mfma")
"""The same for what is vectorised by hand."""


def count(arm: Arm) -> Iterator[dict[str, Any]]:
    """Count for one robot.

    Args:
        arm: The robot.

    Yields:
        Records with `robot`, `real`, `what`, `flags`, `instructions`; nothing where valgrind is not installed.
    """
    if shutil.which("valgrind") is None:
        return
    for real in ScalarType:
        sources = kernel_text(arm, real)
        scalar = {name: sources[name] for name in (c_file(arm.name, "h", real), c_file(arm.name, "c", real))}
        scalar |= {"loop.c": _SCALAR_LOOP.format(**_names(arm, real))}
        batch = sources | {"loop.c": _BATCH_LOOP.format(**_names(arm, real))}
        libm = {"loop.c": closed_form_text(arm, real)}
        programs = (
            ("scalar kernel", PLAIN_FLAGS, scalar),
            ("closed form with libm", PLAIN_FLAGS, libm),
            ("4x4 product with libm", PLAIN_FLAGS, {"loop.c": plain_text(arm, real)}),
            ("scalar kernel", AVX2_FLAGS, scalar),
            ("closed form with libm", AVX2_FLAGS, libm),
            ("batch kernel", AVX2_FLAGS, batch),
            ("closed form vectorised by hand", TILED_AVX2_FLAGS, {"loop.c": tiled_text(arm, real)}),
        )
        for what, flags, files in programs:
            number = _instructions(files | {"main.c": _MAIN.format(real=real, dof=arm.dof)}, flags)
            names = {"robot": arm.name, "real": real.value, "what": what, "flags": " ".join(flags)}
            yield names | {"instructions": number}


def _names(arm: Arm, real: ScalarType) -> dict[str, object]:
    return {
        "header": c_file(arm.name, "h", real),
        "batch_header": c_file(arm.name, "h", real, batch=True),
        "function": function(arm.name, "fk", real),
        "batch_function": function(arm.name, "fk", real, batch=True),
        "real": real,
        "dof": arm.dof,
    }


def _instructions(files: dict[str, str], flags: tuple[str, ...]) -> float:
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for name, text in files.items():
            (folder / name).write_text(text, encoding="utf-8")
        names = tuple(name for name in files if name.endswith(".c"))
        default_build().compiler.run(folder, (*flags, "-o", "program", *names, "-lm"), "the program for callgrind")
        totals = [_total(folder, poses) for poses in (FEW, MANY)]
    return (totals[1] - totals[0]) / (MANY - FEW)


def _total(folder: Path, poses: int) -> int:
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", "./program", str(poses)]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    found = re.search(r"Collected : (\d+)", done.stderr)
    if found is None:
        raise RuntimeError(f"callgrind says nothing that can be read: {done.stderr[-300:]}")
    return int(found[1])


# Joint values are made by a short recurrence, so that libm sees fresh ones; 1,000 of them exist in every run.
_MAIN = """
#include <stddef.h>
#include <stdlib.h>

void loop(size_t n, const {real} *q, {real} *out);

static {real} q[1000 * {dof}], out[1000 * 16];

int main(int argc, char **argv)
{{
    unsigned state = 1;
    for (int i = 0; i < 1000 * {dof}; i++) {{
        state = state * 1664525u + 1013904223u;
        q[i] = ({real})((double)state / 4294967296.0 * 6.283185307179586 - 3.141592653589793);
    }}
    loop((size_t)atoi(argv[argc - 1]), q, out);
    return 0;
}}
"""

_SCALAR_LOOP = """
#include <stddef.h>

#include "{header}"

void loop(size_t n, const {real} *q, {real} *out)
{{
    for (size_t i = 0; i < n; i++) {{
        {function}(q + {dof} * i, out + 16 * i);
    }}
}}
"""

_BATCH_LOOP = """
#include "{batch_header}"

void loop(size_t n, const {real} *q, {real} *out)
{{
    {batch_function}(n, q, {dof}, 1, out, 16, 0);
}}
"""
