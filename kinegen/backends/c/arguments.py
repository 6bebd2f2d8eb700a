"""The arguments of functions in C, where their numbers are, and the functions on joint limits."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Iterator

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.syntax import TRUTH
from kinegen.backends.limits import ARRAY, has_actuators, limit_literals, reading_literals
from kinegen.backends.limits import ARRAY as ACTUATORS
from kinegen.backends.routines import LINE
from kinegen.backends.scalar_types import ScalarType
from kinegen.ir.program import Program
from kinegen.model.outputs import Array, Kind
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import default_params, function, macro, params_type, prefix

_WIDTH = 119
"""Characters of a line, without the semicolon behind it."""


def given(program: Program) -> tuple[Array, ...]:
    """Returns the inputs that hold numbers; C knows no empty arrays."""
    return tuple(array for array in program.signature.inputs if array.size)


def computed(program: Program) -> tuple[Array, ...]:
    """Returns the results that hold numbers; the Jacobian of a robot without joints does not."""
    return tuple(array for array in program.signature.results if array.size)


def extent_macro(kernels: RobotPrograms, program: Program) -> str:
    """Returns the macro of the number of frames or tips that results count."""
    return macro(kernels.robot.name, "FRAMES" if program.quantity.kind is Kind.FRAMES else "TIPS")


def number_type(array: Array, real: str) -> str:
    """Returns the C type of the numbers of an array: a byte for truth values, else the number type of the kernels."""
    return TRUTH if array.is_truth else real


def declared(kernels: RobotPrograms, program: Program, array: Array, qualifier: str = "") -> str:
    """Writes the extents of an input or result, such as `q[6]` or `base_T_tips[restrict ARM_TIPS][16]`.

    The qualifier stands in the outermost brackets, with a space after it.
    """
    robot = kernels.robot.name
    if array.per_frame:
        return f"{array.name}[{qualifier}{extent_macro(kernels, program)}][{array.stored}]"
    if array.per_branch:
        has_names = program.signature.branches is not None
        branches = macro(robot, "BRANCHES") if has_names else str(array.shape[0])
        return f"{array.name}[{qualifier}{branches}][{macro(robot, 'DOF')}]"
    # Macros say what a length counts; other extents are numbers.
    size = f"{array.stored}"
    if array.name == ACTUATORS:
        size = macro(robot, "ACTUATORS")
    elif array.is_truth and program.signature.branches is not None:
        size = macro(robot, "BRANCHES")
    elif array.shape == (kernels.robot.dof,) and array in program.signature.inputs:
        size = macro(robot, "DOF")
    return f"{array.name}[{qualifier}{size}]"


def scalar_arguments(kernels: RobotPrograms, program: Program, real: str, *, restrict: bool) -> str:
    """Writes the parameter list of a scalar kernel, in headers without `restrict`, over which C++ would stumble."""
    qualifier = "restrict " if restrict else ""
    parts = [f"const {real} {declared(kernels, program, array, qualifier)}" for array in given(program)]
    if kernels.robot.runtime_parameters:
        parts.append(f"const {params_type(kernels.robot.name, real)} *{qualifier}params")
    parts += [
        f"{number_type(array, real)} {declared(kernels, program, array, qualifier)}" for array in computed(program)
    ]
    return ", ".join(parts) or "void"


def batch_arguments(inputs: tuple[Array, ...], results: tuple[Array, ...], real: str, params: str) -> tuple[str, ...]:
    """Writes the arguments of a batch kernel, each a declaration that ends in the name.

    `params` is the type of the runtime parameters, empty without.
    """
    arguments = ["size_t n"]
    for array in inputs:
        arguments += [f"const {real} *{array.name}", *strides(array, "ptrdiff_t ").split(", ")]
    if params:
        arguments += [f"const {params} *params", "ptrdiff_t params_stride"]
    for array in results:
        arguments += [f"{number_type(array, real)} *{array.name}", f"ptrdiff_t {array.name}_stride"]
    return (*arguments, "int layout")


def strides(array: Array, before: str = "") -> str:
    """Returns the strides of an input of a batch kernel; `before` is the type of each, with a space."""
    return ", ".join(f"{before}{array.name}_{word}" for word in ("pose", "joint"))


def braced(items: Iterable[str]) -> str:
    """Writes the initializer of an array."""
    return f"{{{', '.join(items)}}}"


def wrapped_prototype(prototype: str) -> tuple[str, ...]:
    """Returns a prototype as lines that end between arguments, which stand below each other."""
    indent = " " * (prototype.index("(") + 1)
    # Lines end behind commas alone.
    whole = re.sub(r"(?<!,) ", "~", prototype)
    lines = textwrap.wrap(whole, _WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
    return tuple(line.replace("~", " ") for line in lines)


def scalar_variables(program: Program) -> tuple[str, ...]:
    """Returns how each number of the inputs is read."""
    return tuple(f"{array.name}[{index}]" for array in program.signature.inputs for index in range(array.size))


def tile_variables(program: Program) -> tuple[str, ...]:
    """Returns the same for configuration i of a tile."""
    return tuple(
        f"{array.name}[i * {array.name}_pose + {index} * {array.name}_joint]"
        for array in program.signature.inputs
        for index in range(array.size)
    )


def block_names(array: Array) -> tuple[str, ...]:
    """Returns the C array of each block of a result."""
    return tuple(f"{array.name}[{block}]" for block in range(array.blocks)) if array.in_blocks else (array.name,)


def result_places(program: Program) -> Iterator[tuple[str, ...]]:
    """For each block of each result, where its computed numbers are stored."""
    for array in computed(program):
        for name in block_names(array):
            yield tuple(f"{name}[{index}]" for index in range(array.size // array.blocks))


def flat_call(kernels: RobotPrograms, program: Program, real: str, name: str, buffers: tuple[str, str]) -> str:
    """Writes a call of a kernel whose arrays lie one after the other in two buffers, without the last semicolon.

    The buffers have all inputs and all results, with the last rows of matrices, and with numbers for truth values.
    Parameters are those of the file.
    """
    arguments, offset, (inputs, results) = [], 0, buffers
    # Inputs follow each other in the first buffer.
    for array in given(program):
        arguments.append(_from(inputs, offset))
        offset += array.stored
    if kernels.robot.runtime_parameters:
        arguments.append(f"&{default_params(kernels.robot.name, real)}")
    before: list[str] = []
    after: list[str] = []
    offset = 0
    for array in computed(program):
        place = _from(results, offset)
        bracketed = f"({place})" if offset else place
        # Bytes become numbers in a buffer of numbers.
        if array.is_truth:
            before.append(f"{TRUTH} {array.name}[{array.size}]")
            widened = f"{bracketed}[i] = ({real}){array.name}[i]"
            after.append(f"for (int i = 0; i < {array.size}; i++) {{ {widened}; }}")
            place = array.name
        arguments.append(f"(void *){bracketed}" if array.in_blocks else place)
        offset += array.stored * array.blocks
    return "; ".join([*before, f"{name}({', '.join(arguments)})", *after])


def _from(buffer: str, offset: int) -> str:
    return f"{buffer} + {offset}" if offset else buffer


_JOINTS = (
    "Limits of the joints, rounded outwards, so that a joint exactly at its limit is within; where the robot file has "
    "no limits, the largest numbers of the type."
)
_READINGS = (
    "What the actuators can read, rounded outwards; where nothing is known, the largest numbers of the type. The "
    "inverse of an arm at a limit may be beyond it by rounding: clamp such readings."
)
_WITHIN = (
    "Whether {} is within the limits: 1 if every {} is at its limits or between them, else 0. NaN and infinity are not."
)


@dataclass(frozen=True, slots=True)
class Bounds:
    """Holds the limits of one vector: texts are lines of comments, `size` is the macro of its length."""

    text: tuple[str, ...]
    vector: str
    word: str
    question: tuple[str, ...]
    entry: str
    size: str
    names: tuple[str, str]
    pairs: tuple[tuple[str, str], ...]
    within: str
    clamp: str
    within_head: tuple[str, ...]
    clamp_head: tuple[str, ...]


def bounds_of(kernels: RobotPrograms, real: ScalarType) -> Iterator[Bounds]:
    """Yields the limits that a file has: of joints, and of readings where kernels have to do with them."""
    robot, stem = kernels.robot, prefix(kernels.robot.name, real)
    if robot.dof:
        yield _bounds(
            vector=("q", macro(robot.name, "DOF")),
            text=_JOINTS,
            words=("a joint vector", "joint"),
            names=limit_names(robot, real),
            pairs=limit_literals(robot, real),
            functions=(function(robot.name, "within_limits", real), function(robot.name, "clamp", real)),
            real=real,
        )
    if has_actuators(kernels):
        yield _bounds(
            vector=(ARRAY, macro(robot.name, "ACTUATORS")),
            text=_READINGS,
            words=("an actuator vector", "reading"),
            names=(macro(stem, "ACTUATORS_LOW"), macro(stem, "ACTUATORS_HIGH")),
            pairs=reading_literals(robot, real),
            functions=(
                function(robot.name, "actuators_within_limits", real),
                function(robot.name, "clamp_actuators", real),
            ),
            real=real,
        )


def _bounds(
    *,
    vector: tuple[str, str],
    text: str,
    words: tuple[str, str],
    names: tuple[str, str],
    pairs: tuple[tuple[str, str], ...],
    functions: tuple[str, str],
    real: ScalarType,
) -> Bounds:
    (array, size), (within, clamp), (one, entry) = vector, functions, words
    given = f"const {real} {array}[{size}]"
    return Bounds(
        text=_wrapped_arguments(text),
        vector=array,
        word=one.partition(" ")[2],
        question=_wrapped_arguments(_WITHIN.format(one, entry)),
        entry=entry,
        size=size,
        names=names,
        pairs=pairs,
        within=within,
        clamp=clamp,
        within_head=wrapped_prototype(f"int {within}({given})"),
        clamp_head=wrapped_prototype(f"void {clamp}({given}, {real} clamped[{size}])"),
    )


def _wrapped_arguments(text: str) -> tuple[str, ...]:
    return tuple(textwrap.wrap(text, LINE))


def limit_names(robot: Robot, real: ScalarType) -> tuple[str, str]:
    """Returns the names of the arrays of lower and of upper limits of the joints."""
    stem = prefix(robot.name, real)
    return macro(stem, "LIMITS_LOW"), macro(stem, "LIMITS_HIGH")
