"""The NumPy form of the programs: `_numpy.py`, with the temporaries of the C in the same order."""

from __future__ import annotations

from dataclasses import dataclass

from kinegen.emit.environment import environment
from kinegen.emit.kernels import QUANTITY_TEXT, Kernels, provenance
from kinegen.emit.reals import Real
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

_SYMBOLS = {Operator.ADD: "+", Operator.SUB: "-", Operator.MUL: "*", Operator.DIV: "/"}


@dataclass(frozen=True, slots=True)
class Formula:
    """One program as a Python function.

    Attributes:
        name: Its name.
        brief: What it computes.
        body: Statements.
        results: Lines of the returned tuple.
        unused: Arguments that the body does not read.
        reads_parameters: Whether it reads runtime parameters.
    """

    name: str
    brief: str
    body: tuple[str, ...]
    results: tuple[str, ...]
    unused: tuple[str, ...]
    reads_parameters: bool


@dataclass(frozen=True, slots=True)
class FormulaContext:
    """What the template `python/_numpy.py.jinja` is given."""

    robot: str
    provenance: str
    parameters: bool
    sincos: bool
    formulas: tuple[Formula, ...]


def emit_formula(kernels: Kernels) -> dict[str, str]:
    """Print the NumPy form.

    Args:
        kernels: The robot and its programs.

    Returns:
        The module, by file name.
    """
    formulas = tuple(_formula(program, bool(kernels.defaults)) for program in kernels.programs)
    context = FormulaContext(
        robot=kernels.robot.name,
        provenance=provenance(kernels.robot),
        parameters=bool(kernels.defaults),
        sincos=any("_sincos(" in line for formula in formulas for line in formula.body),
        formulas=formulas,
    )
    return {"_numpy.py": environment().get_template("python/_numpy.py.jinja").render(k=context)}


def _formula(program: Program, parameters: bool) -> Formula:
    body = _lines(program)
    results = _wrapped([_operand(operand) for operand in program.outputs])
    text = "\n".join((*body, *results))
    reads_parameters = "params." in text
    unused = ["q"] if "q[" not in text and not reads_parameters else []  # q has the number type of the parameters
    unused += ["params"] if parameters and not reads_parameters else []
    return Formula(
        name=program.quantity.function,
        brief=QUANTITY_TEXT[program.quantity],
        body=body,
        results=results,
        unused=tuple(unused),
        reads_parameters=reads_parameters,
    )


def _lines(program: Program) -> tuple[str, ...]:
    halves: dict[Operand, set[str]] = {}
    for statement in program.statements:
        if statement.operator in (Operator.SIN, Operator.COS):
            halves.setdefault(statement.operands[0], set()).add(statement.name)
    lines: list[str] = []
    for statement in program.statements:
        angle = statement.operands[0]
        if statement.operator not in (Operator.SIN, Operator.COS):
            lines.append(f"{statement.name} = {_expression(statement)}")
        elif angle in halves:
            found, label = halves.pop(angle), statement.name[1:]
            sine, cosine = (name if name in found else "_" for name in (f"s{label}", f"c{label}"))
            lines.append(f"{sine}, {cosine} = _sincos({_operand(angle)})")
    return tuple(lines)


def _expression(statement: Statement) -> str:
    operands = [_operand(operand) for operand in statement.operands]
    if statement.operator is Operator.NEG:
        return f"-{operands[0]}"
    if statement.operator not in _SYMBOLS:
        raise TypeError(f"Python has no form for the operator {statement.operator!r}")
    return f"{operands[0]} {_SYMBOLS[statement.operator]} {operands[1]}"


def _operand(operand: Operand) -> str:
    match operand:
        case Variable(index):
            return f"q[{index}]"
        case RuntimeParameter(name):
            return f"params.{python_identifier(name)}"
        case Constant(value):
            return Real.DOUBLE.literal(value)
        case Temporary(name):
            return name
        case _:
            raise TypeError(f"Python has no form for the operand {operand!r}")


def _wrapped(items: list[str]) -> tuple[str, ...]:
    """Items with commas, as the project's formatter lays out a tuple: one to a line."""
    return tuple(f"{item}," for item in items)
