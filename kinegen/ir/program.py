"""Straight-line code: every statement is one operation, every name is defined once, before use, and used.

A program can add, subtract, multiply, divide, change a sign, take the sine and the cosine of an angle, a square root
and the angle of a point, and select one of two numbers. It cannot branch, loop or call anything else, so it takes the
same time for every input.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

from kinegen.older import StrEnum
from kinegen.outputs import Quantity, Signature


class Operator(StrEnum):
    """What a statement does with its operands."""

    ADD = "add"
    SUB = "sub"
    MUL = "mul"
    DIV = "div"
    NEG = "neg"
    SIN = "sin"
    COS = "cos"
    SQRT = "sqrt"
    """Zero of zero, NaN of a negative number."""
    ATAN2 = "atan2"
    """The angle of the point (x, y), in radians, from y and x in this order; zero of two zeros. Zeros have no sign."""
    SELECT_LT = "select_lt"
    """Of a, b, x and y: x if a is less than b, else y."""

    @property
    def arity(self) -> int:
        """Number of operands."""
        return _ARITIES.get(self, 2)


_ARITIES = {Operator.NEG: 1, Operator.SIN: 1, Operator.COS: 1, Operator.SQRT: 1, Operator.SELECT_LT: 4}


@dataclass(frozen=True, slots=True)
class Variable:
    """Number `index` of the inputs, counted through all of them."""

    index: int


@dataclass(frozen=True, slots=True)
class RuntimeParameter:
    """A parameter that the caller may change."""

    name: str


@dataclass(frozen=True, slots=True)
class Constant:
    """A number, exact or to well over a hundred digits; emitters round it once, to their own type.

    Attributes:
        value: The number.
        single: The number that single precision takes instead, for tolerances; None where it takes the same one.
    """

    value: Fraction
    single: Fraction | None = None

    def of(self, is_single: bool) -> Fraction:
        """The number that a type takes."""
        return self.value if self.single is None or not is_single else self.single

    def times(self, sign: int) -> Constant:
        """The same with a sign, 1 or -1, in front."""
        return Constant(sign * self.value, None if self.single is None else sign * self.single)


@dataclass(frozen=True, slots=True)
class Temporary:
    """The result of the statement of that name."""

    name: str


Operand = Variable | RuntimeParameter | Constant | Temporary


@dataclass(frozen=True, slots=True)
class Statement:
    """One operation; `name` is the temporary that it defines."""

    name: str
    operator: Operator
    operands: tuple[Operand, ...]


@dataclass(frozen=True, slots=True)
class AngleSum:
    """An angle whose sine and cosine the program takes, for reports and comments.

    Attributes:
        label: What follows `s` and `c` in the names of its sine and cosine, such as 23.
        text: The angle in terms of joint variables, such as `q2 + q3`.
        is_sum: Whether several joint variables were merged in it.
    """

    label: str
    text: str
    is_sum: bool


@dataclass(frozen=True, slots=True)
class Count:
    """Operations of a program."""

    multiplications: int
    additions: int
    negations: int
    divisions: int
    sine_cosines: int
    roots: int = 0
    arc_tangents: int = 0
    selections: int = 0

    def __str__(self) -> str:
        others = (
            (self.divisions, "div"),
            (self.sine_cosines, "sincos"),
            (self.roots, "sqrt"),
            (self.arc_tangents, "atan2"),
            (self.selections, "select"),
        )
        rest = "".join(f" + {number} {word}" for number, word in others if number)
        return f"{self.multiplications} mul + {self.additions} add{rest}"


@dataclass(frozen=True, slots=True)
class Program:
    """A kernel, independent of any language.

    Attributes:
        signature: What it computes, for which frames, from what.
        parameters: Names of the runtime parameters, in order.
        angles: The angles whose sine and cosine are taken, in order.
        statements: The code.
        outputs: The numbers of the results, one result after the other.
    """

    signature: Signature
    parameters: tuple[str, ...]
    angles: tuple[AngleSum, ...]
    statements: tuple[Statement, ...]
    outputs: tuple[Operand, ...]

    def __post_init__(self) -> None:
        check(self)

    @property
    def quantity(self) -> Quantity:
        """What it computes."""
        return self.signature.quantity

    @property
    def frames(self) -> tuple[str, ...]:
        """The frames for which it computes it."""
        return self.signature.frames


def check(program: Program) -> None:
    """Verify the invariants of a program.

    Raises:
        ValueError: If a name is defined twice, used before its definition or never, or a count is wrong.
    """
    defined: set[str] = set()
    for statement in program.statements:
        if len(statement.operands) != statement.operator.arity:
            raise ValueError(f"{statement.name}: {statement.operator} takes {statement.operator.arity} operands")
        for operand in statement.operands:
            _check_operand(program, operand, defined)
        if statement.name in defined:
            raise ValueError(f"{statement.name} is defined twice")
        defined.add(statement.name)
    for operand in program.outputs:
        _check_operand(program, operand, defined)
    unused = defined - set(_used(program))
    if unused:
        raise ValueError(f"{sorted(unused)} are never used")
    expected = sum(result.size for result in program.signature.results)
    if len(program.outputs) != expected:
        raise ValueError(f"{len(program.outputs)} outputs for results of {expected} numbers")


def _check_operand(program: Program, operand: Operand, defined: set[str]) -> None:
    match operand:
        case Temporary(name) if name not in defined:
            raise ValueError(f"{name} is used before it is defined")
        case Variable(index) if not 0 <= index < sum(given.size for given in program.signature.inputs):
            raise ValueError(f"there is no input {index}")
        case RuntimeParameter(name) if name not in program.parameters:
            raise ValueError(f"there is no runtime parameter {name}")


def _used(program: Program) -> Iterator[str]:
    for operands in (*(statement.operands for statement in program.statements), program.outputs):
        yield from (operand.name for operand in operands if isinstance(operand, Temporary))


def count(program: Program) -> Count:
    """Count the operations; a sine and a cosine of one angle are one sine-cosine pair."""
    operators = [statement.operator for statement in program.statements]
    pairs = {
        statement.operands[0] for statement in program.statements if statement.operator in (Operator.SIN, Operator.COS)
    }
    return Count(
        multiplications=operators.count(Operator.MUL),
        additions=operators.count(Operator.ADD) + operators.count(Operator.SUB),
        negations=operators.count(Operator.NEG),
        divisions=operators.count(Operator.DIV),
        sine_cosines=len(pairs),
        roots=operators.count(Operator.SQRT),
        arc_tangents=operators.count(Operator.ATAN2),
        selections=operators.count(Operator.SELECT_LT),
    )
