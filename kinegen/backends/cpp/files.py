"""The C++ header of a robot, `puma560.hpp`, the CMake package around it, and their tests."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache
from types import MappingProxyType

from kinegen.backends.accuracy import accuracy_lines, sincos_words
from kinegen.backends.bundle import RobotPrograms, joint_lines, parameter_lines, provenance
from kinegen.backends.c.arguments import braced
from kinegen.backends.c.kernel import name_lists
from kinegen.backends.c.test_vectors import Vectors, VectorTests, vector_tests
from kinegen.backends.c.vectors import INVERSE_TOLERANCES
from kinegen.backends.cpp.functions import Argument, Function, Nearest, arguments_of, function_of, nearest_of
from kinegen.backends.cpp.syntax import SYNTAX, number
from kinegen.backends.descriptions import frames_text, input_text, subject
from kinegen.backends.limits import LARGEST, actuator_limits, actuator_lines, joint_limits
from kinegen.backends.metadata import command_lines, table_lines, table_title
from kinegen.backends.printing import CODE, block_comment, routine_lines
from kinegen.backends.routines import LINE, SINCOS, uses
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import rendered
from kinegen.ir.program import Operator, Temporary
from kinegen.model.outputs import Array
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import comment_text

_SINCOS = f"{SINCOS[ScalarType.DOUBLE].accuracy} in double and {SINCOS[ScalarType.FLOAT].accuracy} in float"
_ROOT = "Square roots are correctly rounded; that of a negative number is NaN."
_ANGLES = (
    "Arc tangents of two numbers are within 1.6 units in the last place in double and 1.7e-7 rad in float; that of two "
    "zeros is 0, zeros have no sign, and an infinity or a NaN makes them NaN."
)

_UNLIMITED = {real: (-float(largest), float(largest)) for real, largest in LARGEST.items()}
"""Limits of a joint that has none."""


@dataclass(frozen=True, slots=True)
class Names:
    """Names entries twice, in an enumeration and in an array of texts; the meaning is a sentence."""

    enum: str
    array: str
    entries: tuple[tuple[str, str], ...]
    meaning: str


@dataclass(frozen=True, slots=True)
class RoutineText:
    """Sine and cosine, and the arc tangent, of one number type."""

    real: str
    sincos: tuple[str, ...]
    sine: str
    cosine: str
    atan2: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class HeaderContext:
    """Holds what the templates of `cpp/` are given."""

    header: str
    robot: str
    guard: str
    macro: str
    title: str
    description: str
    provenance: str
    version: str
    frames_text: tuple[str, ...]
    length: str
    joints: tuple[str, ...]
    table_title: str
    table: tuple[str, ...]
    command: tuple[str, ...]
    actuator_lines: tuple[str, ...]
    parameter_lines: tuple[str, ...]
    routine_lines: tuple[str, ...]
    accuracy: tuple[str, ...]
    model: str
    dof: int
    limits: tuple[tuple[str, str], ...]
    readings: tuple[tuple[str, str], ...]
    names: tuple[Names, ...]
    parameters: tuple[tuple[str, str], ...]
    routines: tuple[RoutineText, ...]
    has_sincos: bool
    has_sqrt: bool
    has_atan2: bool
    functions: tuple[Function, ...]
    nearest: Nearest | None


def header_context(kernels: RobotPrograms) -> HeaderContext:
    """Returns everything the templates lay out, as finished text."""
    robot, programs, nearest = kernels.robot, kernels.programs, nearest_of(kernels)
    header = f"{robot.name}.hpp"
    return HeaderContext(
        header=header,
        robot=robot.name,
        guard=f"KINEGEN_{robot.name.upper()}_HPP_INCLUDED",
        macro=robot.name.upper(),
        title=f"{subject(program.quantity for program in programs)} of {robot.name}, double and single precision",
        description=comment_text(robot.description),
        provenance=provenance(robot),
        version=robot.release,
        frames_text=tuple(textwrap.wrap(frames_text(robot.is_tree), LINE)),
        length=robot.units.length,
        joints=joint_lines(robot),
        table_title=table_title(robot),
        table=table_lines(robot),
        command=command_lines(kernels, "--languages cpp"),
        actuator_lines=actuator_lines(kernels),
        parameter_lines=parameter_lines(robot),
        routine_lines=_routine_words(kernels),
        accuracy=accuracy_lines(kernels, header),
        model=robot.digest,
        dof=robot.dof,
        limits=_limits(robot),
        readings=_readings(kernels),
        names=_names(kernels),
        parameters=tuple(
            (parameter.name, number(value))
            for parameter, value in zip(robot.runtime_parameters, kernels.defaults, strict=True)
        ),
        routines=tuple(map(_routines, ScalarType)),
        has_sincos=uses(programs, Operator.SINCOS) or (nearest is not None and nearest.end is not None),
        has_sqrt=uses(programs, Operator.SQRT),
        has_atan2=uses(programs, Operator.ATAN2),
        functions=tuple(function_of(kernels, program) for program in programs),
        nearest=nearest,
    )


def _routine_words(kernels: RobotPrograms) -> tuple[str, ...]:
    """Says what the functions promise that kernels call, as lines of a comment."""
    pair = sincos_words(kernels.robot, _SINCOS)
    texts = ((Operator.SINCOS, pair), (Operator.SQRT, _ROOT), (Operator.ATAN2, _ANGLES))
    used = " ".join(text for operator, text in texts if uses(kernels.programs, operator))
    return tuple(textwrap.wrap(used, LINE, break_on_hyphens=False))


def _routines(real: ScalarType) -> RoutineText:
    """Returns the functions that kernels call, of one number type, whose numbers are plain ones here."""
    pair, angle = CODE[real][Operator.SINCOS], CODE[real][Operator.ATAN2]
    own = replace(
        SYNTAX,
        literal=lambda constant: real.literal(constant.of(real is ScalarType.FLOAT)),
        define=f"const {real} {{name}} = {{value}};",
    )
    sine, cosine = (output.name for output in pair.outputs if isinstance(output, Temporary))
    return RoutineText(
        real=real.value,
        sincos=routine_lines(pair, own, comment=block_comment),
        sine=sine,
        cosine=cosine,
        atan2=routine_lines(angle, own, comment=block_comment, store="return {value};", places=("",)),
    )


def _limits(robot: Robot) -> tuple[tuple[str, str], ...]:
    """Returns the limits of each joint, rounded outwards in each type; the largest numbers where there are none."""
    found = []
    for double, single in zip(*(joint_limits(robot, real) for real in ScalarType), strict=True):
        ends = zip(double or _UNLIMITED[ScalarType.DOUBLE], single or _UNLIMITED[ScalarType.FLOAT], strict=True)
        low, high = (_end(one, other) for one, other in ends)
        found.append((low, high))
    return tuple(found)


def _readings(kernels: RobotPrograms) -> tuple[tuple[str, str], ...]:
    """Returns the range of each actuator, in the same way; none where no kernel has to do with them."""
    ranges = zip(*(actuator_limits(kernels, real) for real in ScalarType), strict=True)
    return tuple((_end(double[0], single[0]), _end(double[1], single[1])) for double, single in ranges)


def _end(double: float, single: float) -> str:
    if abs(double) == LARGEST[ScalarType.DOUBLE]:
        largest = ", ".join(real.literal(LARGEST[real]) for real in ScalarType)
        return f"{'-' if double < 0 else ''}detail::either<Real>({largest})"
    return number(Fraction(double), Fraction(single))


def _names(kernels: RobotPrograms) -> tuple[Names, ...]:
    lists = name_lists(kernels)
    meanings = {
        "JOINTS": ("Joint", "The joints, in the order of q."),
        "FRAMES": ("Frame", "The frames, in the order of frames."),
        "TIPS": ("Tip", "The tips of the tree, in the order of results."),
        "BRANCHES": ("Branch", "The solutions of inverse, in their order."),
        "PARAMETERS": ("Parameter", "The columns of parameter_jacobian, in their order."),
        "ACTUATORS": ("Actuator", "The actuators, in the order of their vector."),
    }
    found = []
    for name, (words, _) in lists.items():
        enum, meaning = meanings[name]
        entries = tuple((_enumerator(word, words), word) for word in words)
        found.append(Names(enum, f"{enum.lower()}_names", entries, meaning))
    return tuple(found)


def _enumerator(word: str, words: tuple[str, ...]) -> str:
    """Returns a name as an enumerator: `shoulder left, elbow up` is shoulder_left_elbow_up."""
    name = re.sub(r"\W+", "_", word).strip("_")
    return name if re.match(r"[A-Za-z]", name) else f"number_{words.index(word)}"


@lru_cache(maxsize=1)
def emit_cpp(kernels: RobotPrograms) -> Mapping[str, str]:
    """Prints the header and the CMake project around it; they are asked for in each number type."""
    context = header_context(kernels)
    templates = {context.header: "cpp/header.hpp", "CMakeLists.txt": "cpp/CMakeLists.txt"}
    return MappingProxyType(rendered(templates, k=context))


@dataclass(frozen=True, slots=True)
class TestContext:
    """Holds what `cpp/vectors.cpp.jinja` is given; `arguments` are the inputs of each function by its name."""

    file: str
    header: str
    macro: str
    real: str
    tolerance: str
    arguments: Mapping[str, tuple[Argument, ...]]
    vectors: VectorTests


def test_file(robot: str, real: ScalarType) -> str:
    """Returns the file of one number type."""
    return f"{robot}_test_{real}.cpp"


def emit_cpp_tests(kernels: RobotPrograms, vectors: Vectors, real: ScalarType) -> dict[str, str]:
    """Print the test of one number type, by the name of its file."""
    robot = kernels.robot.name

    def row(_array: Array, entries: Sequence[Fraction]) -> str:
        return braced(map(real.literal, entries))

    programs = kernels.programs
    context = TestContext(
        file=test_file(robot, real),
        header=f"{robot}.hpp",
        macro=robot.upper(),
        real=real.value,
        tolerance=real.literal(INVERSE_TOLERANCES[real]),
        arguments={each.quantity.function: arguments_of(each.signature.inputs, input_text) for each in programs},
        vectors=vector_tests(kernels, vectors, (real,), row),
    )
    return rendered({context.file: "cpp/vectors.cpp"}, k=context)
