"""The MEX file: the batches of C, in which matrices are laid out as MATLAB has them, and what calls them.

Results are written where MATLAB keeps them: the kernels have the statements of the C files, and their numbers in
another order, so nothing is turned or copied.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction

from kinegen.backends.bundle import RobotPrograms, provenance
from kinegen.backends.c.arguments import computed, given
from kinegen.backends.c.batch import emit_batch
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.matlab.syntax import extents, last_rows, places, size
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import rendered
from kinegen.ir.program import Constant, Operand, Program, Statement, Variable
from kinegen.model.outputs import Array
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import c_file, function, params_type

FOLDER = "csrc"
"""Where the C files are."""

MOST_RESULTS = 1000
"""The most numbers of one configuration, as in WebAssembly: compilers take minutes for loops with more stores."""


@dataclass(frozen=True, slots=True)
class Shaped:
    """Holds an array of a function: its name, numbers of a configuration, dimensions, and if it holds flags."""

    name: str
    size: int
    dimensions: str
    rank: int
    is_truth: bool


@dataclass(frozen=True, slots=True)
class Called:
    """Holds one function: its name, and its arrays."""

    name: str
    inputs: tuple[Shaped, ...]
    results: tuple[Shaped, ...]


@dataclass(frozen=True, slots=True)
class Typed:
    """Holds one number type; its kind is `double` or `single`, and the type of parameters is empty without any."""

    real: str
    kind: str
    header: str
    prefix: str
    params: str
    defaults: str


@dataclass(frozen=True, slots=True)
class GatewayContext:
    """Holds what the templates `matlab/gateway.c.jinja` and `matlab/build_mex.m.jinja` are given."""

    robot: str
    name: str
    provenance: str
    functions: tuple[Called, ...]
    types: tuple[Typed, ...]
    parameters: tuple[str, ...]
    sources: tuple[str, ...]
    most_inputs: int
    most_results: int


def gateway_name(robot: str) -> str:
    """Returns the function that the MEX file is."""
    return f"{robot}_mex"


def batched(kernels: RobotPrograms) -> tuple[Program, ...]:
    """Returns the programs that are part of the MEX file: with batches in C, and at most `MOST_RESULTS` results."""
    batches = (program for program in kernels.programs if given(program) and computed(program))
    return tuple(program for program in batches if sum(map(size, program.signature.results)) <= MOST_RESULTS)


def emit_gateway(kernels: RobotPrograms) -> dict[str, str]:
    """Print the C files, and the function that compiles them; nothing where no function has a batch."""
    programs, robot = batched(kernels), kernels.robot
    if not programs:
        return {}
    name = gateway_name(robot.name)
    own = RobotPrograms(replace(robot, name=name), tuple(map(columnwise, programs)), kernels.defaults)
    files: dict[str, str] = {}
    for real in ScalarType:
        sources = emit_kernel(own, real) | emit_batch(own, real)
        names = (c_file(name, "h", real), *(c_file(name, suffix, real, batch=True) for suffix in "hc"))
        files |= {f"{FOLDER}/{file}": sources[file] for file in names}
    context = GatewayContext(
        robot=robot.name,
        name=name,
        provenance=provenance(robot),
        functions=tuple(_called(program) for program in programs),
        types=tuple(_typed(kernels, real) for real in ScalarType),
        parameters=tuple(parameter.name for parameter in robot.runtime_parameters),
        sources=(f"{name}.c", *(path for path in files if path.endswith(".c"))),
        most_inputs=max(len(program.signature.inputs) for program in programs),
        most_results=max(len(program.signature.results) for program in programs),
    )
    return files | rendered({f"{name}.c": "matlab/gateway.c", "build_mex.m": "matlab/build_mex.m"}, k=context)


def _called(program: Program) -> Called:
    inputs, results = (tuple(map(_shaped, arrays)) for arrays in (program.signature.inputs, program.signature.results))
    return Called(program.quantity.function, inputs, results)


def _shaped(array: Array) -> Shaped:
    own = extents(array)
    return Shaped(array.name, size(array), ", ".join(map(str, own)), len(own), array.is_truth)


def _typed(kernels: RobotPrograms, real: ScalarType) -> Typed:
    name = gateway_name(kernels.robot.name)
    return Typed(
        real=real.value,
        kind="double" if real is ScalarType.DOUBLE else "single",
        header=f"{FOLDER}/{c_file(name, 'h', real, batch=True)}",
        prefix=function(name, "", real),
        params=params_type(name, real) if kernels.robot.runtime_parameters else "",
        defaults=", ".join(real.literal(value) for value in kernels.defaults),
    )


def columnwise(program: Program) -> Program:
    """Returns a program with the numbers of its arrays in the order of MATLAB, last rows of matrices among them."""
    signature = program.signature
    moved = tuple(_variables(signature.inputs))

    def operand(each: Operand) -> Operand:
        return Variable(moved[each.index]) if isinstance(each, Variable) else each

    statements = tuple(
        Statement(each.results, each.operator, tuple(map(operand, each.operands))) for each in program.statements
    )
    # Results get their last rows here, as numbers.
    outputs = list(map(operand, program.outputs))
    return Program(
        signature=replace(
            signature,
            inputs=tuple(map(_plain, signature.inputs)),
            results=tuple(map(_plain, signature.results)),
            branches=None,
        ),
        parameters=program.parameters,
        angles=program.angles,
        statements=statements,
        outputs=tuple(_ordered(signature.results, outputs)),
    )


def _plain(array: Array) -> Array:
    return Array(array.name, (size(array),), is_truth=array.is_truth)


def _variables(inputs: tuple[Array, ...]) -> Iterator[int]:
    """Yields the new place of each number that is read."""
    first = 0
    for array in inputs:
        yield from (first + place for place in places(array))
        first += size(array)


def _ordered(results: tuple[Array, ...], outputs: list[Operand]) -> Iterator[Operand]:
    """Yields the numbers of the results in their new order."""
    for array in results:
        own: dict[int, Operand] = {place: Constant(Fraction(value)) for place, value in last_rows(array)}
        own |= {place: outputs.pop(0) for place in places(array)}
        yield from (own[place] for place in range(size(array)))
