"""The integer kernels: `puma560_q30.h` and `puma560_q30.c`."""

from __future__ import annotations

from collections.abc import Iterator

from kinegen.backends.bundle import RobotPrograms, operation_line, provenance
from kinegen.backends.c.arguments import block_names, declared, result_places
from kinegen.backends.c.kernel import macros, model_macro
from kinegen.backends.descriptions import brief
from kinegen.backends.fixed_point.kernels import (
    FixedKernels,
    above_one,
    error_text,
    joint_lines,
    parameter_lines,
    range_end,
    sincos_lines,
)
from kinegen.backends.fixed_point.syntax import fixed_printer, needed_shifts, uses
from kinegen.backends.metadata import command_lines, table_lines, table_title
from kinegen.backends.templates import rendered
from kinegen.ir.fixed_point.program import NUMBER_BITS, FixedProgram, Operation
from kinegen.model.expression_values import Dimension
from kinegen.model.outputs import Quantity
from kinegen.model.robot import JointType, Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import Q30, c_file, comment_text, function, guard, macro, params_type, prefix, sincos_macro


@dataclass(frozen=True, slots=True)
class FixedFunction:
    """Holds one kernel, printed; the prototype is valid in C++; `unused` are arguments that the body does not read."""

    name: str
    brief: str
    operations: str
    errors: str
    prototype: str
    definition: str
    body: tuple[str, ...]
    output: str
    shape: str
    unused: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Scaling:
    """Holds a rounded division by a power of two.

    `before` is the exponent less one, and half is 0 where nothing is divided.
    """

    shift: int
    before: int
    power: int
    half: int


@dataclass(frozen=True, slots=True)
class FixedContext:
    """Holds what the templates `fixed_point/kernel.h.jinja` and `fixed_point/kernel.c.jinja` are given."""

    header: str
    source: str
    guard: str
    provenance: str
    title: str
    description: str
    prefix: str
    model: tuple[str, str]
    length: str
    dof: int
    macros: tuple[tuple[str, str], ...]
    length_macro: str
    stroke_macro: str
    parameter_macro: str
    stroke_end: str
    parameter_end: str
    joints: tuple[str, ...]
    table_title: str
    table: tuple[str, ...]
    command: tuple[str, ...]
    above_one: int
    sincos_lines: tuple[str, ...]
    parameters: tuple[str, ...]
    parameter_names: tuple[str, ...]
    defaults: tuple[tuple[str, str], ...]
    functions: tuple[FixedFunction, ...]
    shifts: tuple[Scaling, ...]
    rounds: tuple[Scaling, ...]
    parts: tuple[Scaling, ...]
    multiplies: bool
    sincos: bool
    sincos_macro: str


def emit_fixed(fixed: FixedKernels) -> dict[str, str]:
    """Prints the header and the source of the integer kernels."""
    context = fixed_context(fixed)
    templates = {context.header: "fixed_point/kernel.h", context.source: "fixed_point/kernel.c"}
    return rendered(templates, k=context, prefix=context.prefix)


def fixed_context(fixed: FixedKernels) -> FixedContext:
    """Returns everything the templates lay out, as finished text."""
    robot, scales = fixed.robot, fixed.scales
    stem = prefix(robot.name, Q30)
    names = tuple(parameter.name for parameter in robot.runtime_parameters)
    # Robots without strokes or lengths among parameters have no macros for these.
    has_strokes = any(variable.type is JointType.PRISMATIC for variable in robot.variables)
    has_lengths = any(parameter.dimension is Dimension.LENGTH for parameter in robot.runtime_parameters)
    header, source = (c_file(robot.name, suffix, Q30) for suffix in "hc")
    sincos = uses(fixed.programs, Operation.SINCOS)
    return FixedContext(
        header=header,
        source=source,
        guard=guard(header),
        provenance=provenance(robot),
        title=f"Forward kinematics of {robot.name} in integers",
        description=comment_text(robot.description),
        prefix=stem,
        model=model_macro(robot),
        length=robot.units.length,
        dof=robot.dof,
        macros=tuple(_macros(fixed, has_strokes, has_lengths)),
        length_macro=macro(stem, "LENGTH_BITS"),
        stroke_macro=macro(stem, "STROKE_BITS") if has_strokes else "",
        parameter_macro=macro(stem, "PARAM_BITS") if has_lengths else "",
        stroke_end=range_end(scales.stroke),
        parameter_end=range_end(scales.parameter),
        joints=joint_lines(robot, scales),
        table_title=table_title(robot),
        table=table_lines(robot),
        command=command_lines(fixed.kernels, f"--real {Q30}"),
        above_one=above_one(fixed),
        sincos_lines=sincos_lines(fixed, source) if sincos else (),
        parameters=tuple(parameter_lines(fixed)),
        parameter_names=names,
        defaults=tuple((name, f"{value}") for name, value in zip(names, fixed.defaults, strict=True)),
        functions=tuple(_function(fixed, program) for program in fixed.programs),
        shifts=tuple(
            _scaling(shift) for shift in needed_shifts(fixed.programs, Operation.MULTIPLY) if shift != NUMBER_BITS
        ),
        rounds=tuple(_scaling(shift) for shift in needed_shifts(fixed.programs, Operation.ROUND)),
        parts=tuple(_scaling(shift) for shift in needed_shifts(fixed.programs, Operation.TURN_PART)),
        multiplies=NUMBER_BITS in needed_shifts(fixed.programs, Operation.MULTIPLY),
        sincos=sincos,
        sincos_macro=sincos_macro(robot.name, Q30),
    )


