"""Says how the body of a function is written in C, and what other languages with its operators share with it.

Results that are truth values are bytes in C: processors without a floating-point unit then compare bytes where they
would call a library, and others keep a register free.
"""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache, partial
from itertools import compress
from types import MappingProxyType
from typing import Any

from kinegen.backends.c.constants import is_length
from kinegen.backends.printing import CODE, Printer, Revise, Syntax, as_it_is, block_comment, routine_lines
from kinegen.backends.routines import LINE
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.sections import angle_names
from kinegen.ir.program import Constant, Operand, Operator, Program, Statement, Temporary

ARITHMETIC = {
    Operator.ADD: "{0} + {1}",
    Operator.SUB: "{0} - {1}",
    Operator.MUL: "{0} * {1}",
    Operator.DIV: "{0} / {1}",
    Operator.NEG: "-{0}",
}
"""Forms that all languages with the operators of C have."""


def c_like(language: str, forms: Mapping[Operator, str], **others: Any) -> Syntax[Operator]:
    """Makes the syntax of a language with the operators and the assignments of C.

    `forms` are those of its other operators, and of those that it writes in another way.
    """
    every = MappingProxyType({**ARITHMETIC, **forms})
    return Syntax(language=language, store="{place} = {value};", forms=every, **others)


def line_heading(mark: str, width: int, words: Callable[[str], str] = str) -> Callable[[str], tuple[str, ...]]:
    """Makes headings of a blank line and comments that end with the line; nothing where there is no title."""

    def heading(title: str) -> tuple[str, ...]:
        lines = textwrap.wrap(words(title), width, break_long_words=False)
        return ("", *(f"{mark} {line}" for line in lines)) if lines else ()

    return heading


def c_syntax(real: ScalarType, sincos: str, prefix: str, *, selects_bits: bool = False) -> Syntax[Operator]:
    """Makes the syntax of C for one number type, with names of the sine-cosine function and of others.

    `sincos` is a function or a macro; the names of other functions begin with the prefix. With `selects_bits`
    selections are calls of a function, so that loops over them become vector code.
    """
    return c_like(
        "C",
        {
            Operator.SQRT: f"{prefix}_sqrt({{0}})",
            Operator.ATAN2: f"{prefix}_atan2({{0}}, {{1}})",
            Operator.SELECT_LT: f"{prefix}_select_lt({{0}}, {{1}}, {{2}}, {{3}})" if selects_bits else _SELECT,
        },
        literal=partial(_literal, real),
        define=f"const {real} {{name}} = {{value}};",
        sincos=partial(_pair, real, sincos),
        parameter="params->{name}",
        heading=_heading,
    )


_SELECT = "({0} < {1}) ? {2} : {3}"


def named_lengths(program: Program, constants: Mapping[Fraction, str]) -> Revise:
    """Prints the lengths of the table by their names."""
    if not constants:
        return as_it_is
    # The number of a length may also be the number of an angle, which keeps its digits.
    angles = angle_names(program.statements)

    def revise(statement: Statement, operands: tuple[str, ...]) -> tuple[str, ...]:
        if not is_length(statement, angles):
            return operands
        return tuple(_named(*each, constants) for each in zip(statement.operands, operands, strict=True))

    return revise


def c_printer(
    real: ScalarType, sincos: str, variables: Sequence[str], prefix: str, *, selects_bits: bool = False
) -> Printer[Operator]:
    """Prints statements in the syntax of C; see `c_syntax`."""
    return Printer(c_syntax(real, sincos, prefix, selects_bits=selects_bits), variables)


def _named(operand: Operand, text: str, constants: Mapping[Fraction, str]) -> str:
    """Returns one operand, a length of the table by its name."""
    if not isinstance(operand, Constant) or operand.single is not None or abs(operand.value) not in constants:
        return text
    return f"{'-' if operand.value < 0 else ''}{constants[abs(operand.value)]}"


@lru_cache(maxsize=4096)
def _literal(real: ScalarType, constant: Constant) -> str:
    return real.literal(constant.of(real is ScalarType.FLOAT))


def _pair(real: ScalarType, function: str, sine: str, cosine: str, angle: str) -> tuple[str, ...]:
    return f"{real} {sine};", f"{real} {cosine};", f"{function}({angle}, &{sine}, &{cosine});"


def _heading(title: str) -> tuple[str, ...]:
    """Returns a blank line and a comment; nothing where there is no title."""
    if not title:
        return ()
    # The comment closes on its last line.
    first, *others = textwrap.wrap(title, LINE - 5, break_long_words=False)
    lines = [f"/* {first}", *(f" * {line}" for line in others)]
    return "", *lines[:-1], f"{lines[-1]} */"


TRUTH = "uint8_t"
"""Type of a truth value in C: 1 or 0 in a byte, which C++ and other languages lay out alike."""

_BITS = (0, 1)


