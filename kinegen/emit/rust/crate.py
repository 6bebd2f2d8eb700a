"""The files of the crate: `Cargo.toml`, `src/lib.rs` for doubles, `src/f32.rs` for floats, and what belongs to them."""

from __future__ import annotations

import json
import re
import textwrap
from dataclasses import dataclass, replace

from kinegen.emit.accuracy import accuracy_lines
from kinegen.emit.actuators import actuator_lines, actuator_names
from kinegen.emit.c.nearest import Nearest, nearest_of
from kinegen.emit.columns import varied_names
from kinegen.emit.environment import environment
from kinegen.emit.functions import LINE, uses
from kinegen.emit.inverse import branches_of
from kinegen.emit.kernels import Kernels, joint_lines, parameter_lines, provenance
from kinegen.emit.limits import joint_limits
from kinegen.emit.nearest import MOST_TURNS
from kinegen.emit.nearest import NAME as NEAREST
from kinegen.emit.reals import Real
from kinegen.emit.routines import CODE, routine_lines
from kinegen.emit.rust.functions import Function, escaped, function_of, signature_lines
from kinegen.emit.rust.search import Search, emit_search, search_of
from kinegen.emit.rust.syntax import NUMBER, line_comment, literal, rust_syntax
from kinegen.emit.sincos import SINCOS
from kinegen.emit.table import command_lines, table_lines, table_title
from kinegen.emit.words import frames_text, subject
from kinegen.ir.program import Operator
from kinegen.naming import comment_text
from kinegen.outputs import Kind
from kinegen.robot.model import Robot

_CHOICE = (
    "The nearest is the one with the least sum of squared differences to q0, joint by joint. Joints that turn first "
    "take the whole turns that bring them nearest to q0, as far as their limits allow. Of two solutions equally near, "
    "the one in the first branch is taken. None if no branch is valid, or if an entry of q0 is NaN, infinite, or more "
    "than {turns} whole turns from zero. q0 may be outside the limits."
)

_LITERALS = ("turn", "per_turn", "lowest", "highest", "farthest")


@dataclass(frozen=True, slots=True)
class Words:
    """A table of names.

    Attributes:
        name: Its name.
        values: The names.
        meaning: What they are.
    """

    name: str
    values: tuple[str, ...]
    meaning: str


@dataclass(frozen=True, slots=True)
class Branch:
    """A branch of the inverse: its name in code, and in words."""

    variant: str
    name: str


@dataclass(frozen=True, slots=True)
class CrateContext:
    """What the templates of `rust/` are given."""

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


def emit_rust(kernels: Kernels, real: Real) -> dict[str, str]:
    """Print the files of one number type; those of doubles hold the crate together.

    Args:
        kernels: The robot and its programs.
        real: The number type.

    Returns:
        Text by path in the crate.
    """
    context = crate_context(kernels, real)
    templates = {"src/f32.rs": "f32.rs"}
    if real is Real.DOUBLE:
        templates = {
            name: name.rpartition("/")[2] for name in ("Cargo.toml", "README.md", "rustfmt.toml", "src/lib.rs")
        }
        templates["src/convert.rs"] = "convert.rs"
    files = {
        path: environment().get_template(f"rust/{name}.jinja").render(k=context) for path, name in templates.items()
    }
    return files | (emit_search(kernels, real) if kernels.numeric_inverse else {})


def crate_context(kernels: Kernels, real: Real) -> CrateContext:
    """Everything the templates lay out, as finished text."""
    robot, programs = kernels.robot, kernels.programs
    limits = joint_limits(robot, real)
    pair, has_pair = CODE[real][Operator.SINCOS], uses(programs, Operator.SINCOS)
    has_angles = uses(programs, Operator.ATAN2)
    functions = tuple(function_of(kernels, program, real) for program in programs)
    nearest = _nearest(kernels, real)
    return CrateContext(
        crate=robot.name,
        real=real.value,
        number=NUMBER[real],
        is_single=real is Real.FLOAT,
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
        words=_words(kernels),
        branches=_branches(kernels),
        parameters=tuple(
            (parameter.name, literal(real, value))
            for parameter, value in zip(robot.runtime_parameters, kernels.defaults, strict=True)
        ),
        sincos=_routine(Operator.SINCOS, real, ()) if has_pair else (),
        pair=tuple(operand.name for operand in pair.outputs if hasattr(operand, "name")),
        sqrt=uses(programs, Operator.SQRT),
        select=uses(programs, Operator.SELECT_LT) or has_angles or (has_pair and pair.uses(Operator.SELECT_LT)),
        atan2=_routine(Operator.ATAN2, real, ("",)) if has_angles else (),
        is_batched=any(function.batch for function in functions),
        functions=functions,
        nearest=nearest,
        search=search_of(kernels, real) if kernels.numeric_inverse else None,
    )


