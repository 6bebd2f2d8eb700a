"""Prints integer statements as C, one operation each."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

from kinegen.ir.fixed.program import NUMBER_BITS, FixedOperand, FixedProgram, FixedStatement, Integer, Operation
from kinegen.ir.program import RuntimeParameter, Temporary, Variable

_SIGNED = {Operation.ADD: "+", Operation.SUBTRACT: "-", Operation.TIMES: "*"}
_UNSIGNED = {Operation.TURN_ADD: "+", Operation.TURN_SUBTRACT: "-", Operation.TURN_TIMES: "*"}


def needed_shifts(programs: Sequence[FixedProgram], operation: Operation) -> tuple[int, ...]:
    """The shifts with which an operation occurs, ascending."""
    return tuple(
        sorted({each.shift for program in programs for each in program.statements if each.operation is operation})
    )


def uses(programs: Sequence[FixedProgram], operation: Operation) -> bool:
    """Whether an operation occurs."""
    return any(each.operation is operation for program in programs for each in program.statements)


@dataclass(frozen=True, slots=True)
class IntegerPrinter:
    """Prints operands and statements.

    Attributes:
        prefix: What the names of the functions begin with.
        sincos: Name of the macro that takes sine and cosine.
    """

    prefix: str
    sincos: str

    def operand(self, operand: FixedOperand) -> str:
        """One operand as an int32_t."""
        match operand:
            case Variable(index):
                return f"q[{index}]"
            case RuntimeParameter(name):
                return f"params->{name}"
            case Temporary(name):
                return name
            case Integer(value):
                return f"{value}"

    def angle(self, operand: FixedOperand) -> str:
        """One operand as a uint32_t; temporary angles are that already."""
        match operand:
            case Temporary(name):
                return name
            case Integer(value):
                return f"{value}u"
            case _:
                return f"(uint32_t){self.operand(operand)}"

    def lines(self, program: FixedProgram, places: Sequence[str]) -> tuple[str, ...]:
        """The statements of a program; a result is stored as soon as it is there, as in the floating-point kernels.

        Args:
            program: The program.
            places: Where each of its outputs belongs.
        """
        stores: defaultdict[str, list[str]] = defaultdict(list)
        last: list[str] = []
        for place, operand in zip(places, program.outputs, strict=True):
            group = stores[operand.name] if isinstance(operand, Temporary) else last
            group.append(f"{place} = {self.operand(operand)};")
        lines: list[str] = []
        for statement in program.statements:
            lines += self._statement(statement)
            for name in statement.results:
                lines += stores[name]
        return (*lines, *last)

    def _statement(self, statement: FixedStatement) -> tuple[str, ...]:
        operation = statement.operation
        if operation is Operation.SINCOS:
            sine, cosine = statement.results
            pair = f"{self.sincos}({self.angle(statement.operands[0])}, &{sine}, &{cosine});"
            return f"int32_t {sine};", f"int32_t {cosine};", pair
        is_angle = operation in _UNSIGNED or operation in (Operation.TURN_NEGATE, Operation.TURN_PART)
        return (f"const {'uint32_t' if is_angle else 'int32_t'} {statement.name} = {self._expression(statement)};",)

    def _expression(self, statement: FixedStatement) -> str:
        operation = statement.operation
        if operation in _UNSIGNED or operation is Operation.TURN_NEGATE:
            operands = [self.angle(operand) for operand in statement.operands]
        else:
            operands = [self.operand(operand) for operand in statement.operands]
        match operation:
            case _ if operation in _SIGNED:
                right = f"({operands[1]})" if operands[1].startswith("-") else operands[1]
                return f"{operands[0]} {_SIGNED[operation]} {right}"
            case _ if operation in _UNSIGNED:
                return f"{operands[0]} {_UNSIGNED[operation]} {operands[1]}"
            case Operation.NEGATE:
                return f"-{operands[0]}"
            case Operation.TURN_NEGATE:
                return f"0u - {operands[0]}"
            case Operation.MULTIPLY:
                shift = "" if statement.shift == NUMBER_BITS else statement.shift
                return f"{self.prefix}_mul{shift}({operands[0]}, {operands[1]})"
            case Operation.ROUND:
                return f"{self.prefix}_round{statement.shift}({operands[0]})"
            case Operation.TURN_PART:
                return f"{self.prefix}_part{statement.shift}({operands[0]}, {operands[1]})"
            case _:
                raise TypeError(f"C has no form for the operation {operation!r}")
