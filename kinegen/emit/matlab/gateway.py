"""The MEX file: the batches of C, in which matrices are laid out as MATLAB has them, and what calls them.

Results are written where MATLAB keeps them: the kernels have the statements of the C files, and their numbers in
another order, so nothing is turned or copied.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction

from kinegen.emit.c.arguments import computed, given
from kinegen.emit.c.batch import emit_batch
from kinegen.emit.c.kernel import emit_kernel
from kinegen.emit.environment import environment
from kinegen.emit.kernels import Kernels, provenance
from kinegen.emit.matlab.columns import extents, last_rows, places, size
from kinegen.emit.reals import Real
from kinegen.ir.program import Constant, Operand, Program, Statement, Variable
from kinegen.naming import c_file, function, params_type
from kinegen.outputs import Array

FOLDER = "csrc"
"""Where the C files are."""

MOST_RESULTS = 1000
"""The most numbers of one configuration, as in WebAssembly: compilers take minutes for loops with more stores."""


@dataclass(frozen=True, slots=True)
class Shaped:
    """An array of a function: its name, the numbers of one configuration, its dimensions, whether it holds flags."""

    name: str
    size: int
    dimensions: str
    rank: int
    is_truth: bool


@dataclass(frozen=True, slots=True)
class Called:
    """One function: its name, and its arrays."""

    name: str
    inputs: tuple[Shaped, ...]
    results: tuple[Shaped, ...]


@dataclass(frozen=True, slots=True)
class Typed:
    """One number type.

    Attributes:
        real: Its name in C.
        kind: Its name in C where it is part of a name: `double` or `single`.
        header: The header of the batches.
        prefix: What the names of its functions begin with.
        params: The type of the runtime parameters; empty where there are none.
        defaults: The values of the robot file.
    """

    real: str
    kind: str
    header: str
    prefix: str
    params: str
    defaults: str


@dataclass(frozen=True, slots=True)
class GatewayContext:
    """What the templates `matlab/gateway.c.jinja` and `matlab/build_mex.m.jinja` are given."""

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
    """The function that the MEX file is."""
    return f"{robot}_mex"


def batched(kernels: Kernels) -> tuple[Program, ...]:
    """The programs that are part of the MEX file: those with batches in C and at most `MOST_RESULTS` results."""
    batches = (program for program in kernels.programs if given(program) and computed(program))
    return tuple(program for program in batches if sum(map(size, program.signature.results)) <= MOST_RESULTS)


def emit_gateway(kernels: Kernels) -> dict[str, str]:
    """Print the C files, and the function that compiles them; nothing where no function has a batch."""
    programs, robot = batched(kernels), kernels.robot
    if not programs:
        return {}
    name = gateway_name(robot.name)
    own = Kernels(replace(robot, name=name), tuple(map(columnwise, programs)), kernels.defaults)
    files: dict[str, str] = {}
    for real in Real:
        sources = emit_kernel(own, real) | emit_batch(own, real, turns_numbers=True)
        names = (c_file(name, "h", real), *(c_file(name, suffix, real, batch=True) for suffix in "hc"))
        files |= {f"{FOLDER}/{file}": sources[file] for file in names}
    context = GatewayContext(
        robot=robot.name,
        name=name,
        provenance=provenance(robot),
        functions=tuple(_called(program) for program in programs),
        types=tuple(_typed(kernels, real) for real in Real),
        parameters=tuple(parameter.name for parameter in robot.runtime_parameters),
        sources=(f"{name}.c", *(path for path in files if path.endswith(".c"))),
        most_inputs=max(len(program.signature.inputs) for program in programs),
        most_results=max(len(program.signature.results) for program in programs),
    )
    for path, template in ((f"{name}.c", "gateway.c"), ("build_mex.m", "build_mex.m")):
        files[path] = environment().get_template(f"matlab/{template}.jinja").render(k=context)
    return files


def _called(program: Program) -> Called:
    inputs, results = (tuple(map(_shaped, arrays)) for arrays in (program.signature.inputs, program.signature.results))
    return Called(program.quantity.function, inputs, results)


def _shaped(array: Array) -> Shaped:
    own = extents(array)
    return Shaped(array.name, size(array), ", ".join(map(str, own)), len(own), array.is_truth)


def _typed(kernels: Kernels, real: Real) -> Typed:
    name = gateway_name(kernels.robot.name)
    return Typed(
        real=real.value,
        kind="double" if real is Real.DOUBLE else "single",
        header=f"{FOLDER}/{c_file(name, 'h', real, batch=True)}",
        prefix=function(name, "", real),
        params=params_type(name, real) if kernels.robot.runtime_parameters else "",
        defaults=", ".join(real.literal(value) for value in kernels.defaults),
    )


def columnwise(program: Program) -> Program:
    """A program with the numbers of its arrays in the order of MATLAB, last rows of matrices among them."""
    signature = program.signature
    moved = tuple(_variables(signature.inputs))

    def operand(each: Operand) -> Operand:
        return Variable(moved[each.index]) if isinstance(each, Variable) else each

    statements = tuple(
        Statement(each.results, each.operator, tuple(map(operand, each.operands))) for each in program.statements
    )
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
    """An array of numbers without matrices."""
    return Array(array.name, (size(array),), is_truth=array.is_truth)


def _variables(inputs: tuple[Array, ...]) -> Iterator[int]:
    """The new place of each number that is read."""
    first = 0
    for array in inputs:
        yield from (first + place for place in places(array))
        first += size(array)


def _ordered(results: tuple[Array, ...], outputs: list[Operand]) -> Iterator[Operand]:
    """The numbers of the results in their new order."""
    for array in results:
        own: dict[int, Operand] = {place: Constant(Fraction(value)) for place, value in last_rows(array)}
        own |= {place: outputs.pop(0) for place in places(array)}
        yield from (own[place] for place in range(size(array)))
