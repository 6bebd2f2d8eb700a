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
from kinegen.emit.inverse import branches_of
from kinegen.emit.javascript.angles import most_angles, sincos_lines
from kinegen.emit.javascript.functions import LINE, Function, function_of
from kinegen.emit.javascript.syntax import SYNTAX
from kinegen.emit.javascript.wasm import batched, compile_command, emit_wasm
from kinegen.emit.kernels import Kernels, joint_lines, parameter_lines, provenance
from kinegen.emit.limits import joint_limits
from kinegen.emit.reals import Real
from kinegen.emit.routines import CODE, block_comment, routine_lines
from kinegen.emit.sincos import SINCOS
from kinegen.emit.words import frames_text, subject
from kinegen.ir.program import Operator
from kinegen.naming import comment_text, module_file
from kinegen.outputs import Kind

_SINCOS = (
    f"Sines and cosines are evaluated {SINCOS[Real.DOUBLE].accuracy}; an angle beyond that, a NaN or an infinity makes "
    "every output that depends on it NaN."
)


@dataclass(frozen=True, slots=True)
class Table:
    """What the module says of the robot under a name."""

    name: str
    kind: str
    value: str
    meaning: str


@dataclass(frozen=True, slots=True)
class ModuleContext:
    """What the templates of `javascript/` are given."""

    module: str
    types: str
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
    tables: tuple[Table, ...]
    parameters: tuple[tuple[str, str], ...]
    sincos_lines: tuple[str, ...]
    angles: int
    sincos: tuple[str, ...]
    sqrt: bool
    atan2: tuple[str, ...]
    is_batched: bool
    functions: tuple[Function, ...]


def emit_javascript(kernels: Kernels) -> dict[str, str]:
    """Print the module, its type declarations and its description for package managers.

    Args:
        kernels: The robot and its programs.

    Returns:
        Text by file name.
    """
    context = module_context(kernels)
    templates = ((context.module, "javascript/module.js.jinja"), (context.types, "javascript/module.d.ts.jinja"))
    files = {file: environment().get_template(template).render(k=context) for file, template in templates}
    return files | {"package.json": _package(kernels)} | emit_wasm(kernels)


def _package(kernels: Kernels) -> str:
    """The description of the folder as a package; names of packages there have no capital letters."""
    robot, has_wasm = kernels.robot, bool(batched(kernels))
    name, module, types = robot.name, module_file(robot.name, "js"), module_file(robot.name, "d.ts")
    wasm = {"./wasm": {"types": f"./{name}_wasm.d.ts", "default": f"./{name}_wasm.js"}} if has_wasm else {}
    compiled = [f"{name}_wasm.js", f"{name}_wasm.d.ts", f"{name}.wasm"] if has_wasm else []
    scripts = {"wasm": compile_command(kernels)} if has_wasm else {}
    document = {
        "name": name.lower(),
        "version": robot.release,
        "description": robot.description or f"Kinematics of {name}",
        "license": "0BSD",
        "type": "module",
        "sideEffects": False,
        "exports": {".": {"types": f"./{types}", "default": f"./{module}"}, **wasm},
        "types": f"./{types}",
        "files": [module, types, *compiled],
        "scripts": {**scripts, "test": "node --test"},
    }
    return json.dumps(document, indent=2, ensure_ascii=True) + "\n"


def module_context(kernels: Kernels) -> ModuleContext:
    """Everything the templates lay out, as finished text."""
    robot, programs = kernels.robot, kernels.programs
    functions = tuple(function_of(kernels, program) for program in programs)
    return ModuleContext(
        module=module_file(robot.name, "js"),
        types=module_file(robot.name, "d.ts"),
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
        tables=_tables(kernels),
        parameters=tuple(
            (parameter.name, Real.DOUBLE.literal(value))
            for parameter, value in zip(robot.runtime_parameters, kernels.defaults, strict=True)
        ),
        sincos_lines=tuple(textwrap.wrap(_SINCOS, LINE)) if uses(programs, Operator.SINCOS) else (),
        angles=most_angles(programs),
        sincos=sincos_lines(),
        sqrt=uses(programs, Operator.SQRT),
        atan2=_atan2() if uses(programs, Operator.ATAN2) else (),
        is_batched=any(function.batch for function in functions),
        functions=functions,
    )


def _atan2() -> tuple[str, ...]:
    """The body of the function for the angle of a point."""
    routine = CODE[Real.DOUBLE][Operator.ATAN2]
    return routine_lines(routine, SYNTAX, comment=block_comment, store="return {value};", places=("",))


def _tables(kernels: Kernels) -> tuple[Table, ...]:
    """What the module says of the robot."""
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
        Table("LIMITS", "readonly (readonly [number, number] | null)[]", f"Object.freeze([{limits}])", bounds),
        *(
            Table(name, "readonly string[]", f"Object.freeze({json.dumps(list(words))})", meaning)
            for name, words, meaning in names
            if words or name == "JOINTS"
        ),
    )


def _number(value: float) -> str:
    return Real.DOUBLE.literal(Fraction(value))
