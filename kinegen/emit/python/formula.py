"""The NumPy form of the programs: `_numpy.py`, with the temporaries of the C in the same order."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

from kinegen.emit.environment import environment
from kinegen.emit.kernels import Kernels, provenance
from kinegen.emit.reals import Real
from kinegen.emit.sections import Section, sections
from kinegen.emit.words import brief, input_text
from kinegen.ir.program import (
    Constant,
    Operand,
    Operator,
    Program,
    RuntimeParameter,
    Statement,
    Temporary,
    Variable,
)
from kinegen.naming import python_identifier

_FORMS = {
    Operator.SINCOS: "_sincos({})",
    Operator.NEG: "-{}",
    Operator.SQRT: "np.sqrt({})",
    Operator.ATAN2: "_atan2({}, {})",
    Operator.SELECT_LT: "np.where({} < {}, {}, {})",
}
_SYMBOLS = {Operator.ADD: "+", Operator.SUB: "-", Operator.MUL: "*", Operator.DIV: "/"}


_WIDTH = 112
"""Characters of a line of a comment, after its mark."""


@dataclass(frozen=True, slots=True)
class Formula:
    """One program as a Python function.

    Attributes:
        name: Its name.
        brief: What it computes.
        inputs: Its arguments, each with what it holds.
        body: Statements.
        results: Lines of the returned tuple.
        unused: Arguments that the body does not read.
        reads_parameters: Whether it reads runtime parameters.
        asks_type: Whether a tolerance in it depends on the number type.
    """

    name: str
    brief: str
    inputs: tuple[tuple[str, str], ...]
    body: tuple[str, ...]
    results: tuple[str, ...]
    unused: tuple[str, ...]
    reads_parameters: bool
    asks_type: bool


@dataclass(frozen=True, slots=True)
class FormulaContext:
    """What the template `python/_numpy.py.jinja` is given."""

    robot: str
    provenance: str
    parameters: bool
    sincos: bool
    atan2: bool
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
        sincos=any(program.uses(Operator.SINCOS) for program in kernels.programs),
        atan2=any(program.uses(Operator.ATAN2) for program in kernels.programs),
        formulas=formulas,
    )
    return {"_numpy.py": environment().get_template("python/_numpy.py.jinja").render(k=context)}


def _formula(kernels: Kernels, program: Program) -> Formula:
    printer = _Printer(
        tuple(f"{array.name}[{index}]" for array in program.signature.inputs for index in range(array.size))
    )
    reads_parameters = program.reads_parameters
    inputs = program.signature.inputs
    # The first input has the number type of the parameters.
    typed = inputs[:1] if reads_parameters else ()
    unused = [array.name for array in inputs if array not in typed and not program.reads(array)]
    unused += ["params"] if kernels.defaults and not reads_parameters else []
    return Formula(
        name=program.quantity.function,
        brief=brief(program.signature),
        inputs=tuple((array.name, f"{input_text(array)} ({array.size}, N)") for array in program.signature.inputs),
        body=printer.lines(program, sections(kernels.robot, program)),
        results=tuple(f"{printer.operand(operand)}," for operand in program.outputs),
        unused=tuple(unused),
        reads_parameters=reads_parameters,
        asks_type=program.asks_type,
    )


@dataclass(frozen=True, slots=True)
class _Printer:
    """Prints statements.

    Attributes:
        variables: How each number of the inputs is written.
    """

    variables: tuple[str, ...]

    def lines(self, program: Program, parts: Sequence[Section]) -> tuple[str, ...]:
        used = program.used
        lines: list[str] = []
        for part in parts:
            lines += ["", *(f"# {line}" for line in textwrap.wrap(part.title, _WIDTH, break_long_words=False))]
            for statement in part.statements:
                names = (name if Temporary(name) in used else "_" for name in statement.results)
                lines.append(f"{', '.join(names)} = {self.expression(statement)}")
        return tuple(lines[1:])  # no blank line at the beginning

    def expression(self, statement: Statement) -> str:
        operands = [self.operand(operand) for operand in statement.operands]
        chosen = statement.operands[2:]
        if chosen and all(isinstance(each, Constant) for each in chosen):
            # Of two numbers NumPy would make an array of doubles, whatever it compares.
            typed = operands[isinstance(statement.operands[0], Constant)]
            operands[2:] = (f"{typed}.dtype.type({each})" for each in operands[2:])
        if statement.operator in _FORMS:
            return _FORMS[statement.operator].format(*operands)
        if statement.operator not in _SYMBOLS:
            raise TypeError(f"Python has no form for the operator {statement.operator!r}")
        return f"{operands[0]} {_SYMBOLS[statement.operator]} {operands[1]}"

    def operand(self, operand: Operand) -> str:
        match operand:
            case Variable(index):
                return self.variables[index]
            case RuntimeParameter(name):
                return f"params.{python_identifier(name)}"
            case Constant():
                double, single = (Real.DOUBLE.literal(operand.of(kind)) for kind in (False, True))
                return double if operand.single is None else f"({single} if single else {double})"
            case Temporary(name):
                return name
            case _:
                raise TypeError(f"Python has no form for the operand {operand!r}")
