"""The functions of a crate, as finished text: for one configuration and for slices of them."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from kinegen.emit.accuracy import error_lines
from kinegen.emit.c.truths import truth_places, truths_of
from kinegen.emit.functions import LINE
from kinegen.emit.inverse import notes_of
from kinegen.emit.kernels import Kernels, operation_line
from kinegen.emit.printing import Printer
from kinegen.emit.reals import Real
from kinegen.emit.rust.syntax import NUMBER, rust_syntax, truth, truth_operands, truth_syntax
from kinegen.emit.sections import sections
from kinegen.emit.words import brief, input_text, result_text
from kinegen.ir.program import Operator, Program
from kinegen.outputs import Array, Kind
from kinegen.robot.model import Robot

WIDTH = 120
"""Characters of a line of code, as `rustfmt.toml` says."""

SOLUTIONS = "Solutions"
"""The result of an inverse."""


@dataclass(frozen=True, slots=True)
class Batch:
    """The function for slices.

    Attributes:
        signature: Its first lines.
        counted: The slice that counts the configurations.
        checked: The other slices.
        stored: The evaluation of configuration i, and assignments of its results.
    """

    signature: tuple[str, ...]
    counted: str
    checked: tuple[str, ...]
    stored: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Function:
    """One kernel, printed.

    Attributes:
        name: Its name.
        heading: What it computes, as paragraphs of documentation.
        arguments: Of each argument its name and what it holds.
        results: The same of the results.
        notes: Preformatted text about the results.
        costs: What a call costs, and how far its results can be off.
        signature: Its first lines.
        unused: Arguments that the body does not read.
        declared: The results before they are computed.
        body: The statements.
        returned: What it returns.
        batch: The same for slices, where there are inputs.
        taken: The inputs with their types.
        given: The results with their types.
        sizes: Numbers of each result.
        has_parameters: Whether runtime parameters follow the inputs.
        is_inverse: Whether its results are the solutions of a pose.
    """

    name: str
    heading: tuple[str, ...]
    arguments: tuple[tuple[str, str], ...]
    results: tuple[tuple[str, str], ...]
    notes: tuple[str, ...]
    costs: tuple[str, ...]
    signature: tuple[str, ...]
    unused: tuple[str, ...]
    declared: tuple[str, ...]
    body: tuple[str, ...]
    returned: str
    batch: Batch | None
    taken: tuple[tuple[str, str], ...]
    given: tuple[tuple[str, str], ...]
    sizes: tuple[int, ...]
    has_parameters: bool
    is_inverse: bool

    @property
    def others(self) -> tuple[str, ...]:
        """Lines of the function that are not statements."""
        return (*self.declared, *(f"let _ = {name};" for name in self.unused), self.returned)


def function_of(kernels: Kernels, program: Program, real: Real) -> Function:
    """Print one kernel.

    Args:
        kernels: The robot and its programs.
        program: One of these.
        real: The number type.
    """
    robot, signature, number = kernels.robot, program.signature, NUMBER[real]
    is_inverse = program.quantity.kind is Kind.INVERSE
    taken = tuple((each.name, type_of(each, number, robot)) for each in signature.inputs)
    given = tuple((each.name, type_of(each, number, robot)) for each in signature.results)
    parameters = [("params", "Params")] * bool(robot.runtime_parameters)
    arguments = [f"{name}: &{kind}" for name, kind in (*taken, *parameters)]
    unused = [each.name for each in signature.inputs if not program.reads(each)]
    unused += ["params"] * bool(parameters and not program.reads_parameters)
    names = [name for name, _ in given]
    return Function(
        name=program.quantity.function,
        heading=(escaped(brief(signature)),),
        arguments=tuple((each.name, escaped(input_text(each))) for each in signature.inputs),
        results=tuple((each.name, escaped(_result(program, each))) for each in signature.results),
        notes=notes_of(kernels, program, LINE, (real,)),
        costs=_costs(kernels, program, real),
        signature=signature_lines(program.quantity.function, arguments, _returned_type(given, is_inverse=is_inverse)),
        unused=tuple(unused),
        declared=tuple(_declared(each) for each in signature.results),
        body=_body(robot, program, real),
        returned=f"{SOLUTIONS} {{ {', '.join(names)} }}" if is_inverse else _listed(names),
        batch=_batch(program, taken, given, parameters) if any(each.size for each in signature.inputs) else None,
        taken=taken,
        given=given,
        sizes=tuple(each.blocks * each.stored for each in signature.results),
        has_parameters=bool(parameters),
        is_inverse=is_inverse,
    )


def signature_lines(name: str, arguments: Sequence[str], returned: str) -> tuple[str, ...]:
    """The first lines of a function, laid out as rustfmt does."""
    line = f"pub fn {name}({', '.join(arguments)}) -> {returned} {{"
    if len(line) <= WIDTH:
        return (line,)
    return f"pub fn {name}(", *(f"    {each}," for each in arguments), f") -> {returned} {{"


def escaped(text: str) -> str:
    """Text without a meaning in Markdown."""
    return re.sub(r"([\\`*\[\]<>|])", r"\\\1", text)


def type_of(array: Array, number: str, robot: Robot) -> str:
    """The type of an array of one configuration."""
    kind = "bool" if array.is_truth else number
    for size in reversed(array.shape or (1,)):
        kind = f"[{kind}; {size}]"
    is_joints = array.shape == (robot.dof,) and array.name in ("q", "qd", "qdd", "joints")
    return f"[{number}; DOF]" if is_joints else kind


def _result(program: Program, array: Array) -> str:
    """What a result holds."""
    if array.is_truth:
        return "whether each branch is a solution"
    text = "a joint vector for each branch" if array.per_branch else result_text(array)
    if program.quantity.kind is Kind.PARAMETER_JACOBIAN:
        text += ", columns in the order of `PARAMETERS`"
    if array.per_frame:
        text += f", for each {'frame in the order of `FRAMES`' if program.quantity.kind is Kind.FRAMES else 'tip'}"
    return text.replace(", row by row", "")


def _costs(kernels: Kernels, program: Program, real: Real) -> tuple[str, ...]:
    text = " ".join([f"Costs {operation_line(program)}.", *error_lines(kernels, program, real)])
    return tuple(textwrap.wrap(escaped(text), LINE - 4, break_long_words=False, break_on_hyphens=False))


def _returned_type(given: Sequence[tuple[str, str]], *, is_inverse: bool) -> str:
    return SOLUTIONS if is_inverse else _listed([kind for _, kind in given])


def _listed(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"({', '.join(words)})"


def _declared(array: Array) -> str:
    value = "false" if array.is_truth else "0.0"
    for size in reversed(array.shape):
        value = f"[{value}; {size}]"
    return f"let {'mut ' if array.size else ''}{array.name} = {value};"


def entry(array: Array, flat: int) -> str:
    """A number of an array by its place in memory."""
    return array.name + "".join(f"[{index}]" for index in np.unravel_index(flat, array.shape or (1,)))


def _body(robot: Robot, program: Program, real: Real) -> tuple[str, ...]:
    """The statements, and the constant last row of each matrix."""
    syntax, truths = rust_syntax(real), truths_of(program)
    places = [
        entry(array, block * array.stored + index)
        for array in program.signature.results
        for block in range(array.blocks)
        for index in range(array.size // array.blocks)
    ]
    flags = {place for place, holds in zip(places, truth_places(program), strict=True) if holds}
    printer: Printer[Operator] = Printer(
        syntax,
        [entry(array, index) for array in program.signature.inputs for index in range(array.size)],
        partial(truth_operands, truths),
        others=truth_syntax(truths, syntax),
        literals=dict.fromkeys(flags, truth),
    )
    rows = [
        f"{entry(array, block * array.stored + 15)} = 1.0;"
        for array in program.signature.results
        if array.is_pose
        for block in range(array.blocks)
    ]
    return printer.lines(program, [*places], sections(robot, program), rows)


def _batch(
    program: Program,
    taken: Sequence[tuple[str, str]],
    given: Sequence[tuple[str, str]],
    parameters: Sequence[tuple[str, str]],
) -> Batch:
    """Slices in, slices out; an inverse has one slice of results."""
    name, is_inverse = program.quantity.function, program.quantity.kind is Kind.INVERSE
    stored = [("solutions", SOLUTIONS)] if is_inverse else given
    arguments = [f"{each}: &[{kind}]" for each, kind in taken]
    arguments += [f"{each}: &{kind}" for each, kind in parameters]
    arguments += [f"{each}: &mut [{kind}]" for each, kind in stored]
    inputs = [taken[0][0], *(f"&{each}[i]" for each, _ in taken[1:]), *(each for each, _ in parameters)]
    call = f"self::{name}({', '.join(inputs)})"  # a slice may have the name of the function
    assigned = (
        (f"{stored[0][0]}[i] = {call};",)
        if len(stored) == 1
        else (f"let found = {call};", *(f"{each}[i] = found.{index};" for index, (each, _) in enumerate(stored)))
    )
    return Batch(
        signature=signature_lines(f"{name}_batch", arguments, "Result<(), LengthError>"),
        counted=taken[0][0],
        checked=tuple(each for each, _ in (*taken[1:], *stored)),
        stored=assigned,
    )