def _scaling(shift: int) -> Scaling:
    return Scaling(shift, shift - 1, 2**shift, 2**shift // 2)


def _macros(fixed: FixedKernels, has_strokes: bool, has_lengths: bool) -> Iterator[tuple[str, str]]:
    stem = prefix(fixed.robot.name, Q30)
    yield from macros(fixed.kernels)
    yield macro(stem, "LENGTH_BITS"), f"{fixed.scales.length}"
    if has_strokes:
        yield macro(stem, "STROKE_BITS"), f"{fixed.scales.stroke}"
    if has_lengths:
        yield macro(stem, "PARAM_BITS"), f"{fixed.scales.parameter}"


def _function(fixed: FixedKernels, program: FixedProgram) -> FixedFunction:
    robot, exact = fixed.robot, program.program
    name = function(robot.name, exact.quantity.function, Q30)
    result = exact.signature.results[0]
    inputs = [f"const int32_t q[{{}}{macro(robot.name, 'DOF')}]"] if robot.dof else []
    if robot.runtime_parameters:
        inputs.append(f"const {params_type(robot.name, Q30)} *{{}}params")
    inputs.append(f"int32_t {declared(fixed.kernels, exact, result, '{}')}")
    plain, restricted = (", ".join(each.format(word) for each in inputs) for word in ("", "restrict "))
    # Arguments that nothing reads are cast to void.
    unused = ["q"] * bool(robot.dof and not program.reads_joints)
    unused += ["params"] * bool(robot.runtime_parameters and not program.reads_parameters)
    return FixedFunction(
        name=name,
        brief=brief(exact.signature),
        operations=operation_line(exact),
        errors=error_text(fixed, program),
        prototype=f"void {name}({plain})",
        definition=f"void {name}({restricted})",
        body=_body(robot, program),
        output=result.name,
        shape=_shape(fixed.kernels, exact.quantity),
        unused=tuple(unused),
    )


def _body(robot: Robot, program: FixedProgram) -> tuple[str, ...]:
    variables = [f"q[{index}]" for index in range(robot.dof)]
    printer = fixed_printer(variables, prefix(robot.name, Q30), sincos_macro(robot.name, Q30))
    result = program.program.signature.results[0]
    places = [place for block in result_places(program.program) for place in block]
    # The last row of a pose is in the format of its rotation.
    last = (0, 0, 0, 2**NUMBER_BITS) if result.is_pose else ()
    rows = [f"{block}[{12 + column}] = {value};" for block in block_names(result) for column, value in enumerate(last)]
    return printer.lines(program, places, rows=rows)


def _shape(kernels: RobotPrograms, quantity: Quantity) -> str:
    what = "4x4 matrix, row by row" if quantity.is_pose else "x, y, z"
    if quantity == Quantity.FRAMES:
        return f"{what}, for each frame in the order of {macro(kernels.robot.name, 'FRAME')}_*"
    if kernels.robot.is_tree:
        return f"{what}, for each tip in the order of {macro(kernels.robot.name, 'TIP')}_*"
    return what
