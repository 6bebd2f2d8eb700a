"""One program in integers at given scales: literals, shifts and conversions, one by one."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction

from kinegen.ir.fixed_point.binary_angles import Turns
from kinegen.ir.fixed_point.program import (
    EMITTED,
    LARGEST,
    LARGEST_FACTOR,
    NUMBER_BITS,
    FixedOperand,
    FixedProgram,
    FixedStatement,
    Integer,
    Operation,
    Pair,
    Scales,
    above,
    half_place,
    nearest_integer,
)
from kinegen.ir.fixed_point.ranges import Copy, Extent, Extents, Given, Product, Sum, Trigonometric, Value
from kinegen.ir.fixed_point.value_classes import Kind, input_kind, output_kinds
from kinegen.ir.program import Constant, Operand, Operator, Program, RuntimeParameter, Statement, Temporary, Variable
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class Local:
    """A value in integers.

    `place`: its place among the analysed values.
    """

    operand: FixedOperand
    kind: Kind
    bits: int
    place: int


@dataclass(frozen=True, slots=True)
class Draft:
    """Integer statements, and what is known of their values.

    `statements`: the code; which factor of a product stands second is not settled yet. `operands`: for each statement,
    its operands as locals; none for angles. `locals`: every value but angles: inputs, literals, temporaries.
    """

    program: Program
    statements: tuple[FixedStatement, ...]
    operands: tuple[tuple[Local, ...], ...]
    locals: tuple[Local, ...]
    outputs: tuple[Local, ...]
    extents: Extents

    def largest(self, local: Local) -> float:
        """Bound on the magnitude of the integer."""
        if isinstance(local.operand, Integer):
            return abs(local.operand.value)
        return math.ldexp(self.extents.extent(local.place).largest, local.bits)

    def too_large(self) -> list[str]:
        """Return the values that are not shown to fit an int32_t."""
        return [
            str(getattr(local.operand, "name", local.operand)) for local in self.locals if self.largest(local) > LARGEST
        ]

    def overflows(self) -> tuple[str, ...]:
        """Return the values that are not shown to fit, and the products none of whose factors is small enough."""
        found = self.too_large()
        for statement, operands in zip(self.statements, self.operands, strict=True):
            if statement.operator is Operation.MULTIPLY and not self._small(operands):
                found.append(statement.name)
        return tuple(found)

    def splits(self, settled: FixedProgram) -> bool:
        """Tell whether products of 16-bit halves do not overflow, with factors in the order of the finished program."""
        pairs = zip(self.statements, settled.statements, self.operands, strict=True)
        return all(
            self.largest(operands[int(own.operands == final.operands)]) <= LARGEST_FACTOR
            for own, final, operands in pairs
            if own.operator is Operation.MULTIPLY
        )

    @property
    def errors(self) -> tuple[float, ...]:
        """For each output the bound on its error, in units of its last place."""
        return tuple(math.ldexp(self.extents.extent(local.place).error, local.bits) for local in self.outputs)

    def settled(self) -> FixedProgram:
        """Return the finished program: the second factor of each product is a small one."""
        statements = []
        for statement, operands in zip(self.statements, self.operands, strict=True):
            if statement.operator is Operation.MULTIPLY and operands[1] not in self._small(operands):
                statements.append(replace(statement, operands=statement.operands[::-1]))
            else:
                statements.append(statement)
        return FixedProgram(
            program=self.program,
            statements=tuple(statements),
            outputs=tuple(local.operand for local in self.outputs),
            bits=tuple(local.bits for local in self.outputs),
            errors=self.errors,
        )

    def _small(self, operands: Sequence[Local]) -> list[Local]:
        return [local for local in operands if self.largest(local) <= LARGEST_FACTOR]


_SHIFT = 30


def write_statements(
    robot: Robot, program: Program, kinds: Mapping[str, Kind], scales: Scales, pair: Pair = EMITTED
) -> Draft:
    """Write one program in integers.

    Returns the statements, not yet shown to be free of overflow. Raises KinegenError if part of an angle is not clear.
    """
    return _Writer(robot, program, kinds, scales, pair).write()


class _Writer:
    def __init__(self, robot: Robot, program: Program, kinds: Mapping[str, Kind], scales: Scales, pair: Pair) -> None:
        self.robot = robot
        self.program = program
        self.kinds = kinds
        self.scales = scales
        self.pair = pair
        self.turns = Turns(robot)
        self.statements: list[FixedStatement] = []
        self.operands: list[tuple[Local, ...]] = []
        self.values: list[Value] = []
        self.locals: list[Local] = []
        self.known: dict[object, Local] = {}
        self.used = program.used

    def write(self) -> Draft:
        for statement in self.program.statements:
            self._write(statement)
        kinds = output_kinds(self.program)
        outputs = tuple(
            self._converted(operand, kind, self._bits(kind))
            for operand, kind in zip(self.program.outputs, kinds, strict=True)
        )
        return Draft(
            program=self.program,
            statements=tuple(self.statements),
            operands=tuple(self.operands),
            locals=tuple(self.locals),
            outputs=outputs,
            extents=Extents(self.values),
        )

    def _write(self, statement: Statement) -> None:
        match statement.operator:
            case Operator.SINCOS:
                self._sincos(statement)
            case _ if self.kinds[statement.name] is Kind.ANGLE:
                self._emit(self.turns.statement(statement))
            case Operator.ADD | Operator.SUB:
                self._sum(statement)
            case Operator.NEG:
                kind = self.kinds[statement.name]
                operand = self._converted(statement.operands[0], kind, self._bits(kind))
                self._emit(FixedStatement(statement.results, Operation.NEGATE, (operand.operand,)), operand)
                self._define(statement.name, kind, operand.bits, Copy(operand.place, 0.0))
            case Operator.MUL:
                self._product(statement)
            case _:
                raise TypeError(f"integers have no form for the operator {statement.operator!r}")

    def _bits(self, kind: Kind) -> int:
        return self.scales.length if kind is Kind.LENGTH else NUMBER_BITS

    def _emit(self, statement: FixedStatement, *operands: Local) -> None:
        self.statements.append(statement)
        self.operands.append(operands)

    def _define(self, name: str, kind: Kind, bits: int, value: Value) -> Local:
        local = self._local(Local(Temporary(name), kind, bits, len(self.values)), value)
        self.known[Temporary(name)] = local
        return local

    def _local(self, local: Local, value: Value) -> Local:
        self.values.append(value)
        self.locals.append(local)
        return local

    def _sincos(self, statement: Statement) -> None:
        (angle,) = statement.operands
        if isinstance(angle, Constant):
            raise TypeError("the sine of a constant is a constant")
        self._emit(FixedStatement(statement.results, Operation.SINCOS, (angle,)))
        off = self.turns.error(angle)
        errors = [math.ldexp(error, -NUMBER_BITS) + off for error in (self.pair.each, self.pair.both)]
        for name in statement.results:
            if Temporary(name) in self.used:
                self._define(name, Kind.NUMBER, NUMBER_BITS, Trigonometric(angle, *errors))

    def _sum(self, statement: Statement) -> None:
        kind = self.kinds[statement.name]
        left, right = (self._converted(operand, kind, self._bits(kind)) for operand in statement.operands)
        is_sum = statement.operator is Operator.ADD
        operation = Operation.ADD if is_sum else Operation.SUBTRACT
        self._emit(FixedStatement(statement.results, operation, (left.operand, right.operand)), left, right)
        self._define(statement.name, kind, left.bits, Sum(left.place, right.place, 0.0, 1 if is_sum else -1))

    def _product(self, statement: Statement) -> None:
        kind = self.kinds[statement.name]
        bits = self._bits(kind)
        constants = [operand.value for operand in statement.operands if isinstance(operand, Constant)]
        if constants:
            (other,) = (operand for operand in statement.operands if not isinstance(operand, Constant))
            self._multiple(statement, self._natural(other), constants[0])
            return
        left, right = (self._natural(operand) for operand in statement.operands)
        shift = left.bits + right.bits - bits
        self._emit(
            FixedStatement(statement.results, Operation.MULTIPLY, (left.operand, right.operand), shift), left, right
        )
        self._define(statement.name, kind, bits, Product(left.place, right.place, half_place(bits)))

    def _multiple(self, statement: Statement, other: Local, factor: Fraction) -> None:
        """Write a constant times a value; the literal has as many bits as fit, and an integer is exact."""
        kind = self.kinds[statement.name]
        bits = self._bits(kind)
        is_exact = factor.denominator == 1 and other.bits == bits
        scaled = factor * Fraction(2) ** (bits - other.bits)
        # Beside a number the literal may be as large as an int32_t, beside a length it has to be the small factor.
        limit = LARGEST if other.kind is Kind.NUMBER else LARGEST_FACTOR
        shift = 0 if is_exact else next(s for s in range(_SHIFT, -1, -1) if s == 0 or abs(scaled) * 2**s < limit)
        literal = self._literal(abs(factor), bits - other.bits + shift, nearest_integer(scaled * 2**shift))
        operation = Operation.TIMES if is_exact else Operation.MULTIPLY
        self._emit(
            FixedStatement(statement.results, operation, (other.operand, literal.operand), shift), other, literal
        )
        sign = -1 if factor < 0 else 1
        rounding = 0.0 if is_exact else half_place(bits)
        self._define(statement.name, kind, bits, Product(literal.place, other.place, rounding, sign))

    def _literal(self, exact: Fraction, bits: int, value: int) -> Local:
        """Return a literal; the analysed value is its exact counterpart, without the sign if it is a factor."""
        key = (exact, bits, abs(value))
        if key not in self.known:
            error = abs(abs(exact) - abs(value) / Fraction(2) ** bits)
            given = Given(Extent(above(abs(exact)), above(error)), float(exact))
            self.known[key] = self._local(Local(Integer(value), Kind.NUMBER, bits, len(self.values)), given)
        known = self.known[key]
        return Local(Integer(value), known.kind, known.bits, known.place)

    def _natural(self, operand: Operand) -> Local:
        if isinstance(operand, Temporary):
            return self.known[operand]
        if isinstance(operand, (Variable, RuntimeParameter)):
            return self._converted(operand, Kind.LENGTH, self.scales.length)
        raise TypeError(f"{operand!r} has no scale of its own")

    def _converted(self, operand: Operand, kind: Kind, bits: int) -> Local:
        """Return a value at a scale: as it is, or converted by one more statement."""
        if isinstance(operand, Constant):
            return self._literal(operand.value, bits, nearest_integer(operand.value * Fraction(2) ** bits))
        source = self._input(operand) if not isinstance(operand, Temporary) else self.known[operand]
        if source.bits == bits:
            return source
        # A conversion is written once for each scale: a shift down rounds, a shift up is exact.
        if (source.operand, bits) not in self.known:
            name = self._name(operand, kind)
            shift = source.bits - bits
            rounds = shift > 0
            self._emit(
                FixedStatement((name,), Operation.ROUND, (source.operand,), shift)
                if rounds
                else FixedStatement((name,), Operation.TIMES, (source.operand, Integer(2**-shift))),
                source,
            )
            value = Copy(source.place, half_place(bits) if rounds else 0.0)
            self.known[source.operand, bits] = self._define(name, kind, bits, value)
        return self.known[source.operand, bits]

    def _input(self, operand: Variable | RuntimeParameter) -> Local:
        """Return a length that is given: any int32_t, and exact as it is."""
        if operand not in self.known:
            input_kind(self.robot, operand)
            bits = self.scales.stroke if isinstance(operand, Variable) else self.scales.parameter
            given = Given(Extent(math.ldexp(1.0, 31 - bits), 0.0))
            self.values.append(given)
            self.known[operand] = Local(operand, Kind.LENGTH, bits, len(self.values) - 1)
        return self.known[operand]

    @staticmethod
    def _name(operand: Operand, kind: Kind) -> str:
        """Return the name of a converted value; no other temporary can have it."""
        match operand:
            case Variable(index):
                return f"q{index + 1}"
            case RuntimeParameter(name):
                return f"p_{name}"
            case Temporary(name):
                return f"{name}_{kind}"
            case _:
                raise TypeError(f"{operand!r} is not converted")
