"""The files of the package folder: `+puma560/fk.m` and its neighbours."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
from fractions import Fraction

from kinegen.emit.accuracy import accuracy_lines
from kinegen.emit.actuators import actuator_lines, actuator_names
from kinegen.emit.c.nearest import nearest_of
from kinegen.emit.columns import varied_names
from kinegen.emit.environment import environment
from kinegen.emit.functions import uses
from kinegen.emit.inverse import branches_of
from kinegen.emit.kernels import Kernels, joint_lines, parameter_lines, provenance
from kinegen.emit.limits import joint_limits, limit_literals
from kinegen.emit.matlab.functions import Function, function_of
from kinegen.emit.matlab.gateway import emit_gateway
from kinegen.emit.matlab.nearest import Choice, choice_of
from kinegen.emit.matlab.syntax import CLASS, WIDTH, matlab_text, number
from kinegen.emit.reals import Real
from kinegen.emit.sincos import SINCOS
from kinegen.emit.words import frames_text, subject
from kinegen.ir.program import Operator
from kinegen.naming import comment_text
from kinegen.outputs import Kind
from kinegen.robot.model import Robot


@dataclass(frozen=True, slots=True)
class Bounds:
    """The limits of the joints in one number type: its name, and columns as text."""

    kind: str
    low: str
    high: str


@dataclass(frozen=True, slots=True)
class PackageContext:
    """What the templates of `matlab/` are given."""

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
    bounds: tuple[Bounds, ...]
    functions: tuple[Function, ...]
    others: tuple[tuple[str, str], ...]
    nearest: Choice | None


def emit_matlab(kernels: Kernels) -> dict[str, str]:
    """Print the package.

    Args:
        kernels: The robot and its programs.

    Returns:
        Text by path.
    """
    context = package_context(kernels)
    names = ["Contents", "info", "within_limits", "clamp"]
    names += ["default_params"] * bool(context.parameters) + ["inverse_nearest"] * (context.nearest is not None)
    files = {name: environment().get_template(f"matlab/{name}.m.jinja").render(k=context) for name in names}
    template = environment().get_template("matlab/function.m.jinja")
    files |= {function.name: template.render(k=context, f=function) for function in context.functions}
    return {f"+{kernels.robot.name}/{name}.m": text for name, text in files.items()} | emit_gateway(kernels)


def package_context(kernels: Kernels) -> PackageContext:
    """Everything the templates lay out, as finished text."""
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
            (parameter.name, Real.DOUBLE.literal(value))
            for parameter, value in zip(robot.runtime_parameters, kernels.defaults, strict=True)
        ),
        bounds=tuple(_bounds(robot, real) for real in Real),
        functions=tuple(function_of(kernels, program) for program in programs),
        others=_others(kernels),
        nearest=choice_of(kernels),
    )


def _manual(kernels: Kernels) -> tuple[str, ...]:
    """What holds for every function, as paragraphs in lines."""
    every = (
        "Each column is a configuration, and results have the configurations in their last dimension. Joint limits are "
        "not checked. The results have the bits of the C kernels compiled without contraction."
    )
    paragraphs = [every]
    if uses(kernels.programs, Operator.SINCOS):
        double, single = (SINCOS[real].accuracy for real in Real)
        paragraphs.append(
            f"Sines and cosines are evaluated {double}, of singles {single}; an angle beyond that, a NaN or an "
            "infinity makes every output that depends on it NaN."
        )
    paragraphs.append(matlab_text(" ".join(accuracy_lines(kernels, "this package"))))
    lines: list[str] = []
    for text in filter(None, paragraphs):
        lines += ["", *textwrap.wrap(text, WIDTH, break_long_words=False, break_on_hyphens=False)]
    return tuple(lines[1:])


def _tables(kernels: Kernels) -> tuple[tuple[str, str, str], ...]:
    """What the package says of the robot: names, values and meanings."""
    robot, branches = kernels.robot, branches_of(kernels)
    limits = "; ".join(
        "-Inf, Inf" if each is None else ", ".join(Real.DOUBLE.literal(Fraction(end)) for end in each)
        for each in joint_limits(robot, Real.DOUBLE)
    )
    has_frames = any(program.quantity.kind is Kind.FRAMES for program in kernels.programs)
    names: tuple[tuple[str, tuple[str, ...], str], ...] = (
        ("JOINTS", tuple(variable.name for variable in robot.variables), "names of the joints, in the order of q"),
        ("FRAMES", robot.frame_names if has_frames else (), "frames of the result of frames, in its order"),
        ("TIPS", robot.tips if robot.is_tree else (), "tips of the tree, in the order of the results"),
        ("BRANCHES", branches.names if branches else (), "solutions of inverse, in its order"),
        ("PARAMETERS", varied_names(kernels), "columns of parameter_jacobian, in its order"),
        ("ACTUATORS", actuator_names(kernels), "names of the actuators, in the order of their vector"),
    )
    meaning = f"lower and upper limit of each joint in rad or {robot.units.length}, rounded outwards"
    return (
        ("MODEL", f"'{robot.digest}'", "digest of the robot; the headers in C have the same"),
        ("DOF", str(robot.dof), "length of the joint vector"),
        ("LIMITS", f"[{limits}]" if robot.dof else "zeros(0, 2)", f"{meaning}; infinite without"),
        *((name, _cell(words), text) for name, words, text in names if words or name == "JOINTS"),
    )


def _cell(words: tuple[str, ...]) -> str:
    """A row of texts, as a cell that `struct` keeps whole; a quote is doubled."""
    quoted = (word.replace("'", "''") for word in words)
    return "{" + ", ".join(f"'{word}'" for word in quoted) + "}" if words else "cell(1, 0)"


def _bounds(robot: Robot, real: Real) -> Bounds:
    low, high = (
        "; ".join(number(real, pair[side]) for pair in limit_literals(robot, real)) or "zeros(0, 1)" for side in (0, 1)
    )
    return Bounds(CLASS[real], f"[{low}]", f"[{high}]")


def _others(kernels: Kernels) -> tuple[tuple[str, str], ...]:
    """The functions beside the kernels, with what they do."""
    found = [
        ("info", "Names, limits and digest of the robot."),
        ("within_limits", "Whether every joint is at its limits or between them."),
        ("clamp", "The joint vector within the limits that is nearest to another one."),
    ]
    found += [("default_params", "Runtime parameters with the values of the robot file.")] * bool(kernels.defaults)
    has_choice = nearest_of(kernels, Real.DOUBLE) is not None
    return (*found, *[("inverse_nearest", "The solution of inverse that is nearest to a joint vector.")] * has_choice)
