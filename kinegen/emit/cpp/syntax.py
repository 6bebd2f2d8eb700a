"""How the body of a function is written in C++, as a template over the number type.

A number is written once where its double, rounded to a float, is the float that C has, and twice where it is not: both
types get the bits of the C kernels.
"""

from __future__ import annotations

import textwrap
from dataclasses import replace
from fractions import Fraction
from types import MappingProxyType

from kinegen.emit.c.truths import is_truth, truths_of
from kinegen.emit.limits import LARGEST
from kinegen.emit.printing import Printer, Syntax
from kinegen.emit.reals import Real
from kinegen.emit.sections import sections
from kinegen.ir.program import Constant, Operand, Operator, Program, Statement
from kinegen.outputs import Array
from kinegen.robot.model import Robot

COMMENT = 112
"""Characters of a comment in a body, after its mark."""


def number(value: Fraction, single: Fraction | None = None) -> str:
    """A number of the template's type.

    Args:
        value: The number.
        single: What floats take instead; None where it is the same one.
    """
    double, rounded = Real.DOUBLE.literal(value), Real.FLOAT.round(value if single is None else single)
    if abs(value) <= LARGEST[Real.FLOAT] and Real.FLOAT.round(Fraction(Real.DOUBLE.round(value))) == rounded:
        return f"Real({double})"
    return f"detail::either<Real>({double}, {Real.FLOAT.literal(Fraction(rounded))})"


def _literal(constant: Constant) -> str:
    return number(constant.value, constant.single)


def _pair(sine: str, cosine: str, angle: str) -> tuple[str, ...]:
    return (f"const auto [{sine}, {cosine}] = sincos({angle});",)


def _heading(title: str) -> tuple[str, ...]:
    """A blank line and a comment; nothing where there is no title."""
    lines = textwrap.wrap(title, COMMENT, break_long_words=False)
    return ("", *(f"// {line}" for line in lines)) if lines else ()


SYNTAX = Syntax(
    language="C++",
    literal=_literal,
    define="const Real {name} = {value};",
    store="{place} = {value};",
    sincos=_pair,
    parameter="params.{name}",
    forms=MappingProxyType(
        {
            Operator.ADD: "{0} + {1}",
            Operator.SUB: "{0} - {1}",
            Operator.MUL: "{0} * {1}",
            Operator.DIV: "{0} / {1}",
            Operator.NEG: "-{0}",
            Operator.SQRT: "square_root({0})",
            Operator.ATAN2: "angle_of({0}, {1})",
            Operator.SELECT_LT: "{0} < {1} ? {2} : {3}",
        }
    ),
    heading=_heading,
)

TRUTHS = replace(
    SYNTAX,
    define="const bool {name} = {value};",
    forms=MappingProxyType({Operator.MUL: "{0} && {1}", Operator.SELECT_LT: SYNTAX.forms[Operator.SELECT_LT]}),
)
"""How statements are written that make a truth value; a product of two is true where both are."""

_WORDS = {Fraction(0): "false", Fraction(1): "true"}


def body(robot: Robot, program: Program) -> tuple[str, ...]:
    """The statements of a kernel, and the constant last row of each matrix.

    Args:
        robot: The robot.
        program: The program.
    """
    truths, results = truths_of(program), program.signature.results

    def revise(statement: Statement, operands: tuple[str, ...]) -> tuple[str, ...]:
        """Truth values have words of their own; what is compared are numbers."""
        if statement.results[0] not in truths:
            return operands
        compared = 2 if statement.operator is Operator.SELECT_LT else 0
        others = zip(statement.operands[compared:], operands[compared:], strict=True)
        return *operands[:compared], *(_word(operand) or text for operand, text in others)

    variables = [f"{array.name}[{index}]" for array in program.signature.inputs for index in range(array.size)]
    places = [place for array in results for place in _places(array)]
    words = [place for array in results if array.is_truth for place in _places(array)]
    printer = Printer(
        SYNTAX,
        variables,
        revise,
        others=lambda statement: TRUTHS if statement.results[0] in truths else SYNTAX,
        literals=dict.fromkeys(words, _word),
    )
    rows = [
        printer.assignment(f"{array.name}[{block * array.stored + 12 + column}]", Constant(Fraction(value)))
        for array in results
        if array.is_pose
        for block in range(array.blocks)
        for column, value in enumerate((0, 0, 0, 1))
    ]
    return printer.lines(program, places, sections(robot, program), rows)


def _places(array: Array) -> list[str]:
    """Where each computed number of a result is stored."""
    size = array.size // array.blocks if array.blocks else 0
    return [f"{array.name}[{block * array.stored + index}]" for block in range(array.blocks) for index in range(size)]


def _word(operand: Operand) -> str:
    """A number as a truth value; empty for what is no number."""
    return _WORDS[operand.value] if isinstance(operand, Constant) and is_truth(operand, frozenset()) else ""
