"""The functions of the JavaScript module, as finished text: for one configuration, for many, and their types."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from kinegen.backends.bundle import RobotPrograms, operation_line
from kinegen.backends.descriptions import brief, input_text, result_text
from kinegen.backends.inverse import notes_of
from kinegen.backends.javascript.syntax import kernel_lines
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.sections import sections
from kinegen.ir.program import Program
from kinegen.model.outputs import Array, Kind
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import companion

LINE = 116
"""Characters of a line of a comment, without the asterisk before it."""


@dataclass(frozen=True, slots=True)
class Batch:
    """Holds the function for any number of configurations; checks count them, create results and check lengths."""

    definition: str
    checks: tuple[str, ...]
    call: str
    declaration: str


@dataclass(frozen=True, slots=True)
class Function:
    """Holds one kernel, printed.

    Attributes:
        heading: What it computes, and what a call costs, as lines of a comment.
        kernel: The function that evaluates arrays from given places on, with its arguments.
        definition: The exported function with its arguments.
        checks: Statements that check lengths.
        declaration: Its name and arguments with their types.
    """

    name: str
    heading: tuple[str, ...]
    arguments: tuple[str, ...]
    kernel: str
    body: tuple[str, ...]
    definition: str
    checks: tuple[str, ...]
    call: str
    returned: str
    declaration: str
    batch: Batch | None


def function_of(kernels: RobotPrograms, program: Program) -> Function:
    """Prints one kernel."""
    name = program.quantity.function
    inputs, results = program.signature.inputs, program.signature.results
    parameters = ["params"] * bool(kernels.defaults)
    sentences = f"{brief(program.signature)} Costs {operation_line(program)}."
    notes = notes_of(kernels, program, LINE, (ScalarType.DOUBLE,))
    given = [each.name for each in inputs] + [f"{each} = DEFAULT_PARAMS" for each in parameters]
    created = [f"{each.name} = new {_kind(each)}({_numbers(each)})" for each in results]
    return Function(
        name=name,
        heading=(*textwrap.wrap(sentences, LINE, break_on_hyphens=False), *notes),
        arguments=tuple(_argument_lines(program)),
        kernel=_call(name, [f"{each.name}_at" for each in inputs], parameters, program, "{}"),
        body=_body(kernels.robot, program),
        definition=f"{name}({', '.join([*given, *created])})",
        checks=tuple(_check(name, each, f"{_numbers(each)}") for each in (*inputs, *results)),
        call=_call(name, ["0"] * len(inputs), parameters, program, "0"),
        returned=_listed([each.name for each in results]),
        declaration=_declaration(name, program, bool(parameters)),
        batch=_batch(program, given, parameters) if any(each.size for each in inputs) else None,
    )


def _batch(program: Program, given: Sequence[str], parameters: Sequence[str]) -> Batch:
    inputs, results = program.signature.inputs, program.signature.results
    name = companion(program.quantity.function, "batch")
    first = inputs[0]
    checks = [f'const n = count("{name}", "{first.name}", {first.name}, {_numbers(first)});']
    checks += [_check(name, each, f"n * {_numbers(each)}") for each in inputs[1:]]
    for each in results:
        checks.append(f"{each.name} ??= new {_kind(each)}(n * {_numbers(each)});")
        checks.append(_check(name, each, f"n * {_numbers(each)}"))
    places = [f"i * {_numbers(each)}" for each in inputs]
    return Batch(
        definition=f"{name}({', '.join([*given, *(each.name for each in results)])})",
        checks=tuple(checks),
        call=_call(program.quantity.function, places, parameters, program, "i * {size}"),
        declaration=_declaration(name, program, bool(parameters)),
    )


def _call(name: str, places: Sequence[str], parameters: Sequence[str], program: Program, result: str) -> str:
    """Calls the function that evaluates, with each array followed by the place where a configuration begins.

    Parameters are passed between inputs and results. In the place of a result `{}` is its own name for it, `{size}` its
    numbers.
    """
    inputs, results = program.signature.inputs, program.signature.results
    words = [word for each, place in zip(inputs, places, strict=True) for word in (each.name, place)]
    words += parameters
    for each in results:
        words += [each.name, result.format(f"{each.name}_at", size=_numbers(each))]
    return f"{companion(name, 'at')}({', '.join(words)})"


def _argument_lines(program: Program) -> list[str]:
    order = "FRAMES" if program.quantity.kind is Kind.FRAMES else "TIPS"
    lines = [f"@param {each.name} {input_text(each)}: {_numbers(each)} numbers" for each in program.signature.inputs]
    for each in program.signature.results:
        several = f", in the order of {order}" if each.per_frame else ""
        lines.append(f"@param {each.name} array for the result, {result_text(each)}{several}: {_numbers(each)} numbers")
    return lines


def _declaration(name: str, program: Program, has_parameters: bool) -> str:
    kinds = [_kind(each) for each in program.signature.results]
    words = [f"{each.name}: Numbers" for each in program.signature.inputs]
    words += ["params?: Readonly<Params>"] * has_parameters
    words += [f"{each.name}?: {kind}" for each, kind in zip(program.signature.results, kinds, strict=True)]
    return f"{name}({', '.join(words)}): {_listed(kinds)}"


def _listed(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"[{', '.join(words)}]"


def _check(where: str, array: Array, size: str) -> str:
    return f'check("{where}", "{array.name}", {array.name}, {size});'


def _numbers(array: Array) -> int:
    """Returns numbers of one configuration, last rows of matrices among them."""
    return array.blocks * array.stored


def _kind(array: Array) -> str:
    """Names the type of an array; flags are whole numbers."""
    return "Uint8Array" if array.is_truth else "Float64Array"


def _body(robot: Robot, program: Program) -> tuple[str, ...]:
    variables = [_entry(array.name, index) for array in program.signature.inputs for index in range(array.size)]
    results = program.signature.results
    places = [
        _entry(array.name, block * array.stored + index)
        for array in results
        for block in range(array.blocks)
        for index in range(array.size // array.blocks)
    ]
    rows = [
        f"{_entry(array.name, block * array.stored + 12 + column)} = {value};"
        for array in results
        if array.is_pose
        for block in range(array.blocks)
        for column, value in enumerate(("0.0", "0.0", "0.0", "1.0"))
    ]
    return kernel_lines(program, variables, places, rows, sections(robot, program))


def _entry(name: str, index: int) -> str:
    """Returns a number of one configuration; where that begins is an argument."""
    return f"{name}[{name}_at + {index}]" if index else f"{name}[{name}_at]"
