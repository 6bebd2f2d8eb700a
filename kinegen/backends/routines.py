"""What the emitted sines, cosines, square roots and arc tangents promise, and which of them programs call."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from types import MappingProxyType

from kinegen.backends.scalar_types import ScalarType
from kinegen.ir.program import Operator, Program
from kinegen.support.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class Sincos:
    """The pair of one number type.

    `template`: needs `prefix` and `qualifier`; defines `PREFIX_sincos(x, &s, &c)`. `limit`: largest magnitude of an
    angle in radians; beyond it both results are NaN. `absolute_error`: bound on the error of either result, whether or
    not the compiler contracts. `accuracy`: the same in words.
    """

    template: str
    limit: float
    absolute_error: float
    accuracy: str


SINCOS: Mapping[ScalarType, Sincos] = MappingProxyType(
    {
        ScalarType.DOUBLE: Sincos(
            template="c/_sincos_f64.c.jinja",
            limit=1e5,
            absolute_error=0.85 * 2.0**-53,
            accuracy="within 0.85 units in the last place for angles up to 1e5 rad",
        ),
        ScalarType.FLOAT: Sincos(
            template="c/_sincos_f32.c.jinja",
            limit=12000.0,
            absolute_error=5.4e-8,
            accuracy="with an absolute error below 5.4e-8 for angles up to 12000 rad",
        ),
    }
)
"""The pairs by number type."""


@dataclass(frozen=True, slots=True)
class Routine:
    """The code of one function for one number type.

    `template`: needs `prefix` and `qualifier`; defines `PREFIX_sqrt(x)` or `PREFIX_atan2(y, x)`. `accuracy`: how
    accurate it is, a sentence for the manual.
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

ROUTINES: Mapping[ScalarType, Mapping[Operator, Routine]] = MappingProxyType(
    {
        real: MappingProxyType(
            {
                Operator.SQRT: Routine(f"c/_sqrt_{bits}.c.jinja", _ROOT),
                Operator.ATAN2: Routine(f"c/_atan2_{bits}.c.jinja", _ANGLES.format(error=error)),
            }
        )
        for real, bits, error in (
            (ScalarType.DOUBLE, "f64", "within 1.6 units in the last place"),
            (ScalarType.FLOAT, "f32", "within 1.7e-7 rad"),
        )
    }
)
"""The functions by number type and operator."""


def uses(programs: tuple[Program, ...], *operators: Operator) -> bool:
    """Return whether any program has one of these operations."""
    return any(program.uses(*operators) for program in programs)


def is_straight(program: Program) -> bool:
    """Return whether a program has none of the operations of which compilers make branches."""
    return not program.uses(Operator.SQRT, Operator.ATAN2, Operator.SELECT_LT)


def routine_lines(routines: tuple[Routine, ...]) -> tuple[str, ...]:
    """Return what a manual says of functions, as lines of a comment."""
    return tuple(textwrap.wrap(" ".join(routine.accuracy for routine in routines), LINE))


def used_routines(programs: tuple[Program, ...], real: ScalarType) -> tuple[Routine, ...]:
    """Return the functions that programs call, besides sine and cosine."""
    return tuple(routine for operator, routine in ROUTINES[real].items() if uses(programs, operator))


def needs_bits(programs: tuple[Program, ...], real: ScalarType, *, batch: bool = False) -> bool:
    """Whether the functions that programs call look at the bits of numbers; in batch kernels selections do, too."""
    arc_tangent = real is ScalarType.DOUBLE and uses(programs, Operator.ATAN2)
    return arc_tangent or uses(programs, Operator.SQRT) or (batch and uses(programs, Operator.SELECT_LT))


def function_templates(programs: tuple[Program, ...], real: ScalarType, *, batch: bool = False) -> tuple[str, ...]:
    """Return the templates of the functions that programs call besides sine and cosine, and of what these build on.

    `batch`: whether they are the batch kernels, in which a selection is a function. Returns names of templates, in
    order; each needs `prefix` and `qualifier` at most.
    """
    bits = "f64" if real is ScalarType.DOUBLE else "f32"
    called = [routine.template for routine in used_routines(programs, real)]
    if batch and uses(programs, Operator.SELECT_LT):
        called.append(f"c/_select_{bits}.c.jinja")
    before = [f"c/_bits_{bits}.c.jinja"] if needs_bits(programs, real, batch=batch) else []
    if called and not uses(programs, Operator.SINCOS):
        before.insert(0, f"c/_registers_{bits}.c.jinja")  # the template of the pair holds this too
    return (*before, *called)
