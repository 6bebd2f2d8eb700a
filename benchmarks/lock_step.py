"""The numeric inverse of many targets against the search for one, called in a loop in C, in turns in one program."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

from benchmarks.speed.arm import ROBOTS
from kinegen.backends.c import C
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import lower_file
from kinegen.model.joint_bounds import joint_box
from kinegen.model.outputs import NUMERIC_INVERSE, Quantity
from kinegen.runtime.flags import Flags
from kinegen.support.naming import prefix

TARGETS, TURNS = 100_000, 3

ACCEPTED = {ScalarType.DOUBLE: "1e-6", ScalarType.FLOAT: "1e-4F"}
"""Distance in metres, and angle in radians."""


def lock_step(name: str = "iiwa14") -> Iterator[tuple[str, str, str]]:
    """What was measured, what was found, what is asked."""
    for real in ScalarType:
        one, many = _rates(name, real)
        what = f"{name}: numeric inverse, {real}, {TARGETS:,} targets, C, one thread, lock step against a loop"
        yield what, f"{many:,.0f} against {one:,.0f} a second, {many / one:.2f} times", "4 times"


def _rates(name: str, real: ScalarType) -> tuple[float, float]:
    """Targets a second of the loop and of the batch: the best of some turns."""
    kernels, stem, flags = (
        lower_file(ROBOTS / f"{name}.yaml", (Quantity.POSE, NUMERIC_INVERSE)),
        prefix(name, real),
        Flags(),
    )
    with tempfile.TemporaryDirectory() as folder:
        place, objects = Path(folder), []
        for file, text in (*C.files(kernels, real).items(), ("main.c", _main(kernels.robot.dof, stem, real))):
            (place / file).write_text(text, encoding="utf-8")
        (place / "limits.h").write_text(_limits(name), encoding="utf-8")
        for source in sorted(each.name for each in place.glob("*.c")):
            own = ("-D_GNU_SOURCE", *flags.arguments(batch=source.endswith("_batch.c")))
            subprocess.run(["gcc", *own, "-c", source], cwd=place, check=True)
            objects.append(source.replace(".c", ".o"))
        subprocess.run(["gcc", "-o", "program", *objects], cwd=place, check=True)
        found = subprocess.run([place / "program"], capture_output=True, text=True, check=True).stdout.split()
    return float(found[0]), float(found[1])


def _limits(name: str) -> str:
    """The ranges of the joints as C."""
    box = joint_box(lower_file(ROBOTS / f"{name}.yaml", (Quantity.POSE,)).robot)
    rows = ", ".join(f"{{{low!r}, {high!r}}}" for low, high in box)
    return f"static const double limits[][2] = {{{rows}}};\n"


def _main(dof: int, stem: str, real: ScalarType) -> str:
    words = {"STEM": stem, "REAL": str(real), "COUNT": str(dof), "ACCEPTED": ACCEPTED[real]}
    text = _MAIN.replace("N_TARGETS", str(TARGETS)).replace("N_TURNS", str(TURNS))
    for word, value in words.items():
        text = text.replace(word, value)
    return text


_MAIN = r"""
#include <stdint.h>
#include <stdio.h>
#include <time.h>

#include "STEM_numeric_inverse_batch.h"
#include "limits.h"

static REAL targets[N_TARGETS][16], starts[N_TARGETS][COUNT], q[N_TARGETS][COUNT];
static STEM_found found[N_TARGETS];
static unsigned char solved[N_TARGETS];

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

int main(void)
{
    uint32_t state = 1;
    double one = 1e9, many = 1e9;
    for (int i = 0; i < N_TARGETS; i++) {
        REAL joints[COUNT], jacobian[6 * COUNT];
        for (int j = 0; j < 2 * COUNT; j++) {
            state = state * 1664525u + 1013904223u;
            const double *const range = limits[j % COUNT];
            const double value = range[0] + (range[1] - range[0]) * state / 4294967296.0;
            (j < COUNT ? joints : starts[i])[j % COUNT] = (REAL)value;
        }
        STEM_fk_jacobian(joints, targets[i], jacobian);
    }
    const STEM_search search = {ACCEPTED, ACCEPTED, 10, 1, 0, 0};
    for (int turn = 0; turn < N_TURNS; turn++) {
        const double begin = now();
        for (int i = 0; i < N_TARGETS; i++) {
            STEM_search own = search;
            own.seed = search.seed + (uint32_t)i * 2654435761U;
            solved[i] = (unsigned char)STEM_numeric_inverse(targets[i], starts[i], &own, q[i], &found[i]);
        }
        const double middle = now();
        STEM_numeric_inverse_batch(N_TARGETS, &targets[0][0], 16, 1, &starts[0][0], COUNT, 1, &search, 0,
            &q[0][0], COUNT, found, solved, 0);
        const double end = now();
        one = (middle - begin < one) ? middle - begin : one;
        many = (end - middle < many) ? end - middle : many;
    }
    printf("%.0f %.0f\n", N_TARGETS / one, N_TARGETS / many);
    return 0;
}
"""
