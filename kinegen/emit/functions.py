"""What the emitted square root and arc tangent promise, for the emitters and the headers.

The statements of the arc tangents are in `kinegen.ir.routines.atan2`, the rest is in the templates. Nothing is computed
here; tests/functions proves the figures.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from kinegen.emit.reals import Real
from kinegen.ir.program import Operator, Program


@dataclass(frozen=True, slots=True)
class Routine:
    """The code of one function for one number type.

    Attributes:
        template: Needs `prefix` and `qualifier`; defines `PREFIX_sqrt(x)` or `PREFIX_atan2(y, x)`.
        accuracy: How accurate it is, a sentence for the manual.
    """

    template: str
    accuracy: str


LINE = 116
"""Characters of a line of a comment, without the asterisk before it."""

_ROOT = (
    "Square roots are correctly rounded; that of a negative number is NaN. With -fno-math-errno, gcc and clang use the "
    "instruction of the processor if it has one; the bits are the same."
)
_ANGLES = (
    "Arc tangents of two numbers are {error}; that of two zeros is 0, zeros have no sign, and an infinity or a NaN "
    "makes them NaN."
)

ROUTINES: Mapping[Real, Mapping[Operator, Routine]] = MappingProxyType(
    {
        real: MappingProxyType(
            {
                Operator.SQRT: Routine(f"c/_sqrt_{bits}.c.jinja", _ROOT),
                Operator.ATAN2: Routine(f"c/_atan2_{bits}.c.jinja", _ANGLES.format(error=error)),
            }
        )
        for real, bits, error in (
            (Real.DOUBLE, "f64", "within 1.6 units in the last place"),
            (Real.FLOAT, "f32", "within 1.7e-7 rad"),
        )
    }
)
"""The functions by number type and operator."""


def uses(programs: tuple[Program, ...], *operators: Operator) -> bool:
    """Whether any program has one of these operations."""
    return any(program.uses(*operators) for program in programs)


def is_straight(program: Program) -> bool:
    """Whether a program has none of the operations of which compilers make branches."""
    return not program.uses(Operator.SQRT, Operator.ATAN2, Operator.SELECT_LT)


def routine_lines(routines: tuple[Routine, ...]) -> tuple[str, ...]:
    """What a manual says of functions, as lines of a comment."""
    return tuple(textwrap.wrap(" ".join(routine.accuracy for routine in routines), LINE))


def used_routines(programs: tuple[Program, ...], real: Real) -> tuple[Routine, ...]:
    """The functions that programs call, besides sine and cosine."""
    return tuple(routine for operator, routine in ROUTINES[real].items() if uses(programs, operator))


def needs_bits(programs: tuple[Program, ...], real: Real, *, batch: bool = False) -> bool:
    """Whether the functions that programs call look at the bits of numbers; in batch kernels selections do, too."""
    arc_tangent = real is Real.DOUBLE and uses(programs, Operator.ATAN2)
    return arc_tangent or uses(programs, Operator.SQRT) or (batch and uses(programs, Operator.SELECT_LT))


def function_templates(programs: tuple[Program, ...], real: Real, *, batch: bool = False) -> tuple[str, ...]:
    """The templates of the functions that programs call besides sine and cosine, and of what these build on.

    Args:
        programs: The programs of one file.
        real: The number type.
        batch: Whether they are the batch kernels, in which a selection is a function.

    Returns:
        Names of templates, in order; each needs `prefix` and `qualifier` at most.
    """
    bits = "f64" if real is Real.DOUBLE else "f32"
    called = [routine.template for routine in used_routines(programs, real)]
    if batch and uses(programs, Operator.SELECT_LT):
        called.append(f"c/_select_{bits}.c.jinja")
    before = [f"c/_bits_{bits}.c.jinja"] if needs_bits(programs, real, batch=batch) else []
    if called and not uses(programs, Operator.SINCOS):
        before.insert(0, f"c/_registers_{bits}.c.jinja")  # the template of the pair holds this too
    return (*before, *called)