def _manual(kernels: Kernels, real: Real) -> tuple[str, ...]:
    """What holds for every function, as paragraphs in lines."""
    pure = (
        "Every function is pure: no state, no heap, no panic, safe from threads and interrupts. Joint limits are not "
        "checked. The results have the same bits on every machine, and the bits of the C kernels compiled without "
        "contraction."
    )
    pair = (
        f"Sines and cosines are evaluated {SINCOS[real].accuracy}; an angle beyond that, a NaN or an infinity makes "
        "every output that depends on it NaN."
    )
    paragraphs = [pure, *[pair] * uses(kernels.programs, Operator.SINCOS)]
    paragraphs.append(" ".join(accuracy_lines(kernels, "this crate")))
    lines: list[str] = []
    for text in filter(None, paragraphs):
        lines += ["", *textwrap.wrap(escaped(text), LINE, break_long_words=False, break_on_hyphens=False)]
    return tuple(lines[1:])


def _routine(operator: Operator, real: Real, places: tuple[str, ...]) -> tuple[str, ...]:
    """The body of a function that kernels call."""
    return routine_lines(CODE[real][operator], rust_syntax(real), comment=line_comment, store="{value}", places=places)


def _nearest(kernels: Kernels, real: Real) -> Nearest | None:
    """The choice of a solution, with the numbers of C as Rust writes them."""
    found = nearest_of(kernels, real)
    if found is None:
        return None
    joints = tuple(
        replace(joint, **{name: getattr(joint, name).removesuffix("F") for name in _LITERALS}) for joint in found.joints
    )
    numbers = {name: getattr(found, name).removesuffix("F") for name in ("rounding", "largest", "zero", "one")}
    lines = textwrap.wrap(escaped(_CHOICE.format(turns=MOST_TURNS[real])), LINE, break_on_hyphens=False)
    declaration = _choice_signature(kernels, real, found)
    return replace(found, joints=joints, lines=tuple(lines), declaration=declaration, **numbers)


def _choice_signature(kernels: Kernels, real: Real, found: Nearest) -> tuple[str, ...]:
    number = NUMBER[real]
    arguments = [f"{found.target}: &[[{number}; 4]; 4]"]
    arguments += [f"redundancy: &[{number}; {found.given}]"] * bool(found.given)
    arguments += [f"q0: &[{number}; DOF]"]
    arguments += ["params: &Params"] * bool(kernels.robot.runtime_parameters)
    return signature_lines(NEAREST, arguments, f"Option<[{number}; DOF]>")


def _branches(kernels: Kernels) -> tuple[Branch, ...]:
    found = branches_of(kernels)
    names = found.names if found else ()
    return tuple(
        Branch("".join(word.capitalize() for word in re.findall(r"[a-zA-Z0-9]+", name)), name) for name in names
    )


def _words(kernels: Kernels) -> tuple[Words, ...]:
    """What the crate says of the robot by name."""
    robot: Robot = kernels.robot
    has_frames = any(program.quantity.kind is Kind.FRAMES for program in kernels.programs)
    tables = (
        Words("FRAMES", robot.frame_names if has_frames else (), "Frames of the result of `frames`, in its order."),
        Words("TIPS", robot.tips if robot.is_tree else (), "Tips of the tree, in the order of the results."),
        Words("PARAMETERS", varied_names(kernels), "Columns of `parameter_jacobian`, in its order."),
        Words("ACTUATORS", actuator_names(kernels), "Names of the actuators, in the order of their vector."),
    )
    return tuple(table for table in tables if table.values)


def _toml(text: str) -> str:
    """A string of TOML."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007F")
