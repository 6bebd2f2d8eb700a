"""WebAssembly: the C of the batches, the command that compiles it, and a module that takes it or falls back.

The compiled file is made by `npm run wasm`, or by the proof: what is written here is text, the same on every machine.
"""

from __future__ import annotations

import json

from kinegen.backends.bundle import RobotPrograms, provenance
from kinegen.backends.c.arguments import batch_arguments, computed, given, number_type
from kinegen.backends.c.batch import TILE_BYTES, emit_batch
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import rendered
from kinegen.ir.program import Program
from kinegen.model.outputs import Array
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import c_file, function, params_type, wasm_function

FOLDER = "wasm"
"""Where the C files are in the package."""

FLAGS = (
    "--target=wasm32 -Os -msimd128 -ffreestanding -nostdlib -ffp-contract=off -std=c99 -Wl,--no-entry -Wl,--strip-all"
    " -Wl,--stack-first"
)
"""With `-O2` clang unrolls every loop over a tile: twice the size for a pose, and no faster. With `-Oz` it makes no
vectors, and a pose takes twice the time."""

_TEMPLATES = (("", "js"), ("", "d.ts"), (f"{FOLDER}/", "c"))

_MOST_CALLS = 1
"""Sines and cosines that are calls of their own. Each would be a copy of the routine, 350 bytes; a loop is as fast."""

_NO_SLP = "-fno-slp-vectorize"
"""For inverses with a redundancy: clang 14 looks for vectors among the statements of the arm angle without an end. The
loop over a tile becomes vectors all the same."""

MOST_RESULTS = 1000
"""The most numbers of one configuration. clang compares every store of a loop with every other one, so the Hessian of a
hand, 8,670 numbers, takes it five minutes; with this many it is seconds."""

_PAGE = 65536
"""Bytes of a page of memory; what is not the kernel's own, such as copies of registers, fits in one too."""


@dataclass(frozen=True, slots=True)
class WasmFunction:
    """Holds one function that the compiled file has.

    Attributes:
        output: Its name in JavaScript, without `_batch`.
        shape: Its name in C and the numbers of its arrays, as a literal.
        values: What is passed for the arguments of the batch kernel.
    """

    output: str
    shape: str
    name: str
    arguments: str
    batch: str
    batch_arguments: str
    values: str


@dataclass(frozen=True, slots=True)
class WasmContext:
    """Holds what the templates `javascript/wasm.js.jinja` and `javascript/wasm.c.jinja` are given."""

    name: str
    provenance: str
    header: str
    batch: str
    functions: tuple[WasmFunction, ...]
    parameters: tuple[str, ...]
    parameter_bytes: int


def batched(kernels: RobotPrograms) -> tuple[Program, ...]:
    """Returns the programs that have batches in WebAssembly: with batches in C, and at most `MOST_RESULTS` results."""
    batches = (program for program in kernels.programs if given(program) and computed(program))
    return tuple(program for program in batches if sum(map(_numbers, program.signature.results)) <= MOST_RESULTS)


def emit_wasm(kernels: RobotPrograms) -> dict[str, str]:
    """Prints the C files and the module, by path; nothing where no function has a batch."""
    programs, robot = batched(kernels), kernels.robot
    if not programs:
        return {}
    # Kernels without batches would be dead code in the compiled file.
    alone = RobotPrograms(robot, programs, kernels.defaults)
    names = (c_file(robot.name, "h"), c_file(robot.name, "h", batch=True), c_file(robot.name, "c", batch=True))
    sources = emit_kernel(alone, ScalarType.DOUBLE) | emit_batch(alone, ScalarType.DOUBLE, most_calls=_MOST_CALLS)
    context = WasmContext(
        name=robot.name,
        provenance=provenance(robot),
        header=names[0],
        batch=names[2],
        functions=tuple(_function(kernels, program) for program in programs),
        parameters=tuple(parameter.name for parameter in robot.runtime_parameters),
        parameter_bytes=8 * len(robot.runtime_parameters),
    )
    stem = f"{robot.name}_wasm"
    templates = {f"{folder}{stem}.{end}": f"javascript/wasm.{end}" for folder, end in _TEMPLATES}
    return rendered(templates, k=context) | {f"{FOLDER}/{name}": sources[name] for name in names}


def compile_command(kernels: RobotPrograms) -> str:
    """Returns the command that compiles the C files, in the folder of the package."""
    robot = kernels.robot.name
    exported = [wasm_function(robot, program.quantity.function) for program in batched(kernels)]
    exports = " ".join(f"-Wl,--export={name}" for name in ("__heap_base", *exported))
    stack = f"-Wl,-z,stack-size={_stack(batched(kernels))}"
    flags = f"{FLAGS} {_NO_SLP}" if kernels.robot.redundancy else FLAGS
    return f"clang {flags} {stack} {exports} -o {robot}.wasm {FOLDER}/{robot}_wasm.c"


def _stack(programs: tuple[Program, ...]) -> int:
    """Sizes the stack, in bytes of whole pages.

    A tile of each input, result and statement of the longest kernel fits, and a page. The linker's own choice is one
    page, and what runs over it is lost or spoils the constants.
    """
    arrays = ((*program.signature.inputs, *program.signature.results) for program in programs)
    numbers = [sum(map(_numbers, each)) for each in arrays]
    longest = max(count + len(program.statements) for count, program in zip(numbers, programs, strict=True))
    return _PAGE * (1 + -(-TILE_BYTES * longest // _PAGE))


def _function(kernels: RobotPrograms, program: Program) -> WasmFunction:
    real, signature = str(ScalarType.DOUBLE), program.signature
    params = params_type(kernels.robot.name) if kernels.robot.runtime_parameters else ""
    arguments, values = ["size_t n"], ["n"]
    # Arrays lie without gaps; those without numbers are not passed.
    for array in signature.inputs:
        arguments += [f"const {real} *{array.name}"] * bool(_numbers(array))
        values += [array.name, f"{_numbers(array)}", "1"] if _numbers(array) else ["NULL", "0", "0"]
    arguments += [f"const {params} *params"] * bool(params)
    values += ["params", "0"] * bool(params)
    for array in signature.results:
        arguments += [f"{number_type(array, real)} *{array.name}"] * bool(_numbers(array))
        values += [array.name if _numbers(array) else "NULL", f"{_numbers(array)}"]
    return WasmFunction(
        output=program.quantity.function,
        shape=_shape(kernels, program),
        name=wasm_function(kernels.robot.name, program.quantity.function),
        arguments=", ".join(arguments),
        batch=function(kernels.robot.name, program.quantity.function, batch=True),
        batch_arguments=", ".join(batch_arguments(signature.inputs, signature.results, real, params)),
        values=", ".join([*values, "0"]),
    )


def _shape(kernels: RobotPrograms, program: Program) -> str:
    """Returns the function in C and the numbers of its arrays, as a literal; a truth value is a byte."""
    inputs, results = program.signature.inputs, program.signature.results
    shape = {
        "c": wasm_function(kernels.robot.name, program.quantity.function),
        "inputs": [_numbers(each) for each in inputs],
        "results": [_numbers(each) for each in results],
        "flags": [each.is_truth for each in results],
    }
    return json.dumps(shape)


def _numbers(array: Array) -> int:
    return array.blocks * array.stored
