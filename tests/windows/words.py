"""Programs that call every kernel of a robot, one by one and in batches, and write the words of what they return.

In: a robot's kernels. Out: the C of a table for `words.c`, and the rows that each entry is given: the inputs of the
test vectors, and the same with a number in each row that is not one or far out of range.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.arguments import computed, flat_call, given
from kinegen.backends.c.nearest import nearest_of
from kinegen.backends.c.numeric_inverse import solver_context
from kinegen.backends.c.test_vectors import Vectors
from kinegen.backends.files import emit_files
from kinegen.backends.scalar_types import ScalarType
from kinegen.io.load import load
from kinegen.ir.program import Program
from kinegen.model.outputs import COMPLETE_INVERSE, POSE_AND_JACOBIAN, USUAL, Kind, parse_quantity
from kinegen.support.naming import c_file, complete_file, default_params, function, search_file
from kinegen.verify.invocations import DTYPES
from kinegen.verify.vectors import compute_vectors
from scripts.generated import programs

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent

QUANTITIES = (*USUAL, POSE_AND_JACOBIAN, parse_quantity("inverse"))

LAYOUTS = (0, 1, 2)
"""The layouts of results of batch kernels, see the batch header."""

SPOILT = (np.nan, np.inf, -np.inf, 1e30, -0.0, 5e4)

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Entry:
    """One way to call a kernel.

    Attributes:
        name: Of the kernel, and of the way.
        real: The number type.
        given: Numbers of a row.
        found: Numbers of its results.
        body: C statements; `n` rows `x`, results `y`.
        rows: What it is given, shape (N, given).
    """

    name: str
    real: ScalarType
    given: int
    found: int
    body: str
    rows: Floats


@dataclass(frozen=True)
class Robot:
    """What is compiled for a robot.

    Attributes:
        name: Its name.
        files: C text by file name, the table among it.
        entries: The entries of the table.
    """

    name: str
    files: dict[str, str]
    entries: tuple[Entry, ...]

    @property
    def sources(self) -> list[str]:
        """The files of a program: the kernels and what the table calls besides, but for the self-tests."""
        left_out = ("_selftest.c", "_inverse_tracker.c", "_numeric_inverse_batch.c", "_redundancy_range.c")
        return sorted(file for file in self.files if file.endswith(".c") and not file.endswith(left_out))

    def write(self, folder: Path) -> None:
        """Write the files, and what the program reads, into a folder."""
        for name, text in self.files.items():
            (folder / name).write_text(text, encoding="utf-8", newline="\n")
        with (folder / "rows").open("wb") as file:
            for entry in self.entries:
                file.write(struct.pack("<Q", len(entry.rows)))
                with np.errstate(over="ignore"):
                    file.write(entry.rows.astype(DTYPES[entry.real]).tobytes())

    def split(self, content: bytes) -> Iterator[tuple[Entry, NDArray[np.uint64 | np.uint32]]]:
        """The words that a program wrote, of each entry; NaN, which has many, is always the same."""
        start = 0
        for entry in self.entries:
            count = len(entry.rows) * entry.found
            numbers = np.frombuffer(content, DTYPES[entry.real], count, start).copy()
            start += numbers.nbytes
            numbers[np.isnan(numbers)] = np.nan
            yield entry, numbers.view(np.uint64 if entry.real is ScalarType.DOUBLE else np.uint32)
        assert start == len(content)


@cache
def robot_of(name: str) -> Robot:
    """What is compiled for a robot of `robots/`."""
    kernels = programs(load(ROOT / "robots" / f"{name}.yaml"), QUANTITIES)
    vectors = compute_vectors(kernels)
    files = {
        file: text
        for file, text in emit_files(kernels, tuple(ScalarType), vectors).files.items()
        if file.endswith((".c", ".h"))
    }
    entries = tuple(entry for real in ScalarType for entry in _entries(kernels, vectors, real))
    table = {"table.c": _table(kernels, entries)}
    table |= {file: (HERE / file).read_text(encoding="utf-8") for file in ("table.h", "words.c")}
    return Robot(name, {**files, **table}, entries)


def _entries(kernels: RobotPrograms, vectors: Vectors, real: ScalarType) -> Iterator[Entry]:
    """Every kernel of a number type, alone and in batches, and what searches for joint values."""
    for program in kernels.programs:
        rows = _rows(kernels, program, vectors)
        numbers = sum(array.stored for array in given(program))
        results = sum(array.stored * array.blocks for array in computed(program))
        name = function(kernels.robot.name, program.quantity.function, real)
        call = flat_call(kernels, program, real, name, ("row", "result"))
        yield Entry(name, real, numbers, results, _one_by_one(real, numbers, results, call), rows)
        for layout in LAYOUTS:
            yield _batch(kernels, program, real, layout, rows)
    if kernels.numeric_inverse:
        yield _search(kernels, vectors, real)
    nearest = nearest_of(kernels, real)
    if nearest is not None:
        yield _nearest(kernels, vectors, real)
    if kernels.complete_inverse and real is ScalarType.DOUBLE:
        yield _complete(kernels, vectors)


def _one_by_one(real: ScalarType, numbers: int, results: int, call: str) -> str:
    place = f"const {real} *row = x + {numbers} * i; {real} *result = y + {results} * i"
    return f"for (size_t i = 0; i < n; ++i) {{ {place}; (void)row; (void)result; {call}; }}"


def _batch(kernels: RobotPrograms, program: Program, real: ScalarType, layout: int, rows: Floats) -> Entry:
    """A kernel for batches; truth values, which are bytes, become numbers afterwards."""
    numbers = sum(array.stored for array in given(program))
    arguments, before, after, offset = ["n"], "", "", 0
    for array in program.signature.inputs:
        arguments += [f"x + {offset}", str(numbers), "1"]
        offset += array.stored
    if kernels.robot.runtime_parameters:
        arguments += [f"&{default_params(kernels.robot.name, real)}", "0"]
    sizes = [array.stored * array.blocks if layout == 0 else array.size for array in program.signature.results]
    total, offset = sum(sizes), 0
    for array, size in zip(program.signature.results, sizes, strict=True):
        place, stride = (
            (f"y + n * {offset}", "(ptrdiff_t)n") if layout == LAYOUTS[-1] else (f"y + {offset}", f"{total}")
        )
        if array.is_truth:
            before += f"unsigned char *bytes = malloc(n * {size} + 1); "
            number = (
                f"y[{offset} * n + i]" if layout == LAYOUTS[-1] else f"y[i / {size} * {total} + {offset} + i % {size}]"
            )
            after += f" for (size_t i = 0; i < n * {size}; ++i) {{ {number} = ({real})bytes[i]; }} free(bytes);"
            place, stride = "bytes", "(ptrdiff_t)n" if layout == LAYOUTS[-1] else f"{size}"
        arguments += [place, stride]
        offset += size
    name = function(kernels.robot.name, program.quantity.function, real, batch=True)
    body = f"{before}{name}({', '.join([*arguments, str(layout)])});{after}"
    return Entry(f"{name}, layout {layout}", real, numbers, total, body, rows)


def _search(kernels: RobotPrograms, vectors: Vectors, real: ScalarType) -> Entry:
    """The numeric inverse, started at zero, for the pose of a joint vector; and how far it got."""
    robot, solver = kernels.robot, solver_context(kernels, real)
    program = next(each for each in kernels.programs if each.quantity == POSE_AND_JACOBIAN)
    tips, dof = len(robot.tips) if robot.is_tree else 1, robot.dof
    pointer, at = ("(void *)", "") if robot.is_tree else ("", "&")
    parameters = f"&{solver.prefix}_default_params, " if solver.parameters else ""
    call = "; ".join(
        [
            f"{real} there[{sum(array.stored * array.blocks for array in computed(program))}]",
            flat_call(kernels, program, real, solver.kernel, ("row", "there")),
            f"static const {real} start[{dof}] = {{0}}",
            f"{solver.prefix}_search how = {solver.prefix}_default_search",
            "how.restarts = 2",
            f"{solver.prefix}_found found",
            f"result[{dof}] = ({real}){solver.function}({pointer}there, start, {parameters}&how, result, &found)",
            f"result[{dof + 1}] = ({real})found.iterations",
            f"memcpy(result + {dof + 2}, {at}found.position_error, {tips} * sizeof({real}))",
            f"memcpy(result + {dof + 2 + tips}, {at}found.rotation_error, {tips} * sizeof({real}))",
        ]
    )
    rows = _flat(vectors, "q", dof)[: 4 if tips == 1 else 1]
    found = dof + 2 + 2 * tips
    return Entry(solver.function, real, dof, found, _one_by_one(real, dof, found, call), rows)


def _nearest(kernels: RobotPrograms, vectors: Vectors, real: ScalarType) -> Entry:
    """The solution nearest to a joint vector close to that of the target."""
    nearest, dof = nearest_of(kernels, real), kernels.robot.dof
    assert nearest is not None
    ahead = 16 + nearest.given
    parameters = f"&{default_params(kernels.robot.name, real)}, " if nearest.params_type else ""
    redundancy = "row + 16, " if nearest.given else ""
    call = f"result[{dof}] = ({real}){nearest.name}(row, {redundancy}row + {ahead}, {parameters}result)"
    joints = np.array([[float(entry) for entry in q] for _, q in vectors.targets])
    rows = np.hstack([_targets(vectors), joints + 0.01 * (-1.0) ** np.arange(dof)])
    return Entry(nearest.name, real, ahead + dof, dof + 1, _one_by_one(real, ahead + dof, dof + 1, call), rows)


def _complete(kernels: RobotPrograms, vectors: Vectors) -> Entry:
    """All solutions for a target, and their number."""
    name, dof = function(kernels.robot.name, COMPLETE_INVERSE.function), kernels.robot.dof
    call = f"result[{16 * dof}] = (double){name}(row, (void *)result)"
    body = _one_by_one(ScalarType.DOUBLE, 16, 16 * dof + 1, call)
    return Entry(name, ScalarType.DOUBLE, 16, 16 * dof + 1, body, _targets(vectors)[:4, :16])


def _rows(kernels: RobotPrograms, program: Program, vectors: Vectors) -> Floats:
    """The inputs of a kernel in the test vectors, and the same with one number that is none or far away."""
    if program.quantity.kind is Kind.INVERSE:
        rows = _targets(vectors)
    else:
        rows = np.hstack([_flat(vectors, array.name, array.stored) for array in program.signature.inputs])
    spoilt = rows.copy()
    if rows.shape[1]:
        places = np.arange(len(rows))
        spoilt[places, places % rows.shape[1]] = np.resize(SPOILT, len(rows))
    assert rows.shape[1] == sum(array.stored for array in program.signature.inputs), kernels.robot.name
    return np.vstack([rows, spoilt])


def _flat(vectors: Vectors, name: str, size: int) -> Floats:
    rows = np.array([[float(entry) for entry in row] for row in vectors.inputs[name]], dtype=float)
    return rows.reshape(len(vectors.inputs[name]), size)


def _targets(vectors: Vectors) -> Floats:
    """Poses, each with what the inverse is given besides."""
    poses = np.array([[float(entry) for entry in pose] for pose, _ in vectors.targets])
    more = np.array([[float(entry) for entry in row] for row in vectors.given]).reshape(len(poses), -1)
    return np.hstack([poses, more]) if vectors.given else poses


def _table(kernels: RobotPrograms, entries: Sequence[Entry]) -> str:
    """The C of a table."""
    name = kernels.robot.name
    headers = [c_file(name, "h", real, batch=True) for real in ScalarType]
    headers += [search_file(name, "h", real) for real in ScalarType if kernels.numeric_inverse]
    headers += [complete_file(name, "h")] if kernels.complete_inverse else []
    lines = [
        '#include "table.h"',
        "",
        "#include <stdlib.h>",
        "#include <string.h>",
        "",
        *(f'#include "{header}"' for header in headers),
        "",
    ]
    for number, entry in enumerate(entries):
        lines += [
            f"static void run_{number}(size_t n, const void *given, void *found)",
            "{",
            f"    const {entry.real} *x = given;",
            f"    {entry.real} *y = found;",
            "    (void)x;",
            "    (void)y;",
            f"    {entry.body}",
            "}",
            "",
        ]
    lines += ["const table_entry table[] = {"]
    lines += [
        f'    {{"{entry.name}", sizeof({entry.real}), {entry.given}, {entry.found}, run_{number}}},'
        for number, entry in enumerate(entries)
    ]
    return "\n".join([*lines, "};", "const size_t table_count = sizeof table / sizeof table[0];", ""])
