"""Says how the body of a function is written in C++, as a template over the number type.

A number is written once where its double, rounded to a float, is the float that C has, and twice where it is not: both
types get the bits of the C kernels.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from types import MappingProxyType

from kinegen.backends.c.syntax import c_like, line_heading, truth_printer
from kinegen.backends.limits import LARGEST
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.sections import sections
from kinegen.ir.program import Constant, Operator, Program
from kinegen.model.outputs import Array
from kinegen.model.robot import Robot

COMMENT = 112
"""Characters of a comment in a body, after its mark."""


def number(value: Fraction, single: Fraction | None = None) -> str:
    """Writes a number of the template's type; `single` is what floats take instead, None where it is the same one."""
    # A double that rounds to the float of C serves both types.
    double, rounded = ScalarType.DOUBLE.literal(value), ScalarType.FLOAT.round(value if single is None else single)
    if (
        abs(value) <= LARGEST[ScalarType.FLOAT]
        and ScalarType.FLOAT.round(Fraction(ScalarType.DOUBLE.round(value))) == rounded
    ):
        return f"Real({double})"
    return f"detail::either<Real>({double}, {ScalarType.FLOAT.literal(Fraction(rounded))})"


def _literal(constant: Constant) -> str:
    return number(constant.value, constant.single)


def _pair(sine: str, cosine: str, angle: str) -> tuple[str, ...]:
    return (f"const auto [{sine}, {cosine}] = sincos({angle});",)


SYNTAX = c_like(
    "C++",
    {
        Operator.SQRT: "square_root({0})",
        Operator.ATAN2: "angle_of({0}, {1})",
        Operator.SELECT_LT: "{0} < {1} ? {2} : {3}",
    },
    literal=_literal,
    define="const Real {name} = {value};",
    sincos=_pair,
    parameter="params.{name}",
    heading=line_heading("//", COMMENT),
)

TRUTHS = replace(
    SYNTAX,
    define="const bool {name} = {value};",
    forms=MappingProxyType({Operator.MUL: "{0} && {1}", Operator.SELECT_LT: SYNTAX.forms[Operator.SELECT_LT]}),
)
"""How statements are written that make a truth value; a product of two is true where both are."""


def body(robot: Robot, program: Program) -> tuple[str, ...]:
    """Prints the statements of a kernel, and the constant last row of each matrix."""
    results = program.signature.results
    variables = [f"{array.name}[{index}]" for array in program.signature.inputs for index in range(array.size)]
    places = [place for array in results for place in _places(array)]
    printer = truth_printer(program, (SYNTAX, TRUTHS), ("false", "true"), variables, places)
    rows = [
        printer.assignment(f"{array.name}[{block * array.stored + 12 + column}]", Constant(Fraction(value)))
        for array in results
        if array.is_pose
        for block in range(array.blocks)
        for column, value in enumerate((0, 0, 0, 1))
    ]
    return printer.lines(program, places, sections(robot, program), rows)


def _places(array: Array) -> list[str]:
    size = array.size // array.blocks if array.blocks else 0
    return [f"{array.name}[{block * array.stored + index}]" for block in range(array.blocks) for index in range(size)]
