"""The scalar kernels: `puma560.h` and `puma560.c`, which firmware vendors as they are."""

from __future__ import annotations

import textwrap
from fractions import Fraction
from functools import lru_cache

from kinegen.backends.accuracy import accuracy_lines, error_lines, sincos_words
from kinegen.backends.bundle import RobotPrograms, joint_lines, operation_line, parameter_lines, provenance
from kinegen.backends.c.arguments import (
    Bounds,
    block_names,
    bounds_of,
    computed,
    given,
    result_places,
    scalar_arguments,
    scalar_variables,
    wrapped_prototype,
)
from kinegen.backends.c.constants import NamedConstant, constant_lines, named_constants, names_of
from kinegen.backends.c.loops import batched_sincos
from kinegen.backends.c.nearest import Nearest, nearest_of
from kinegen.backends.c.syntax import byte_syntax, c_syntax, named_lengths, truth_printer
from kinegen.backends.descriptions import brief, frames_text, input_text, result_text, subject
from kinegen.backends.inverse import NEAREST_FUNCTION, branches_of, notes_of
from kinegen.backends.limits import actuator_lines, actuator_names
from kinegen.backends.metadata import command_lines, table_lines, table_title, tip_lines, varied_names
from kinegen.backends.routines import (
    LINE,
    SINCOS,
    Sincos,
    function_templates,
    is_straight,
    needs_bits,
    routine_lines,
    used_routines,
    uses,
)
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.sections import sections
from kinegen.backends.templates import rendered
from kinegen.ir.program import Constant, Operator, Program
from kinegen.model.outputs import Array, Kind
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import c_file, comment_text, function, guard, macro, prefix, sincos_macro


@dataclass(frozen=True, slots=True)
class Function:
    """Holds one kernel, printed: texts are lines of comments, and inputs and results come with what they hold.

    Attributes:
        prototype: Declaration without `restrict`, valid in C++.
        declaration: The same in lines.
        definition: Head of the definition.
        body: Statements; each result is stored as soon as it is there.
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
    """Holds what the templates `c/kernel.h.jinja` and `c/kernel.c.jinja` are given."""

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
    bounds: tuple[Bounds, ...]
    accuracy: tuple[str, ...]
    sincos: Sincos | None
    sincos_macro: str
    sincos_lines: tuple[str, ...]
    routines: tuple[str, ...]
    routine_lines: tuple[str, ...]
    needs_bits: bool
    has_truths: bool


def emit_kernel(kernels: RobotPrograms, real: ScalarType) -> dict[str, str]:
    """Prints the header and the source of the scalar kernels, by file name."""
    context = kernel_context(kernels, real)
    templates = {context.header: "c/kernel.h", context.source: "c/kernel.c"}
    return rendered(templates, k=context, prefix=context.prefix, qualifier="static")


@lru_cache(maxsize=8)
def kernel_context(kernels: RobotPrograms, real: ScalarType) -> KernelContext:
    """Returns everything that templates lay out, as finished text: the same for kernels, batches and packages."""
    robot = kernels.robot
    header, source = (c_file(robot.name, suffix, real) for suffix in "hc")
    about = subject(program.quantity for program in kernels.programs)
    names = tuple(parameter.name for parameter in robot.runtime_parameters)
    bounds = tuple(bounds_of(kernels, real))
    # A named constant must not have the name of another macro of the file.
    arrays = (name for each in bounds for name in each.names)
    taken = frozenset((*dict(macros(kernels)), *arrays, macro(prefix(robot.name, real), "OWN_ROOT")))
    constants, nearest = named_constants(kernels, real, taken), nearest_of(kernels, real)
    return KernelContext(
        header=header,
        source=source,
        guard=guard(header),
        provenance=provenance(robot),
        title=f"{about} of {robot.name}, {real.precision} precision",
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
        nearest=nearest,
        bounds=bounds,
        accuracy=accuracy_lines(kernels, source),
        sincos=SINCOS[real] if uses(kernels.programs, Operator.SINCOS) or (nearest and nearest.end) else None,
        sincos_macro=sincos_macro(robot.name, real),
        sincos_lines=_sincos_lines(robot, SINCOS[real], sincos_macro(robot.name, real), source),
        routines=function_templates(kernels.programs, real),
        routine_lines=routine_lines(used_routines(kernels.programs, real)),
        needs_bits=needs_bits(kernels.programs, real),
        has_truths=any(array.is_truth for program in kernels.programs for array in program.signature.results),
    )


def model_macro(robot: Robot) -> tuple[str, str]:
    """Returns the macro by which sources recognise headers of the same robot, and its value."""
    return macro(robot.name, "MODEL"), f"0x{robot.digest}U"


def name_lists(kernels: RobotPrograms) -> dict[str, tuple[tuple[str, ...], str]]:
    """Returns the lists of names that results are counted by, each with its meaning in Markdown.

    Lists without names are left out, but for that of the joints.
    """
    robot, branches = kernels.robot, branches_of(kernels)
    has_frames = any(program.quantity.kind is Kind.FRAMES for program in kernels.programs)
    joints = tuple(variable.name for variable in robot.variables)
    lists = {
        "JOINTS": (joints, "Names of the joints, in the order of q."),
        "FRAMES": (robot.frame_names if has_frames else (), "Frames of the result of `frames`, in its order."),
        "TIPS": (robot.tips if robot.is_tree else (), "Tips of the tree, in the order of the results."),
        "BRANCHES": (branches.names if branches else (), "Solutions of inverse, in its order."),
        "PARAMETERS": (varied_names(kernels), "Columns of `parameter_jacobian`, in its order."),
        "ACTUATORS": (actuator_names(kernels), "Names of the actuators, in the order of their vector."),
    }
    return {name: (words, meaning) for name, (words, meaning) in lists.items() if words or name == "JOINTS"}


def macros(kernels: RobotPrograms) -> tuple[tuple[str, str], ...]:
    """Returns the macros of a robot's headers: sizes, and the index of each frame, tip or column of parameters."""
    robot, lists = kernels.robot.name, name_lists(kernels)
    found = [(macro(robot, "DOF"), f"{kernels.robot.dof}")]
    # Callers find tips, frames, readings and columns by names that the compiler checks.
    for several in ("TIPS", "FRAMES", "ACTUATORS", "BRANCHES", "PARAMETERS"):
        words = lists.get(several, ((), ""))[0]
        found += [(macro(robot, several), f"{len(words)}")] * bool(words)
        one = several.removesuffix("S")
        if several != "BRANCHES":
            found += [(macro(robot, f"{one}_{word}"), f"{index}") for index, word in enumerate(words)]
    return (*found, model_macro(kernels.robot))


