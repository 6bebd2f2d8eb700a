"""The integer kernels: `puma560_q30.h` and `puma560_q30.c`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

from kinegen.emit.accuracy import two_digits
from kinegen.emit.c.kernel import macros, output_argument
from kinegen.emit.environment import environment
from kinegen.emit.fixed import Q30
from kinegen.emit.fixed.statements import IntegerPrinter, needed_shifts, uses
from kinegen.emit.kernels import QUANTITY_TEXT, Kernels, operation_line, provenance
from kinegen.ir.fixed.plan import plan_fixed
from kinegen.ir.fixed.program import NUMBER_BITS, FixedProgram, Operation, Scales
from kinegen.ir.fixed.rounding import nearest_integer
from kinegen.ir.fixed.turns import PI, TURN, binary_angle
from kinegen.naming import c_file, comment_text, function, guard, macro, prefix
from kinegen.outputs import Quantity
from kinegen.robot.expressions import Arithmetic, Expression, evaluate
from kinegen.robot.model import Dimension, JointType, JointVariable, Parameter, Robot

_EXACT = Arithmetic(number=Fraction, pi=PI, functions={"sqrt": lambda value: Fraction(math.sqrt(value))})


@dataclass(frozen=True, slots=True)
class FixedKernels:
    """A robot and its programs in integers.

    Attributes:
        kernels: The robot and its exact programs.
        scales: Fraction bits of lengths.
        programs: One integer program for each.
    """

    kernels: Kernels
    scales: Scales
    programs: tuple[FixedProgram, ...]

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self.kernels.robot

    @property
    def defaults(self) -> tuple[int, ...]:
        """The file's values of the runtime parameters, as the kernels take them."""
        parameters = zip(self.robot.runtime_parameters, self.kernels.defaults, strict=True)
        return tuple(
            _signed(binary_angle(value))
            if parameter.dimension is Dimension.ANGLE
            else nearest_integer(value * 2**self.scales.parameter)
            for parameter, value in parameters
        )


@dataclass(frozen=True, slots=True)
class FixedFunction:
    """One kernel, printed.

    Attributes:
        brief: What it computes.
        operations: What a call costs, in words.
        errors: What is proven of its results.
        prototype: Declaration without `restrict`, valid in C++.
        definition: Head of the definition.
        body: Statements.
        output: Name of the output argument.
        shape: What the output argument holds.
        unused: Arguments that the body does not read.
    """

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
class FixedContext:
    """What the templates `fixed/kernel.h.jinja` and `fixed/kernel.c.jinja` are given."""

    header: str
    source: str
    guard: str
    provenance: str
    title: str
    description: str
    prefix: str
    length: str
    dof: int
    macros: tuple[tuple[str, str], ...]
    length_macro: str
    stroke_macro: str
    parameter_macro: str
    stroke_end: str
    parameter_end: str
    joints: tuple[str, ...]
    parameters: tuple[str, ...]
    parameter_names: tuple[str, ...]
    defaults: tuple[tuple[str, str], ...]
    functions: tuple[FixedFunction, ...]
    shifts: tuple[int, ...]
    rounds: tuple[int, ...]
    parts: tuple[int, ...]
    multiplies: bool
    sincos: bool


def fixed_kernels(kernels: Kernels) -> FixedKernels:
    """Write the programs of a robot in integers.

    Raises:
        KinegenError: If integers cannot evaluate one; the message says why.
    """
    scales, programs = plan_fixed(kernels.robot, kernels.programs)
    return FixedKernels(kernels, scales, programs)


def emit_fixed(fixed: FixedKernels) -> dict[str, str]:
    """Print the integer kernels of a robot.

    Args:
        fixed: The robot and its integer programs.

    Returns:
        The header and the source, by file name.
    """
    context = fixed_context(fixed)
    return {
        name: environment().get_template(template).render(k=context, prefix=context.prefix)
        for name, template in ((context.header, "fixed/kernel.h.jinja"), (context.source, "fixed/kernel.c.jinja"))
    }


