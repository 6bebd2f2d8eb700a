"""Test vectors and a self-test: a board can be checked without Python.

The expected values come from the caller, computed with 50 digits; here they are rounded once and printed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction

from kinegen.backends.bundle import RobotPrograms, provenance
from kinegen.backends.c.arguments import braced, computed, declared, given
from kinegen.backends.c.kernel import macros
from kinegen.backends.c.test_vectors import Targets, Vectors, accepted_differences, accepted_pair_error, targets_of
from kinegen.backends.descriptions import input_text
from kinegen.backends.inverse import NEAREST_FUNCTION as NEAREST
from kinegen.backends.inverse import inverse_of
from kinegen.backends.limits import LARGEST
from kinegen.backends.routines import SINCOS, Sincos
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import rendered
from kinegen.ir.program import Program
from kinegen.model.outputs import Kind
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import (
    c_file,
    comment_text,
    companion,
    default_params,
    function,
    guard,
    macro,
    prefix,
    selftest_file,
    sincos_macro,
    vectors_file,
)

INVERSE_TOLERANCES = {ScalarType.DOUBLE: Fraction(1, 10**10), ScalarType.FLOAT: Fraction(1, 10**4)}
"""How near a solution must be to the joint vector of its target: radians, and lengths relative to the reach."""

_PI = Fraction(math.pi)


@dataclass(frozen=True, slots=True)
class VectorInput:
    """Holds the values of one input."""

    array: str
    given: str
    extent: str
    words: str
    rows: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class VectorResult:
    """Holds the check of one result."""

    array: str
    found: str
    rows: tuple[str, ...]
    entries: str
    block: int
    blocks: int
    total: int
    stride: int
    last: int
    output: str
    first: str
    value: str
    wanted: str
    accepted: str
    accepted_array: str
    limits: str


@dataclass(frozen=True, slots=True)
class VectorCheck:
    """Holds the check of one kernel, at the first `count` inputs."""

    function: str
    count: int
    results: tuple[VectorResult, ...]
    call: str


@dataclass(frozen=True, slots=True)
class InverseCheck:
    """Holds the check of the inverse at its targets: a solution has to be the joint vector that a target comes from.

    The solution that is chosen as the nearest to that vector has to be it, too. Where a vector is too far away, none
    may be chosen.
    """

    function: str
    count_macro: str
    count: int
    tolerance_macro: str
    tolerance: str
    dof: str
    branches: str
    given: tuple[str, ...]
    targets: Targets
    call: str
    choice: str
    choice_call: str
    too_far: str


@dataclass(frozen=True, slots=True)
class VectorContext:
    """Holds what the templates `c/vectors.h.jinja` and `c/selftest.c.jinja` are given."""

    header: str
    source: str
    kernel_header: str
    guard: str
    provenance: str
    description: str
    robot: str
    prefix: str
    real: str
    flash_macro: str
    count_macro: str
    count: int
    inputs: tuple[VectorInput, ...]
    checks: tuple[VectorCheck, ...]
    inverse: InverseCheck | None
    left_out: tuple[str, ...]
    has_turns: bool
    has_matrices: bool
    pairs: tuple[str, ...]
    pairs_macro: str
    sincos: Sincos
    sincos_macro: str
    pair_tolerance: str
    zero: str
    one: str


def emit_vectors(kernels: RobotPrograms, vectors: Vectors, real: ScalarType) -> dict[str, str]:
    """Prints the vectors and the self-test of one number type, by file name."""
    robot = kernels.robot
    stem = prefix(robot.name, real)
    checked = [program for program in kernels.programs if program.quantity in vectors.expected]
    inverse = _inverse_check(kernels, vectors, real)
    left_out = [
        program.quantity
        for program in kernels.programs
        if program.quantity not in vectors.expected and program.quantity.kind is not Kind.INVERSE
    ]
    context = VectorContext(
        header=vectors_file(robot.name, real),
        source=selftest_file(robot.name, real),
        kernel_header=c_file(robot.name, "h", real),
        guard=guard(vectors_file(robot.name, real)),
        provenance=provenance(robot),
        description=comment_text(robot.description),
        robot=robot.name,
        prefix=stem,
        real=real.value,
        flash_macro=macro(stem, "FLASH"),
        count_macro=macro(stem, "VECTORS"),
        count=len(vectors.inputs["q"]) if checked else 0,
        inputs=tuple(_inputs(kernels, checked, vectors, real)),
        checks=tuple(_check(kernels, program, vectors, real) for program in checked),
        inverse=inverse,
        left_out=tuple(function(robot.name, quantity.function, real) for quantity in left_out),
        has_turns=inverse is not None
        or any(result.turns for program in checked for result in vectors.expected[program.quantity]),
        has_matrices=any(array.is_pose for program in checked for array in program.signature.results),
        pairs=tuple(_pair(*pair, real) for pair in vectors.pairs),
        pairs_macro=macro(stem, "PAIRS"),
        sincos=SINCOS[real],
        sincos_macro=sincos_macro(robot.name, real),
        pair_tolerance=real.literal(accepted_pair_error(real)),
        zero=real.literal(Fraction(0)),
        one=real.literal(Fraction(1)),
    )
    templates = {context.header: "c/vectors.h", context.source: "c/selftest.c"}
    return rendered(templates, k=context, prefix=stem, qualifier="static")


def _inputs(
    kernels: RobotPrograms, checked: list[Program], vectors: Vectors, real: ScalarType
) -> Iterator[VectorInput]:
    arrays = {array.name: array for program in checked for array in given(program)}
    for name, array in arrays.items():
        yield VectorInput(
            array=f"{prefix(kernels.robot.name, real)}_vectors_{name}",
            given=f"given_{name}",
            extent=macros(kernels)[0][0] if array.shape == (kernels.robot.dof,) else str(array.stored),
            words="Joint vectors." if name == "q" else f"{name}: {input_text(array)}.",
            rows=tuple(_row(entries, real) for entries in vectors.inputs[name]),
        )


def _inverse_check(kernels: RobotPrograms, vectors: Vectors, real: ScalarType) -> InverseCheck | None:
    found = inverse_of(kernels)
    if found is None:
        return None
    inverse, branches = found
    robot = kernels.robot
    stem, name = prefix(robot.name, real), function(robot.name, inverse.quantity.function, real)
    choice = function(robot.name, NEAREST, real)
    given_values = ["pose", *["redundancy"] * bool(branches.given)]
    return InverseCheck(
        function=name,
        count_macro=macro(stem, "TARGETS"),
        count=len(vectors.targets),
        tolerance_macro=macro(stem, "INVERSE_TOLERANCE"),
        tolerance=real.literal(INVERSE_TOLERANCES[real]),
        dof=macro(robot.name, "DOF"),
        branches=macro(robot.name, "BRANCHES"),
        given=tuple(real.literal(row[0]) if len(row) == 1 else _row(row, real) for row in vectors.given),
        targets=targets_of(kernels, vectors, lambda _array, entries: _row(entries, real)),
        call=f"{name}({', '.join([*given_values, *_parameters(kernels, real), 'solutions', 'valid'])})",
        choice=choice,
        choice_call=f"{choice}({', '.join([*given_values, 'wanted', *_parameters(kernels, real), 'chosen'])})",
        too_far=real.literal(LARGEST[real]),
    )


def _check(kernels: RobotPrograms, program: Program, vectors: Vectors, real: ScalarType) -> VectorCheck:
    robot = kernels.robot
    name = function(robot.name, program.quantity.function, real)
    expected = vectors.expected[program.quantity]
    inputs = [f"given_{array.name}" for array in given(program)]
    arguments = [*inputs, *_parameters(kernels, real), *(array.name for array in computed(program))]
    return VectorCheck(
        function=name,
        count=len(expected[0].rows),
        results=tuple(_results(kernels, program, vectors, real)),
        call=f"{name}({', '.join(arguments)})",
    )


def _parameters(kernels: RobotPrograms, real: ScalarType) -> list[str]:
    return [f"&{default_params(kernels.robot.name, real)}"] if kernels.robot.runtime_parameters else []


def _results(kernels: RobotPrograms, program: Program, vectors: Vectors, real: ScalarType) -> Iterator[VectorResult]:
    name = function(kernels.robot.name, program.quantity.function, real)
    arrays = program.signature.results
    accepted = iter(accepted_differences(kernels, program, vectors, real))
    for array, result in zip(arrays, vectors.expected[program.quantity], strict=True):
        if not array.size:
            continue
        # Results of one kernel have arrays of their own.
        ending = f"_{array.name}" if len(arrays) > 1 else ""
        expected, limits = (f"{companion(name, part)}{ending}" for part in ("expected", "accepted"))
        entries = array.size // array.blocks
        of_frames = " for each frame" if program.frames else ""
        without = "; the last rows 0 0 0 1 are left out" if array.is_pose else ""
        whole = entries == array.stored
        # The constant last rows are between the entries of frames.
        place = f"found{ending}[entry]" if whole else f"found{ending}[(frame * {array.stored}) + entry]"
        entry = "entry" if whole else f"(frame * {entries}) + entry"
        read = f"{prefix(kernels.robot.name, real)}_read"
        wanted = f"{read}(&{expected}[vector][{entry}])"
        yield VectorResult(
            array=expected,
            found=f"found{ending}",
            rows=tuple(_row(numbers, real) for numbers in result.rows),
            entries=f"{entries} entries{of_frames}{without}",
            block=entries,
            blocks=array.blocks,
            total=array.size,
            stride=array.stored,
            last=array.stored - 1,
            output=declared(kernels, program, array),
            first=f"&{array.name}[0][0]" if array.per_frame else f"&{array.name}[0]",
            value=f"{prefix(kernels.robot.name, real)}_turned({place}, {wanted}, {real.literal(2 * _PI)})"
            if result.turns
            else place,
            wanted=wanted,
            accepted=f"{read}(&{limits}[{entry}])",
            accepted_array=limits,
            limits=_row(next(accepted), real),
        )


def _pair(angle: Fraction, sine: Fraction, cosine: Fraction, real: ScalarType) -> str:
    """Writes an angle and its results, each as the nearest number and the rest: errors below half a unit show."""
    nearest = [Fraction(real.round(result)) for result in (sine, cosine)]
    return _row((angle, nearest[0], sine - nearest[0], nearest[1], cosine - nearest[1]), real)


def _row(entries: Sequence[Fraction], real: ScalarType) -> str:
    return braced(map(real.literal, entries))
