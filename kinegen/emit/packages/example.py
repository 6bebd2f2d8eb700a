"""The calls that the examples of packages make: whatever the kernels take, and whatever they give."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

from kinegen.emit.c.arguments import computed, declared, given, number_type
from kinegen.emit.c.expected import Row, Vectors
from kinegen.emit.c.numeric_inverse import solver_context
from kinegen.emit.kernels import Kernels
from kinegen.emit.reals import Real
from kinegen.ir.program import Program
from kinegen.naming import default_params, function, macro
from kinegen.outputs import REDUNDANCY, USUAL, Array, Kind, Quantity
from kinegen.robot.extent import joint_box
from kinegen.robot.model import JointType, Robot

_ROW = 3
"""Of the test vectors the first three are zero and the ends of all ranges."""


@dataclass(frozen=True, slots=True)
class ExampleInput:
    """One input of an example.

    Attributes:
        declaration: Name and extent.
        lines: Its values, with what they are.
    """

    declaration: str
    lines: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ExampleResult:
    """One result of an example.

    Attributes:
        declaration: Name and extent.
        entries: Name of the pointer to its numbers.
        first: The first of them.
        rows: Rows to print.
        columns: Numbers in each row.
        scales: What a unit of the last place is in each column, where results are integers.
        kind: Its number type, where it has one of its own.
    """

    declaration: str
    entries: str
    first: str
    rows: int
    columns: int
    scales: tuple[str, ...] = ()
    kind: str = ""


@dataclass(frozen=True, slots=True)
class Example:
    """One call, and how its results are printed.

    Attributes:
        what: What is printed, in words.
        header: The header that declares the function.
        real: Number type.
        inputs: The inputs.
        results: The results.
        extra: Declarations of what else is passed.
        flag: What the call returns, 0 where it has found nothing; empty where it returns nothing.
        call: The call.
    """

    what: str
    header: str
    real: str
    inputs: tuple[ExampleInput, ...]
    results: tuple[ExampleResult, ...]
    extra: tuple[str, ...]
    flag: str
    call: str


def example_of(kernels: Kernels, vectors: Vectors, header: str, real: Real) -> Example:
    """The example of a package: the pose where there is one; then the search; else the first kernel with results.

    Args:
        kernels: The robot and its programs.
        vectors: The test vectors, which have values for every input.
        header: The header of the kernels.
        real: The number type.

    Returns:
        The call and its text.
    """
    programs = {program.quantity: program for program in kernels.programs if computed(program)}
    if Quantity.POSE not in programs and kernels.numeric_inverse and kernels.robot.is_arm:
        return _search(kernels, vectors, real)
    program = programs.get(Quantity.POSE) or next(iter(programs.values()), kernels.programs[0])
    arguments = [array.name for array in given(program)]
    if kernels.robot.runtime_parameters:
        arguments.append(f"&{default_params(kernels.robot.name, real)}")
    arguments += [array.name for array in computed(program)]
    name = function(kernels.robot.name, program.quantity.function, real)
    return Example(
        what=what_of(program, name),
        header=header,
        real=real.value,
        inputs=tuple(_input(kernels, vectors, program, array, real) for array in given(program)),
        results=tuple(result_of(kernels, program, array) for array in computed(program)),
        extra=(),
        flag="",
        call=f"{name}({', '.join(arguments)})",
    )


def _search(kernels: Kernels, vectors: Vectors, real: Real) -> Example:
    """The numeric inverse for a pose that the arm can take, from the middle of all ranges."""
    robot, solver = kernels.robot, solver_context(kernels, real)
    dof = macro(robot.name, "DOF")
    start = tuple(Fraction(math.floor((low + high) * 32), 64) for low, high in joint_box(robot))
    parameters = [f"&{solver.prefix}_default_params"] if solver.parameters else []
    arguments = ["base_T_tool", "start", *parameters, f"&{solver.prefix}_default_search", "q", "&found"]
    return Example(
        what=f"joint vector that {solver.function} finds for a pose",
        header=solver.header,
        real=real.value,
        inputs=(
            ExampleInput("base_T_tool[16]", tuple(_matrix(vectors.targets[0][0], real))),
            ExampleInput(f"start[{dof}]", tuple(_joints(robot, start, real))),
        ),
        results=(ExampleResult(f"q[{dof}]", "q_entries", "&q[0]", 1, robot.dof),),
        extra=(f"{solver.prefix}_found found",),
        flag="solved",
        call=f"const int solved = {solver.function}({', '.join(arguments)})",
    )


def what_of(program: Program, name: str) -> str:
    """What an example prints that calls a kernel, in words."""
    if program.quantity not in USUAL:
        return f"results of {name}"
    frame = program.frames[0] if program.signature.results[0].per_frame else "tool"
    return f"{program.quantity.kind} of frame {frame}"


def _input(kernels: Kernels, vectors: Vectors, program: Program, array: Array, real: Real) -> ExampleInput:
    """Values away from zero, so that results show something; poses are such that arms reach them."""
    if array.name == "q":
        lines = tuple(_joints(kernels.robot, joint_vector(kernels.robot), real))
    elif array.name == REDUNDANCY.name:
        lines = (_line(vectors.given[0], real, last=True),)
    elif program.quantity.kind is Kind.INVERSE:
        lines = tuple(_matrix(vectors.targets[0][0], real))
    else:
        rows = vectors.inputs[array.name]
        row = rows[min(_ROW, len(rows) - 1)]
        lines = tuple(_matrix(row, real)) if array.is_pose else (_line(row, real, last=True),)
    return ExampleInput(declared(kernels, program, array), lines)


def result_of(kernels: Kernels, program: Program, array: Array) -> ExampleResult:
    """One result of a kernel, and how it is printed."""
    shape = array.shape[1:] if array.per_frame else array.shape
    return ExampleResult(
        declaration=declared(kernels, program, array),
        entries=f"{array.name}_entries",
        first=f"&{array.name}[0][0]" if array.in_blocks else f"&{array.name}[0]",
        rows=3 if array.is_pose else math.prod(shape[:-1]),
        columns=shape[-1],
        kind=number_type(array, ""),
    )


def joint_vector(robot: Robot) -> Row:
    """A joint vector within the limits, in radians and the file's length unit."""
    return tuple(Fraction(math.floor((3 * low + 5 * high) / 8 * 64), 64) for low, high in joint_box(robot))


def _joints(robot: Robot, values: Row, real: Real) -> Iterator[str]:
    for variable, value in zip(robot.variables, values, strict=True):
        unit = robot.units.length if variable.type is JointType.PRISMATIC else "rad"
        comma = "" if variable is robot.variables[-1] else ","
        yield f"{real.literal(value)}{comma} /* {variable.name} [{unit}] */"


def _matrix(entries: Row, real: Real) -> Iterator[str]:
    """A 4x4 matrix, a row a line."""
    for row in range(4):
        yield _line(entries[4 * row : 4 * row + 4], real, last=row == 3)


def _line(entries: Row, real: Real, *, last: bool) -> str:
    return f"{', '.join(real.literal(entry) for entry in entries)}{'' if last else ','}"
