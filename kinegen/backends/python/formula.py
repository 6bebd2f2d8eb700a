"""The NumPy form of the programs: its syntax, and `_numpy.py`, with the temporaries of the C in the same order."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import replace
from types import MappingProxyType

from kinegen.backends.bundle import RobotPrograms, provenance
from kinegen.backends.descriptions import brief, input_text, summary
from kinegen.backends.printing import CODE, Printer, Syntax, routine_lines
from kinegen.backends.routines import uses
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.sections import sections
from kinegen.backends.templates import environment
from kinegen.ir.program import Constant, Operator, Program, Statement, Temporary
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import python_identifier

_WIDTH = 112
"""Characters of a line of a comment, after its mark."""

_STATEMENT = 116
"""Characters of a statement, after its indentation."""


def _literal(constant: Constant) -> str:
    """Return a number that both types take, or one for each."""
    double, single = (ScalarType.DOUBLE.literal(constant.of(kind)) for kind in (False, True))
    text = double if constant.single is None else f"({single} if single else {double})"
    return text.replace("e+", "e")  # as formatters write it


def _pair(sine: str, cosine: str, angle: str) -> tuple[str, ...]:
    return (f"{sine}, {cosine} = _sincos({angle})",)


def _heading(title: str) -> tuple[str, ...]:
    return "", *(f"# {line}" for line in textwrap.wrap(title, _WIDTH, break_long_words=False))


def hash_comment(text: str) -> tuple[str, ...]:
    """Return a comment of several lines."""
    return tuple(f"# {line}" for line in text.split("\n"))


SYNTAX = Syntax(
    language="Python",
    literal=_literal,
    define="{name} = {value}",
    store="{place} = {value}",
    sincos=_pair,
    parameter="params.{name}",
    forms=MappingProxyType(
        {
            Operator.ADD: "{0} + {1}",
            Operator.SUB: "{0} - {1}",
            Operator.MUL: "{0} * {1}",
            Operator.DIV: "{0} / {1}",
            Operator.NEG: "-{0}",
            Operator.SQRT: "_sqrt({0})",
            Operator.ATAN2: "_atan2({0}, {1})",
            Operator.SELECT_LT: "np.where({0} < {1}, {2}, {3})",
        }
    ),
    negative="{0}",
    unused="_",
    identifier=python_identifier,
    heading=_heading,
    release="del {names}",
)


_TURNED = replace(SYNTAX, forms={Operator.SELECT_LT: "np.where({1} > {0}, {2}, {3})"})


def numpy_printer(variables: Sequence[str]) -> Printer[Operator]:
    """Print statements in NumPy.

    `variables`: how each number of the inputs is written.
    """
    return Printer(SYNTAX, variables, typed, others=turned)


def turned(statement: Statement) -> Syntax[Operator]:
    """Return the syntax of a statement: a comparison has its constant last, as linters want it."""
    compares = statement.operator is Operator.SELECT_LT and isinstance(statement.operands[0], Constant)
    return _TURNED if compares else SYNTAX


def broken(lines: tuple[str, ...]) -> tuple[str, ...]:
    """Statements as formatters break them where they are too long: the arguments of a selection on their own line."""
    found: list[str] = []
    for line in lines:
        call, where, arguments = line.partition("np.where(")
        long = where and len(line) > _STATEMENT
        found += (f"{call}{where}", f"    {arguments.removesuffix(')')}", ")") if long else (line,)
    return tuple(found)


def typed(statement: Statement, operands: tuple[str, ...]) -> tuple[str, ...]:
    """Of two numbers that are selected NumPy would make an array of doubles, whatever it compares."""
    chosen = statement.operands[2:]
    if not chosen or not all(isinstance(each, Constant) for each in chosen):
        return operands
    typed = operands[isinstance(statement.operands[0], Constant)]
    return *operands[:2], *(f"{typed}.dtype.type({each})" for each in operands[2:])


_BRIEFS = {
    Operator.SINCOS: "Sine and cosine with the operations and the bits of the C kernels in {real}.",
    Operator.ATAN2: "The angle of a point with the bits of the C kernels in {real}.",
}


@dataclass(frozen=True, slots=True)
class Formula:
    """One program as a Python function.

    `brief`: what it computes, in paragraphs. `inputs`: its arguments, each with what it holds. `body`: statements.
    `results`: lines of the returned tuple. `unused`: arguments that the body does not read. `reads_parameters`: whether
    it reads runtime parameters. `asks_type`: whether a tolerance in it depends on the number type.
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

    `arguments`: its arguments with their types. `kind`: the type of what it returns. `brief`: what it computes.
    `returned`: what it returns.
    """

    name: str
    arguments: str
    kind: str
    brief: str
    lines: tuple[str, ...]
    returned: str


@dataclass(frozen=True, slots=True)
class FormulaContext:
    """Holds what the template `python/_numpy.py.jinja` is given."""

    robot: str
    provenance: str
    parameters: bool
    sincos: bool
    sqrt: bool
    atan2: bool
    routines: tuple[FormulaRoutine, ...]
    formulas: tuple[Formula, ...]


def emit_formula(kernels: RobotPrograms) -> dict[str, str]:
    """Print the NumPy form.

    Returns the module, by file name.
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
            _routine(operator, real) for operator in _BRIEFS if uses(kernels.programs, operator) for real in ScalarType
        ),
        formulas=formulas,
    )
    return {"_numpy.py": environment().get_template("python/_numpy.py.jinja").render(k=context)}


def _routine(operator: Operator, real: ScalarType) -> FormulaRoutine:
    """Return one function for one number type."""
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


def _formula(kernels: RobotPrograms, program: Program) -> Formula:
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
