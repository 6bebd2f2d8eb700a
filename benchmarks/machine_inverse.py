"""What both joint vectors of a five-axis machine cost: rows of `python -m benchmarks.inverse`."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.compiled import nanoseconds
from benchmarks.speed.arm import ROBOTS, Array
from benchmarks.speed.clock import Case, Effort, measure
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import build, lower_file
from kinegen.driver.results import BuildOptions
from kinegen.io.load import load
from kinegen.model.joint_bounds import joint_box
from kinegen.model.outputs import parse_quantity
from kinegen.runtime.extension import load_package
from kinegen.runtime.flags import Flags

MACHINES = ("trunnion_mill", "nutating_mill")
WAY = "cutter/workpiece"
QUANTITIES = (parse_quantity(f"pose@{WAY}"), parse_quantity(f"axis_inverse@{WAY}"))
BLOCK = 100_000
EFFORT = Effort(turns=5, patience=5.0)

Row = tuple[str, str, str]


def machines() -> Iterator[Row]:
    """One target in C, a batch, and the joint vectors that are missed."""
    for name in MACHINES:
        path = ROBOTS / f"{name}.yaml"
        with tempfile.TemporaryDirectory() as folder:
            options = BuildOptions(output=Path(folder), reals=(ScalarType.DOUBLE,), quantities=QUANTITIES)
            package = load_package(build(path, options, lambda _: None).folder)
        low, high = np.array(joint_box(load(path))).T
        q = np.random.default_rng(0).uniform(low, high, (BLOCK, len(low)))
        pose = package.fk_cutter_in_workpiece(q)
        points, axes = (np.ascontiguousarray(pose[:, :3, column]) for column in (3, 2))
        files = emit_kernel(lower_file(path, QUANTITIES), ScalarType.DOUBLE)
        files |= {"main.c": _MAIN.replace("NAME", name), "targets.h": _targets_text(points, axes, q)}
        found = f"{nanoseconds(files, Flags().arguments()):.0f} ns"
        yield f"{name}: both branches, C, one target", found, "under 150 ns"
        out = package.axis_inverse_cutter_in_workpiece(points, axes, q)
        call = partial(package.axis_inverse_cutter_in_workpiece, points, axes, q, out=out)
        spent = measure([Case("", call, 1)], EFFORT)[""].median()
        yield f"{name}: both branches, batch", f"{spent / BLOCK * 1e9:.0f} ns", "-"
        solutions, valid = out
        apart = np.where(valid != 0, np.abs(solutions - q[:, None]).max(axis=2), np.inf).min(axis=1)
        yield f"{name}: random joint vectors missed", f"{int((apart > 1e-6).sum())} of {BLOCK:,}", "none"


def _targets_text(points: Array, axes: Array, q: Array) -> str:
    """A thousand targets, each with a joint vector, as C."""
    rows = np.concatenate([points[:1000], axes[:1000], q[:1000]], axis=1)
    lines = (f"    {{{', '.join(map(repr, map(float, row)))}}}," for row in rows)
    return "static const double targets[1000][11] = {\n" + "\n".join(lines) + "\n};\n"


_MAIN = r"""
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "NAME.h"
#include "targets.h"

static double solutions[2][5];
static uint8_t valid[2];

int main(int argc, char **argv)
{
    const int calls = atoi(argv[argc - 1]);
    struct timespec begin, end;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &begin);
    for (int i = 0; i < calls; i++) {
        const double *t = targets[i % 1000];
        NAME_axis_inverse_cutter_in_workpiece(t, t + 3, t + 6, &NAME_default_params, solutions, valid);
    }
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &end);
    printf("%.1f\n", ((double)(end.tv_sec - begin.tv_sec) * 1e9 + (double)(end.tv_nsec - begin.tv_nsec)) / calls);
    return 0;
}
"""
