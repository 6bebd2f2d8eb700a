"""The files of the crate: `Cargo.toml`, `src/lib.rs` for doubles, `src/f32.rs` for floats, and their companions."""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import partial

from kinegen.backends.accuracy import accuracy_lines, sincos_words
from kinegen.backends.bundle import RobotPrograms, joint_lines, parameter_lines, provenance
from kinegen.backends.c.kernel import name_lists
from kinegen.backends.c.nearest import Nearest, nearest_of
from kinegen.backends.c.test_vectors import Vectors, VectorTests, vector_tests
from kinegen.backends.c.vectors import INVERSE_TOLERANCES
from kinegen.backends.descriptions import frames_text, subject
from kinegen.backends.inverse import MOST_TURNS, branches_of, free_end_words
from kinegen.backends.inverse import NEAREST_FUNCTION as NEAREST
from kinegen.backends.limits import actuator_limits, actuator_lines, joint_limits
from kinegen.backends.metadata import command_lines, table_lines, table_title
from kinegen.backends.printing import CODE, routine_lines
from kinegen.backends.routines import LINE, SINCOS, uses
from kinegen.backends.rust.functions import (
    Function,
    Search,
    emit_search,
    escaped,
    function_of,
    search_of,
    signature_lines,
    type_of,
)
from kinegen.backends.rust.syntax import NUMBER, line_comment, literal, rust_syntax
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import rendered
from kinegen.ir.program import Operator
from kinegen.model.outputs import Array
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import comment_text

_CHOICE = (
    "The nearest is the one with the least sum of squared differences to q0, joint by joint. Revolute joints are first "
    "moved by whole turns as near to q0 as their limits allow. Two joints whose axes coincide are set so that both are "
    "nearest to q0 within their limits. Of two solutions equally near, the one in the first branch is selected. "
    "None if no branch is valid, or if an entry of q0 is NaN, infinite, or more than {turns} whole turns from zero. q0 "
    "may be outside the limits."
)


@dataclass(frozen=True, slots=True)
class Words:
    """Holds a table of names, and what they mean."""

    name: str
    values: tuple[str, ...]
    meaning: str


@dataclass(frozen=True, slots=True)
class Branch:
    """Holds a branch of the inverse: its name in code, and in words."""

    variant: str
    name: str


@dataclass(frozen=True, slots=True)
class CrateContext:
    """Holds what the templates of `rust/` are given."""

    crate: str
    real: str
    number: str
    is_single: bool
    is_tree: bool
    title: str
    description: str
    plain_description: str
    version: str
    provenance: str
    manual: tuple[str, ...]
    frames_text: tuple[str, ...]
    length: str
    joints: tuple[str, ...]
    table_title: str
    table: tuple[str, ...]
    command: tuple[str, ...]
    actuators: tuple[str, ...]
    parameter_lines: tuple[str, ...]
    model: str
    dof: int
    joint_names: tuple[str, ...]
    zeros: str
    limits: tuple[tuple[str, str] | None, ...]
    readings: tuple[tuple[str, str], ...]
    words: tuple[Words, ...]
    branches: tuple[Branch, ...]
    parameters: tuple[tuple[str, str], ...]
    sincos: tuple[str, ...]
    pair: tuple[str, ...]
    sqrt: bool
    select: bool
    atan2: tuple[str, ...]
    is_batched: bool
    functions: tuple[Function, ...]
    nearest: Nearest | None
    search: Search | None


def emit_rust(kernels: RobotPrograms, real: ScalarType) -> dict[str, str]:
    """Prints the files of one number type; those of doubles hold the crate together."""
    context = crate_context(kernels, real)
    names: tuple[str, ...] = ("Cargo.toml", "README.md", "rustfmt.toml", "src/lib.rs", "src/convert.rs")
    # Files of the package come with doubles, once.
    names = names if real is ScalarType.DOUBLE else ("src/f32.rs",)
    files = rendered({name: f"rust/{name.rpartition('/')[2]}" for name in names}, k=context)
    return files | (emit_search(kernels, real) if kernels.numeric_inverse else {})


