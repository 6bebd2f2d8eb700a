"""The tests of the package: test vectors that were computed with 50 digits, for `run_tests`."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

from kinegen.emit.c.accepted import accepted_differences
from kinegen.emit.c.expected import NOTHING, Row, Vectors, whole
from kinegen.emit.c.vectors import INVERSE_TOLERANCES
from kinegen.emit.environment import environment
from kinegen.emit.inverse import branches_of
from kinegen.emit.kernels import Kernels, provenance
from kinegen.emit.matlab.columns import extents, in_columns
from kinegen.emit.reals import Real
from kinegen.ir.program import Program
from kinegen.outputs import Array, Kind
from kinegen.robot.extent import reach


@dataclass(frozen=True, slots=True)
class Table:
    """The values of an input at all vectors: its name, its shape, and rows of numbers."""

    name: str
    shape: str
    rows: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Checked:
    """The check of one result: rows expected, what is accepted of each number and type, whether turns do not matter."""

    rows: tuple[str, ...]
    double: str
    single: str
    turns: str


@dataclass(frozen=True, slots=True)
class Tested:
    """The test of one function at the first `count` vectors."""

    function: str
    count: int
    inputs: str
    results: tuple[Checked, ...]


@dataclass(frozen=True, slots=True)
class Targets:
    """The test of the inverse: targets, redundancies, the joint vectors they come from, what is accepted of each."""

    poses: tuple[str, ...]
    given: str
    joints: tuple[str, ...]
    double: str
    single: str


@dataclass(frozen=True, slots=True)
class TestContext:
    """What the template `matlab/run_tests.m.jinja` is given."""

    robot: str
    provenance: str
    dof: int
    inputs: tuple[Table, ...]
    tests: tuple[Tested, ...]
    targets: Targets | None


def emit_matlab_tests(kernels: Kernels, vectors: Vectors) -> dict[str, str]:
    """Print the tests.

    Args:
        kernels: The robot and its programs.
        vectors: What the functions must return.
    """
    checked = [program for program in kernels.programs if program.quantity in vectors.expected]
    has_inverse = any(program.quantity.kind is Kind.INVERSE for program in kernels.programs)
    context = TestContext(
        robot=kernels.robot.name,
        provenance=provenance(kernels.robot),
        dof=kernels.robot.dof,
        inputs=tuple(_inputs(checked, vectors)),
        tests=tuple(_test(kernels, program, vectors) for program in checked),
        targets=_targets(kernels, vectors) if has_inverse and vectors.targets else None,
    )
    return {"run_tests.m": environment().get_template("matlab/run_tests.m.jinja").render(k=context)}


def _inputs(checked: Iterable[Program], vectors: Vectors) -> Iterator[Table]:
    arrays = {array.name: array for program in checked for array in program.signature.inputs}
    for name, array in arrays.items():
        rows = vectors.inputs[name] if array.size else ()
        yield Table(
            name, f"[{' '.join(map(str, extents(array)))}]", tuple(_row(in_columns(array, row)) for row in rows)
        )


def _test(kernels: Kernels, program: Program, vectors: Vectors) -> Tested:
    expected = vectors.expected[program.quantity]
    count = min(len(each.rows) for each in expected)
    limits = {real: iter(accepted_differences(kernels, program, vectors, real)) for real in Real}
    results = []
    for array, each in zip(program.signature.results, expected, strict=True):
        double, single = (_accepted(array, next(limits[real]) if array.size else (), real) for real in Real)
        rows = tuple(_row(in_columns(array, whole(array, row))) for row in each.rows[:count])
        results.append(Checked(rows if array.size else (), double, single, "true" if each.turns else "false"))
    names = ", ".join(array.name for array in program.signature.inputs)
    return Tested(program.quantity.function, count, names, tuple(results))


def _accepted(array: Array, limits: Row, real: Real) -> str:
    entries = whole(array, limits, NOTHING)
    return _row([Fraction(real.round(each)) for each in (in_columns(array, entries) if array.size else ())])


def _targets(kernels: Kernels, vectors: Vectors) -> Targets:
    branches = branches_of(kernels)
    turns = branches.turns if branches else ()
    sizes = [Fraction(reach(kernels.robot) if math.isinf(turn) else 1) for turn in turns]
    double, single = (_row([size * Fraction(INVERSE_TOLERANCES[real]) for size in sizes]) for real in Real)
    pose = Array("base_T_tool", (4, 4), is_pose=True)
    return Targets(
        poses=tuple(_row(in_columns(pose, row)) for row, _ in vectors.targets),
        given="; ".join(map(_row, zip(*vectors.given, strict=True))),
        joints=tuple(_row(joints) for _, joints in vectors.targets),
        double=double,
        single=single,
    )


def _row(entries: Sequence[Fraction]) -> str:
    return ", ".join(Real.DOUBLE.literal(entry) for entry in entries)
