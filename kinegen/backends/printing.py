"""The one walk over a program that prints the body of a function in any syntax, and the bodies of routines."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field, replace
from fractions import Fraction
from types import MappingProxyType
from typing import Any, Generic, Protocol, TypeVar

from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.sections import CONSTANT, FEWEST
from kinegen.ir.finalize import last_reads
from kinegen.ir.fixed_point.program import Integer
from kinegen.ir.program import Constant, Operator, RuntimeParameter, Temporary, Variable
from kinegen.ir.routine_notation import Routine
from kinegen.ir.routines import ATAN2_DOUBLE, ATAN2_FLOAT, SINCOS_DOUBLE, SINCOS_FLOAT
from kinegen.support.compat import StrEnum
from kinegen.support.dataclass import dataclass

_MANY = 64
"""Programs of so many statements give temporaries back: of a block of rows, they would be more than a cache holds."""

_TOGETHER = 16
"""Temporaries that one line gives back."""

Op = TypeVar("Op", bound=StrEnum)
"""The operators of a program: `Operator`, or those of integers."""

Op_co = TypeVar("Op_co", bound=StrEnum, covariant=True)
"""The same of what is only read."""


class Step(Protocol[Op_co]):
    """A statement of numbers or of integers."""

    @property
    def results(self) -> tuple[str, ...]:
        """The names of the temporaries that it defines: one, or those of a sine and a cosine."""

    @property
    def operator(self) -> Op_co:
        """Return what it does."""

    @property
    def operands(self) -> tuple[Any, ...]:
        """Return what it does it to."""


class Code(Protocol[Op_co]):
    """A program, or a part of one."""

    @property
    def statements(self) -> Sequence[Step[Op_co]]:
        """The code."""

    @property
    def outputs(self) -> Sequence[Any]:
        """The numbers of the results."""


class Titled(Protocol):
    """Statements with a title or a comment."""

    @property
    def title(self) -> str:
        """Return what they are about."""

    @property
    def statements(self) -> Sequence[Any]:
        """The statements."""


def _untitled(_title: str) -> tuple[str, ...]:
    return ()


@dataclass(frozen=True, slots=True)
class Syntax(Generic[Op]):
    """All that differs between languages in the body of a function.

    Attributes:
        language: What it is called in messages.
        literal: A constant as text, without brackets.
        define: A definition, with `{name}` and `{value}`.
        store: An assignment to a place of a result, with `{place}` and `{value}`.
        sincos: The lines that define sine and cosine, from the names of both and the angle.
        parameter: A runtime parameter, with `{name}`.
        forms: The expression of each other operator, with `{0}` and so on for its operands.
        negative: A negative number among the operands of an operation, with `{0}`.
        others: Definitions of operators whose results are of another type.
        unused: The name of a sine or cosine that nothing uses, with `{name}`.
        identifier: A name of the robot file as this language allows it.
        heading: The lines before a section, from its title; the first one is blank.
        release: In long programs, the line that gives back temporaries nothing reads any more, with `{names}`; empty
            where a language needs none.
    """

    language: str
    literal: Callable[[Any], str]
    define: str
    store: str
    sincos: Callable[[str, str, str], tuple[str, ...]]
    parameter: str
    forms: Mapping[Op, str]
    negative: str = "({0})"
    others: Mapping[Op, str] = field(default_factory=dict)
    unused: str = "{name}"
    identifier: Callable[[str], str] = str
    heading: Callable[[str], tuple[str, ...]] = _untitled
    release: str = ""


Revise = Callable[[Any, tuple[str, ...]], tuple[str, ...]]
"""The operands of a statement as text, where a language or a kernel writes some of them in another way."""


def as_it_is(_statement: Any, operands: tuple[str, ...]) -> tuple[str, ...]:
    """Write every operand as it is."""
    return operands


@dataclass(frozen=True, slots=True)
class Printer(Generic[Op]):
    """Prints one program.

    Attributes:
        syntax: Of which language.
        variables: How each number of the inputs is written.
        revise: Which operands of a statement are written in another way.
        is_direct: Whether a result that no statement reads is stored without a name of its own.
        others: The syntax of a statement, where results of several types have several; None for that of the program.
        literals: How numbers are written at places of another type.
        elsewhere: How temporaries are written that other lines define.
    """

    syntax: Syntax[Op]
    variables: Sequence[str]
    revise: Revise = as_it_is
    is_direct: bool = False
    others: Callable[[Any], Syntax[Op]] | None = None
    literals: Mapping[str, Callable[[Any], str]] = field(default_factory=dict)
    elsewhere: Mapping[str, str] = field(default_factory=dict)

    def operand(self, operand: Any) -> str:
        """Return one operand of an operation."""
        text = self.value(operand)
        return self.syntax.negative.format(text) if text.startswith("-") else text

    def value(self, operand: Any) -> str:
        """Return one operand by itself."""
        match operand:
            case Variable(index):
                return self.variables[index]
            case RuntimeParameter(name):
                return self.syntax.parameter.format(name=self.syntax.identifier(name))
            case Temporary(name):
                return self.elsewhere.get(name, name)
            case Constant() | Integer():
                return self.syntax.literal(operand)
            case _:
                raise TypeError(f"{self.syntax.language} has no form for the operand {operand!r}")

    def assignment(self, place: str, operand: Any) -> str:
        """Return the assignment of an operand to a place of a result."""
        written = self.literals.get(place, self.value) if isinstance(operand, Constant) else self.value
        return self.syntax.store.format(place=place, value=written(operand))

    def lines(
        self,
        program: Code[Op],
        places: Sequence[str | None],
        parts: Sequence[Titled] = (),
        rows: Sequence[str] = (),
    ) -> tuple[str, ...]:
        """Return the statements of a program; one operation each.

        Args:
            program: The program, or a part of it.
            places: Where each of its outputs belongs. A result is stored as soon as it is computed, so that it need not
                be kept (outputs do not overlap inputs); what needs no computing comes last. None leaves one out.
            parts: Its sections, each with a heading; none for lines without titles.
            rows: What comes after all that: assignments of numbers.
        """
        stores: defaultdict[str, list[str]] = defaultdict(list)
        last: list[str] = []
        for place, operand in zip(places, program.outputs, strict=True):
            if place is not None and isinstance(operand, Temporary) and operand.name not in self.elsewhere:
                stores[operand.name].append(place)
            elif place is not None:
                last.append(self.assignment(place, operand))
        read = _names(each for statement in program.statements for each in statement.operands)
        used = read | _names(program.outputs)
        lines: list[str] = []
        groups: list[tuple[str, Sequence[Any]]] = [(part.title, part.statements) for part in parts]
        released = self._released(program)
        for title, statements in groups or [("", program.statements)]:
            lines += self.syntax.heading(title) if parts else ()
            for statement in statements:
                if self.is_direct and stores[statement.results[0]] and read.isdisjoint(statement.results):
                    lines += self._stores(stores[statement.name], self._value(statement))
                else:
                    lines += self.statement(statement, used)
                    lines += (line for name in statement.results for line in self._stores(stores[name], name))
                lines += released.get(statement.results[0], ())
        if parts and len(last) + len(rows) >= FEWEST:
            lines += self.syntax.heading(CONSTANT)
        body = (*lines, *last, *rows)
        return body[1:] if body and not body[0] else body  # no blank line at the beginning

    def _released(self, program: Code[Op]) -> dict[str, tuple[str, ...]]:
        """Return the lines that give back temporaries, by the first result of the statement that they follow."""
        if not self.syntax.release or len(program.statements) < _MANY:
            return {}
        last = last_reads(program)
        names = sorted(last, key=last.__getitem__)
        full = [names[start : start + _TOGETHER] for start in range(0, len(names) - _TOGETHER + 1, _TOGETHER)]
        ends = {last[some[-1]]: (self.syntax.release.format(names=", ".join(some)),) for some in full}
        ends.pop(len(program.statements) - 1, None)  # what follows is the end
        return {program.statements[place].results[0]: lines for place, lines in ends.items()}

    def _stores(self, places: Sequence[str], value: str) -> list[str]:
        return [self.syntax.store.format(place=place, value=value) for place in places]

    def statement(self, statement: Any, used: frozenset[str]) -> tuple[str, ...]:
        """Return the lines of one statement.

        `used`: the temporaries that anything reads.
        """
        if len(statement.results) > 1:
            unused = self.syntax.unused
            sine, cosine = (name if name in used else unused.format(name=name) for name in statement.results)
            return self.syntax.sincos(sine, cosine, *self._operands(statement))
        syntax = self._syntax(statement)
        define = syntax.others.get(statement.operator, syntax.define)
        return (define.format(name=statement.name, value=self._value(statement)),)

    def _value(self, statement: Any) -> str:
        """Return the operation of a statement with one result."""
        forms = self._syntax(statement).forms
        if statement.operator not in forms:
            raise TypeError(f"{self.syntax.language} has no form for the operator {statement.operator!r}")
        return forms[statement.operator].format(*self._operands(statement))

    def _syntax(self, statement: Any) -> Syntax[Op]:
        return self.syntax if self.others is None else self.others(statement)

    def _operands(self, statement: Any) -> tuple[str, ...]:
        return self.revise(statement, tuple(map(self.operand, statement.operands)))


def _names(operands: Iterable[Any]) -> frozenset[str]:
    """Return the temporaries among operands; of a sine and a cosine one may be missing."""
    return frozenset(operand.name for operand in operands if isinstance(operand, Temporary))


def number(literal: Callable[[Fraction], str]) -> Callable[[Constant], str]:
    """Return literals of a language that takes the same number for every type."""
    return lambda constant: literal(constant.value)


CODE: Mapping[ScalarType, Mapping[Operator, Routine]] = MappingProxyType(
    {
        ScalarType.DOUBLE: MappingProxyType({Operator.SINCOS: SINCOS_DOUBLE, Operator.ATAN2: ATAN2_DOUBLE}),
        ScalarType.FLOAT: MappingProxyType({Operator.SINCOS: SINCOS_FLOAT, Operator.ATAN2: ATAN2_FLOAT}),
    }
)
"""The routines by number type and operator."""


def routine_lines(
    routine: Routine,
    syntax: Syntax[Operator],
    *,
    comment: Callable[[str], tuple[str, ...]],
    store: str = "",
    places: Sequence[str | None] = (),
    revise: Revise = as_it_is,
    begin: str = "",
) -> tuple[str, ...]:
    """Print the body of a routine.

    `syntax`: the syntax of kernels in the language. Negative numbers have no brackets here. `comment`: a comment of
    several lines. `store`: how a result is stored or returned, with `{place}` and `{value}`. `places`: where each
    result is stored; none for code after which results are returned by their names. `revise`: which operands are
    written in another way. `begin`: how the comments of the passages begin that are printed.
    """

    def heading(title: str) -> tuple[str, ...]:
        return "", *comment(title)

    own = replace(syntax, negative="{0}", heading=heading, store=store)
    printer = Printer(own, routine.inputs, revise, is_direct=True)
    passages = [passage for passage in routine.passages if passage.title.startswith(begin)]
    return printer.lines(routine, places or (None,) * len(routine.outputs), passages)


def block_comment(text: str) -> tuple[str, ...]:
    """Return a comment as C writes it, and languages that took it from there."""
    first, *others = text.split("\n")
    lines = [f"/* {first}", *(f"   {line}" for line in others)]
    return *lines[:-1], f"{lines[-1]} */"
