"""Tests of the crate: test vectors that were computed with 50 digits, for `cargo test`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

from kinegen.emit.c.accepted import accepted_differences
from kinegen.emit.c.expected import NOTHING, Vectors, whole
from kinegen.emit.c.vectors import INVERSE_TOLERANCES
from kinegen.emit.environment import environment
from kinegen.emit.inverse import inverse_of
from kinegen.emit.kernels import Kernels, provenance
from kinegen.emit.reals import Real
from kinegen.emit.rust.functions import escaped, type_of
from kinegen.emit.rust.syntax import NUMBER, literal
from kinegen.ir.program import Program
from kinegen.robot.extent import reach


@dataclass(frozen=True, slots=True)
class Table:
    """The values of an array at all vectors: its name, the type of one value, and the values."""

    name: str
    kind: str
    rows: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Checked:
    """The check of one result: its place among the results, what is expected and what is accepted of each number."""

    place: str
    size: int
    rows: tuple[str, ...]
    accepted: str
    turns: bool


@dataclass(frozen=True, slots=True)
class Test:
    """The test of one function."""

    function: str
    arguments: str
    results: tuple[Checked, ...]


@dataclass(frozen=True, slots=True)
class Targets:
    """The tests of inverses: targets, the joint vectors they come from; of the closed form turns, sizes, tolerance."""

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
    """What the template `rust/vectors.rs.jinja` is given."""

    module: str
    number: str
    robot: str
    provenance: str
    dof: int
    inputs: tuple[Table, ...]
    tests: tuple[Test, ...]
    targets: Targets | None
    has_search: bool
    parameters: str


def emit_rust_tests(kernels: Kernels, vectors: Vectors, real: Real) -> dict[str, str]:
    """Print the tests of one number type.

    Args:
        kernels: The robot and its programs.
        vectors: What the functions must return.
        real: The number type.

    Returns:
        One file, by its path in the crate.
    """
    robot = kernels.robot
    checked = [program for program in kernels.programs if program.quantity in vectors.expected]
    context = TestContext(
        module=robot.name if real is Real.DOUBLE else f"{robot.name}::f32",
        number=NUMBER[real],
        robot=robot.name,
        provenance=escaped(provenance(robot)),
        dof=robot.dof,
        inputs=tuple(_inputs(kernels, checked, vectors, real)),
        tests=tuple(_test(kernels, program, vectors, real) for program in checked),
        targets=_targets(kernels, vectors, real) if vectors.targets else None,
        has_search=kernels.numeric_inverse,
        parameters=", &robot::Params::default()" if robot.runtime_parameters else "",
    )
    name = "vectors" if real is Real.DOUBLE else "vectors_f32"
    return {f"tests/{name}.rs": environment().get_template("rust/vectors.rs.jinja").render(k=context)}


def _inputs(kernels: Kernels, checked: Sequence[Program], vectors: Vectors, real: Real) -> Iterator[Table]:
    arrays = {array.name: array for program in checked for array in program.signature.inputs}
    for name, array in arrays.items():
        rows = tuple(nested([literal(real, each) for each in row], array.shape) for row in vectors.inputs[name])
        yield Table(name.upper(), type_of(array, NUMBER[real], kernels.robot), rows)


def nested(words: Sequence[str], shape: Sequence[int]) -> str:
    """Numbers in a row as an array of arrays."""
    if len(shape) == 1:
        return f"[{', '.join(words)}]"
    step = len(words) // shape[0] if shape[0] else 0
    return f"[{', '.join(nested(words[i * step : (i + 1) * step], shape[1:]) for i in range(shape[0]))}]"


def _test(kernels: Kernels, program: Program, vectors: Vectors, real: Real) -> Test:
    accepted = iter(accepted_differences(kernels, program, vectors, real))
    arrays, results = program.signature.results, []
    count = min(len(each.rows) for each in vectors.expected[program.quantity])
    for place, (array, expected) in enumerate(zip(arrays, vectors.expected[program.quantity], strict=True)):
        if not array.size:
            continue
        rows = tuple(_row(whole(array, row), real) for row in expected.rows[:count])
        limits = _row(whole(array, next(accepted), NOTHING), real)
        where = "found" if len(arrays) == 1 else f"found.{place}"
        results.append(Checked(where, array.blocks * array.stored, rows, limits, expected.turns))
    names = [f"&{array.name.upper()}[i]" for array in program.signature.inputs]
    parameters = ["&robot::Params::default()"] * bool(kernels.robot.runtime_parameters)
    return Test(program.quantity.function, ", ".join([*names, *parameters]), tuple(results))


def _row(entries: Sequence[Fraction], real: Real) -> str:
    return f"[{', '.join(literal(real, entry) for entry in entries)}]"


def _targets(kernels: Kernels, vectors: Vectors, real: Real) -> Targets:
    solved, robot = inverse_of(kernels), kernels.robot
    branches = solved[1] if solved else None
    whole = branches.turns if branches else ()
    turns = [Fraction(0 if math.isinf(turn) else turn) for turn in whole]
    return Targets(
        poses=tuple(nested([literal(real, each) for each in pose], (4, 4)) for pose, _ in vectors.targets),
        joints=tuple(_row(joints, real) for _, joints in vectors.targets),
        given=tuple(_row(row, real) for row in vectors.given),
        given_count=branches.given if branches else 0,
        inverse=solved[0].quantity.function if solved else "",
        turns=_row(turns, real) if branches else "",
        extents=_row([Fraction(reach(robot) if math.isinf(turn) else 1) for turn in whole], real),
        tolerance=literal(real, INVERSE_TOLERANCES[real]),
    )