def truths_of(program: Program) -> frozenset[str]:
    """Finds the temporaries of a program that are truth values; none where no result is one.

    A selection of truth values and a product of two are truth values. One that anything else uses is a number, and so
    is what is made of it.

    Raises:
        ValueError: If a result that is declared as a truth value is something else.
    """
    if not any(array.is_truth for array in program.signature.results):
        return frozenset()
    # Who reads each temporary decides whether it may be a byte.
    users: dict[str, list[Statement]] = {}
    for statement in program.statements:
        for operand in statement.operands:
            if isinstance(operand, Temporary):
                users.setdefault(operand.name, []).append(statement)
    are_numbers = (not holds for holds in truth_places(program))
    numbers = {place.name for place in compress(program.outputs, are_numbers) if isinstance(place, Temporary)}
    found = frozenset(name for statement in program.statements for name in statement.results) - numbers
    # What is made of a number is a number: names leave the set until none has to.
    while (kept := _kept(program, found, users)) != found:
        found = kept
    if not all(is_truth(place, found) for place in compress(program.outputs, truth_places(program))):
        raise ValueError(f"{program.quantity}: a result that is declared as a Boolean is not one")
    return found


def truth_printer(
    program: Program,
    syntaxes: tuple[Syntax[Operator], Syntax[Operator]],
    words: tuple[str, str],
    variables: Sequence[str],
    places: Sequence[str],
    revise: Revise = as_it_is,
) -> Printer[Operator]:
    """Makes the printer of a program some of whose results are truth values, written as the words for 0 and 1.

    The second syntax is that of statements that make a truth value; `revise` is for statements of numbers.
    """
    truths, (plain, of_truths) = truths_of(program), syntaxes

    def word(operand: Operand) -> str:
        return words[bool(operand.value)] if isinstance(operand, Constant) else ""

    def revised(statement: Statement, operands: tuple[str, ...]) -> tuple[str, ...]:
        if statement.results[0] not in truths:
            return revise(statement, operands)
        # What is compared are numbers; what is selected or multiplied are truth values.
        compared = 2 if statement.operator is Operator.SELECT_LT else 0
        made_of = zip(statement.operands[compared:], operands[compared:], strict=True)
        return *operands[:compared], *(word(operand) or text for operand, text in made_of)

    return Printer(
        plain,
        variables,
        revised,
        others=lambda statement: of_truths if statement.results[0] in truths else plain,
        literals=dict.fromkeys(compress(places, truth_places(program)), word),
    )


def byte_syntax(syntax: Syntax[Operator]) -> Syntax[Operator]:
    """Makes the syntax of statements in C that make a truth value; a product of two is 1 where both are."""
    forms = {Operator.MUL: f"({TRUTH})({{0}} & {{1}})", Operator.SELECT_LT: _SELECT}
    return replace(syntax, define=f"const {TRUTH} {{name}} = {{value}};", forms=forms)


def truth_places(program: Program) -> tuple[bool, ...]:
    """Returns whether each output of a program is a truth value."""
    return tuple(array.is_truth for array in program.signature.results for _ in range(array.size))


def is_truth(operand: Operand, truths: frozenset[str]) -> bool:
    """Returns whether an operand is a truth value, or a number that can be one."""
    if isinstance(operand, Constant):
        return operand.single is None and operand.value in _BITS
    return isinstance(operand, Temporary) and operand.name in truths


def _kept(program: Program, found: frozenset[str], users: dict[str, list[Statement]]) -> frozenset[str]:
    """Returns those that are made of truth values, and used by nothing else."""
    return frozenset(
        statement.name
        for statement in program.statements
        if len(statement.results) == 1
        and statement.name in found
        and _gives(statement, found)
        and all(_takes(user, statement.name, found) for user in users.get(statement.name, ()))
    )


def _gives(statement: Statement, truths: frozenset[str]) -> bool:
    if statement.operator is Operator.SELECT_LT:
        return all(is_truth(operand, truths) for operand in statement.operands[2:])
    return statement.operator is Operator.MUL and all(is_truth(operand, truths) for operand in statement.operands)


def _takes(statement: Statement, name: str, truths: frozenset[str]) -> bool:
    if statement.results[0] not in truths:
        return False
    if statement.operator is Operator.SELECT_LT:
        return Temporary(name) not in statement.operands[:2]
    return True


_STORES = {"sincos": ("{place} = {value};", ("*s", "*c")), "atan2": ("return {value};", ("",))}


def c_routine(name: str, real: str, begin: str = "") -> tuple[str, ...]:
    """Prints the statements of the function `sincos` or `atan2`, with the comments of passages that begin like this."""
    store, places = _STORES[name]
    syntax = c_syntax(ScalarType(real), "", "")
    routine = CODE[ScalarType(real)][Operator(name)]
    return routine_lines(routine, syntax, comment=block_comment, store=store, places=places, begin=begin)
