"""Test vectors and a self-test of the integer kernels; the expected values come from the caller, as integers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from kinegen.backends.bundle import provenance
from kinegen.backends.c.arguments import declared
from kinegen.backends.fixed_point.kernels import FixedKernels
from kinegen.backends.templates import rendered
from kinegen.ir.fixed_point.program import NUMBER_BITS, FixedProgram
from kinegen.model.outputs import Quantity
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import (
    Q30,
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

IntegerRow = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class FixedVectors:
    """Holds joint vectors, as the kernels take them, and the integers next to what these must return.

    Attributes:
        expected: For each quantity and joint vector, the entries of the output array in order, without the constant
            last row of a matrix.
    """

    inputs: tuple[IntegerRow, ...]
    expected: Mapping[Quantity, tuple[IntegerRow, ...]]


@dataclass(frozen=True, slots=True)
class FixedCheck:
    """Holds the check of one kernel."""

    function: str
    array: str
    rows: tuple[str, ...]
    entries: int
    frames: int
    total: int
    stride: int
    last: int
    output: str
    first: str
    call: str


@dataclass(frozen=True, slots=True)
class FixedVectorContext:
    """Holds what the templates `fixed_point/vectors.h.jinja` and `fixed_point/selftest.c.jinja` are given."""

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
    sincos_macro: str
    count_macro: str
    tolerance_macro: str
    count: int
    dof: int
    dof_macro: str
    inputs: tuple[str, ...]
    checks: tuple[FixedCheck, ...]
    tolerance: int
    coarse_tolerance: int
    one: int


def emit_fixed_vectors(fixed: FixedKernels, vectors: FixedVectors) -> dict[str, str]:
    """Prints the vectors and the self-test, by file name."""
    robot = fixed.robot
    stem = prefix(robot.name, Q30)
    context = FixedVectorContext(
        header=vectors_file(robot.name, Q30),
        source=selftest_file(robot.name, Q30),
        kernel_header=c_file(robot.name, "h", Q30),
        guard=guard(vectors_file(robot.name, Q30)),
        provenance=provenance(robot),
        description=comment_text(robot.description),
        robot=robot.name,
        prefix=stem,
        real="int32_t",
        flash_macro=macro(stem, "FLASH"),
        sincos_macro=sincos_macro(robot.name, Q30),
        count_macro=macro(stem, "VECTORS"),
        tolerance_macro=macro(stem, "TOLERANCE"),
        count=len(vectors.inputs),
        dof=robot.dof,
        dof_macro=macro(robot.name, "DOF"),
        inputs=tuple(_row(entries) for entries in vectors.inputs),
        checks=tuple(_check(fixed, program, vectors) for program in fixed.programs),
        tolerance=tolerance(fixed),
        coarse_tolerance=_accepted(fixed.coarse.errors) if fixed.coarse else 0,
        one=2**NUMBER_BITS,
    )
    templates = {context.header: "fixed_point/vectors.h", context.source: "fixed_point/selftest.c"}
    return rendered(templates, k=context)


def tolerance(fixed: FixedKernels) -> int:
    """Returns how far results may be from the rounded exact ones, in units of the last place."""
    return _accepted([program.errors for program in fixed.programs])


def _accepted(errors: Sequence[Sequence[float]]) -> int:
    return math.floor(max(error for program in errors for error in program) + 0.5)


def _check(fixed: FixedKernels, program: FixedProgram, vectors: FixedVectors) -> FixedCheck:
    robot, quantity = fixed.robot, program.program.quantity
    name = function(robot.name, quantity.function, Q30)
    result = program.program.signature.results[0]
    inputs = ["q"] if robot.dof else []
    if robot.runtime_parameters:
        inputs.append(f"&{default_params(robot.name, Q30)}")
    return FixedCheck(
        function=name,
        array=companion(name, "expected"),
        rows=tuple(_row(entries) for entries in vectors.expected[quantity]),
        entries=result.size // result.blocks,
        frames=result.blocks,
        total=result.size,
        stride=result.stored,
        last=result.stored - 1,
        output=declared(fixed.kernels, program.program, result),
        first=f"&{result.name}[0][0]" if result.per_frame else f"&{result.name}[0]",
        call=f"{name}({', '.join([*inputs, result.name])})",
    )


def _row(entries: Sequence[int]) -> str:
    # The literal 2147483648 does not fit an int32_t, and its negation is no literal.
    return "{" + ", ".join(f"{entry}" if entry > -(2**31) else "(-2147483647 - 1)" for entry in entries) + "}"
