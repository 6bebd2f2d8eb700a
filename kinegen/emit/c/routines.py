"""The bodies of sine-cosine pairs and arc tangents in C, for the templates that hold the functions."""

from __future__ import annotations

from kinegen.emit.c.syntax import c_syntax
from kinegen.emit.reals import Real
from kinegen.emit.routines import CODE, block_comment, routine_lines
from kinegen.ir.program import Operator

_STORES = {"sincos": ("{place} = {value};", ("*s", "*c")), "atan2": ("return {value};", ("",))}


def c_routine(name: str, real: str, begin: str = "") -> tuple[str, ...]:
    """The statements of a function.

    Args:
        name: Of an operator, `sincos` or `atan2`.
        real: Of a number type.
        begin: How the comments of the passages begin that are printed.
    """
    store, places = _STORES[name]
    syntax = c_syntax(Real(real), "", "")
    routine = CODE[Real(real)][Operator(name)]
    return routine_lines(routine, syntax, comment=block_comment, store=store, places=places, begin=begin)