def _promises(kernels: RobotPrograms, real: ScalarType) -> list[str]:
    pure = "no state, no heap, no library, no loop"
    if any(batched_sincos(program, program) for program in kernels.programs):
        pure += " but those with a fixed number of turns that take sines and cosines"
    # What compilers make of selections is not ours to promise.
    if all(map(is_straight, kernels.programs)):
        pure, steps = f"{pure}, no branch on data", ""
    else:
        steps = (
            " Compilers may turn square roots, arc tangents and selections into branches; no other function has any."
        )
    if any(program.quantity.kind is Kind.INVERSE for program in kernels.programs):
        pure += f" (but those of {function(kernels.robot.name, NEAREST_FUNCTION, real)})"
    text = (
        f"Every function is pure: {pure}; safe from threads and interrupts. Inputs and outputs must not overlap. "
        f"Limits are not checked.{steps}"
    )
    # Their interrupt handlers use the FPU only where ESP-IDF is told to save its registers.
    if real is ScalarType.FLOAT:
        text += (
            " ESP32 and ESP32-S3: an interrupt handler may use float only at level 1, and only with "
            "CONFIG_FREERTOS_FPU_IN_ISR."
        )
    return textwrap.wrap(text, LINE)


def _function(
    kernels: RobotPrograms, program: Program, real: ScalarType, constants: tuple[NamedConstant, ...]
) -> Function:
    robot = kernels.robot
    name = function(robot.name, program.quantity.function, real)
    prototype, definition = (
        f"void {name}({scalar_arguments(kernels, program, real, restrict=restrict)})" for restrict in (False, True)
    )
    body = _body(kernels, program, real, constants)
    # Arguments that nothing reads are cast to void, or strict compilers complain.
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


def _sincos_lines(robot: Robot, pair: Sincos, name: str, source: str) -> tuple[str, ...]:
    text = (
        f"{sincos_words(robot, pair.accuracy)} A macro {name}(x,~s,~c), defined where {source} is compiled, "
        "replaces the pair: it stores the sine and cosine of x at s and c."
    )
    # No line ends inside the macro.
    lines = textwrap.wrap(text, LINE, break_long_words=False, break_on_hyphens=False)
    return tuple(line.replace("~", " ") for line in lines)


def _shape(kernels: RobotPrograms, program: Program, array: Array) -> str:
    what = "a joint vector for each branch" if array.per_branch else result_text(array)
    if program.quantity.kind is Kind.PARAMETER_JACOBIAN:
        what = f"{what}, columns in the order of {macro(kernels.robot.name, 'PARAMETER')}_*"
    if program.quantity.kind is Kind.FRAMES:
        return f"{what}, for each frame in the order of {macro(kernels.robot.name, 'FRAME')}_*"
    if array.per_frame:
        return f"{what}, for each tip in the order of {macro(kernels.robot.name, 'TIP')}_*"
    return what


def _body(
    kernels: RobotPrograms, program: Program, real: ScalarType, constants: tuple[NamedConstant, ...]
) -> tuple[str, ...]:
    stem = prefix(kernels.robot.name, real)
    pair, named = sincos_macro(kernels.robot.name, real), names_of(constants, program)
    places = [place for block in result_places(program) for place in block]
    syntax = c_syntax(real, pair, stem)
    printer = truth_printer(
        program,
        (syntax, byte_syntax(syntax)),
        ("0U", "1U"),
        scalar_variables(program),
        places,
        named_lengths(program, named),
    )
    # The last row of a pose is stored last: nothing has to be kept for it.
    last = [Constant(Fraction(value)) for value in (0, 0, 0, 1)]
    rows = [
        printer.assignment(f"{block}[{12 + column}]", entry)
        for array in program.signature.results
        if array.is_pose
        for block in block_names(array)
        for column, entry in enumerate(last)
    ]
    # Long chains take their sines and cosines in one loop.
    parts, pairs = sections(kernels.robot, program), batched_sincos(program, program)
    if pairs is None:
        return printer.lines(program, places, parts, rows)
    return (*pairs.scalar_lines(printer, real.value, pair), "", *pairs.scalar_body(printer, places, parts, rows))
