"""The NumPy form of the programs: `_numpy.py`, with the temporaries of the C in the same order."""

from __future__ import annotations

from dataclasses import dataclass

from kinegen.emit.environment import environment
from kinegen.emit.functions import uses
from kinegen.emit.kernels import Kernels, provenance
from kinegen.emit.python.syntax import SYNTAX, broken, hash_comment, numpy_printer, typed
from kinegen.emit.reals import Real
from kinegen.emit.routines import CODE, routine_lines
from kinegen.emit.sections import sections
from kinegen.emit.words import brief, input_text, summary
from kinegen.ir.program import Operator, Program, Temporary

_BRIEFS = {
    Operator.SINCOS: "Sine and cosine with the operations and the bits of the C kernels in {real}.",
    Operator.ATAN2: "The angle of a point with the bits of the C kernels in {real}.",
}


@dataclass(frozen=True, slots=True)
class Formula:
    """One program as a Python function.

    Attributes:
        name: Its name.
        brief: What it computes, in paragraphs.
        inputs: Its arguments, each with what it holds.
        body: Statements.
        results: Lines of the returned tuple.
        unused: Arguments that the body does not read.
        reads_parameters: Whether it reads runtime parameters.
        asks_type: Whether a tolerance in it depends on the number type.
    """

    name: str
    brief: tuple[str, ...]
    inputs: tuple[tuple[str, str], ...]
    body: tuple[str, ...]
    results: tuple[str, ...]
    unused: tuple[str, ...]
    reads_parameters: bool
    asks_type: bool


@dataclass(frozen=True, slots=True)
class FormulaRoutine:
    """A function that formulas call, with the bits of C.

    Attributes:
        name: Its name.
        arguments: Its arguments with their types.
        kind: The type of what it returns.
        brief: What it computes.
        lines: Statements.
        returned: What it returns.
    """

    name: str
    arguments: str
    kind: str
    brief: str
    lines: tuple[str, ...]
    returned: str


@dataclass(frozen=True, slots=True)
class FormulaContext:
    """What the template `python/_numpy.py.jinja` is given."""

    robot: str
    provenance: str
    parameters: bool
    sincos: bool
    sqrt: bool
    atan2: bool
    routines: tuple[FormulaRoutine, ...]
    formulas: tuple[Formula, ...]


def emit_formula(kernels: Kernels) -> dict[str, str]:
    """Print the NumPy form.

    Args:
        kernels: The robot and its programs.

    Returns:
        The module, by file name.
    """
    formulas = tuple(_formula(kernels, program) for program in kernels.programs)
    context = FormulaContext(
        robot=kernels.robot.name,
        provenance=provenance(kernels.robot),
        parameters=bool(kernels.defaults),
        sincos=uses(kernels.programs, Operator.SINCOS),
        sqrt=uses(kernels.programs, Operator.SQRT),
        atan2=uses(kernels.programs, Operator.ATAN2),
        routines=tuple(
            _routine(operator, real) for operator in _BRIEFS if uses(kernels.programs, operator) for real in Real
        ),
        formulas=formulas,
    )
    return {"_numpy.py": environment().get_template("python/_numpy.py.jinja").render(k=context)}


def _routine(operator: Operator, real: Real) -> FormulaRoutine:
    """One function for one number type."""
    routine = CODE[real][operator]
    returned = [printed.name for printed in routine.outputs if isinstance(printed, Temporary)]
    return FormulaRoutine(
        name=f"_{routine.name}_{real}",
        arguments=", ".join(f"{name}: Floats" for name in routine.inputs),
        kind="Floats" if len(returned) == 1 else f"tuple[{', '.join(['Floats'] * len(returned))}]",
        brief=_BRIEFS[operator].format(real=real),
        lines=routine_lines(routine, SYNTAX, comment=hash_comment, revise=typed),
        returned=", ".join(returned),
    )


def _formula(kernels: Kernels, program: Program) -> Formula:
    printer = numpy_printer(
        [f"{array.name}[{index}]" for array in program.signature.inputs for index in range(array.size)]
    )
    reads_parameters = program.reads_parameters
    inputs = program.signature.inputs
    # The first input has the number type of the parameters.
    typed = inputs[:1] if reads_parameters else ()
    unused = [array.name for array in inputs if array not in typed and not program.reads(array)]
    unused += ["params"] if kernels.defaults and not reads_parameters else []
    return Formula(
        name=program.quantity.function,
        brief=summary(brief(program.signature)),
        inputs=tuple((array.name, f"{input_text(array)} ({array.size}, N)") for array in program.signature.inputs),
        body=broken(printer.lines(program, [None] * len(program.outputs), sections(kernels.robot, program))),
        results=tuple(f"{printer.operand(operand)}," for operand in program.outputs),
        unused=tuple(unused),
        reads_parameters=reads_parameters,
        asks_type=program.asks_type,
    )
