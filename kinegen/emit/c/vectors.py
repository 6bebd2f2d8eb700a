"""Test vectors and a self-test: a board can be checked without Python.

The expected values come from the caller, computed with 50 digits; here they are rounded once and printed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from kinegen.emit.c.arguments import declared
from kinegen.emit.c.kernel import macros
from kinegen.emit.environment import environment
from kinegen.emit.kernels import Kernels, provenance
from kinegen.emit.reals import Real
from kinegen.emit.sincos import SINCOS, Sincos
from kinegen.naming import c_file, comment_text, function, guard, prefix, sincos_macro
from kinegen.outputs import Quantity


@dataclass(frozen=True, slots=True)
class Vectors:
    """Joint vectors and what the kernels must return for them.

    Attributes:
        inputs: Joint vectors; entries that floats hold exactly.
        expected: For each quantity and joint vector, the entries of the output array in order, without the constant
            last row of a matrix.
        pairs: Angles that the kernels take, which floats hold exactly, each with its sine and cosine.
        tolerances: Largest accepted difference of an entry, in its own unit, for each number type.
    """

    inputs: tuple[tuple[Fraction, ...], ...]
    expected: Mapping[Quantity, tuple[tuple[Fraction, ...], ...]]
    pairs: tuple[tuple[Fraction, Fraction, Fraction], ...]
    tolerances: Mapping[Real, Fraction]


@dataclass(frozen=True, slots=True)
class VectorCheck:
    """The check of one kernel."""

    function: str
    array: str
    rows: tuple[str, ...]
    entries: int
    frames: int
    total: int
    stride: int
    output: str
    first: str
    call: str


@dataclass(frozen=True, slots=True)
class VectorContext:
    """What the templates `c/vectors.h.jinja` and `c/selftest.c.jinja` are given."""

    header: str
    source: str
    kernel_header: str
    guard: str
    provenance: str
    description: str
    robot: str
    prefix: str
    real: str
    length: str
    count_macro: str
    count: int
    dof: int
    dof_macro: str
    inputs: tuple[str, ...]
    checks: tuple[VectorCheck, ...]
    pairs: tuple[str, ...]
    pairs_macro: str
    sincos: Sincos
    sincos_macro: str
    tolerance: str
    zero: str


def emit_vectors(kernels: Kernels, vectors: Vectors, real: Real) -> dict[str, str]:
    """Print the vectors and the self-test of one number type.

    Args:
        kernels: The robot and its programs.
        vectors: The data.
        real: The number type.

    Returns:
        Text by file name.
    """
    robot = kernels.robot
    stem = prefix(robot.name, real)
    context = VectorContext(
        header=f"{stem}_vectors.h",
        source=f"{stem}_selftest.c",
        kernel_header=c_file(robot.name, "h", real),
        guard=guard(f"{stem}_vectors.h"),
        provenance=provenance(robot),
        description=comment_text(robot.description),
        robot=robot.name,
        prefix=stem,
        real=real.value,
        length=robot.units.length,
        count_macro=f"{stem.upper()}_VECTORS",
        count=len(vectors.inputs),
        dof=robot.dof,
        dof_macro=macros(kernels)[0][0],
        inputs=tuple(_row(entries, real) for entries in vectors.inputs),
        checks=tuple(_check(kernels, vectors, index, real) for index in range(len(kernels.programs))),
        pairs=tuple(_pair(*pair, real) for pair in vectors.pairs),
        pairs_macro=f"{stem.upper()}_PAIRS",
        sincos=SINCOS[real],
        sincos_macro=sincos_macro(robot.name, real),
        tolerance=real.literal(vectors.tolerances[real]),
        zero=real.literal(Fraction(0)),
    )
    return {
        name: environment().get_template(template).render(k=context, prefix=stem, qualifier="static")
        for name, template in ((context.header, "c/vectors.h.jinja"), (context.source, "c/selftest.c.jinja"))
    }


def _check(kernels: Kernels, vectors: Vectors, index: int, real: Real) -> VectorCheck:
    robot = kernels.robot
    program = kernels.programs[index]
    name = function(robot.name, program.quantity.function, real)
    result = program.signature.results[0]
    inputs = ["q"] if robot.dof else []
    if robot.runtime_parameters:
        inputs.append(f"&{prefix(robot.name, real)}_default_params")
    return VectorCheck(
        function=name,
        array=f"{name}_expected",
        rows=tuple(_row(entries, real) for entries in vectors.expected[program.quantity]),
        entries=result.size // result.blocks,
        frames=result.blocks,
        total=result.size,
        stride=result.stored,
        output=declared(kernels, program, result),
        first=f"&{result.name}[0][0]" if result.per_frame else f"&{result.name}[0]",
        call=f"{name}({', '.join([*inputs, result.name])})",
    )


def _pair(angle: Fraction, sine: Fraction, cosine: Fraction, real: Real) -> str:
    """The angle and its results, each as the nearest number and the rest, so that errors below half a unit show."""
    nearest = [Fraction(real.round(result)) for result in (sine, cosine)]
    return _row((angle, nearest[0], sine - nearest[0], nearest[1], cosine - nearest[1]), real)


def _row(entries: Sequence[Fraction], real: Real) -> str:
    return "{" + ", ".join(real.literal(entry) for entry in entries) + "}"
