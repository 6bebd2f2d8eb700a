"""The tile of a batch kernel: rows of parameters, results that are stored as they come, lanes of inputs."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import replace

from kinegen.backends.c.arguments import computed, given
from kinegen.backends.printing import Printer
from kinegen.backends.scalar_types import ScalarType
from kinegen.ir.program import Constant, Operand, Operator, Program, RuntimeParameter, Statement, Temporary, Variable
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import companion

_WIDTH = 112
"""Longest line of a comment."""


@dataclass(frozen=True, slots=True)
class Part:
    """Holds statements that are printed together, and the numbers that are stored, in the order of their places."""

    statements: tuple[Statement, ...]
    outputs: tuple[Operand, ...]


@dataclass(frozen=True, slots=True)
class Parts:
    """Holds a program in two parts. The variables after those of the inputs are the rows of parameters.

    Attributes:
        rows: What each row holds: the names of the parameters, then those of temporaries.
        first: What follows from the parameters alone; its outputs are the rows after those of the parameters.
        rest: The program without that.
    """

    rows: tuple[str, ...]
    first: Part
    rest: Part


@dataclass(frozen=True, slots=True)
class ParamRows:
    """Holds the rows of a tile for the parameters, printed; `words` say what each holds.

    Attributes:
        taker: Name of the function that fills them.
        function: Name of the function that computes what follows from parameters alone; empty where nothing does.
    """

    count: int
    words: tuple[str, ...]
    taker: str
    function: str
    body: tuple[str, ...]


def param_rows(printer: Printer[Operator], parts: Parts, function: str, suffix: str) -> ParamRows:
    """Prints the first part of a program that reads parameters.

    The variables of the printer go on with the rows `p[0][i]`, `p[1][i]` and so on. The names of functions that bring
    tiles in and out end in the suffix.
    """
    begin = len(parts.rows) - len(parts.first.outputs)
    body = printer.lines(parts.first, [f"p[{row}][i]" for row in range(begin, len(parts.rows))])
    return ParamRows(
        count=len(parts.rows),
        words=_lines(parts.rows),
        taker=companion(function, "params") if body else f"take_params{suffix}",
        function=companion(function, "from_params") if body else "",
        body=body,
    )


def _lines(rows: tuple[str, ...]) -> tuple[str, ...]:
    text = ", ".join(f"p[{row}]~{name}" for row, name in enumerate(rows))
    lines = textwrap.wrap(text, _WIDTH, break_long_words=False, break_on_hyphens=False)
    return tuple(line.replace("~", " ") for line in lines)


def part(program: Program) -> Parts:
    """Divides a program: what follows from the parameters alone, and all the rest.

    A tile has a row of numbers for each parameter, and one for each number that follows from parameters alone and is
    used by the rest. With one set of parameters for a whole batch these rows are filled once; with a set for each
    configuration they are filled for each tile. The rest is the same code in both cases, so it gives the same bits,
    also where the compiler fuses products and sums.
    """
    if not program.reads_parameters:
        return Parts((), Part((), ()), Part(program.statements, program.outputs))
    early: dict[str, Statement] = {}
    late: list[Statement] = []
    # A statement is early if all that it reads is.
    for statement in program.statements:
        if all(_is_early(operand, early) for operand in statement.operands):
            early |= dict.fromkeys(statement.results, statement)
        else:
            late.append(statement)
    # Early numbers that the rest reads go on in rows of a tile.
    used = {operand.name for operand in _operands(late, program.outputs) if isinstance(operand, Temporary)}
    handed_on = [name for name in early if name in used]
    inputs = sum(given.size for given in program.signature.inputs)
    rows = (*program.parameters, *handed_on)
    # Both parts read rows as variables behind the inputs.
    places: dict[Operand, Operand] = {}
    for place, name in enumerate(rows):
        operand = RuntimeParameter(name) if place < len(program.parameters) else Temporary(name)
        places[operand] = Variable(inputs + place)
    parameters: dict[Operand, Operand] = {
        operand: place for operand, place in places.items() if isinstance(operand, RuntimeParameter)
    }
    first = Part(_moved(dict.fromkeys(early.values()), parameters), tuple(Temporary(name) for name in handed_on))
    outputs = tuple(places.get(operand, operand) for operand in program.outputs)
    return Parts(rows, first, Part(_moved(late, places), outputs))


def _is_early(operand: Operand, early: Mapping[str, Statement]) -> bool:
    if isinstance(operand, Temporary):
        return operand.name in early
    return isinstance(operand, (RuntimeParameter, Constant))


def _operands(statements: Iterable[Statement], outputs: tuple[Operand, ...]) -> tuple[Operand, ...]:
    return (*(operand for statement in statements for operand in statement.operands), *outputs)


def _moved(statements: Iterable[Statement], places: Mapping[Operand, Operand]) -> tuple[Statement, ...]:
    return tuple(
        replace(statement, operands=tuple(places.get(operand, operand) for operand in statement.operands))
        for statement in statements
    )


LONGEST_DIRECT = 200
"""Statements of a kernel that is printed twice, once for results in rows alone: longer ones take long to compile, and
have more to do than to store."""


@dataclass(frozen=True, slots=True)
class Direct:
    """Says how full tiles go straight into the rows of a result, where neighbours lie next to each other.

    Attributes:
        condition: When that can be.
        values: What is passed to the function that evaluates a tile.
        constants: Assignments of the rows that hold the same number for every configuration.
    """

    condition: str
    result: str
    values: str
    constants: tuple[str, ...]


def direct_way(
    printer: Printer[Operator],
    body: tuple[str, ...],
    program: Program,
    size: str,
    constants: dict[int, Constant],
    *,
    reads_params: bool,
) -> Direct | None:
    """Finds the way without the tile, for short kernels of one result; None for others.

    The body are the statements for one configuration, `size` is the constant that counts those of a tile, and
    `constants` are the rows that hold the same number for every one.
    """
    read = tuple(array for array in given(program) if program.reads(array))
    results = computed(program)
    if not read or len(results) != 1 or len(body) > LONGEST_DIRECT:
        return None
    # Neighbours in memory let compilers write whole vectors.
    name = results[0].name
    neighbours = [f"({array.name}_pose == 1)" for array in read]
    values = [f"{array.name} + begin, 1, {array.name}_joint" for array in read] + ["given"] * reads_params
    return Direct(
        condition=" && ".join(["(layout == 2)", *neighbours, f"({name}_stride >= {size})"]),
        result=name,
        values=", ".join([*values, "to", f"{name}_stride"]),
        constants=tuple(printer.assignment(f"to[{row} * {name}_stride + i]", each) for row, each in constants.items()),
    )


PART = 4
"""Numbers of a part."""

_NAMES = ("four", "eight", "sixteen")


@dataclass(frozen=True, slots=True)
class Lanes:
    """Describes the vectors of one width, in which numbers of several configurations are turned.

    A vector consists of parts of four numbers, and part g of vector i holds numbers of configuration i + 4 g. Four
    vectors are transposed within each part; whole parts are then put together for one configuration.
    """

    parts: int
    bytes_each: int

    @property
    def count(self) -> int:
        """Numbers of a vector, and configurations that are turned at once."""
        return PART * self.parts

    @property
    def types(self) -> tuple[tuple[str, int], ...]:
        """Names and bytes of vectors of one part, of two, and so on up to this width."""
        widths = (PART * self.bytes_each << number for number in range(self.parts.bit_length()))
        return tuple(zip(_NAMES, widths, strict=False))

    @property
    def name(self) -> str:
        """Says what the type of a vector is called, after the prefix."""
        return self.types[-1][0]

    @property
    def bytes(self) -> int:
        """Bytes of a vector."""
        return self.types[-1][1]

    @property
    def starts(self) -> tuple[str, ...]:
        """Where each part of a vector is read from, for the configurations from `one` on."""
        return tuple(f"(one + {PART * part} * stride)" if part else "one" for part in range(self.parts))

    @property
    def last_rows(self) -> str:
        """The last rows of matrices, side by side."""
        return ", ".join(["0, 0, 0, 1"] * self.parts)

    @property
    def shares(self) -> tuple[tuple[str, str, str], ...]:
        """Parts one by one: the configuration, indices of it and the same part of another vector, and of it alone."""
        return tuple(
            (f"(i + {PART * part})" if part else "i", self.whole(f"a{part} b{part}"), self.whole(f"a{part}"))
            for part in range(self.parts)
        )

    def numbers(self, places: str) -> str:
        """Lists the indices of a shuffle that does the same in every part.

        Places are the vector (a or b) of each number and the place there, such as `a0 b0 a1 b1`.
        """
        each = [(place[0] == "b", int(place[1])) for place in places.split()]
        return _joined(PART * (self.parts * b + part) + at for part in range(self.parts) for b, at in each)

    def whole(self, places: str) -> str:
        """Lists the indices of a shuffle of whole parts, from the vector (a or b) and the part there of each."""
        each = [(place[0] == "b", int(place[1])) for place in places.split()]
        return _joined(PART * (self.parts * b + part) + at for b, part in each for at in range(PART))


def lanes_of(real: ScalarType) -> tuple[Lanes, Lanes]:
    """Returns the vectors of one number type: of 32 bytes, and the widest ones."""
    parts, size = (1, 8) if real is ScalarType.DOUBLE else (2, 4)
    return Lanes(parts, size), Lanes(2 * parts, size)


def firsts(size: int) -> tuple[int, ...]:
    """Returns the first of each four numbers that are turned at once, of so many.

    The last four may share some with others.
    """
    return tuple(min(first, size - PART) for first in range(0, size, PART)) if size >= PART else ()


def _joined(indices: Iterable[int]) -> str:
    return ", ".join(map(str, indices))
