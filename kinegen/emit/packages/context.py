"""What the templates of packages are given: finished strings, the same for every ecosystem."""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass
from fractions import Fraction

from kinegen import __version__
from kinegen.emit.c.arguments import declared
from kinegen.emit.c.kernel import KernelContext, kernel_context
from kinegen.emit.kernels import Kernels, joint_lines, provenance
from kinegen.emit.packages.layout import Layout
from kinegen.emit.reals import Real
from kinegen.ir.program import Program
from kinegen.naming import c_file, cmake_target, comment_text, function, macro, prefix, selftest_file, vectors_file
from kinegen.outputs import Quantity
from kinegen.robot.extent import joint_box
from kinegen.robot.model import JointType, Robot

_LONGEST_SENTENCE = 240  # PlatformIO's schema ends a description at 255 characters


@dataclass(frozen=True, slots=True)
class Example:
    """One call of a kernel, and how its result is printed.

    Attributes:
        header: Header of the kernel.
        real: Number type.
        zero: Zero in that type.
        dof: Macro of the size of the joint vector.
        joints: Value of each joint variable, and its name and unit.
        output: Declaration of the result.
        call: The call.
        first: The first number of the result.
        rows: Rows to print.
        columns: Numbers in each row.
        what: What is printed, in words.
    """

    header: str
    real: str
    zero: str
    dof: str
    joints: tuple[tuple[str, str], ...]
    output: str
    call: str
    first: str
    rows: int
    columns: int
    what: str


@dataclass(frozen=True, slots=True)
class Selftest:
    """The self-test of one number type.

    Attributes:
        source: Its file, without folder.
        vectors: Its header, without folder.
        program: Name of the program that runs it.
        function: C function that returns the largest difference.
        tolerance: Macro of the largest accepted one.
        real: Number type.
        zero: Zero in that type.
    """

    source: str
    vectors: str
    program: str
    function: str
    tolerance: str
    real: str
    zero: str


@dataclass(frozen=True, slots=True)
class ProjectContext:
    """What every template of a package is given, as `p`."""

    name: str
    upper: str
    version: str
    provenance: str
    description: str
    sentence: str
    markdown: str
    json_name: str
    json_sentence: str
    length: str
    joints: tuple[str, ...]
    kernels: tuple[KernelContext, ...]
    selftests: tuple[Selftest, ...]
    example: Example
    has_double: bool
    target: str
    layout: Layout


def project_context(kernels: Kernels, reals: tuple[Real, ...], layout: Layout) -> ProjectContext:
    """Everything the templates lay out.

    Args:
        kernels: The robot and its programs.
        reals: Number types of the package.
        layout: Its folders.

    Returns:
        The context.
    """
    robot = kernels.robot
    sentence = _sentence(robot)
    return ProjectContext(
        name=robot.name,
        upper=robot.name.upper(),
        version=__version__,
        provenance=provenance(robot),
        description=comment_text(robot.description),
        sentence=sentence,
        markdown=_markdown_text(sentence),
        json_name=json.dumps(robot.name),
        json_sentence=json.dumps(sentence),
        length=robot.units.length,
        joints=joint_lines(robot),
        kernels=tuple(kernel_context(kernels, real) for real in reals),
        selftests=tuple(_selftest(robot, real) for real in reals),
        example=_example(kernels, reals[0]),
        has_double=Real.DOUBLE in reals,
        target=cmake_target(robot.name),
        layout=layout,
    )


def _sentence(robot: Robot) -> str:
    """What the package is, in one line that any manifest can hold."""
    subject = comment_text(robot.description).rstrip(". ") or robot.name
    sentence = f"Forward kinematics: {subject}."
    return sentence if len(sentence) <= _LONGEST_SENTENCE else f"{sentence[: _LONGEST_SENTENCE - 3]}..."


def _markdown_text(text: str) -> str:
    """Text that Markdown shows as it is."""
    return re.sub(r"([\\`*_{}\[\]<>#|])", r"\\\1", text)


def _selftest(robot: Robot, real: Real) -> Selftest:
    stem = prefix(robot.name, real)
    return Selftest(
        source=selftest_file(robot.name, real),
        vectors=vectors_file(robot.name, real),
        program=f"{stem}_selftest",
        function=f"{stem}_selftest",
        tolerance=f"{stem.upper()}_TOLERANCE",
        real=real.value,
        zero=real.literal(Fraction(0)),
    )


def _example(kernels: Kernels, real: Real) -> Example:
    robot = kernels.robot
    program = _first_program(kernels.programs)
    result = program.signature.results[0]
    shape = result.shape[1:] if result.per_frame else result.shape
    arguments = ["q"] if robot.dof else []
    if robot.runtime_parameters:
        arguments.append(f"&{prefix(robot.name, real)}_default_params")
    frame = program.frames[0] if result.per_frame else "tool"
    return Example(
        header=c_file(robot.name, "h", real),
        real=real.value,
        zero=real.literal(Fraction(0)),
        dof=macro(robot.name, "DOF"),
        joints=_joint_vector(robot, real),
        output=f"{real.value} {declared(kernels, program, result)}",
        call=f"{function(robot.name, program.quantity.function, real)}({', '.join([*arguments, result.name])})",
        first=f"&{result.name}[0][0]" if result.per_frame else f"&{result.name}[0]",
        rows=3 if result.is_pose else math.prod(shape[:-1]),
        columns=shape[-1],
        what=f"{program.quantity.kind} of frame {frame}",
    )


def _first_program(programs: tuple[Program, ...]) -> Program:
    """The pose, where there is one."""
    return next((program for program in programs if program.quantity == Quantity.POSE), programs[0])


def _joint_vector(robot: Robot, real: Real) -> tuple[tuple[str, str], ...]:
    """A joint vector within the limits, away from zero so that the pose shows something."""
    vector = []
    for variable, (low, high) in zip(robot.variables, joint_box(robot), strict=True):
        place = Fraction(math.floor((3 * low + 5 * high) / 8 * 64), 64)
        unit = robot.units.length if variable.type is JointType.PRISMATIC else "rad"
        vector.append((real.literal(place), f"{variable.name} [{unit}]"))
    return tuple(vector)
