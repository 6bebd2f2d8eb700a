"""Says how the body of a function is written in JavaScript, and its loops over angles.

Its numbers are doubles, and its operators round each result once, as those of C without contraction: the same bits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from kinegen.backends.c.syntax import c_like, line_heading
from kinegen.backends.printing import CODE, Printer, block_comment, number, routine_lines
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.sections import Section
from kinegen.ir.program import Operand, Operator, Program, Statement, Temporary
from kinegen.ir.routine_notation import Routine
from kinegen.support.dataclass import dataclass

SINES, COSINES = "sines", "cosines"
"""The arrays of the module for sines and cosines; an angle waits in the place of its sine."""


def _pair(sine: str, cosine: str, angle: str) -> tuple[str, ...]:
    """Returns one by itself; kernels take several in a call."""
    return (
        f"{SINES}[0] = {angle};",
        "sincos(1);",
        f"const {sine} = {SINES}[0];",
        f"const {cosine} = {COSINES}[0];",
    )


_COMMENT = 115
"""Characters of a comment in a function."""

SYNTAX = c_like(
    "JavaScript",
    {
        Operator.SQRT: "sqrt({0})",
        Operator.ATAN2: "atan2({0}, {1})",
        Operator.SELECT_LT: "{0} < {1} ? {2} : {3}",
    },
    literal=number(ScalarType.DOUBLE.literal),
    define="const {name} = {value};",
    sincos=_pair,
    parameter="params.{name}",
    heading=line_heading("//", _COMMENT),
)


_SECOND = "_b"
"""What follows the names of the second angle."""


@dataclass(frozen=True, slots=True)
class Step:
    """Holds the sines and cosines that are taken in one call, and the statements up to the next call."""

    pairs: tuple[Statement, ...]
    statements: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class _Part:
    statements: tuple[Statement, ...]
    outputs: tuple[Operand, ...] = ()


def steps(program: Program) -> tuple[Step, ...]:
    """Orders the statements of a program, with its sines and cosines in as few calls as their angles allow.

    V8 copies no function of this length into its callers, and allocates a number for each that is passed to one: a
    kernel leaves its angles in an array and takes all of them in one call.

    Returns:
        The statements before the first call, without pairs, and each call with what follows it. What leads to an angle
        comes before the call; all else keeps its order.
    """
    ranks: dict[str, int] = {}
    last, rank_of = 0, dict[Statement, int]()
    # The rank of a statement is the number of calls that it needs.
    for statement in program.statements:
        rank = max((ranks.get(each.name, 0) for each in statement.operands if isinstance(each, Temporary)), default=0)
        rank += statement.operator is Operator.SINCOS
        last, rank_of[statement] = max(last, rank), rank
        ranks |= dict.fromkeys(statement.results, rank)
    early = _leading(program, rank_of)
    # What leads to an angle comes before its call, and all else behind the last one.
    groups: list[tuple[list[Statement], list[Statement]]] = [([], []) for _ in range(last + 1)]
    for statement in program.statements:
        if statement.operator is Operator.SINCOS:
            groups[rank_of[statement]][0].append(statement)
        else:
            groups[early.get(statement.name, last)][1].append(statement)
    return tuple(Step(tuple(pairs), tuple(others)) for pairs, others in groups)


def _leading(program: Program, rank_of: dict[Statement, int]) -> dict[str, int]:
    """Returns the call after which each temporary is computed that leads to a later angle: the last one before that."""
    needed: dict[str, int] = {}
    for statement in reversed(program.statements):
        if statement.operator is Operator.SINCOS:
            before = rank_of[statement] - 1
        elif statement.name in needed:
            before = needed[statement.name]
        else:
            continue
        for each in statement.operands:
            if isinstance(each, Temporary):
                needed[each.name] = min(before, needed.get(each.name, before))
    return needed


def kernel_lines(
    program: Program, variables: Sequence[str], places: Sequence[str], rows: Sequence[str], parts: Sequence[Section]
) -> tuple[str, ...]:
    """Prints the body of a kernel.

    `variables`: how inputs are written. `places`: where outputs belong. `rows`: what comes after all that. `parts`: the
    sections of the program.
    """
    printer = Printer(SYNTAX, variables)
    used = frozenset(each.name for each in program.used if isinstance(each, Temporary))
    outputs = tuple(zip(places, program.outputs, strict=True))
    *early, last = steps(program)
    kept = ((part.title, tuple(filter(frozenset(last.statements).__contains__, part.statements))) for part in parts)
    titled = tuple(Section(title, statements) for title, statements in kept if statements)
    # The first title is that of the angles where all of them are taken before what else has a title.
    lines = [*SYNTAX.heading(parts[0].title)[1:]] if titled and titled[0].title != parts[0].title else []
    for step in (*early, last):
        # Each call fills the arrays anew: what is read of them gets a name.
        lines += _call(printer, step.pairs, used)
        defined = {name for statement in (*step.pairs, *step.statements) for name in statement.results}
        now = [each for each in outputs if isinstance(each[1], Temporary) and each[1].name in defined]
        now += [each for each in outputs if step is last and not isinstance(each[1], Temporary)]
        code = _Part(step.statements, tuple(operand for _, operand in now))
        own = replace(printer, elsewhere={name: name for pair in step.pairs for name in pair.results})
        lines += [""] * bool(step is last and titled and lines)
        ends = (titled, rows) if step is last else ()
        lines += own.lines(code, [place for place, _ in now], *ends)
    return tuple(lines)


def _call(printer: Printer[Operator], pairs: Sequence[Statement], used: frozenset[str]) -> list[str]:
    """Returns the angles in the places of their sines, the call, and the names of the results."""
    if not pairs:
        return []
    lines = [printer.assignment(f"{SINES}[{place}]", each.operands[0]) for place, each in enumerate(pairs)]
    lines.append(f"sincos({len(pairs)});")
    for place, pair in enumerate(pairs):
        for name, array in zip(pair.results, (SINES, COSINES), strict=True):
            lines += [SYNTAX.define.format(name=name, value=f"{array}[{place}]")] * (name in used)
    return lines


def most_angles(programs: Sequence[Program]) -> int:
    """Returns the length of the arrays: the angles of the longest call, and one more if that is odd."""
    longest = max((len(step.pairs) for program in programs for step in steps(program)), default=0)
    return longest + longest % 2


def sincos_lines() -> tuple[str, ...]:
    """Prints the loop over the angles: two in each round.

    Two keep a processor busy that would wait for the results of one. Both are read first and stored last, so V8
    interleaves them.
    """
    first = CODE[ScalarType.DOUBLE][Operator.SINCOS]
    second = _renamed(first)
    places = {f"{SINES}[at]": first, f"{SINES}[at + 1]": second}
    store = SYNTAX.define.format(name="{place}", value="{value}")
    names = ("sine", "cosine"), (f"sine{_SECOND}", f"cosine{_SECOND}")
    lines = [SYNTAX.define.format(name=routine.inputs[0], value=place) for place, routine in places.items()]
    lines += routine_lines(first, SYNTAX, comment=block_comment, store=store, places=names[0])
    lines += ["", *block_comment("The same of the next angle, which does not wait for this one.")]
    copy = routine_lines(second, SYNTAX, comment=lambda _title: (), store=store, places=names[1])
    lines += [line for line in copy if line]
    for place, pair in zip(("at", "at + 1"), names, strict=True):
        for array, name in zip((SINES, COSINES), pair, strict=True):
            lines.append(SYNTAX.store.format(place=f"{array}[{place}]", value=name))
    return tuple(lines)


def _renamed(routine: Routine) -> Routine:
    """Returns the routine with other names, for a second copy in the same block."""

    def operand(each: Operand) -> Operand:
        return Temporary(each.name + _SECOND) if isinstance(each, Temporary) else each

    def statement(each: Statement) -> Statement:
        results = tuple(name + _SECOND for name in each.results)
        return replace(each, results=results, operands=tuple(map(operand, each.operands)))

    passages = tuple(
        replace(passage, statements=tuple(map(statement, passage.statements))) for passage in routine.passages
    )
    inputs = tuple(name + _SECOND for name in routine.inputs)
    return Routine(routine.name, inputs, passages, tuple(map(operand, routine.outputs)))