def fixed_context(fixed: FixedKernels) -> FixedContext:
    """Everything the templates lay out, as finished text."""
    robot, scales = fixed.robot, fixed.scales
    stem = prefix(robot.name, Q30)
    names = tuple(parameter.name for parameter in robot.runtime_parameters)
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
        length=robot.units.length,
        dof=robot.dof,
        macros=tuple(_macros(fixed, has_strokes, has_lengths)),
        length_macro=macro(stem, "LENGTH_BITS"),
        stroke_macro=macro(stem, "STROKE_BITS") if has_strokes else "",
        parameter_macro=macro(stem, "PARAM_BITS") if has_lengths else "",
        stroke_end=_end(scales.stroke),
        parameter_end=_end(scales.parameter),
        joints=joint_lines(robot, scales),
        parameters=tuple(_parameter_lines(fixed)),
        parameter_names=names,
        defaults=tuple((name, f"{value}") for name, value in zip(names, fixed.defaults, strict=True)),
        functions=tuple(_function(fixed, program) for program in fixed.programs),
        shifts=tuple(s for s in needed_shifts(fixed.programs, Operation.MULTIPLY) if s != NUMBER_BITS),
        rounds=needed_shifts(fixed.programs, Operation.ROUND),
        parts=needed_shifts(fixed.programs, Operation.TURN_PART),
        multiplies=sincos or NUMBER_BITS in needed_shifts(fixed.programs, Operation.MULTIPLY),
        sincos=sincos,
    )


def _macros(fixed: FixedKernels, has_strokes: bool, has_lengths: bool) -> Iterator[tuple[str, str]]:
    stem = prefix(fixed.robot.name, Q30)
    yield from macros(fixed.kernels)
    yield macro(stem, "LENGTH_BITS"), f"{fixed.scales.length}"
    if has_strokes:
        yield macro(stem, "STROKE_BITS"), f"{fixed.scales.stroke}"
    if has_lengths:
        yield macro(stem, "PARAM_BITS"), f"{fixed.scales.parameter}"


def _end(bits: int) -> str:
    """Where the range of an int32_t ends at a scale."""
    return f"{math.ldexp(1.0, 31 - bits):.6g}"


def joint_lines(robot: Robot, scales: Scales) -> tuple[str, ...]:
    """One line for each entry of the joint vector: place, name, type, unit, limits."""
    width = max((len(variable.name) for variable in robot.variables), default=0)
    return tuple(
        f"q[{variable.index}]  {variable.name:<{width}}  {variable.type.value:<9}  {_joint_range(robot, variable, scales)}"
        for variable in robot.variables
    )


def _joint_range(robot: Robot, variable: JointVariable, scales: Scales) -> str:
    is_stroke = variable.type is JointType.PRISMATIC
    unit = f"1/2^{scales.stroke} {robot.units.length}" if is_stroke else "1/2^32 turn"
    if variable.limits is None:
        return f"{unit}  no limits"
    low, high = (_joint_value(limit, is_stroke, scales) for limit in variable.limits)
    return f"{unit}  {low} to {high}"


def _joint_value(limit: Expression, is_stroke: bool, scales: Scales) -> int:
    """A limit in the unit of the joint; more than a turn stays what it is."""
    value: Fraction = evaluate(limit, {}, _EXACT)
    return nearest_integer(value * 2**scales.stroke if is_stroke else value * TURN / (2 * PI))


def _parameter_lines(fixed: FixedKernels) -> Iterator[str]:
    for parameter, value in zip(fixed.robot.runtime_parameters, fixed.defaults, strict=True):
        yield f"{parameter.name}  [{_parameter_unit(fixed, parameter)}]  {value}"


def _parameter_unit(fixed: FixedKernels, parameter: Parameter) -> str:
    if parameter.dimension is Dimension.ANGLE:
        return "1/2^32 turn"
    return f"1/2^{fixed.scales.parameter} {fixed.robot.units.length}"