def crate_context(kernels: RobotPrograms, real: ScalarType) -> CrateContext:
    """Returns everything the templates lay out, as finished text."""
    robot, programs = kernels.robot, kernels.programs
    limits = joint_limits(robot, real)
    nearest = _nearest(kernels, real)
    pair = CODE[real][Operator.SINCOS]
    # The choice of a free joint turns the target, with the pair of the kernels.
    has_pair = uses(programs, Operator.SINCOS) or (nearest is not None and nearest.end is not None)
    has_angles, has_roots = uses(programs, Operator.ATAN2), uses(programs, Operator.SQRT)
    functions = tuple(function_of(kernels, program, real) for program in programs)
    return CrateContext(
        crate=robot.name,
        real=real.value,
        number=NUMBER[real],
        is_single=real is ScalarType.FLOAT,
        is_tree=robot.is_tree,
        title=f"{subject(program.quantity for program in programs)} of {robot.name}",
        description=escaped(comment_text(robot.description)),
        plain_description=_toml(comment_text(robot.description) or f"Kinematics of {robot.name}"),
        version=robot.release,
        provenance=escaped(provenance(robot)),
        manual=_manual(kernels, real),
        frames_text=tuple(textwrap.wrap(escaped(frames_text(robot.is_tree)), LINE)),
        length=robot.units.length,
        joints=joint_lines(robot),
        table_title=table_title(robot),
        table=table_lines(robot),
        command=command_lines(kernels, "--languages rust"),
        actuators=actuator_lines(kernels),
        parameter_lines=parameter_lines(robot),
        model=robot.digest,
        dof=robot.dof,
        joint_names=tuple(variable.name for variable in robot.variables),
        zeros=", ".join(["0.0"] * robot.dof),
        limits=tuple(each and (literal(real, each[0]), literal(real, each[1])) for each in limits),
        readings=_readings(kernels, real),
        words=_words(kernels),
        branches=_branches(kernels),
        parameters=tuple(
            (parameter.name, literal(real, value))
            for parameter, value in zip(robot.runtime_parameters, kernels.defaults, strict=True)
        ),
        sincos=_routine(Operator.SINCOS, real, ()) if has_pair else (),
        pair=tuple(operand.name for operand in pair.outputs if hasattr(operand, "name")),
        sqrt=has_roots,
        select=has_angles or uses(programs, Operator.SELECT_LT) or (has_pair and pair.uses(Operator.SELECT_LT)),
        atan2=_routine(Operator.ATAN2, real, ("",)) if has_angles else (),
        is_batched=any(function.batch for function in functions),
        functions=functions,
        nearest=nearest,
        search=search_of(kernels, real) if kernels.numeric_inverse else None,
    )


def _manual(kernels: RobotPrograms, real: ScalarType) -> tuple[str, ...]:
    pure = (
        "Every function is pure: no state, no heap, no panic, safe from threads and interrupts. Joint limits are not "
        "checked. The results have the same bits on every machine, and the bits of the C kernels compiled without "
        "contraction."
    )
    pair = sincos_words(kernels.robot, SINCOS[real].accuracy)
    paragraphs = [pure, *[pair] * uses(kernels.programs, Operator.SINCOS)]
    paragraphs.append(" ".join(accuracy_lines(kernels, "this crate")))
    lines: list[str] = []
    for text in filter(None, paragraphs):
        lines += ["", *textwrap.wrap(escaped(text), LINE, break_long_words=False, break_on_hyphens=False)]
    return tuple(lines[1:])


def _routine(operator: Operator, real: ScalarType, places: tuple[str, ...]) -> tuple[str, ...]:
    return routine_lines(CODE[real][operator], rust_syntax(real), comment=line_comment, store="{value}", places=places)


