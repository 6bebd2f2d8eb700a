"""The functions of a package, as finished text: one for each kernel, and the nearest solution."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import fields
from fractions import Fraction

from kinegen.backends.bundle import RobotPrograms, operation_line
from kinegen.backends.c.nearest import Choice, choice_of
from kinegen.backends.descriptions import brief, input_text, result_text
from kinegen.backends.inverse import MOST_TURNS, free_end_words, inverse_of, notes_of
from kinegen.backends.matlab.syntax import (
    CLASS,
    WIDTH,
    extents,
    last_rows,
    matlab_syntax,
    matlab_text,
    number,
    percent_comment,
    places,
    size,
)
from kinegen.backends.printing import CODE, Printer, routine_lines
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.sections import sections
from kinegen.ir.program import Constant, Operator, Program
from kinegen.model.outputs import INVERSES, Array, Kind
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class Input:
    """Holds an argument: its name, how N is counted, its rows and shape, and a condition under which it is refused."""

    name: str
    count: str
    flat: str
    shape: str
    wrong: str


@dataclass(frozen=True, slots=True)
class Result:
    """Holds one result: its name, and its final form."""

    name: str
    shaped: str


@dataclass(frozen=True, slots=True)
class Body:
    """Holds the statements for one number type, with headings, and those of routines that it calls."""

    kind: str
    declared: tuple[str, ...]
    lines: tuple[str, ...]
    sincos: tuple[str, ...]
    atan2: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Function:
    """Holds one kernel, printed.

    Attributes:
        is_single: The condition under which singles are computed.
        full: Its arguments where all are passed, runtime parameters among them; 0 where it takes none of these.
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


def function_of(kernels: RobotPrograms, program: Program) -> Function:
    """Prints one kernel."""
    inputs, results = program.signature.inputs, program.signature.results
    has_parameters = bool(kernels.robot.runtime_parameters)
    arguments = [*(each.name for each in inputs), *["params"] * has_parameters]
    bodies = tuple(_body(kernels.robot, program, real) for real in ScalarType)
    # The pair may select, and then needs the function of selections too.
    pairs = [CODE[real][Operator.SINCOS] for real in ScalarType if program.uses(Operator.SINCOS)]
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
    """Returns one result, or several in brackets."""
    return names[0] if len(names) == 1 else f"[{', '.join(names)}]"


def shape_text(array: Array) -> str:
    """Returns the shape of an array with its configurations, in words."""
    own = [str(each) for each in extents(array)] if array.shape else ["1"]
    return " x ".join([*own, "N"])


def _shaped(array: Array) -> str:
    """Returns a result with its shape: its numbers are computed as rows."""
    rows = f"{array.name} > 0" if array.is_truth else array.name
    if len(extents(array)) == 1:
        return rows
    return f"reshape({rows}, {', '.join(map(str, extents(array)))}, n)"


def _input(array: Array, first: Array) -> Input:
    """Returns an argument; the first one counts the configurations."""
    shape = extents(array)
    # The last dimension counts configurations; MATLAB drops trailing ones.
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


def _body(robot: Robot, program: Program, real: ScalarType) -> Body:
    syntax, results = matlab_syntax(real), program.signature.results
    printer = Printer(syntax, [row(each, place) for each in program.signature.inputs for place in places(each)])
    stored = [row(array, place) for array in results for place in places(array)]
    rows = [
        printer.assignment(row(array, place), Constant(Fraction(value)))
        for array in results
        for place, value in last_rows(array)
    ]
    kind = "" if real is ScalarType.DOUBLE else ", 'single'"
    return Body(
        kind=CLASS[real],
        declared=tuple(f"{each.name} = zeros({size(each)}, n{kind});" for each in results),
        lines=printer.lines(program, stored, sections(robot, program), rows),
        sincos=_routine(program, Operator.SINCOS, real, ("s", "c")),
        atan2=_routine(program, Operator.ATAN2, real, ("angle",)),
    )


def row(array: Array, place: int) -> str:
    """Returns one number of all configurations."""
    return f"{array.name}({place + 1}, :)"


def _routine(program: Program, operator: Operator, real: ScalarType, stored: tuple[str, ...]) -> tuple[str, ...]:
    return called(operator, real, stored) if program.uses(operator) else ()


