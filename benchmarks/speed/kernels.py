"""The batch kernels against the C loops: shares of the sincos rate, other sizes, other compilers and flags."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from benchmarks.speed.arm import Arm, Array
from benchmarks.speed.c_text import (
    PEAK_OPERATIONS,
    arithmetic_text,
    closed_form_text,
    floor_text,
    kernel_text,
    memory_text,
    peak_text,
    plain_text,
    tiled_text,
)
from benchmarks.speed.clock import Case, Effort, Timing, measure, ratio
from benchmarks.speed.library import (
    LAYOUTS,
    Build,
    Run,
    default_build,
    kernel,
    kernel_build,
    kernel_library,
    libm_build,
    loop,
    tiled_build,
)
from benchmarks.speed.rows import Row
from kinegen.backends.scalar_types import ScalarType
from kinegen.runtime.compiler import Compiler
from kinegen.runtime.flags import Flags

FLOOR = "sines and cosines alone"
ARITHMETIC = "sines, cosines and the arithmetic, no stores"
LIBM = "closed form with libm, C loop"
TILED = "closed form vectorised by hand, libmvec, C loop"
PLAIN = "4x4 product with libm, C loop"
MEMORY = "reading and writing alone"
KERNEL = "batch kernel, from C"
CALL = "fk(q, out=T), from Python"
FRESH = "fk(q), from Python"


@dataclass(frozen=True)
class Data:
    """Configurations of one robot in one number type, and room for results; the cases of a group share them.

    Attributes:
        arm: The robot.
        real: The number type.
        count: Number of configurations.
    """

    arm: Arm
    real: ScalarType
    count: int

    @cached_property
    def q(self) -> Array:
        """Shape (N, dof)."""
        return self.arm.configurations(self.count, self.real)

    @cached_property
    def q_rows(self) -> Array:
        """Shape (dof, N)."""
        return np.ascontiguousarray(self.q.T)

    @cached_property
    def out(self) -> Array:
        """Shape (N, 4, 4); every page of it has been written."""
        return np.ones((self.count, 4, 4), self.q.dtype)

    @cached_property
    def out_rows(self) -> Array:
        """Shape (12, N), in the same memory."""
        rows: Array = self.out.reshape(-1)[: 12 * self.count].reshape(12, self.count)
        return rows

    def layout(self, layout: str) -> tuple[Array, Array]:
        """Joint values and results in a layout."""
        return (self.q_rows, self.out_rows) if layout == "joint-major" else (self.q, self.out)


@dataclass(frozen=True, slots=True)
class Entry:
    """A case, and the row that it will become but for its numbers."""

    case: Case
    row: Row


def entry(data: Data, what: str, run: Run, *, layout: str = "4x4", build: Build | None = None) -> Entry:
    """One case of one thread.

    Args:
        data: What it evaluates.
        what: What it is.
        run: The call.
        layout: Layout of the result.
        build: How it was compiled; by default as the package is.
    """
    made = build or default_build()
    key = f"{data.arm.name} {what} {layout} {data.real} {data.count} {made.label}"
    row = Row(
        robot=data.arm.name,
        what=what,
        layout=layout,
        real=data.real.value,
        threads=1,
        poses=data.count,
        flags=" ".join(made.flags),
        compiler=made.version,
        value=0.0,
        best=0.0,
        spread=0.0,
    )
    return Entry(Case(key, run, data.count), row)


def filled(
    one: Entry, timings: Mapping[str, Timing], against: tuple[str, Entry] | None = None, asked: float | None = None
) -> Row:
    """The row of a case with its numbers.

    Args:
        one: The case.
        timings: What was measured.
        against: What the ratio is called, and the case that it is taken against.
        asked: The figure asked for.
    """
    timing = timings[one.case.key]
    row = replace(one.row, value=timing.rate, best=timing.best, spread=timing.spread, asked=asked)
    if against is None:
        return row
    return replace(row, against=against[0], ratio=ratio(timings, one.case.key, against[1].case.key))


def loops(data: Data) -> dict[str, Entry]:
    """The C loops, and the kernels called from C and from Python, by a short name."""
    arm, real, count = data.arm, data.real, data.count
    kernels, libm, tiled = default_build(), libm_build(), tiled_build()
    library = kernel_library(kernels, kernel_text(arm, real), arm.name, real)
    sums = np.ones(count, data.q.dtype)
    found = {
        "floor": entry(data, FLOOR, loop(kernels, floor_text(arm, real), data.q_rows, sums, count), layout="sum"),
        "arithmetic": entry(
            data, ARITHMETIC, loop(kernels, arithmetic_text(arm, real), data.q_rows, sums, count), layout="sum"
        ),
        "libm": entry(data, LIBM, loop(libm, closed_form_text(arm, real), data.q, data.out, count), build=libm),
        "tiled": entry(data, TILED, loop(tiled, tiled_text(arm, real), data.q, data.out, count), build=tiled),
        "plain": entry(data, PLAIN, loop(libm, plain_text(arm, real), data.q, data.out, count), build=libm),
        "memory": entry(data, MEMORY, loop(libm, memory_text(arm, real), data.q, data.out, count), build=libm),
        "call": entry(data, CALL, partial(arm.package.fk, data.q, out=data.out)),
        "fresh": entry(data, FRESH, partial(arm.package.fk, data.q)),
    }
    for layout in LAYOUTS:
        run = kernel(library, layout, *data.layout(layout))
        found[layout] = entry(data, KERNEL, run, layout=layout)
    return found


def shares(arm: Arm, poses: int, effort: Effort, ask: bool) -> Iterator[Row]:
    """The kernels of one robot against the floor, libm and the plain product.

    Args:
        arm: The robot.
        poses: Number of configurations.
        effort: How long to measure.
        ask: Whether the figures are asked of this robot.

    Yields:
        Rows for both number types.
    """
    sets = {real: loops(Data(arm, real, poses)) for real in ScalarType}
    timings = measure([one.case for entries in sets.values() for one in entries.values()], effort)
    for real, entries in sets.items():
        floor, double = ("of the sincos rate", entries["floor"]), real is ScalarType.DOUBLE
        asked: dict[str, float] = {"4x4": 0.5, "joint-major": 0.65} if ask and double else {}
        yield filled(entries["floor"], timings)
        yield filled(entries["arithmetic"], timings, floor)
        yield from (filled(entries[name], timings, floor, asked.get(name)) for name in LAYOUTS)
        yield filled(entries["call"], timings, floor)
        yield filled(entries["fresh"], timings, floor)
        for name, words, figure in (("libm", "closed form with libm", 9.0), ("plain", "4x4 product", 18.0)):
            yield filled(entries[name], timings)
            against = (f"times the {words}", entries[name])
            yield filled(entries["4x4"], timings, against, figure if ask and double else None)
        yield from by_hand(entries, timings, ask=ask)
        yield filled(entries["memory"], timings)
    for name in ("4x4", "joint-major"):
        against = ("times the double kernel", sets[ScalarType.DOUBLE][name])
        yield filled(sets[ScalarType.FLOAT][name], timings, against, 1.7 if ask and name == "4x4" else None)


def by_hand(entries: Mapping[str, Entry], timings: Mapping[str, Timing], *, ask: bool) -> Iterator[Row]:
    """The kernel against the closed form that a good engineer vectorises, and that form itself."""
    double = entries["4x4"].row.real == ScalarType.DOUBLE.value
    yield filled(entries["tiled"], timings)
    against = ("times the closed form vectorised by hand", entries["tiled"])
    yield filled(entries["4x4"], timings, against, (2.5 if double else 3.0) if ask else None)


def sizes(arm: Arm, poses: Sequence[int], effort: Effort) -> Iterator[Row]:
    """Batches that fit into the caches less and less.

    Args:
        arm: The robot.
        poses: Numbers of configurations; the last is compared with the one before it.
        effort: How long to measure.

    Yields:
        Kernels, floor and bare memory for each size, both number types.
    """
    names = ("floor", "arithmetic", "joint-major", "4x4", "call", "memory", "tiled")
    for real in ScalarType:
        sets = [loops(Data(arm, real, count)) for count in poses]
        timings = measure([entries[name].case for entries in sets for name in names], effort)
        for entries in sets:
            yield from by_hand(entries, timings, ask=True)
        for entries in sets[:-1]:
            yield from (filled(entries[name], timings) for name in names[:-1])
        for name in names[:-1]:
            against = (f"of the rate at {poses[-2]:,}", sets[-2][name])
            asked = 0.85 if name in ("4x4", "call") and real is ScalarType.DOUBLE else None
            yield filled(sets[-1][name], timings, against, asked)


def builds(arm: Arm, poses: int, effort: Effort) -> Iterator[Row]:
    """Other compilers and flags, each against a floor of its own.

    Yields:
        For each build and number type the floor, the 4x4 and the joint-major kernel.
    """
    for real in ScalarType:
        data = Data(arm, real, poses)
        sums = np.ones(poses, data.q.dtype)
        sets = []
        for build in _other_builds():
            library = kernel_library(build, kernel_text(arm, real), arm.name, real)
            run = loop(build, floor_text(arm, real), data.q_rows, sums, poses)
            entries = [entry(data, f"{FLOOR}, {build.label}", run, layout="sum", build=build)]
            for layout in ("4x4", "joint-major"):
                run = kernel(library, layout, *data.layout(layout))
                entries.append(entry(data, f"{KERNEL}, {build.label}", run, layout=layout, build=build))
            sets.append(entries)
        timings = measure([one.case for entries in sets for one in entries], effort)
        for floor, *others in sets:
            yield filled(floor, timings)
            yield from (filled(one, timings, ("of its sincos rate", floor)) for one in others)


def peak(arm: Arm) -> dict[str, float]:
    """Billion operations a second with everything in registers, by number type: the roof."""
    found = {}
    for real in ScalarType:
        q, out = (
            np.array([0.5, 0.25], arm.configurations(1, real).dtype),
            np.zeros(1, arm.configurations(1, real).dtype),
        )
        case = Case("peak", loop(default_build(), peak_text(real), q, out, 100_000), 100_000)
        found[real.value] = measure([case], Effort(20, 0.0))["peak"].best * PEAK_OPERATIONS[real] / 1e3
    return found


def _other_builds() -> Iterator[Build]:
    x86 = os.uname().machine == "x86_64"
    targets = {"native": "native"} | ({"AVX2": "x86-64-v3", "SSE2": "x86-64"} if x86 else {})
    for name in ("gcc", "clang"):
        if shutil.which(name):
            compiler = _compiler(name)
            for label, march in targets.items():
                yield kernel_build(f"{name}, {label}", compiler, Flags(march=march))
            yield kernel_build(f"{name}, reproducible", compiler, Flags(contraction=False))
    if shutil.which("gcc"):
        yield Build("gcc, native, order as written", _compiler("gcc"), Flags().arguments(batch=True))


def _compiler(name: str) -> Compiler:
    told = subprocess.run([name, "--version"], capture_output=True, text=True, check=True).stdout
    return Compiler((name,), told)
