"""The functions of a package, as finished text: one for each kernel, for columns of either number type."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

from kinegen.emit.inverse import notes_of
from kinegen.emit.kernels import Kernels, operation_line
from kinegen.emit.matlab.columns import extents, last_rows, places, size
from kinegen.emit.matlab.syntax import CLASS, WIDTH, matlab_syntax, matlab_text, percent_comment
from kinegen.emit.printing import Printer
from kinegen.emit.reals import Real
from kinegen.emit.routines import CODE, routine_lines
from kinegen.emit.sections import sections
from kinegen.emit.words import brief, input_text, result_text
from kinegen.ir.program import Constant, Operator, Program
from kinegen.outputs import INVERSES, Array, Kind
from kinegen.robot.model import Robot


@dataclass(frozen=True, slots=True)
class Input:
    """One argument: its name, how N is counted, its rows and its shape, and a condition under which it is refused."""

    name: str
    count: str
    flat: str
    shape: str
    wrong: str


@dataclass(frozen=True, slots=True)
class Result:
    """One result: its name, and its final form."""

    name: str
    shaped: str


@dataclass(frozen=True, slots=True)
class Body:
    """The statements for one number type.

    Attributes:
        kind: The number type, as MATLAB names it.
        declared: The results before they are computed.
        lines: The statements, with headings.
        sincos: The statements of the sine-cosine pair; none where it is not called.
        atan2: The same of the arc tangent.
    """

    kind: str
    declared: tuple[str, ...]
    lines: tuple[str, ...]
    sincos: tuple[str, ...]
    atan2: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Function:
    """One kernel, printed.

    Attributes:
        name: Its name.
        brief: What it computes, in one sentence.
        help: The rest of its help text.
        returned: What it returns, as the head of a function has it.
        inputs: Its inputs.
        arguments: Their names, with the parameters.
        is_single: The condition under which singles are computed.
        results: Its results.
        bodies: The statements for both number types.
        full: Its arguments where all are passed, runtime parameters among them; 0 where it takes none of these.
        sqrt: Whether a body takes square roots.
        choose: Whether a body selects.
    """

    name: str
    brief: str
    help: tuple[str, ...]
    returned: str
    inputs: tuple[Input, ...]
    arguments: str
    is_single: str
    results: tuple[Result, ...]
    bodies: tuple[Body, ...]
    full: int
    sqrt: bool
    choose: bool


def function_of(kernels: Kernels, program: Program) -> Function:
    """Print one kernel.

    Args:
        kernels: The robot and its programs.
        program: One of these.
    """
    inputs, results = program.signature.inputs, program.signature.results
    has_parameters = bool(kernels.robot.runtime_parameters)
    arguments = [*(each.name for each in inputs), *["params"] * has_parameters]
    bodies = tuple(_body(kernels.robot, program, real) for real in Real)
    pairs = [CODE[real][Operator.SINCOS] for real in Real if program.uses(Operator.SINCOS)]
    return Function(
        name=program.quantity.function,
        brief=matlab_text(brief(program.signature)),
        help=tuple(_help(kernels, program)),
        returned=listed([each.name for each in results]),
        inputs=tuple(_input(each, inputs[0]) for each in inputs),
        arguments=", ".join(arguments),
        is_single=" || ".join(f"isa({each.name}, 'single')" for each in inputs),
        results=tuple(Result(each.name, _shaped(each)) for each in results),
        bodies=bodies,
        full=len(arguments) if has_parameters else 0,
        sqrt=program.uses(Operator.SQRT),
        choose=program.uses(Operator.SELECT_LT, Operator.ATAN2) or any(each.uses(Operator.SELECT_LT) for each in pairs),
    )


def listed(names: Sequence[str]) -> str:
    """One result, or several in brackets."""
    return names[0] if len(names) == 1 else f"[{', '.join(names)}]"


def shape_text(array: Array) -> str:
    """The shape of an array with its configurations, in words."""
    own = [str(each) for each in extents(array)] if array.shape else ["1"]
    return " x ".join([*own, "N"])


def _shaped(array: Array) -> str:
    """A result with its shape: its numbers are computed as rows."""
    rows = f"{array.name} > 0" if array.is_truth else array.name
    if len(extents(array)) == 1:
        return rows
    return f"reshape({rows}, {', '.join(map(str, extents(array)))}, n)"


def _input(array: Array, first: Array) -> Input:
    """An argument; the first one counts the configurations."""
    shape = extents(array)
    axis = len(shape) + 1
    wrong = [f"~isfloat({array.name})", f"~isreal({array.name})", f"ndims({array.name}) > {max(axis, 2)}"]
    wrong += [f"size({array.name}, {place}) ~= {extent}" for place, extent in enumerate(shape, start=1)]
    wrong += [f"size({array.name}, {axis}) ~= n"] * (array is not first)
    return Input(
        name=array.name,
        count=f"size({array.name}, {axis})",
        flat=array.name if len(shape) == 1 else f"reshape({array.name}, {size(array)}, n)",
        shape=shape_text(array),
        wrong=" || ".join(wrong),
    )


def _body(robot: Robot, program: Program, real: Real) -> Body:
    """The statements, and the constant last rows of matrices."""
    syntax, results = matlab_syntax(real), program.signature.results
    printer = Printer(syntax, [row(each, place) for each in program.signature.inputs for place in places(each)])
    stored = [row(array, place) for array in results for place in places(array)]
    rows = [
        printer.assignment(row(array, place), Constant(Fraction(value)))
        for array in results
        for place, value in last_rows(array)
    ]
    kind = "" if real is Real.DOUBLE else ", 'single'"
    return Body(
        kind=CLASS[real],
        declared=tuple(f"{each.name} = zeros({size(each)}, n{kind});" for each in results),
        lines=printer.lines(program, stored, sections(robot, program), rows),
        sincos=_routine(program, Operator.SINCOS, real, ("s", "c")),
        atan2=_routine(program, Operator.ATAN2, real, ("angle",)),
    )


def row(array: Array, place: int) -> str:
    """One number of all configurations."""
    return f"{array.name}({place + 1}, :)"


def _routine(program: Program, operator: Operator, real: Real, stored: tuple[str, ...]) -> tuple[str, ...]:
    """The body of a function that a kernel calls."""
    if not program.uses(operator):
        return ()
    own = _apart(stored)
    lines = routine_lines(
        CODE[real][operator], matlab_syntax(real), comment=percent_comment, store="{place} = {value};", places=own
    )
    return tuple(lines)


def _apart(stored: tuple[str, ...]) -> tuple[str, ...]:
    """Names of results that no statement of a routine has."""
    return tuple(f"found_{name}" for name in stored)


def _help(kernels: Kernels, program: Program) -> Iterator[str]:
    """The help text after its first line."""
    robot, signature = kernels.robot, program.signature
    call = f"{robot.name}.{program.quantity.function}"
    names = [each.name for each in signature.inputs]
    left = listed([each.name for each in signature.results])
    yield f"{left} = {call}({', '.join(names)})"
    if robot.runtime_parameters:
        yield f"{left} = {call}({', '.join([*names, 'params'])})"
    yield ""
    described = [(each, _words(input_text(each))) for each in signature.inputs]
    described += [(each, _result(program, each)) for each in signature.results]
    name_width = max(len(each.name) for each, _ in described)
    shape_width = max(len(shape_text(each)) for each, _ in described)
    for each, text in described:
        yield f"  {each.name:<{name_width}}  {shape_text(each):<{shape_width}}  {text}".rstrip()
    if robot.runtime_parameters:
        yield f"  {'params':<{name_width}}  {'struct':<{shape_width}}  runtime parameters, as of default_params"
    yield ""
    if program.quantity.kind in INVERSES:
        yield from inverse_lines(kernels, program)
        yield ""
    yield from textwrap.wrap(
        "N is the number of configurations, one in each column. Results are single where an input is single, else "
        f"double. Angles are in rad, lengths in {robot.units.length}; help {robot.name} describes frames and joints. "
        f"Costs {operation_line(program)} for each configuration.",
        WIDTH,
        break_on_hyphens=False,
    )


def inverse_lines(kernels: Kernels, program: Program) -> Iterator[str]:
    """The branches of an inverse, counted from 1."""
    for line in notes_of(kernels, program, WIDTH, tuple(Real)):
        counted = re.sub(r"^  (\d+)  ", lambda found: f"  {int(found[1]) + 1}  ", line)
        yield matlab_text(counted.replace("Rows of solutions", "Columns of solutions"))


def _words(text: str) -> str:
    return re.sub(r"(, )?\d+(x\d+)+ (matrix|array)", "", matlab_text(text)).lstrip(", ")


def _result(program: Program, array: Array) -> str:
    """What a result holds."""
    text = "a joint vector for each branch" if array.name == "solutions" else _words(result_text(array))
    if array.is_truth:
        return "true for each branch that is a solution"
    if program.quantity.kind is Kind.PARAMETER_JACOBIAN:
        text = ", ".join([*filter(None, [text]), "columns in the order of PARAMETERS"])
    if array.per_frame:
        order = "FRAMES" if program.quantity.kind is Kind.FRAMES else "TIPS"
        text = ", ".join([*filter(None, [text]), f"in the order of {order}"])
    return text
