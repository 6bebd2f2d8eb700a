"""The tests of the package: test vectors that were computed with 50 digits, for `node --test`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from kinegen.emit.c.accepted import accepted_differences
from kinegen.emit.c.expected import NOTHING, Row, Vectors, whole
from kinegen.emit.environment import environment
from kinegen.emit.javascript.wasm import batched
from kinegen.emit.kernels import Kernels, provenance
from kinegen.emit.reals import Real
from kinegen.ir.program import Program


@dataclass(frozen=True, slots=True)
class VectorTest:
    """The test of one function: its inputs, and of each result what is expected and accepted, as literals."""

    function: str
    has_batch: bool
    inputs: tuple[tuple[str, ...], ...]
    results: tuple[tuple[tuple[str, ...], str, str], ...]


@dataclass(frozen=True, slots=True)
class TestContext:
    """What the template `javascript/test.mjs.jinja` is given."""

    name: str
    provenance: str
    has_wasm: bool
    tests: tuple[VectorTest, ...]


def emit_javascript_tests(kernels: Kernels, vectors: Vectors) -> dict[str, str]:
    """Print the tests.

    Args:
        kernels: The robot and its programs.
        vectors: What the functions must return.
    """
    checked = [program for program in kernels.programs if program.quantity in vectors.expected]
    context = TestContext(
        name=kernels.robot.name,
        provenance=provenance(kernels.robot),
        has_wasm=bool(batched(kernels)),
        tests=tuple(_test(kernels, program, vectors) for program in checked),
    )
    return {"test.mjs": environment().get_template("javascript/test.mjs.jinja").render(k=context)}


def _test(kernels: Kernels, program: Program, vectors: Vectors) -> VectorTest:
    inputs = tuple(
        tuple(_numbers(row) for row in vectors.inputs[array.name]) for array in program.signature.inputs if array.size
    )
    has_batch = any(array.size for array in program.signature.inputs)
    return VectorTest(program.quantity.function, has_batch, inputs, tuple(_results(kernels, program, vectors)))


def _results(kernels: Kernels, program: Program, vectors: Vectors) -> Iterator[tuple[tuple[str, ...], str, str]]:
    accepted = iter(accepted_differences(kernels, program, vectors, Real.DOUBLE))
    expected = vectors.expected[program.quantity]
    count = min(len(each.rows) for each in expected)
    for array, each in zip(program.signature.results, expected, strict=True):
        limits = next(accepted) if array.size else ()
        rows = tuple(_numbers(whole(array, row)) for row in each.rows[:count])
        yield rows, _numbers(whole(array, limits, NOTHING)), "true" if each.turns else "false"


def _numbers(entries: Row) -> str:
    return f"[{', '.join(Real.DOUBLE.literal(entry) for entry in entries)}]"
