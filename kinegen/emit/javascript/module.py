"""The files of the JavaScript form: `puma560.js`, `puma560.d.ts` and the `package.json` that makes them a package."""

from __future__ import annotations

import json
import textwrap
from dataclasses import dataclass
from fractions import Fraction

from kinegen.emit.actuators import actuator_lines, actuator_names
from kinegen.emit.columns import varied_names
from kinegen.emit.environment import environment
from kinegen.emit.functions import uses
from kinegen.emit.inverse import branch_lines, branches_of
from kinegen.emit.javascript.syntax import SYNTAX
from kinegen.emit.kernels import Kernels, joint_lines, operation_line, parameter_lines, provenance
from kinegen.emit.limits import joint_limits
from kinegen.emit.printing import Printer
from kinegen.emit.reals import Real
from kinegen.emit.sincos import SINCOS
from kinegen.emit.words import brief, frames_text, input_text, result_text, subject
from kinegen.ir.program import Constant, Operator, Program
from kinegen.naming import comment_text
from kinegen.outputs import Array, Kind
from kinegen.robot.model import Robot

LINE = 116
"""Characters of a line of a comment, without the asterisk before it."""

_SINCOS = (
    f"Sines and cosines are evaluated {SINCOS[Real.DOUBLE].accuracy}; an angle beyond that, a NaN or an infinity makes "
    "every output that depends on it NaN."
)


@dataclass(frozen=True, slots=True)
class Argument:
    """An input or a result of a function.

    Attributes:
        name: Its name.
        size: Numbers of one configuration.
        text: What it holds.
        kind: The typed array that is made for it, or that a caller passes.
    """

    name: str
    size: int
    text: str
    kind: str


@dataclass(frozen=True, slots=True)
class Function:
    """One kernel, printed.

    Attributes:
        name: Its name; that of many configurations ends in `_batch`.
        heading: What it computes, and what a call costs, as lines of a comment.
        inputs: Its inputs.
        results: Its results.
        body: Statements.
        is_batched: Whether there are inputs, and so batches of them.
    """

    name: str
    heading: tuple[str, ...]
    inputs: tuple[Argument, ...]
    results: tuple[Argument, ...]
    body: tuple[str, ...]
    is_batched: bool


@dataclass(frozen=True, slots=True)
class ModuleContext:
    """What the templates of `javascript/` are given."""

    robot: str
    title: str
    description: str
    provenance: str
    frames_text: tuple[str, ...]
    length: str
    joints: tuple[str, ...]
    actuator_lines: tuple[str, ...]
    parameter_lines: tuple[str, ...]
    model: str
    dof: int
    constants: tuple[tuple[str, str, str, str], ...]
    parameters: tuple[tuple[str, str], ...]
    sincos: bool
    sincos_lines: tuple[str, ...]
    sqrt: bool
    atan2: bool
    functions: tuple[Function, ...]


def emit_javascript(kernels: Kernels) -> dict[str, str]:
    """Print the module, its type declarations and its description for package managers.

    Args:
        kernels: The robot and its programs.

    Returns:
        Text by file name.
    """
    name, context = kernels.robot.name, module_context(kernels)
    templates = ((f"{name}.js", "javascript/module.js.jinja"), (f"{name}.d.ts", "javascript/module.d.ts.jinja"))
    files = {file: environment().get_template(template).render(k=context) for file, template in templates}
    return files | {"package.json": _package(kernels.robot)}


def _package(robot: Robot) -> str:
    """The description of the folder as a package; names of packages there have no capital letters."""
    name = robot.name
    document = {
        "name": name.lower(),
        "version": robot.release,
        "description": robot.description or f"Kinematics of {name}",
        "license": "0BSD",
        "type": "module",
        "sideEffects": False,
        "exports": {".": {"types": f"./{name}.d.ts", "default": f"./{name}.js"}},
        "types": f"./{name}.d.ts",
        "files": [f"{name}.js", f"{name}.d.ts"],
    }
    return json.dumps(document, indent=2, ensure_ascii=True) + "\n"


