"""The scalar kernels: `puma560.h` and `puma560.c`, which firmware vendors as they are."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

from kinegen.emit.accuracy import accuracy_lines, error_lines
from kinegen.emit.actuators import actuator_lines, actuator_names
from kinegen.emit.c.arguments import (
    block_names,
    computed,
    given,
    result_places,
    scalar_arguments,
    scalar_variables,
    wrapped_prototype,
)
from kinegen.emit.c.constants import NamedConstant, constant_lines, named_constants, names_of
from kinegen.emit.c.nearest import Nearest, nearest_of
from kinegen.emit.c.pairs import many_pairs
from kinegen.emit.c.syntax import c_syntax, named_lengths
from kinegen.emit.c.truths import truth_literals, truth_operands, truth_syntax, truths_of
from kinegen.emit.columns import varied_names
from kinegen.emit.environment import environment
from kinegen.emit.functions import (
    LINE,
    function_templates,
    is_straight,
    needs_bits,
    routine_lines,
    used_routines,
    uses,
)
from kinegen.emit.inverse import branches_of, notes_of
from kinegen.emit.kernels import Kernels, joint_lines, operation_line, parameter_lines, provenance
from kinegen.emit.limits import limit_literals
from kinegen.emit.nearest import NAME
from kinegen.emit.printing import Printer
from kinegen.emit.reals import Real
from kinegen.emit.sections import sections
from kinegen.emit.sincos import SINCOS, Sincos
from kinegen.emit.table import command_lines, table_lines, table_title, tip_lines
from kinegen.emit.words import brief, frames_text, input_text, result_text, subject
from kinegen.ir.program import Constant, Operator, Program
from kinegen.naming import c_file, comment_text, function, guard, macro, prefix, sincos_macro
from kinegen.outputs import Array, Kind
from kinegen.robot.model import Robot


@dataclass(frozen=True, slots=True)
class Function:
    """One kernel, printed.

    Attributes:
        name: C name.
        heading: What it computes, as lines of a comment.
        notes: What there is to say of its results, as lines of a comment.
        operations: What a call costs, as lines of a comment.
        errors: How far its results can be off.
        prototype: Declaration without `restrict`, valid in C++.
        declaration: The same in lines.
        definition: Head of the definition.
        body: Statements; each result is stored as soon as it is there.
        inputs: The input arguments, each with what it holds.
        results: The output arguments, each with what it holds.
        unused: Arguments that the body does not read.
    """

    name: str
    heading: tuple[str, ...]
    notes: tuple[str, ...]
    operations: tuple[str, ...]
    errors: tuple[str, ...]
    prototype: str
    declaration: tuple[str, ...]
    definition: tuple[str, ...]
    body: tuple[str, ...]
    inputs: tuple[tuple[str, str], ...]
    results: tuple[tuple[str, str], ...]
    unused: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class KernelContext:
    """What the templates `c/kernel.h.jinja` and `c/kernel.c.jinja` are given."""

    header: str
    source: str
    guard: str
    provenance: str
    title: str
    description: str
    prefix: str
    model: tuple[str, str]
    real: str
    length: str
    frames: tuple[str, ...]
    macros: tuple[tuple[str, str], ...]
    joints: tuple[str, ...]
    table_title: str
    table: tuple[str, ...]
    tips: tuple[str, ...]
    command: tuple[str, ...]
    actuators: tuple[str, ...]
    parameters: tuple[str, ...]
    parameter_names: tuple[str, ...]
    defaults: tuple[tuple[str, str], ...]
    constants: tuple[NamedConstant, ...]
    constant_lines: tuple[str, ...]
    promises: tuple[str, ...]
    functions: tuple[Function, ...]
    nearest: Nearest | None
    limits: tuple[tuple[str, str], ...]
    limit_names: tuple[str, str]
    dof: str
    accuracy: tuple[str, ...]
    sincos: Sincos | None
    sincos_macro: str
    sincos_lines: tuple[str, ...]
    routines: tuple[str, ...]
    routine_lines: tuple[str, ...]
    needs_bits: bool
    has_truths: bool


def emit_kernel(kernels: Kernels, real: Real) -> dict[str, str]:
    """Print the scalar kernels of one number type.

    Args:
        kernels: The robot and its programs.
        real: The number type.

    Returns:
        The header and the source, by file name.
    """
    context = kernel_context(kernels, real)
    return {
        name: environment().get_template(template).render(k=context, prefix=context.prefix, qualifier="static")
        for name, template in ((context.header, "c/kernel.h.jinja"), (context.source, "c/kernel.c.jinja"))
    }


@lru_cache(maxsize=8)
def kernel_context(kernels: Kernels, real: Real) -> KernelContext:
    """Everything the templates lay out, as finished text; scalar kernels, batches and packages print the same one."""
    robot = kernels.robot
    header, source = (c_file(robot.name, suffix, real) for suffix in "hc")
    about = subject(program.quantity for program in kernels.programs)
    names = tuple(parameter.name for parameter in robot.runtime_parameters)
    taken = frozenset((*dict(macros(kernels)), *limit_names(robot, real), macro(prefix(robot.name, real), "OWN_ROOT")))
    constants = named_constants(kernels, real, taken)
    return KernelContext(
        header=header,
        source=source,
        guard=guard(header),
        provenance=provenance(robot),
        title=f"{about} of {robot.name}, {'double' if real is Real.DOUBLE else 'single'} precision",
        description=comment_text(robot.description),
        prefix=prefix(robot.name, real),
        model=model_macro(robot),
        real=real.value,
        length=robot.units.length,
        frames=tuple(textwrap.wrap(frames_text(robot.is_tree), LINE)),
        macros=macros(kernels),
        joints=joint_lines(robot),
        table_title=table_title(robot),
        table=table_lines(robot),
        tips=tip_lines(robot),
        command=command_lines(kernels),
        actuators=actuator_lines(kernels),
        parameters=parameter_lines(robot),
        parameter_names=names,
        defaults=tuple((name, real.literal(value)) for name, value in zip(names, kernels.defaults, strict=True)),
        constants=constants,
        constant_lines=constant_lines(constants),
        promises=tuple(_promises(kernels, real)),
        functions=tuple(_function(kernels, program, real, constants) for program in kernels.programs),
        nearest=nearest_of(kernels, real),
        limits=limit_literals(robot, real),
        limit_names=limit_names(robot, real),
        dof=macro(robot.name, "DOF"),
        accuracy=accuracy_lines(kernels, source),
        sincos=SINCOS[real] if uses(kernels.programs, Operator.SINCOS) else None,
        sincos_macro=sincos_macro(robot.name, real),
        sincos_lines=_sincos_lines(SINCOS[real], sincos_macro(robot.name, real), source),
        routines=function_templates(kernels.programs, real),
        routine_lines=routine_lines(used_routines(kernels.programs, real)),
        needs_bits=needs_bits(kernels.programs, real),
        has_truths=any(array.is_truth for program in kernels.programs for array in program.signature.results),
    )


def limit_names(robot: Robot, real: Real) -> tuple[str, str]:
    """The names of the arrays of lower and of upper limits."""
    stem = prefix(robot.name, real)
    return macro(stem, "LIMITS_LOW"), macro(stem, "LIMITS_HIGH")


def model_macro(robot: Robot) -> tuple[str, str]:
    """The macro by which sources recognise headers of the same robot, and its value."""
    return macro(robot.name, "MODEL"), f"0x{robot.digest}U"


def macros(kernels: Kernels) -> tuple[tuple[str, str], ...]:
    """The macros of a robot's headers: sizes, and the index of each frame, tip or column of parameters."""
    robot = kernels.robot
    found = [(macro(robot.name, "DOF"), f"{robot.dof}")]
    if robot.is_tree:
        found.append((macro(robot.name, "TIPS"), f"{len(robot.tips)}"))
        found += [(macro(robot.name, f"TIP_{tip}"), f"{index}") for index, tip in enumerate(robot.tips)]
    for program in kernels.programs:
        if program.quantity.kind is Kind.FRAMES:
            found.append((macro(robot.name, "FRAMES"), f"{len(program.frames)}"))
            found += [(macro(robot.name, f"FRAME_{frame}"), f"{i}") for i, frame in enumerate(program.frames)]
    actuators = actuator_names(kernels)
    if actuators:
        found.append((macro(robot.name, "ACTUATORS"), f"{len(actuators)}"))
        found += [(macro(robot.name, f"ACTUATOR_{name}"), f"{index}") for index, name in enumerate(actuators)]
    branches = branches_of(kernels)
    if branches:
        found.append((macro(robot.name, "BRANCHES"), f"{len(branches.names)}"))
    varied = varied_names(kernels)
    if varied:
        found.append((macro(robot.name, "PARAMETERS"), f"{len(varied)}"))
        found += [(macro(robot.name, f"PARAMETER_{name}"), f"{index}") for index, name in enumerate(varied)]
    return (*((name, f"{value}") for name, value in found), model_macro(robot))