def called(operator: Operator, real: ScalarType, stored: tuple[str, ...]) -> tuple[str, ...]:
    """Prints the body of a function that gives what an operator does.

    In MATLAB `found_` is put before the names of results.
    """
    own = _apart(stored)
    lines = routine_lines(
        CODE[real][operator], matlab_syntax(real), comment=percent_comment, store="{place} = {value};", places=own
    )
    return tuple(lines)


def _apart(stored: tuple[str, ...]) -> tuple[str, ...]:
    """Names results as no statement of a routine does."""
    return tuple(f"found_{name}" for name in stored)


def _help(kernels: RobotPrograms, program: Program) -> Iterator[str]:
    robot, signature = kernels.robot, program.signature
    call = f"{robot.name}.{program.quantity.function}"
    names = [each.name for each in signature.inputs]
    left = listed([each.name for each in signature.results])
    yield f"{left} = {call}({', '.join(names)})"
    if robot.runtime_parameters:
        yield f"{left} = {call}({', '.join([*names, 'params'])})"
    yield ""
    # Names and shapes stand in columns.
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


def inverse_lines(kernels: RobotPrograms, program: Program) -> Iterator[str]:
    """Yields the branches of an inverse, counted from 1."""
    for line in notes_of(kernels, program, WIDTH, tuple(ScalarType)):
        counted = re.sub(r"^  (\d+)  ", lambda found: f"  {int(found[1]) + 1}  ", line)
        yield matlab_text(counted.replace("Rows of solutions", "Columns of solutions"))


def _words(text: str) -> str:
    return re.sub(r"(, )?\d+(x\d+)+ (matrix|array)", "", matlab_text(text)).lstrip(", ")


def _result(program: Program, array: Array) -> str:
    text = "a joint vector for each branch" if array.name == "solutions" else _words(result_text(array))
    if array.is_truth:
        return "true for each branch that is a solution"
    if program.quantity.kind is Kind.PARAMETER_JACOBIAN:
        text = ", ".join([*filter(None, [text]), "columns in the order of PARAMETERS"])
    if array.per_frame:
        order = "FRAMES" if program.quantity.kind is Kind.FRAMES else "TIPS"
        text = ", ".join([*filter(None, [text]), f"in the order of {order}"])
    return text


_CHOICE = (
    "The nearest is the one with the least sum of squared differences to q0, joint by joint. Revolute joints are first "
    "moved by whole turns as near to q0 as their limits allow. Two joints whose axes coincide are set so that both are "
    "nearest to q0 within their limits. Of two solutions equally near, the one in the first branch is selected. "
    "exists is false, and q NaN, if no branch is valid, or if an entry of q0 is NaN, infinite, or more than {double} "
    "whole turns ({single} in single) from zero. q0 may be outside the limits."
)


@dataclass(frozen=True, slots=True)
class TypedChoice(Choice):
    """Adds the name of the number type, and the statements of the sine-cosine pair."""

    kind: str
    sincos: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class NearestFunction:
    """Holds what `matlab/inverse_nearest.m.jinja` is given: words, and the numbers in each type."""

    lines: tuple[str, ...]
    branches: int
    types: tuple[TypedChoice, ...]
    turned: bool
    words: str


def nearest_function(kernels: RobotPrograms) -> NearestFunction | None:
    """Returns what the template lays out; None where there is no closed-form inverse."""
    solved, types = inverse_of(kernels), tuple(_typed(kernels, real) for real in ScalarType)
    if solved is None:
        return None
    inverse, branches = solved
    text = _CHOICE.format(double=MOST_TURNS[ScalarType.DOUBLE], single=MOST_TURNS[ScalarType.FLOAT])
    text += free_end_words(branches)
    return NearestFunction(
        lines=tuple(textwrap.wrap(matlab_text(text), WIDTH, break_on_hyphens=False)),
        branches=len(branches.names),
        types=tuple(each for each in types if each is not None),
        turned=any(map(math.isfinite, branches.turns)),
        # Without the layout of other languages.
        words=inverse.signature.inputs[0].words.partition(",")[0] or "pose of the tool in the base frame",
    )


def _typed(kernels: RobotPrograms, real: ScalarType) -> TypedChoice | None:
    choice = choice_of(kernels, (real,), lambda value: number(real, real.literal(value)))
    if choice is None:
        return None
    numbers = {each.name: getattr(choice, each.name) for each in fields(choice)}
    return TypedChoice(**numbers, kind=CLASS[real], sincos=called(Operator.SINCOS, real, ("s", "c")))
