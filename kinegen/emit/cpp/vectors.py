"""The test of the C++ header: vectors that were computed with 50 digits, for ctest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from kinegen.emit.c.accepted import accepted_differences
from kinegen.emit.c.expected import NOTHING, Vectors, whole
from kinegen.emit.c.vectors import INVERSE_TOLERANCES
from kinegen.emit.cpp.functions import Function, function_of
from kinegen.emit.environment import environment
from kinegen.emit.inverse import inverse_of
from kinegen.emit.kernels import Kernels, provenance
from kinegen.emit.reals import Real
from kinegen.ir.program import Program
from kinegen.robot.extent import reach


@dataclass(frozen=True, slots=True)
class Table:
    """The values of an input: its name, the numbers of one value, and the values."""

    name: str
    size: int
    rows: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Checked:
    """The check of one result: its member, what is expected and accepted of each number, and if turns matter not."""

    member: str
    size: int
    rows: tuple[str, ...]
    accepted: str
    turns: bool


@dataclass(frozen=True, slots=True)
class Tested:
    """The test of one function at the first `count` values of its inputs."""

    function: Function
    count: int
    results: tuple[Checked, ...]


@dataclass(frozen=True, slots=True)
class Targets:
    """The test of the inverse: targets, joint vectors they come from, redundancies, turns, sizes, the tolerance."""

    poses: tuple[str, ...]
    joints: tuple[str, ...]
    given: tuple[str, ...]
    given_count: int
    inverse: str
    turns: str
    extents: str
    tolerance: str


@dataclass(frozen=True, slots=True)
class TestContext:
    """What the template `cpp/vectors.cpp.jinja` is given."""

    file: str
    header: str
    macro: str
    robot: str
    provenance: str
    real: str
    inputs: tuple[Table, ...]
    tests: tuple[Tested, ...]
    targets: Targets | None


def test_file(robot: str, real: Real) -> str:
    """The file of one number type."""
    return f"{robot}_test_{real}.cpp"


def emit_cpp_tests(kernels: Kernels, vectors: Vectors, real: Real) -> dict[str, str]:
    """Print the test of one number type.

    Args:
        kernels: The robot and its programs.
        vectors: What the functions must return.
        real: The number type.

    Returns:
        One file, by its name.
    """
    robot = kernels.robot
    checked = [program for program in kernels.programs if program.quantity in vectors.expected]
    arrays = {array.name: array for program in checked for array in program.signature.inputs if array.size}
    context = TestContext(
        file=test_file(robot.name, real),
        header=f"{robot.name}.hpp",
        macro=robot.name.upper(),
        robot=robot.name,
        provenance=provenance(robot),
        real=real.value,
        inputs=tuple(
            Table(name, array.stored, tuple(_row(row, real) for row in vectors.inputs[name]))
            for name, array in arrays.items()
        ),
        tests=tuple(_tested(kernels, program, vectors, real) for program in checked),
        targets=_targets(kernels, vectors, real),
    )
    return {context.file: environment().get_template("cpp/vectors.cpp.jinja").render(k=context)}


def _tested(kernels: Kernels, program: Program, vectors: Vectors, real: Real) -> Tested:
    expected, results = vectors.expected[program.quantity], []
    accepted = iter(accepted_differences(kernels, program, vectors, real))
    arrays = program.signature.results
    count = min(len(each.rows) for each in expected)
    for array, each in zip(arrays, expected, strict=True):
        if array.size:
            rows = tuple(_row(whole(array, row), real) for row in each.rows[:count])
            limits = _row(whole(array, next(accepted), NOTHING), real)
            member = "found" if len(arrays) == 1 else f"found.{array.name}"
            results.append(Checked(member, array.blocks * array.stored, rows, limits, each.turns))
    return Tested(function_of(kernels, program), count, tuple(results))


def _row(entries: Sequence[Fraction], real: Real) -> str:
    return f"{{{', '.join(real.literal(entry) for entry in entries)}}}"


def _targets(kernels: Kernels, vectors: Vectors, real: Real) -> Targets | None:
    found = inverse_of(kernels)
    if found is None:
        return None
    (inverse, branches), robot = found, kernels.robot
    extents = [Fraction(reach(robot) if math.isinf(turn) else 1) for turn in branches.turns]
    return Targets(
        poses=tuple(_row(pose, real) for pose, _ in vectors.targets),
        joints=tuple(_row(joints, real) for _, joints in vectors.targets),
        given=tuple(_row(row, real) for row in vectors.given),
        given_count=branches.given,
        inverse=inverse.quantity.function,
        turns=_row([Fraction(0 if math.isinf(turn) else turn) for turn in branches.turns], real),
        extents=_row(extents, real),
        tolerance=real.literal(INVERSE_TOLERANCES[real]),
    )
