"""The C++ header of a robot: `puma560.hpp`."""

from __future__ import annotations

import re
import textwrap
from dataclasses import dataclass, replace
from fractions import Fraction

from kinegen.emit.accuracy import accuracy_lines
from kinegen.emit.actuators import actuator_lines, actuator_names
from kinegen.emit.columns import varied_names
from kinegen.emit.cpp.functions import Function, function_of
from kinegen.emit.cpp.nearest import Nearest, nearest_of
from kinegen.emit.cpp.syntax import SYNTAX, number
from kinegen.emit.functions import LINE, uses
from kinegen.emit.inverse import branches_of
from kinegen.emit.kernels import Kernels, joint_lines, parameter_lines, provenance
from kinegen.emit.limits import LARGEST, joint_limits
from kinegen.emit.reals import Real
from kinegen.emit.routines import CODE, block_comment, routine_lines
from kinegen.emit.sincos import SINCOS
from kinegen.emit.table import command_lines, table_lines, table_title
from kinegen.emit.words import frames_text, subject
from kinegen.ir.program import Operator, Temporary
from kinegen.naming import comment_text
from kinegen.outputs import Kind
from kinegen.robot.model import Robot

_SINCOS = (
    f"Sines and cosines are evaluated {SINCOS[Real.DOUBLE].accuracy} in double and {SINCOS[Real.FLOAT].accuracy} in "
    "float; an angle beyond that, a NaN or an infinity makes every output that depends on it NaN."
)
_ROOT = "Square roots are correctly rounded; that of a negative number is NaN."
_ANGLES = (
    "Arc tangents of two numbers are within 1.6 units in the last place in double and 1.7e-7 rad in float; that of two "
    "zeros is 0, zeros have no sign, and an infinity or a NaN makes them NaN."
)


@dataclass(frozen=True, slots=True)
class Names:
    """A list of names: an enumeration and an array of texts.

    Attributes:
        enum: The enumeration.
        array: The array.
        entries: For each its enumerator and its text.
        meaning: What they name, a sentence.
    """

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
    """What the templates of `cpp/` are given."""

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
    names: tuple[Names, ...]
    parameters: tuple[tuple[str, str], ...]
    routines: tuple[RoutineText, ...]
    has_sincos: bool
    has_sqrt: bool
    has_atan2: bool
    functions: tuple[Function, ...]
    nearest: Nearest | None


def header_context(kernels: Kernels) -> HeaderContext:
    """Everything the templates lay out, as finished text."""
    robot, programs = kernels.robot, kernels.programs
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
        names=_names(kernels),
        parameters=tuple(
            (parameter.name, number(value))
            for parameter, value in zip(robot.runtime_parameters, kernels.defaults, strict=True)
        ),
        routines=tuple(map(_routines, Real)),
        has_sincos=uses(programs, Operator.SINCOS),
        has_sqrt=uses(programs, Operator.SQRT),
        has_atan2=uses(programs, Operator.ATAN2),
        functions=tuple(function_of(kernels, program) for program in programs),
        nearest=nearest_of(kernels),
    )


def _routine_words(kernels: Kernels) -> tuple[str, ...]:
    """What the functions promise that kernels call, as lines of a comment."""
    texts = ((Operator.SINCOS, _SINCOS), (Operator.SQRT, _ROOT), (Operator.ATAN2, _ANGLES))
    used = " ".join(text for operator, text in texts if uses(kernels.programs, operator))
    return tuple(textwrap.wrap(used, LINE, break_on_hyphens=False))


def _routines(real: Real) -> RoutineText:
    """The functions that kernels call, of one number type, whose numbers are plain ones here."""
    pair, angle = CODE[real][Operator.SINCOS], CODE[real][Operator.ATAN2]
    own = replace(
        SYNTAX,
        literal=lambda constant: real.literal(constant.of(real is Real.FLOAT)),
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
    """Both limits of each joint, rounded outwards in each type; the largest numbers of a type where there are none."""
    found = []
    for double, single in zip(*(joint_limits(robot, real) for real in Real), strict=True):
        if double is None or single is None:
            largest = f"detail::either<Real>({Real.DOUBLE.literal(LARGEST[Real.DOUBLE])}, {_largest_float()})"
            found.append((f"-{largest}", largest))
        else:
            low, high = (number(Fraction(one), Fraction(other)) for one, other in zip(double, single, strict=True))
            found.append((low, high))
    return tuple(found)


def _largest_float() -> str:
    return Real.FLOAT.literal(LARGEST[Real.FLOAT])


def _names(kernels: Kernels) -> tuple[Names, ...]:
    """The lists of names that there are."""
    robot, branches = kernels.robot, branches_of(kernels)
    has_frames = any(program.quantity.kind is Kind.FRAMES for program in kernels.programs)
    joints = tuple(variable.name for variable in robot.variables)
    lists = (
        ("Joint", "joint_names", joints, "The joints, in the order of q."),
        ("Frame", "frame_names", robot.frame_names if has_frames else (), "The frames, in the order of frames."),
        ("Tip", "tip_names", robot.tips if robot.is_tree else (), "The tips of the tree, in the order of results."),
        ("Branch", "branch_names", branches.names if branches else (), "The solutions of inverse, in their order."),
        ("Parameter", "parameter_names", varied_names(kernels), "The columns of parameter_jacobian, in their order."),
        ("Actuator", "actuator_names", actuator_names(kernels), "The actuators, in the order of their vector."),
    )
    return tuple(
        Names(enum, array, tuple((_enumerator(word, words), word) for word in words), meaning)
        for enum, array, words, meaning in lists
        if words or enum == "Joint"
    )


def _enumerator(word: str, words: tuple[str, ...]) -> str:
    """A name as an enumerator: `shoulder left, elbow up` is shoulder_left_elbow_up."""
    name = re.sub(r"\W+", "_", word).strip("_")
    return name if re.match(r"[A-Za-z]", name) else f"number_{words.index(word)}"
