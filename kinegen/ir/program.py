"""Straight-line code: every statement is one operation, every name is defined once, before use, and used.

A program can add, subtract, multiply, divide, change a sign, take the sine and the cosine of an angle, a square root
and the angle of a point, and select one of two numbers. It cannot branch, loop or call anything else, so it takes the
same time for every input.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from fractions import Fraction

from kinegen.model.outputs import Array, Quantity, Signature
from kinegen.support.compat import StrEnum
from kinegen.support.dataclass import dataclass


class Operator(StrEnum):
    """What a statement does with its operands."""

    ADD = "add"
    SUB = "sub"
    MUL = "mul"
    DIV = "div"
    NEG = "neg"
    SINCOS = "sincos"
    """The sine and the cosine of an angle, in this order; a program may use one of them alone."""
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

    @property
    def results(self) -> int:
        """Number of temporaries that a statement defines."""
        return 2 if self is Operator.SINCOS else 1


_ARITIES = {Operator.NEG: 1, Operator.SINCOS: 1, Operator.SQRT: 1, Operator.SELECT_LT: 4}


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
        single: The number that single precision takes instead, for tolerances; None where it takes the same one.
    """

    value: Fraction
    single: Fraction | None = None

    def __hash__(self) -> int:
        # That of a fraction takes a division in a field of the size of a word: long for 150 digits.
        return hash((self.value.numerator, self.value.denominator))

    def of(self, is_single: bool) -> Fraction:
        """Return the number that a type takes."""
        return self.value if self.single is None or not is_single else self.single

    def times(self, sign: int) -> Constant:
        """Return the same with a sign, 1 or -1, in front."""
        return Constant(sign * self.value, None if self.single is None else sign * self.single)


@dataclass(frozen=True, slots=True)
class Temporary:
    """A result of a statement, by its name."""

    name: str


Operand = Variable | RuntimeParameter | Constant | Temporary


@dataclass(frozen=True, slots=True)
class Statement:
    """One operation.

    Attributes:
        results: The names of the temporaries that it defines: one, or those of a sine and a cosine.
    """

    results: tuple[str, ...]
    operator: Operator
    operands: tuple[Operand, ...]

    @property
    def name(self) -> str:
        """The name of the only result.

        Raises:
            ValueError: If there are two.
        """
        (name,) = self.results
        return name


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

    @property
    def weight(self) -> int:
        """Return what they cost: a change of sign 1, a product or a sum 2, the sine and cosine of an angle 60.

        The kernels' own sine and cosine take about thirty operations together.
        """
        arithmetic = self.multiplications + self.additions + self.divisions
        calls = self.roots + self.arc_tangents + self.selections
        return self.negations + 2 * (arithmetic + calls) + 60 * self.sine_cosines

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
        outputs: The numbers of the results, one result after the other.
        used: All operands of statements and outputs; of a sine and a cosine one may be missing.
    """

    signature: Signature
    parameters: tuple[str, ...]
    angles: tuple[AngleSum, ...]
    statements: tuple[Statement, ...]
    outputs: tuple[Operand, ...]
    used: frozenset[Operand] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        operands = (each for statement in self.statements for each in statement.operands)
        object.__setattr__(self, "used", frozenset((*operands, *self.outputs)))
        check(self)

    def __hash__(self) -> int:
        # What is worked out once for a program is looked up often, and has no time for thousands of statements.
        return hash((self.signature, self.parameters, len(self.statements), self.outputs))

    @property
    def quantity(self) -> Quantity:
        """Return what it computes."""
        return self.signature.quantity

    @property
    def frames(self) -> tuple[str, ...]:
        """The frames for which it computes it."""
        return self.signature.frames

    @property
    def reads_parameters(self) -> bool:
        """Tell whether any result depends on a runtime parameter."""
        return any(isinstance(operand, RuntimeParameter) for operand in self.used)

    @property
    def asks_type(self) -> bool:
        """Tell whether a number in it depends on the number type."""
        return any(isinstance(operand, Constant) and operand.single is not None for operand in self.used)

    def reads(self, array: Array) -> bool:
        """Tell whether any result depends on a number of one of the inputs."""
        first = sum(given.size for given in self.signature.inputs[: self.signature.inputs.index(array)])
        return any(Variable(index) in self.used for index in range(first, first + array.size))

    def uses(self, *operators: Operator) -> bool:
        """Tell whether it has one of these operations."""
        return any(statement.operator in operators for statement in self.statements)


def check(program: Program) -> None:
    """Verify the invariants of a program.

    Raises:
        ValueError: If a name is defined twice, used before its definition or never, two statements take the sine and
            cosine of one angle, or a count is wrong.
    """
    defined: set[str] = set()
    for statement in program.statements:
        _check_counts(statement)
        for operand in statement.operands:
            _check_operand(program, operand, defined)
        for name in statement.results:
            if name in defined:
                raise ValueError(f"{name} is defined twice")
            defined.add(name)
    for operand in program.outputs:
        _check_operand(program, operand, defined)
    _check_uses(program)
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


def _check_counts(statement: Statement) -> None:
    operator, names = statement.operator, " and ".join(statement.results)
    if len(statement.operands) != operator.arity:
        raise ValueError(f"{names}: {operator} takes {operator.arity} operands")
    if len(statement.results) != operator.results:
        raise ValueError(f"{names}: {operator} has {operator.results} results")


def _check_uses(program: Program) -> None:
    used = program.used
    unused = {
        statement.results
        for statement in program.statements
        if not any(Temporary(name) in used for name in statement.results)
    }
    if unused:
        raise ValueError(f"{sorted(name for names in unused for name in names)} are never used")
    angles = [statement.operands for statement in program.statements if statement.operator is Operator.SINCOS]
    if len(set(angles)) < len(angles):
        raise ValueError("the sine and cosine of one angle are taken twice")


def count(program: Program) -> Count:
    """Count the operations; a sine and a cosine of one angle are one operation."""
    return counted([statement.operator for statement in program.statements])


def counted(operators: Sequence[Operator]) -> Count:
    """Count operations; see `count`."""
    return Count(
        multiplications=operators.count(Operator.MUL),
        additions=operators.count(Operator.ADD) + operators.count(Operator.SUB),
        negations=operators.count(Operator.NEG),
        divisions=operators.count(Operator.DIV),
        sine_cosines=operators.count(Operator.SINCOS),
        roots=operators.count(Operator.SQRT),
        arc_tangents=operators.count(Operator.ATAN2),
        selections=operators.count(Operator.SELECT_LT),
    )
