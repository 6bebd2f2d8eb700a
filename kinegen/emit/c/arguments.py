"""The arguments of the C functions: how each array of a kernel is declared, passed and read."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator

from kinegen.emit.actuators import ARRAY as ACTUATORS
from kinegen.emit.c.truths import TRUTH
from kinegen.emit.kernels import Kernels
from kinegen.ir.program import Program
from kinegen.naming import default_params, macro, params_type
from kinegen.outputs import Array, Kind

_WIDTH = 119
"""Characters of a line, without the semicolon behind it."""


def given(program: Program) -> tuple[Array, ...]:
    """The inputs that hold numbers; C knows no empty arrays."""
    return tuple(array for array in program.signature.inputs if array.size)


def computed(program: Program) -> tuple[Array, ...]:
    """The results that hold numbers; the Jacobian of a robot without joints does not."""
    return tuple(array for array in program.signature.results if array.size)


def extent_macro(kernels: Kernels, program: Program) -> str:
    """The macro of the number of frames or tips that results count."""
    return macro(kernels.robot.name, "FRAMES" if program.quantity.kind is Kind.FRAMES else "TIPS")


def number_type(array: Array, real: str) -> str:
    """The C type of the numbers of an array: a byte for truth values, else the number type of the kernels."""
    return TRUTH if array.is_truth else real


def declared(kernels: Kernels, program: Program, array: Array, qualifier: str = "") -> str:
    """The extents of an argument, such as `q[6]` or `base_T_tips[restrict ARM_TIPS][16]`.

    Args:
        kernels: The robot and its programs.
        program: The program.
        array: One of its inputs or results.
        qualifier: What stands in the outermost brackets before the extent, with a space after it.
    """
    robot = kernels.robot.name
    if array.per_frame:
        return f"{array.name}[{qualifier}{extent_macro(kernels, program)}][{array.stored}]"
    if array.per_branch:
        has_names = program.signature.branches is not None
        branches = macro(robot, "BRANCHES") if has_names else str(array.shape[0])
        return f"{array.name}[{qualifier}{branches}][{macro(robot, 'DOF')}]"
    size = f"{array.stored}"
    if array.name == ACTUATORS:
        size = macro(robot, "ACTUATORS")
    elif array.is_truth and program.signature.branches is not None:
        size = macro(robot, "BRANCHES")
    elif array.shape == (kernels.robot.dof,) and array in program.signature.inputs:
        size = macro(robot, "DOF")
    return f"{array.name}[{qualifier}{size}]"


def scalar_arguments(kernels: Kernels, program: Program, real: str, *, restrict: bool) -> str:
    """The parameter list of a scalar kernel; `restrict` is left out in headers, where C++ would stumble over it."""
    qualifier = "restrict " if restrict else ""
    parts = [f"const {real} {declared(kernels, program, array, qualifier)}" for array in given(program)]
    if kernels.robot.runtime_parameters:
        parts.append(f"const {params_type(kernels.robot.name, real)} *{qualifier}params")
    parts += [
        f"{number_type(array, real)} {declared(kernels, program, array, qualifier)}" for array in computed(program)
    ]
    return ", ".join(parts) or "void"


def batch_arguments(inputs: tuple[Array, ...], results: tuple[Array, ...], real: str, params: str) -> tuple[str, ...]:
    """The arguments of a batch kernel, each a declaration that ends in the name.

    Args:
        inputs: What it is given.
        results: What it gives.
        real: Number type.
        params: Type of the runtime parameters; empty where there are none.
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
    """The strides of an input of a batch kernel; `before` is the type of each, with a space."""
    return ", ".join(f"{before}{array.name}_{word}" for word in ("pose", "joint"))


def wrapped_prototype(prototype: str) -> tuple[str, ...]:
    """A prototype as lines that end between arguments, which stand below each other."""
    indent = " " * (prototype.index("(") + 1)
    whole = re.sub(r"(?<!,) ", "~", prototype)
    lines = textwrap.wrap(whole, _WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
    return tuple(line.replace("~", " ") for line in lines)


def scalar_variables(program: Program) -> tuple[str, ...]:
    """How each number of the inputs is read."""
    return tuple(f"{array.name}[{index}]" for array in program.signature.inputs for index in range(array.size))


def tile_variables(program: Program) -> tuple[str, ...]:
    """The same for configuration i of a tile."""
    return tuple(
        f"{array.name}[i * {array.name}_pose + {index} * {array.name}_joint]"
        for array in program.signature.inputs
        for index in range(array.size)
    )


def block_names(array: Array) -> tuple[str, ...]:
    """The C array of each block of a result."""
    return tuple(f"{array.name}[{block}]" for block in range(array.blocks)) if array.in_blocks else (array.name,)


def result_places(program: Program) -> Iterator[tuple[str, ...]]:
    """For each block of each result, where its computed numbers are stored."""
    for array in computed(program):
        for name in block_names(array):
            yield tuple(f"{name}[{index}]" for index in range(array.size // array.blocks))


def flat_call(kernels: Kernels, program: Program, real: str, name: str, buffers: tuple[str, str]) -> str:
    """A call of a kernel whose arrays lie one after the other in two buffers; parameters are those of the file.

    Args:
        kernels: The robot and its programs.
        program: The program.
        real: Number type.
        name: The kernel.
        buffers: Name of the buffer with all inputs, and of the one for all results, in which matrices have their last
            rows and truth values are numbers.

    Returns:
        C statements, without the last semicolon.
    """
    arguments, offset, (inputs, results) = [], 0, buffers
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
