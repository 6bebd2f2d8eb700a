"""The functions of a crate, as finished text: for one configuration, for slices of them, and the search of C."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from dataclasses import replace

from kinegen.backends.accuracy import error_lines
from kinegen.backends.bundle import RobotPrograms, operation_line
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.c.numeric_inverse import emit_numeric_inverse, tolerances
from kinegen.backends.c.syntax import truth_printer
from kinegen.backends.descriptions import brief, input_text, result_text
from kinegen.backends.inverse import notes_of
from kinegen.backends.routines import LINE
from kinegen.backends.rust.syntax import BOTH, NUMBER, literal, rust_syntax
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.sections import sections
from kinegen.backends.solver_parameters import TUNING
from kinegen.backends.templates import rendered
from kinegen.ir.program import Operator, Program
from kinegen.model.outputs import NUMERIC_INVERSE, POSE_AND_JACOBIAN, Array, Kind
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import c_file, function, search_file

WIDTH = 120
"""Characters of a line of code, as `rustfmt.toml` says."""

SOLUTIONS = "Solutions"
"""The result of an inverse."""


@dataclass(frozen=True, slots=True)
class Batch:
    """Holds the function for slices, one of which counts the configurations; the lengths of others are checked."""

    signature: tuple[str, ...]
    counted: str
    checked: tuple[str, ...]
    stored: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Function:
    """Holds one kernel, printed.

    Attributes:
        heading: What it computes, as paragraphs of documentation.
        notes: Preformatted text about the results.
        costs: What a call costs, and how far its results can be off.
        unused: Arguments that the body does not read.
        declared: The results before they are computed.
        taken: The inputs with their types.
        given: The results with their types.
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


def function_of(kernels: RobotPrograms, program: Program, real: ScalarType) -> Function:
    """Prints one kernel."""
    robot, signature, number = kernels.robot, program.signature, NUMBER[real]
    is_inverse = program.quantity.kind is Kind.INVERSE
    taken = tuple((each.name, type_of(each, number, robot)) for each in signature.inputs)
    given = tuple((each.name, type_of(each, number, robot)) for each in signature.results)
    parameters = [("params", "Params")] * bool(robot.runtime_parameters)
    arguments = [f"{name}: &{kind}" for name, kind in (*taken, *parameters)]
    # Arguments that nothing reads are bound to `_`.
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
    """Returns the first lines of a function, laid out as rustfmt does."""
    line = f"pub fn {name}({', '.join(arguments)}) -> {returned} {{"
    if len(line) <= WIDTH:
        return (line,)
    return f"pub fn {name}(", *(f"    {each}," for each in arguments), f") -> {returned} {{"


def escaped(text: str) -> str:
    """Returns text without a meaning in Markdown."""
    return re.sub(r"([\\`*\[\]<>|])", r"\\\1", text)


def type_of(array: Array, number: str, robot: Robot) -> str:
    """Returns the type of an array of one configuration."""
    kind = "bool" if array.is_truth else number
    for size in reversed(array.shape or (1,)):
        kind = f"[{kind}; {size}]"
    is_joints = array.shape == (robot.dof,) and array.name in ("q", "qd", "qdd", "joints")
    return f"[{number}; DOF]" if is_joints else kind


def _result(program: Program, array: Array) -> str:
    if array.is_truth:
        return "whether each branch is a solution"
    text = "a joint vector for each branch" if array.per_branch else result_text(array)
    if program.quantity.kind is Kind.PARAMETER_JACOBIAN:
        text += ", columns in the order of `PARAMETERS`"
    if array.per_frame:
        text += f", for each {'frame in the order of `FRAMES`' if program.quantity.kind is Kind.FRAMES else 'tip'}"
    return text.replace(", row by row", "")


def _costs(kernels: RobotPrograms, program: Program, real: ScalarType) -> tuple[str, ...]:
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
    """Returns a number of an array by its place in memory."""
    indices = []
    for size in reversed(array.shape or (1,)):
        flat, index = divmod(flat, size)
        indices.append(index)
    return array.name + "".join(f"[{index}]" for index in reversed(indices))


def _body(robot: Robot, program: Program, real: ScalarType) -> tuple[str, ...]:
    syntax = rust_syntax(real)
    places = [
        entry(array, block * array.stored + index)
        for array in program.signature.results
        for block in range(array.blocks)
        for index in range(array.size // array.blocks)
    ]
    variables = [entry(array, index) for array in program.signature.inputs for index in range(array.size)]
    of_truths = replace(syntax, forms={**syntax.forms, Operator.MUL: BOTH})
    printer = truth_printer(program, (syntax, of_truths), ("false", "true"), variables, places)
    # Other entries of the last row are zero from the beginning.
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
    """Prints the function for slices; an inverse has one slice of results."""
    name, is_inverse = program.quantity.function, program.quantity.kind is Kind.INVERSE
    # Solutions of a pose are one record.
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


FOLDER = "csrc"
"""Where the C files are in the crate."""


@dataclass(frozen=True, slots=True)
class Search:
    """Holds what the templates of the search are given.

    Tolerances are those by default, in the length unit and in radians; restarts are descents after the first by
    default; the C files that are compiled are of both number types.
    """

    crate: str
    function: str
    number: str
    length: str
    position_tolerance: str
    rotation_tolerance: str
    restarts: int
    sources: tuple[str, ...]
    has_parameters: bool
    signature: tuple[str, ...]


def search_of(kernels: RobotPrograms, real: ScalarType) -> Search:
    """Returns what the templates lay out."""
    robot = kernels.robot
    position, rotation = tolerances(robot, real)
    number = NUMBER[real]
    arguments = [f"base_T_tool: &[[{number}; 4]; 4]", f"start: &[{number}; DOF]"]
    arguments += [*["params: &Params"] * bool(robot.runtime_parameters), "search: &Search"]
    return Search(
        crate=robot.name,
        function=function(robot.name, str(NUMERIC_INVERSE), real),
        number=number,
        length=robot.units.length,
        position_tolerance=literal(real, position),
        rotation_tolerance=literal(real, rotation),
        restarts=TUNING.restarts,
        sources=tuple(
            f"{FOLDER}/{name}"
            for each in ScalarType
            for name in (c_file(robot.name, "c", each), search_file(robot.name, "c", each))
        ),
        has_parameters=bool(robot.runtime_parameters),
        signature=signature_lines(str(NUMERIC_INVERSE), arguments, "Found"),
    )


def emit_search(kernels: RobotPrograms, real: ScalarType) -> dict[str, str]:
    """Print the files of the search of one number type, by path in the crate; C has the kernel that it takes alone."""
    alone = tuple(program for program in kernels.programs if program.quantity == POSE_AND_JACOBIAN)
    searched = RobotPrograms(kernels.robot, alone, kernels.defaults, numeric_inverse=True)
    sources = emit_kernel(searched, real) | emit_numeric_inverse(searched, real)
    files = {f"{FOLDER}/{name}": text for name, text in sources.items()}
    search = search_of(kernels, real)
    templates = {"src/numeric_inverse.rs": "rust/numeric_inverse.rs", "build.rs": "rust/build.rs"}
    if real is ScalarType.FLOAT:
        templates = {"src/f32/numeric_inverse.rs": "rust/numeric_inverse.rs"}
    return files | rendered(templates, s=search)