def _promises(kernels: Kernels, real: Real) -> list[str]:
    """What holds for every function, as lines of a comment."""
    pure = "no state, no heap, no library, no loop"
    if any(many_pairs(program, program) for program in kernels.programs):
        pure += " but those with a fixed number of turns that take sines and cosines"
    if all(map(is_straight, kernels.programs)):
        pure, steps = f"{pure}, no branch on data", ""
    else:
        steps = (
            " Compilers may turn square roots, arc tangents and selections into branches; no other function has any."
        )
    if any(program.quantity.kind is Kind.INVERSE for program in kernels.programs):
        pure += f" (but those of {function(kernels.robot.name, NAME, real)})"
    text = (
        f"Every function is pure: {pure}; safe from threads and interrupts. Inputs and outputs must not overlap. "
        f"Limits are not checked.{steps}"
    )
    if real is Real.FLOAT:
        text += (
            " ESP32 and ESP32-S3: an interrupt handler may use float only at level 1, and only with "
            "CONFIG_FREERTOS_FPU_IN_ISR."
        )
    return textwrap.wrap(text, LINE)


def _function(kernels: Kernels, program: Program, real: Real, constants: tuple[NamedConstant, ...]) -> Function:
    robot = kernels.robot
    name = function(robot.name, program.quantity.function, real)
    prototype, definition = (
        f"void {name}({scalar_arguments(kernels, program, real, restrict=restrict)})" for restrict in (False, True)
    )
    body = _body(kernels, program, real, constants)
    unused = [array.name for array in given(program) if not program.reads(array)]
    unused += ["params"] * bool(robot.runtime_parameters and not program.reads_parameters)
    return Function(
        name=name,
        heading=tuple(textwrap.wrap(brief(program.signature), LINE, break_on_hyphens=False)),
        notes=notes_of(kernels, program, LINE, (real,)),
        operations=tuple(textwrap.wrap(f"Costs {operation_line(program)}.", LINE)),
        errors=error_lines(kernels, program, real),
        prototype=prototype,
        declaration=wrapped_prototype(prototype),
        definition=wrapped_prototype(definition),
        body=body,
        inputs=tuple((array.name, input_text(array)) for array in given(program)),
        results=tuple((array.name, _shape(kernels, program, array)) for array in computed(program)),
        unused=tuple(unused),
    )


