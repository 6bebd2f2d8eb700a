"""Which values of a program are truth values, so that C can keep them in a byte instead of a floating-point number.

In: a program. Out: the names of the temporaries that are 1 or 0 and are used as such alone. Processors without a
floating-point unit then compare bytes where they would call a library, and others keep a register free.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import compress

from kinegen.emit.printing import Revise, Syntax
from kinegen.ir.program import Constant, Operand, Operator, Program, Statement, Temporary

TRUTH = "uint8_t"
"""Type of a truth value in C: 1 or 0 in a byte, which C++ and other languages lay out alike."""

_BITS = (0, 1)


def truths_of(program: Program) -> frozenset[str]:
    """The temporaries of a program that are truth values.

    A selection of truth values and a product of two are truth values. One that anything else uses is a number, and so
    is what is made of it.

    Args:
        program: The program.

    Returns:
        Their names; none where no result is a truth value.

    Raises:
        ValueError: If a result that is declared as a truth value is something else.
    """
    if not any(array.is_truth for array in program.signature.results):
        return frozenset()
    users: dict[str, list[Statement]] = {}
    for statement in program.statements:
        for operand in statement.operands:
            if isinstance(operand, Temporary):
                users.setdefault(operand.name, []).append(statement)
    numbers = {place.name for place in _numbers(program) if isinstance(place, Temporary)}
    found = frozenset(name for statement in program.statements for name in statement.results) - numbers
    while (kept := _kept(program, found, users)) != found:
        found = kept
    if not all(is_truth(place, found) for place in compress(program.outputs, truth_places(program))):
        raise ValueError(f"{program.quantity}: a result that is declared as a truth value is not one")
    return found


def truth_syntax(truths: frozenset[str], syntax: Syntax[Operator]) -> Callable[[Statement], Syntax[Operator]]:
    """How statements are written: those that make a truth value with bytes, the others in the syntax of numbers.

    Args:
        truths: The temporaries that are truth values.
        syntax: The syntax of numbers.
    """
    forms = {
        Operator.MUL: f"({TRUTH})({{0}} & {{1}})",  # a product of two is 1 where both are
        Operator.SELECT_LT: "({0} < {1}) ? {2} : {3}",
    }
    of_bytes = replace(syntax, define=f"const {TRUTH} {{name}} = {{value}};", forms=forms)
    return lambda statement: of_bytes if statement.results[0] in truths else syntax


def truth_operands(truths: frozenset[str], revise: Revise) -> Revise:
    """How operands are written: numbers in a truth value as whole numbers, the others as `revise` says."""

    def revised(statement: Statement, operands: tuple[str, ...]) -> tuple[str, ...]:
        if statement.results[0] not in truths:
            return revise(statement, operands)
        compared = 2 if statement.operator is Operator.SELECT_LT else 0
        made_of = zip(statement.operands[compared:], operands[compared:], strict=True)
        return *operands[:compared], *(_whole(operand) or text for operand, text in made_of)

    return revised


def truth_literals(program: Program, places: Sequence[str]) -> Mapping[str, Callable[[Operand], str]]:
    """How numbers are written at the places of results that hold truth values."""
    return dict.fromkeys(compress(places, truth_places(program)), _whole)


def _whole(operand: Operand) -> str:
    """A number as a whole number; empty for a temporary."""
    return f"{operand.value}U" if isinstance(operand, Constant) else ""


def truth_places(program: Program) -> tuple[bool, ...]:
    """Whether each output of a program is a truth value."""
    return tuple(array.is_truth for array in program.signature.results for _ in range(array.size))


def is_truth(operand: Operand, truths: frozenset[str]) -> bool:
    """Whether an operand is a truth value, or a number that can be one."""
    if isinstance(operand, Constant):
        return operand.single is None and operand.value in _BITS
    return isinstance(operand, Temporary) and operand.name in truths


def _numbers(program: Program) -> Iterator[Operand]:
    """The outputs that are not truth values."""
    yield from compress(program.outputs, (not holds for holds in truth_places(program)))


def _kept(program: Program, found: frozenset[str], users: dict[str, list[Statement]]) -> frozenset[str]:
    """Those that are made of truth values, and used by nothing else."""
    return frozenset(
        statement.name
        for statement in program.statements
        if len(statement.results) == 1
        and statement.name in found
        and _gives(statement, found)
        and all(_takes(user, statement.name, found) for user in users.get(statement.name, ()))
    )


def _gives(statement: Statement, truths: frozenset[str]) -> bool:
    """Whether a statement makes a truth value."""
    if statement.operator is Operator.SELECT_LT:
        return all(is_truth(operand, truths) for operand in statement.operands[2:])
    return statement.operator is Operator.MUL and all(is_truth(operand, truths) for operand in statement.operands)


def _takes(statement: Statement, name: str, truths: frozenset[str]) -> bool:
    """Whether a statement uses a temporary as a truth value."""
    if statement.results[0] not in truths:
        return False
    if statement.operator is Operator.SELECT_LT:
        return Temporary(name) not in statement.operands[:2]
    return True