def module_context(kernels: Kernels) -> ModuleContext:
    """Everything the templates lay out, as finished text."""
    robot, programs = kernels.robot, kernels.programs
    return ModuleContext(
        robot=robot.name,
        title=f"{subject(program.quantity for program in programs)} of {robot.name}",
        description=comment_text(robot.description),
        provenance=provenance(robot),
        frames_text=tuple(textwrap.wrap(frames_text(robot.is_tree), LINE)),
        length=robot.units.length,
        joints=joint_lines(robot),
        actuator_lines=actuator_lines(kernels),
        parameter_lines=parameter_lines(robot),
        model=robot.digest,
        dof=robot.dof,
        constants=_constants(kernels),
        parameters=tuple(
            (parameter.name, Real.DOUBLE.literal(value))
            for parameter, value in zip(robot.runtime_parameters, kernels.defaults, strict=True)
        ),
        sincos=uses(programs, Operator.SIN, Operator.COS),
        sincos_lines=tuple(textwrap.wrap(_SINCOS, LINE)),
        sqrt=uses(programs, Operator.SQRT),
        atan2=uses(programs, Operator.ATAN2),
        functions=tuple(_function(kernels, program) for program in programs),
    )


def _constants(kernels: Kernels) -> tuple[tuple[str, str, str, str], ...]:
    """Name, type, value and meaning of what the module says of the robot."""
    robot = kernels.robot
    limits = ", ".join(
        "null" if each is None else f"Object.freeze([{', '.join(_number(end) for end in each)}])"
        for each in joint_limits(robot, Real.DOUBLE)
    )
    branches = branches_of(kernels)
    has_frames = any(program.quantity.kind is Kind.FRAMES for program in kernels.programs)
    names: tuple[tuple[str, tuple[str, ...], str], ...] = (
        ("JOINTS", tuple(variable.name for variable in robot.variables), "Names of the joints, in the order of q."),
        ("FRAMES", robot.frame_names if has_frames else (), "Frames of the result of frames, in its order."),
        ("TIPS", robot.tips if robot.is_tree else (), "Tips of the tree, in the order of the results."),
        ("BRANCHES", branches.names if branches else (), "Solutions of inverse, in its order."),
        ("PARAMETERS", varied_names(kernels), "Columns of parameter_jacobian, in its order."),
        ("ACTUATORS", actuator_names(kernels), "Names of the actuators, in the order of their vector."),
    )
    bounds = f"Lower and upper limit of each joint in rad or {robot.units.length}, rounded outwards; null without."
    return (
        ("LIMITS", "readonly (readonly [number, number] | null)[]", f"Object.freeze([{limits}])", bounds),
        *(
            (name, "readonly string[]", f"Object.freeze({json.dumps(list(words))})", meaning)
            for name, words, meaning in names
            if words or name == "JOINTS"
        ),
    )


def _number(value: float) -> str:
    return Real.DOUBLE.literal(Fraction(value))


def _function(kernels: Kernels, program: Program) -> Function:
    branches = branches_of(kernels) if program.quantity.kind is Kind.INVERSE else None
    sentences = f"{brief(program.signature)} Costs {operation_line(program)}."
    notes = () if branches is None else branch_lines(branches, LINE, (Real.DOUBLE,))
    inputs = tuple(Argument(each.name, _stored(each), input_text(each), "") for each in program.signature.inputs)
    return Function(
        name=program.quantity.function,
        heading=(*textwrap.wrap(sentences, LINE, break_on_hyphens=False), *notes),
        inputs=inputs,
        results=tuple(
            Argument(each.name, _stored(each), _meaning(program, each), _kind(each))
            for each in program.signature.results
        ),
        body=_body(program),
        is_batched=any(each.size for each in inputs),
    )


def _stored(array: Array) -> int:
    return array.blocks * array.stored


def _kind(array: Array) -> str:
    """Flags are whole numbers."""
    return "Uint8Array" if array.name == "valid" else "Float64Array"


def _meaning(program: Program, array: Array) -> str:
    order = "FRAMES" if program.quantity.kind is Kind.FRAMES else "TIPS"
    return f"{result_text(array)}{f', in the order of {order}' if array.per_frame else ''}"


def _body(program: Program) -> tuple[str, ...]:
    """The statements, and the constant last row of each matrix."""
    variables = [_entry(array.name, index) for array in program.signature.inputs for index in range(array.size)]
    printer = Printer(SYNTAX, variables)
    results = program.signature.results
    places = [
        _entry(array.name, block * array.stored + index)
        for array in results
        for block in range(array.blocks)
        for index in range(array.size // array.blocks)
    ]
    rows = [
        printer.assignment(_entry(array.name, block * array.stored + 12 + column), Constant(Fraction(value)))
        for array in results
        if array.is_pose
        for block in range(array.blocks)
        for column, value in enumerate((0, 0, 0, 1))
    ]
    return (*printer.lines(program, places), *rows)


def _entry(name: str, index: int) -> str:
    """A number of one configuration; where that begins is an argument."""
    return f"{name}[{name}_at + {index}]" if index else f"{name}[{name}_at]"
