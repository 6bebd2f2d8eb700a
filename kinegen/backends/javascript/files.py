"""The files of JavaScript: a module with its types, its tests, and what a package of npm needs."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Sequence
from fractions import Fraction

from kinegen.backends.accuracy import sincos_words
from kinegen.backends.bundle import RobotPrograms, joint_lines, parameter_lines, provenance
from kinegen.backends.c.kernel import name_lists
from kinegen.backends.c.test_vectors import Vectors, vector_tests
from kinegen.backends.descriptions import frames_text, subject
from kinegen.backends.javascript.functions import LINE, Function, function_of
from kinegen.backends.javascript.syntax import SYNTAX, most_angles, sincos_lines
from kinegen.backends.javascript.wasm import batched, compile_command, emit_wasm
from kinegen.backends.limits import actuator_limits, actuator_lines, joint_limits
from kinegen.backends.printing import CODE, block_comment, routine_lines
from kinegen.backends.routines import SINCOS, uses
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import rendered
from kinegen.ir.program import Operator
from kinegen.model.outputs import Array
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import comment_text, module_file

_RANGES = "readonly (readonly [number, number])[]"
_KNOWN = "Lowest and highest reading of each actuator, rounded outwards; the largest numbers where nothing is known."


@dataclass(frozen=True, slots=True)
class Table:
    """Holds what the module says of the robot under a name."""

    name: str
    kind: str
    value: str
    meaning: str


@dataclass(frozen=True, slots=True)
class ModuleContext:
    """Holds what the templates of `javascript/` are given."""

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


def emit_javascript(kernels: RobotPrograms) -> dict[str, str]:
    """Prints the module, its type declarations and its description for package managers."""
    context = module_context(kernels)
    files = rendered({context.module: "javascript/module.js", context.types: "javascript/module.d.ts"}, k=context)
    return files | {"package.json": _package(kernels)} | emit_wasm(kernels)


def _package(kernels: RobotPrograms) -> str:
    """Returns the description of the folder as a package; names of packages there have no capital letters."""
    robot, has_wasm = kernels.robot, bool(batched(kernels))
    name, module, types = robot.name, module_file(robot.name, "js"), module_file(robot.name, "d.ts")
    # What is not compiled is not exported.
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


def module_context(kernels: RobotPrograms) -> ModuleContext:
    """Returns everything the templates lay out, as finished text."""
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
            (parameter.name, ScalarType.DOUBLE.literal(value))
            for parameter, value in zip(robot.runtime_parameters, kernels.defaults, strict=True)
        ),
        sincos_lines=_pair_lines(robot) if uses(programs, Operator.SINCOS) else (),
        angles=most_angles(programs),
        sincos=sincos_lines(),
        sqrt=uses(programs, Operator.SQRT),
        atan2=_atan2() if uses(programs, Operator.ATAN2) else (),
        is_batched=any(function.batch for function in functions),
        functions=functions,
    )


def _pair_lines(robot: Robot) -> tuple[str, ...]:
    return tuple(textwrap.wrap(sincos_words(robot, SINCOS[ScalarType.DOUBLE].accuracy), LINE))


def _atan2() -> tuple[str, ...]:
    routine = CODE[ScalarType.DOUBLE][Operator.ATAN2]
    return routine_lines(routine, SYNTAX, comment=block_comment, store="return {value};", places=("",))


def _tables(kernels: RobotPrograms) -> tuple[Table, ...]:
    robot = kernels.robot
    limits = ", ".join(
        "null" if each is None else f"Object.freeze([{', '.join(_number(end) for end in each)}])"
        for each in joint_limits(robot, ScalarType.DOUBLE)
    )
    readings = actuator_limits(kernels, ScalarType.DOUBLE)
    ranges = ", ".join(f"Object.freeze([{_number(low)}, {_number(high)}])" for low, high in readings)
    bounds = f"Lower and upper limit of each joint in rad or {robot.units.length}, rounded outwards; null without."
    return (
        Table("LIMITS", "readonly (readonly [number, number] | null)[]", f"Object.freeze([{limits}])", bounds),
        *(
            Table(name, "readonly string[]", f"Object.freeze({json.dumps(list(words))})", meaning.replace("`", ""))
            for name, (words, meaning) in name_lists(kernels).items()
        ),
        *((Table("ACTUATOR_RANGES", _RANGES, f"Object.freeze([{ranges}])", _KNOWN),) * bool(ranges)),
    )


def _number(value: float) -> str:
    return ScalarType.DOUBLE.literal(Fraction(value))


def emit_javascript_tests(kernels: RobotPrograms, vectors: Vectors) -> dict[str, str]:
    """Print the tests, by the name of their file."""
    tests = vector_tests(kernels, vectors, (ScalarType.DOUBLE,), _numbers)
    return rendered({"test.mjs": "javascript/test.mjs"}, v=tests, has_wasm=bool(batched(kernels)))


def _numbers(_array: Array, entries: Sequence[Fraction]) -> str:
    return f"[{', '.join(map(ScalarType.DOUBLE.literal, entries))}]"
