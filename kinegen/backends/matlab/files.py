"""The files of the MATLAB package: its functions and what it says of the robot, and its tests."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import lru_cache
from types import MappingProxyType

from kinegen.backends.accuracy import accuracy_lines, sincos_words
from kinegen.backends.bundle import RobotPrograms, joint_lines, parameter_lines, provenance
from kinegen.backends.c.kernel import name_lists
from kinegen.backends.c.test_vectors import Vectors, VectorTests, extents_of, vector_tests
from kinegen.backends.c.vectors import INVERSE_TOLERANCES
from kinegen.backends.descriptions import frames_text, subject
from kinegen.backends.inverse import branches_of, inverse_of
from kinegen.backends.limits import (
    ARRAY,
    actuator_limits,
    actuator_lines,
    has_actuators,
    joint_limits,
    limit_literals,
    reading_literals,
)
from kinegen.backends.matlab.functions import Function, NearestFunction, function_of, nearest_function
from kinegen.backends.matlab.gateway import emit_gateway
from kinegen.backends.matlab.syntax import CLASS, WIDTH, extents, in_columns, matlab_text, number
from kinegen.backends.routines import SINCOS, uses
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import rendered
from kinegen.ir.program import Operator
from kinegen.model.outputs import Array
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import comment_text


@dataclass(frozen=True, slots=True)
class Bounds:
    """Holds the limits of a vector in one number type: its name, and columns as text."""

    kind: str
    low: str
    high: str


@dataclass(frozen=True, slots=True)
class Limited:
    """Holds a vector that has limits: a function asks whether it is within these, and one clamps it."""

    array: str
    size: int
    word: str
    within: str
    within_text: str
    clamp: str
    clamp_text: str
    bounds: tuple[Bounds, ...]

    @property
    def within_names(self) -> tuple[str, str]:
        """The argument and the result of the function that asks, as wide as each other."""
        return _as_wide(self.array, "within")

    @property
    def clamp_names(self) -> tuple[str, str]:
        """The argument and the result of the function that clamps, as wide as each other."""
        return _as_wide(self.array, "clamped")


def _as_wide(*names: str) -> tuple[str, str]:
    first, second = (name.ljust(max(map(len, names))) for name in names)
    return first, second


@dataclass(frozen=True, slots=True)
class PackageContext:
    """Holds what the templates of `matlab/` are given."""

    robot: str
    title: str
    description: str
    provenance: str
    frames_text: tuple[str, ...]
    length: str
    joints: tuple[str, ...]
    actuators: tuple[str, ...]
    parameter_lines: tuple[str, ...]
    manual: tuple[str, ...]
    model: str
    dof: int
    tables: tuple[tuple[str, str, str], ...]
    parameters: tuple[tuple[str, str], ...]
    limited: tuple[Limited, ...]
    functions: tuple[Function, ...]
    others: tuple[tuple[str, str], ...]
    nearest: NearestFunction | None


@lru_cache(maxsize=1)
def emit_matlab(kernels: RobotPrograms) -> Mapping[str, str]:
    """Prints the package, by path; they are asked for in each number type."""
    context = package_context(kernels)
    names = ["Contents", "info"]
    names += ["default_params"] * bool(context.parameters) + ["inverse_nearest"] * (context.nearest is not None)
    files = rendered({name: f"matlab/{name}.m" for name in names}, k=context)
    # Joints and actuators have functions of one form.
    for vector in context.limited:
        limits = {vector.within: "matlab/within_limits.m", vector.clamp: "matlab/clamp.m"}
        files |= rendered(limits, k=context, v=vector)
    for function in context.functions:
        files |= rendered({function.name: "matlab/function.m"}, k=context, f=function)
    package = {f"+{kernels.robot.name}/{name}.m": text for name, text in files.items()}
    return MappingProxyType(package | emit_gateway(kernels))


def package_context(kernels: RobotPrograms) -> PackageContext:
    """Returns everything the templates lay out, as finished text."""
    robot, programs = kernels.robot, kernels.programs
    return PackageContext(
        robot=robot.name,
        title=f"{subject(program.quantity for program in programs)} of {robot.name}",
        description=comment_text(robot.description),
        provenance=provenance(robot),
        frames_text=tuple(textwrap.wrap(matlab_text(frames_text(robot.is_tree)), WIDTH)),
        length=robot.units.length,
        joints=tuple(map(matlab_text, joint_lines(robot))),
        actuators=tuple(map(matlab_text, actuator_lines(kernels))),
        parameter_lines=parameter_lines(robot),
        manual=_manual(kernels),
        model=robot.digest,
        dof=robot.dof,
        tables=_tables(kernels),
        parameters=tuple(
            (parameter.name, ScalarType.DOUBLE.literal(value))
            for parameter, value in zip(robot.runtime_parameters, kernels.defaults, strict=True)
        ),
        limited=_limited(kernels),
        functions=tuple(function_of(kernels, program) for program in programs),
        others=_others(kernels),
        nearest=nearest_function(kernels),
    )


def _manual(kernels: RobotPrograms) -> tuple[str, ...]:
    every = (
        "Each column is a configuration, and results have the configurations in their last dimension. Joint limits are "
        "not checked. The results have the bits of the C kernels compiled without contraction."
    )
    paragraphs = [every]
    if uses(kernels.programs, Operator.SINCOS):
        double, single = (SINCOS[real].accuracy for real in ScalarType)
        paragraphs.append(sincos_words(kernels.robot, f"{double}, of singles {single}"))
    paragraphs.append(matlab_text(" ".join(accuracy_lines(kernels, "this package"))))
    lines: list[str] = []
    for text in filter(None, paragraphs):
        lines += ["", *textwrap.wrap(text, WIDTH, break_long_words=False, break_on_hyphens=False)]
    return tuple(lines[1:])


def _tables(kernels: RobotPrograms) -> tuple[tuple[str, str, str], ...]:
    robot = kernels.robot
    limits = "; ".join(
        "-Inf, Inf" if each is None else ", ".join(ScalarType.DOUBLE.literal(Fraction(end)) for end in each)
        for each in joint_limits(robot, ScalarType.DOUBLE)
    )
    ranges = "; ".join(
        ", ".join(ScalarType.DOUBLE.literal(Fraction(end)) for end in each)
        for each in actuator_limits(kernels, ScalarType.DOUBLE)
    )
    known = "lowest and highest reading of each actuator, rounded outwards; the largest numbers where nothing is known"
    meaning = f"lower and upper limit of each joint in rad or {robot.units.length}, rounded outwards"
    return (
        ("MODEL", f"'{robot.digest}'", "digest of the robot; the headers in C have the same"),
        ("DOF", str(robot.dof), "length of the joint vector"),
        ("LIMITS", f"[{limits}]" if robot.dof else "zeros(0, 2)", f"{meaning}; infinite without"),
        *((name, _cell(words), _phrase(meaning)) for name, (words, meaning) in name_lists(kernels).items()),
        *((("ACTUATOR_RANGES", f"[{ranges}]", known),) * bool(ranges)),
    )


def _phrase(sentence: str) -> str:
    return f"{sentence[0].lower()}{sentence[1:-1]}".replace("`", "")


def _cell(words: tuple[str, ...]) -> str:
    """Returns a row of texts, as a cell that `struct` keeps whole; a quote is doubled."""
    quoted = (word.replace("'", "''") for word in words)
    return "{" + ", ".join(f"'{word}'" for word in quoted) + "}" if words else "cell(1, 0)"


def _limited(kernels: RobotPrograms) -> tuple[Limited, ...]:
    """Returns the joint vector, and the actuator vector where kernels have to do with it."""
    robot = kernels.robot
    joints = Limited(
        array="q",
        size=robot.dof,
        word="joint vector",
        within="within_limits",
        within_text="Whether every joint is at its limits or between them.",
        clamp="clamp",
        clamp_text="The joint vector within the limits that is nearest to another one.",
        bounds=_bounds(limit_literals, robot),
    )
    if not has_actuators(kernels):
        return (joints,)
    readings = Limited(
        array=ARRAY,
        size=len(robot.actuators.readings),
        word="actuator vector",
        within="actuators_within_limits",
        within_text="Whether every reading is at the ends of its range or between them.",
        clamp="clamp_actuators",
        clamp_text="The actuator vector within the ranges that is nearest to another one.",
        bounds=_bounds(reading_literals, robot),
    )
    return (joints, readings)


def _bounds(literals: Callable[[Robot, ScalarType], tuple[tuple[str, str], ...]], robot: Robot) -> tuple[Bounds, ...]:

    def column(real: ScalarType, side: int) -> str:
        return f"[{'; '.join(number(real, pair[side]) for pair in literals(robot, real)) or 'zeros(0, 1)'}]"

    return tuple(Bounds(CLASS[real], column(real, 0), column(real, 1)) for real in ScalarType)


def _others(kernels: RobotPrograms) -> tuple[tuple[str, str], ...]:
    found = [
        ("info", "Names, limits and digest of the robot."),
    ]
    for vector in _limited(kernels):
        found += [(vector.within, vector.within_text), (vector.clamp, vector.clamp_text)]
    found += [("default_params", "Runtime parameters with the values of the robot file.")] * bool(kernels.defaults)
    has_choice = inverse_of(kernels) is not None
    return (*found, *[("inverse_nearest", "The solution of inverse that is nearest to a joint vector.")] * has_choice)


@dataclass(frozen=True, slots=True)
class TestContext:
    """Holds what the template `matlab/run_tests.m.jinja` is given.

    Attributes:
        given: What targets are given besides, a row for each of these numbers.
        accepted: How far each joint may be from the vector of a target, in double and in single.
    """

    shapes: Mapping[str, str]
    given: str
    accepted: tuple[str, ...]
    vectors: VectorTests


def emit_matlab_tests(kernels: RobotPrograms, vectors: Vectors) -> dict[str, str]:
    """Print the tests, by the name of their file."""
    branches, tests = branches_of(kernels), vector_tests(kernels, vectors, tuple(ScalarType), _in_columns)
    sizes = extents_of(kernels.robot, branches.turns if branches else ())
    context = TestContext(
        shapes={array.name: f"[{' '.join(map(str, extents(array)))}]" for array in tests.inputs},
        given="; ".join(map(_row, zip(*vectors.given, strict=True))),
        accepted=tuple(_row([size * INVERSE_TOLERANCES[real] for size in sizes]) for real in ScalarType),
        vectors=tests,
    )
    return rendered({"run_tests.m": "matlab/run_tests.m"}, k=context)


def _in_columns(array: Array, entries: Sequence[Fraction]) -> str:
    return _row(in_columns(array, entries) if entries else ())


def _row(entries: Sequence[Fraction]) -> str:
    return ", ".join(map(ScalarType.DOUBLE.literal, entries))
