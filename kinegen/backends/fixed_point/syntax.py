"""Says how integer statements are written in C, one operation each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from types import MappingProxyType

from kinegen.backends.printing import Printer, Syntax
from kinegen.ir.fixed_point.program import NUMBER_BITS, FixedProgram, FixedStatement, Integer, Operation
from kinegen.ir.program import Temporary

_SIGNED = (Operation.ADD, Operation.SUBTRACT, Operation.TIMES)
_ON_ANGLES = (Operation.TURN_ADD, Operation.TURN_SUBTRACT, Operation.TURN_TIMES, Operation.TURN_NEGATE)
_SHIFTED = (Operation.MULTIPLY, Operation.ROUND, Operation.TURN_PART)
_ANGLE = "const uint32_t {name} = {value};"


def fixed_syntax(prefix: str, sincos: str) -> Syntax[Operation]:
    """Makes the syntax of integers in C, from the prefix of functions and the macro that takes sine and cosine."""
    others: Mapping[Operation, str] = dict.fromkeys((*_ON_ANGLES, Operation.TURN_PART), _ANGLE)
    return Syntax(
        language="C",
        literal=_literal,
        define="const int32_t {name} = {value};",
        store="{place} = {value};",
        sincos=partial(_pair, sincos),
        parameter="params->{name}",
        forms=MappingProxyType(
            {
                Operation.ADD: "{0} + {1}",
                Operation.SUBTRACT: "{0} - {1}",
                Operation.TIMES: "{0} * {1}",
                Operation.NEGATE: "-{0}",
                Operation.MULTIPLY: f"{prefix}_mul{{2}}({{0}}, {{1}})",
                Operation.ROUND: f"{prefix}_round{{1}}({{0}})",
                Operation.TURN_ADD: "{0} + {1}",
                Operation.TURN_SUBTRACT: "{0} - {1}",
                Operation.TURN_TIMES: "{0} * {1}",
                Operation.TURN_NEGATE: "0u - {0}",
                Operation.TURN_PART: f"{prefix}_part{{2}}({{0}}, {{1}})",
            }
        ),
        negative="{0}",
        others=MappingProxyType(others),
    )


def fixed_printer(variables: Sequence[str], prefix: str, sincos: str) -> Printer[Operation]:
    """Prints integer statements; see `fixed_syntax`."""
    return Printer(fixed_syntax(prefix, sincos), variables, _revised)


def needed_shifts(programs: Sequence[FixedProgram], operation: Operation) -> tuple[int, ...]:
    """Returns the shifts with which an operation occurs, ascending."""
    return tuple(
        sorted({each.shift for program in programs for each in program.statements if each.operator is operation})
    )


def uses(programs: Sequence[FixedProgram], operation: Operation) -> bool:
    """Returns whether an operation occurs."""
    return any(each.operator is operation for program in programs for each in program.statements)


def _revised(statement: FixedStatement, operands: tuple[str, ...]) -> tuple[str, ...]:
    """Returns angles unsigned, negative numbers behind an operator in brackets, and the shift behind the operands."""
    if statement.operator in (*_ON_ANGLES, Operation.SINCOS):
        return tuple(_angle(*each) for each in zip(statement.operands, operands, strict=True))
    if statement.operator in _SIGNED and operands[1].startswith("-"):
        return operands[0], f"({operands[1]})"
    if statement.operator in _SHIFTED:
        is_usual = statement.operator is Operation.MULTIPLY and statement.shift == NUMBER_BITS
        return *operands, "" if is_usual else f"{statement.shift}"
    return operands


def _angle(operand: object, text: str) -> str:
    """Returns one operand as a uint32_t; temporary angles are that already."""
    if isinstance(operand, Integer):
        return f"{text}u"
    return text if isinstance(operand, Temporary) else f"(uint32_t){text}"


def _literal(constant: Integer) -> str:
    return f"{constant.value}"


def _pair(function: str, sine: str, cosine: str, angle: str) -> tuple[str, ...]:
    return f"int32_t {sine};", f"int32_t {cosine};", f"{function}({angle}, &{sine}, &{cosine});"