def _nearest(kernels: RobotPrograms, real: ScalarType) -> Nearest | None:
    """Returns the choice of a solution, with the numbers of C as Rust writes them."""
    found, solved = nearest_of(kernels, real, partial(literal, real)), branches_of(kernels)
    if found is None or solved is None:
        return None
    text = escaped(_CHOICE.format(turns=MOST_TURNS[real]) + free_end_words(solved))
    lines = tuple(textwrap.wrap(text, LINE, break_on_hyphens=False))
    return replace(found, lines=lines, declaration=_choice_signature(kernels, real, found))


def _readings(kernels: RobotPrograms, real: ScalarType) -> tuple[tuple[str, str], ...]:
    """Returns the range of each actuator; none where no kernel has to do with them."""
    return tuple((literal(real, low), literal(real, high)) for low, high in actuator_limits(kernels, real))


def _choice_signature(kernels: RobotPrograms, real: ScalarType, found: Nearest) -> tuple[str, ...]:
    number = NUMBER[real]
    arguments = [f"{found.target}: &[[{number}; 4]; 4]"]
    arguments += [f"redundancy: &[{number}; {found.given}]"] * bool(found.given)
    arguments += [f"q0: &[{number}; DOF]"]
    arguments += ["params: &Params"] * bool(kernels.robot.runtime_parameters)
    return signature_lines(NEAREST, arguments, f"Option<[{number}; DOF]>")


def _branches(kernels: RobotPrograms) -> tuple[Branch, ...]:
    found = branches_of(kernels)
    names = found.names if found else ()
    return tuple(
        Branch("".join(word.capitalize() for word in re.findall(r"[a-zA-Z0-9]+", name)), name) for name in names
    )


def _words(kernels: RobotPrograms) -> tuple[Words, ...]:
    # Joints and branches have types of their own.
    lists = name_lists(kernels).items()
    return tuple(Words(name, *each) for name, each in lists if name not in ("JOINTS", "BRANCHES"))


def _toml(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007F")


@dataclass(frozen=True, slots=True)
class TestContext:
    """Holds what the template `rust/vectors.rs.jinja` is given; `kinds` are the types of the inputs by their names."""

    module: str
    number: str
    kinds: Mapping[str, str]
    tolerance: str
    has_search: bool
    parameters: str
    vectors: VectorTests


def emit_rust_tests(kernels: RobotPrograms, vectors: Vectors, real: ScalarType) -> dict[str, str]:
    """Print the tests of one number type, by the path of their file in the crate."""
    robot, number = kernels.robot, NUMBER[real]

    def nested(array: Array, entries: Sequence[Fraction]) -> str:
        return _nested([literal(real, each) for each in entries], array.shape)

    def flat(_array: Array, entries: Sequence[Fraction]) -> str:
        return _nested([literal(real, each) for each in entries], (len(entries),))

    # Inputs are arrays of arrays as functions take them; results are compared as rows of numbers.
    tests = vector_tests(kernels, vectors, (real,), nested, flat)
    context = TestContext(
        module=robot.name if real is ScalarType.DOUBLE else f"{robot.name}::f32",
        number=number,
        kinds={array.name: type_of(array, number, robot) for array in tests.inputs},
        tolerance=literal(real, INVERSE_TOLERANCES[real]),
        has_search=kernels.numeric_inverse,
        parameters=", &robot::Params::default()" if robot.runtime_parameters else "",
        vectors=replace(tests, provenance=escaped(tests.provenance)),
    )
    name = "vectors" if real is ScalarType.DOUBLE else "vectors_f32"
    return rendered({f"tests/{name}.rs": "rust/vectors.rs"}, k=context)


def _nested(words: Sequence[str], shape: Sequence[int]) -> str:
    if len(shape) == 1:
        return f"[{', '.join(words)}]"
    step = len(words) // shape[0] if shape[0] else 0
    return f"[{', '.join(_nested(words[i * step : (i + 1) * step], shape[1:]) for i in range(shape[0]))}]"
