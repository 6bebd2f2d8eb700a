"""The bodies of sine-cosine pairs and arc tangents in any syntax, from the routines of `kinegen.ir.routines`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

from kinegen.emit.printing import Printer, Revise, Syntax, as_it_is
from kinegen.emit.reals import Real
from kinegen.ir.program import Operator
from kinegen.ir.routines.atan2 import ATAN2_DOUBLE, ATAN2_FLOAT
from kinegen.ir.routines.routine import Routine
from kinegen.ir.routines.sincos import SINCOS_DOUBLE, SINCOS_FLOAT

CODE: Mapping[Real, Mapping[Operator, Routine]] = MappingProxyType(
    {
        Real.DOUBLE: MappingProxyType({Operator.SINCOS: SINCOS_DOUBLE, Operator.ATAN2: ATAN2_DOUBLE}),
        Real.FLOAT: MappingProxyType({Operator.SINCOS: SINCOS_FLOAT, Operator.ATAN2: ATAN2_FLOAT}),
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

    Args:
        routine: The routine.
        syntax: The syntax of kernels in the language. Negative numbers have no brackets here.
        comment: A comment of several lines.
        store: How a result is stored or returned, with `{place}` and `{value}`.
        places: Where each result is stored; none for code after which results are returned by their names.
        revise: Which operands are written in another way.
        begin: How the comments of the passages begin that are printed.
    """

    def heading(title: str) -> tuple[str, ...]:
        return "", *comment(title)

    own = replace(syntax, negative="{0}", heading=heading, store=store)
    printer = Printer(own, routine.inputs, revise, is_direct=True)
    passages = [passage for passage in routine.passages if passage.title.startswith(begin)]
    return printer.lines(routine, places or (None,) * len(routine.outputs), passages)


def block_comment(text: str) -> tuple[str, ...]:
    """A comment as C writes it, and languages that took it from there."""
    first, *others = text.split("\n")
    lines = [f"/* {first}", *(f"   {line}" for line in others)]
    return *lines[:-1], f"{lines[-1]} */"