def _sincos_lines(pair: Sincos, name: str, source: str) -> tuple[str, ...]:
    text = (
        f"Sines and cosines are evaluated {pair.accuracy}; an angle beyond that, a NaN or an infinity makes every "
        f"output that depends on it NaN. A macro {name}(x,~s,~c), defined where {source} is compiled, takes the place "
        "of the pair: it stores the sine and cosine of x at s and c."
    )
    lines = textwrap.wrap(text, LINE, break_long_words=False, break_on_hyphens=False)
    return tuple(line.replace("~", " ") for line in lines)


def _shape(kernels: Kernels, program: Program, array: Array) -> str:
    what = "a joint vector for each branch" if array.per_branch else result_text(array)
    if program.quantity.kind is Kind.PARAMETER_JACOBIAN:
        what = f"{what}, columns in the order of {macro(kernels.robot.name, 'PARAMETER')}_*"
    if program.quantity.kind is Kind.FRAMES:
        return f"{what}, for each frame in the order of {macro(kernels.robot.name, 'FRAME')}_*"
    if array.per_frame:
        return f"{what}, for each tip in the order of {macro(kernels.robot.name, 'TIP')}_*"
    return what


def _body(kernels: Kernels, program: Program, real: Real, constants: tuple[NamedConstant, ...]) -> tuple[str, ...]:
    """The statements, and the constant last row of each matrix."""
    stem = prefix(kernels.robot.name, real)
    pair, named = sincos_macro(kernels.robot.name, real), names_of(constants, program)
    places = [place for block in result_places(program) for place in block]
    syntax, truths = c_syntax(real, pair, stem), truths_of(program)
    printer = Printer(
        syntax,
        scalar_variables(program),
        truth_operands(truths, named_lengths(program, named)),
        others=truth_syntax(truths, syntax),
        literals=truth_literals(program, places),
    )
    last = [Constant(Fraction(value)) for value in (0, 0, 0, 1)]
    rows = [
        printer.assignment(f"{block}[{12 + column}]", entry)
        for array in program.signature.results
        if array.is_pose
        for block in block_names(array)
        for column, entry in enumerate(last)
    ]
    parts, pairs = sections(kernels.robot, program), many_pairs(program, program)
    if pairs is None:
        return printer.lines(program, places, parts, rows)
    return (*pairs.scalar_lines(printer, real.value, pair), "", *pairs.scalar_body(printer, places, parts, rows))
