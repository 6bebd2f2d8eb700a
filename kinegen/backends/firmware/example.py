"""The calls that the examples of packages make: what kernels take and give, in floating point or in integers."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.arguments import computed, declared, given, number_type
from kinegen.backends.c.numeric_inverse import solver_context
from kinegen.backends.c.test_vectors import Row, Vectors
from kinegen.backends.fixed_point.kernels import FixedKernels, signed_angle
from kinegen.backends.scalar_types import ScalarType
from kinegen.ir.fixed_point.binary_angles import binary_angle
from kinegen.ir.fixed_point.program import NUMBER_BITS, FixedProgram, nearest_integer
from kinegen.ir.program import Program
from kinegen.model.joint_bounds import joint_box
from kinegen.model.outputs import REDUNDANCY, USUAL, Array, Kind, Quantity
from kinegen.model.robot import JointType, Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import Q30, c_file, default_params, function, macro

_ROW = 3
"""Of the test vectors the first three are zero and the ends of all ranges."""


@dataclass(frozen=True, slots=True)
class ExampleInput:
    """One input of an example.

    `declaration`: name and extent. `lines`: its values, with what they are.
    """

    declaration: str
    lines: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ExampleResult:
    """One result of an example.

    `declaration`: name and extent. `entries`: name of the pointer to its numbers. `first`: the first of them. `rows`:
    rows to print. `columns`: numbers in each row. `scales`: what a unit of the last place is in each column, where
    results are integers. `kind`: its number type, where it has one of its own.
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

    `what`: what is printed, in words. `header`: the header that declares the function. `extra`: declarations of what
    else is passed. `flag`: what the call returns, 0 where it has found nothing; empty where it returns nothing.
    """

    what: str
    header: str
    real: str
    inputs: tuple[ExampleInput, ...]
    results: tuple[ExampleResult, ...]
    extra: tuple[str, ...]
    flag: str
    call: str


def example_of(kernels: RobotPrograms, vectors: Vectors, header: str, real: ScalarType) -> Example:
    """The example of a package: the pose where there is one; then the search; else the first kernel with results.

    `vectors`: the test vectors, which have values for every input. `header`: the header of the kernels.
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


def _search(kernels: RobotPrograms, vectors: Vectors, real: ScalarType) -> Example:
    """Return the numeric inverse for a pose that the arm can take, from the middle of all ranges."""
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
    """Return what an example prints that calls a kernel, in words."""
    if program.quantity not in USUAL:
        return f"results of {name}"
    frame = program.frames[0] if program.signature.results[0].per_frame else "tool"
    return f"{program.quantity.kind} of frame {frame}"


def _input(kernels: RobotPrograms, vectors: Vectors, program: Program, array: Array, real: ScalarType) -> ExampleInput:
    """Return values away from zero, so that results show something; poses are such that arms reach them."""
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


def result_of(kernels: RobotPrograms, program: Program, array: Array) -> ExampleResult:
    """Return one result of a kernel, and how it is printed."""
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
    """Return a joint vector within the limits, in radians and the file's length unit."""
    return tuple(Fraction(math.floor((3 * low + 5 * high) / 8 * 64), 64) for low, high in joint_box(robot))


def _joints(robot: Robot, values: Row, real: ScalarType) -> Iterator[str]:
    for variable, value in zip(robot.variables, values, strict=True):
        unit = robot.units.length if variable.type is JointType.PRISMATIC else "rad"
        comma = "" if variable is robot.variables[-1] else ","
        yield f"{real.literal(value)}{comma} /* {variable.name} [{unit}] */"


def _matrix(entries: Row, real: ScalarType) -> Iterator[str]:
    """Yield a 4x4 matrix, a row a line."""
    for row in range(4):
        yield _line(entries[4 * row : 4 * row + 4], real, last=row == 3)


def _line(entries: Row, real: ScalarType, *, last: bool) -> str:
    return f"{', '.join(real.literal(entry) for entry in entries)}{'' if last else ','}"


def fixed_example(fixed: FixedKernels) -> Example:
    """Return the example: the pose where there is one, else the first kernel.

    Returns the call and its text; results are printed as numbers of the file's units.
    """
    robot = fixed.robot
    poses = [each for each in fixed.programs if each.program.quantity == Quantity.POSE]
    program = (poses or fixed.programs)[0]
    exact = program.program
    result = exact.signature.results[0]
    name = function(robot.name, exact.quantity.function, Q30)
    parameters = [f"&{default_params(robot.name, Q30)}"] if robot.runtime_parameters else []
    arguments = [*(["q"] if robot.dof else []), *parameters, result.name]
    return Example(
        what=what_of(exact, name),
        header=c_file(robot.name, "h", Q30),
        real="int32_t",
        inputs=(ExampleInput(f"q[{macro(robot.name, 'DOF')}]", tuple(_integer_joints(fixed))),) if robot.dof else (),
        results=tuple(_scaled(fixed, program, result_of(fixed.kernels, exact, array)) for array in computed(exact)),
        extra=(),
        flag="",
        call=f"{name}({', '.join(arguments)})",
    )


def _scaled(fixed: FixedKernels, program: FixedProgram, result: ExampleResult) -> ExampleResult:
    """A result with what its integers stand for: the last column of a pose is a length, the others are numbers."""
    is_pose = program.program.quantity.is_pose
    columns = range(result.columns)
    bits = [NUMBER_BITS if is_pose and column < result.columns - 1 else fixed.scales.length for column in columns]
    return replace(result, scales=tuple(f"{0.5**each!r}" for each in bits))


def _integer_joints(fixed: FixedKernels) -> Iterator[str]:
    """Yield the joint vector in integers, each entry with its name and unit."""
    robot = fixed.robot
    for variable, value in zip(robot.variables, joint_vector(robot), strict=True):
        is_stroke = variable.type is JointType.PRISMATIC
        unit = f"1/2^{fixed.scales.stroke} {robot.units.length}" if is_stroke else "1/2^32 turn"
        comma = "" if variable is robot.variables[-1] else ","
        yield f"{_integer(value, fixed.scales.stroke if is_stroke else None)}{comma} /* {variable.name} [{unit}] */"


def _integer(value: Fraction, bits: int | None) -> int:
    return signed_angle(binary_angle(value)) if bits is None else nearest_integer(value * 2**bits)