def _signed(angle: int) -> int:
    """A binary angle as the int32_t of the same bits."""
    return angle - TURN if angle >= TURN // 2 else angle


def _function(fixed: FixedKernels, program: FixedProgram) -> FixedFunction:
    robot, exact = fixed.robot, program.program
    name = function(robot.name, exact.quantity.function, Q30)
    output, extent = output_argument(fixed.kernels, exact)
    size = 16 if exact.quantity.is_pose else 3
    inputs = [f"const int32_t q[{{}}{macro(robot.name, 'DOF')}]"] if robot.dof else []
    if robot.runtime_parameters:
        inputs.append(f"const {prefix(robot.name, Q30)}_params *{{}}params")
    inputs.append(f"int32_t {output}[{{}}{extent}][{size}]" if extent else f"int32_t {output}[{{}}{size}]")
    plain, restricted = (", ".join(each.format(word) for each in inputs) for word in ("", "restrict "))
    body = _body(IntegerPrinter(prefix(robot.name, Q30)), program, output, extent is not None)
    text = "\n".join(body)
    unused = [("q", "q[", robot.dof), ("params", "params->", robot.runtime_parameters)]
    return FixedFunction(
        brief=QUANTITY_TEXT[exact.quantity],
        operations=operation_line(exact),
        errors=_errors(fixed, program),
        prototype=f"void {name}({plain})",
        definition=f"void {name}({restricted})",
        body=body,
        output=output,
        shape=_shape(fixed.kernels, exact.quantity),
        unused=tuple(argument for argument, sign, present in unused if present and sign not in text),
    )


def _body(printer: IntegerPrinter, program: FixedProgram, output: str, nested: bool) -> tuple[str, ...]:
    """The statements, and the constant last row of each matrix."""
    quantity = program.program.quantity
    arrays = [f"{output}[{number}]" if nested else output for number in range(len(program.program.frames))]
    places = [f"{array}[{entry}]" for array in arrays for entry in range(quantity.entries)]
    last = (0, 0, 0, 2**NUMBER_BITS) if quantity.is_pose else ()
    rows = [f"{array}[{12 + column}] = {value};" for array in arrays for column, value in enumerate(last)]
    return (*printer.lines(program, places), *rows)


def _shape(kernels: Kernels, quantity: Quantity) -> str:
    what = "4x4 matrix, row by row" if quantity.is_pose else "x, y, z"
    if quantity is Quantity.FRAMES:
        return f"{what}, for each frame in the order of {macro(kernels.robot.name, 'FRAME')}_*"
    if kernels.robot.is_tree:
        return f"{what}, for each tip in the order of {macro(kernels.robot.name, 'TIP')}_*"
    return what


def largest_errors(program: FixedProgram) -> tuple[tuple[float, float, float], float]:
    """The proven errors of x, y and z and of the entries of a rotation, over all frames, in units of the last place."""
    entries = program.program.quantity.entries
    axes = range(3, 12, 4) if entries == 12 else range(3)
    errors = program.errors

    def worst(places: Sequence[int]) -> float:
        return max((errors[place] for place in range(len(errors)) if place % entries in places), default=0.0)

    x, y, z = (worst((axis,)) for axis in axes)
    return (x, y, z), worst([place for place in range(entries) if place not in axes])


def _errors(fixed: FixedKernels, program: FixedProgram) -> str:
    """The proven errors in words."""
    position, rotation = largest_errors(program)
    length = fixed.robot.units.length
    parts = [
        f"|p{axis}| <= {two_digits(math.ldexp(error, -fixed.scales.length))} {length}"
        for axis, error in zip("xyz", position, strict=True)
    ]
    if program.program.quantity.is_pose:
        parts.append(f"rotation entries <= {two_digits(math.ldexp(rotation, -NUMBER_BITS))}")
    return ", ".join(parts)
