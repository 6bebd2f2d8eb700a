"""The complete inverse: `jaco2_complete_inverse.h` and `.c`, every solution of an arm with six turning joints."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import mpmath

from kinegen.emit.c.arguments import wrapped_prototype
from kinegen.emit.c.kernel import model_macro
from kinegen.emit.complete import numbers
from kinegen.emit.complete.choose import SHIFTS, complete_of
from kinegen.emit.complete.numbers import Limits, limits_of
from kinegen.emit.complete.tables import Elimination
from kinegen.emit.environment import environment
from kinegen.emit.functions import ROUTINES, Routine
from kinegen.emit.kernels import Kernels, provenance
from kinegen.emit.reals import Real
from kinegen.ir.program import Operator
from kinegen.naming import c_file, comment_text, complete_file, function, guard, macro, prefix
from kinegen.outputs import COMPLETE_INVERSE, POSE_AND_JACOBIAN

_PI = Fraction(3.141592653589793)

SWEEPS = 480
"""QR steps: thirty for each eigenvalue."""

STEPS = 24
"""Newton steps from one candidate."""

STACK = 12000
"""Bytes of the stack that a call takes, roughly; the largest arrays are the matrices of one elimination."""


@dataclass(frozen=True, slots=True)
class EliminationText:
    """The constants of one elimination as C text."""

    order: str
    backwards: int
    closes_first: int
    real: int
    pairs: int
    shift: str
    left: str
    right: str
    fixed: str
    along: tuple[str, ...]
    across: tuple[tuple[str, ...], ...]
    basis: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class CompleteContext:
    """What the templates `c/complete_inverse.h.jinja` and `c/complete_inverse.c.jinja` are given."""

    header: str
    source: str
    kernel_header: str
    guard: str
    most: str
    provenance: str
    title: str
    description: str
    prefix: str
    model: tuple[str, str]
    real: str
    format: str
    function: str
    kernel: str
    prototype: str
    declaration: tuple[str, ...]
    routines: tuple[Routine, ...]
    eliminations: tuple[EliminationText, ...]
    reach: str
    lowest: str
    highest: str
    middle: str
    is_limited: str
    sweeps: int
    steps: int
    candidates: int
    stack: int
    accepted: str
    accepted_square: str
    merged: str
    nearly_real: str
    longest_step: str
    room: str
    rigid: str
    farthest: str
    huge: str
    attempts: int
    asides: str
    least_pivot: str
    small_pivot: str
    half_turn: str
    turn: str


def emit_complete_inverse(kernels: Kernels) -> dict[str, str]:
    """Print the complete inverse, which is in double alone.

    Args:
        kernels: The robot and its programs, the pose with its Jacobian among them.

    Returns:
        The header and the source, by file name.
    """
    context = complete_context(kernels)
    return {
        name: environment().get_template(template).render(k=context, prefix=context.prefix, qualifier="static")
        for name, template in (
            (context.header, "c/complete_inverse.h.jinja"),
            (context.source, "c/complete_inverse.c.jinja"),
        )
    }


def complete_context(kernels: Kernels) -> CompleteContext:
    """Everything the templates lay out, as finished text."""
    robot = kernels.robot
    header, source = (complete_file(robot.name, suffix) for suffix in "hc")
    stem, most = prefix(robot.name, Real.DOUBLE), macro(robot.name, "COMPLETE_SOLUTIONS")
    name = function(robot.name, COMPLETE_INVERSE.function, Real.DOUBLE)
    solutions = f"double solutions[{most}][{macro(robot.name, 'DOF')}]"
    prototype = f"int {name}(const double base_T_tool[16], {solutions})"
    complete = complete_of(robot)
    return CompleteContext(
        **_numbers(limits_of(robot)),
        header=header,
        source=source,
        kernel_header=c_file(robot.name, "h", Real.DOUBLE),
        guard=guard(header),
        most=most,
        provenance=provenance(robot),
        title=f"Complete inverse kinematics of {robot.name}, double precision",
        description=comment_text(robot.description),
        prefix=stem,
        model=model_macro(robot),
        real=Real.DOUBLE.value,
        format="f64",
        function=name,
        kernel=function(robot.name, POSE_AND_JACOBIAN.function, Real.DOUBLE),
        prototype=prototype,
        declaration=wrapped_prototype(prototype),
        routines=tuple(ROUTINES[Real.DOUBLE][operator] for operator in (Operator.SQRT, Operator.ATAN2)),
        eliminations=tuple(map(_text, complete.eliminations, SHIFTS)),
        reach=_literal(complete.scale),
        attempts=len(numbers.ASIDES),
        sweeps=SWEEPS,
        steps=STEPS,
        candidates=24,
        stack=STACK,
    )


def _numbers(limits: Limits) -> dict[str, str]:
    """The bounds of the search as C text."""
    return {
        "lowest": _array(limits.lowest),
        "highest": _array(limits.highest),
        "middle": _array(limits.middle),
        "is_limited": _listed(str(int(limited)) for limited in limits.is_limited),
        "accepted": f"{numbers.ACCEPTED:.0e}",
        "accepted_square": _literal(numbers.ACCEPTED**2),
        "merged": _literal(numbers.MERGED),
        "nearly_real": _literal(numbers.NEARLY_REAL),
        "longest_step": _literal(0.4),
        "room": _literal(numbers.ROOM),
        "rigid": _literal(numbers.RIGID**2),
        "farthest": _literal(numbers.FARTHEST),
        "huge": _literal(numbers.HUGE),
        "asides": _array(numbers.ASIDES),
        "least_pivot": _literal(numbers.LEAST_PIVOT),
        "small_pivot": _literal(numbers.SMALL_PIVOT),
        "half_turn": Real.DOUBLE.literal(_PI),
        "turn": Real.DOUBLE.literal(2 * _PI),
    }


def _text(elimination: Elimination, shift: float) -> EliminationText:
    with mpmath.workdps(30):
        turned = [mpmath.cos(shift), mpmath.sin(shift)]
    return EliminationText(
        order=_listed(map(str, elimination.order)),
        backwards=int(elimination.backwards),
        closes_first=int(elimination.closes_first),
        real=elimination.real,
        pairs=4 - elimination.real,
        shift=_array(turned),
        left=_motion(elimination.left),
        right=_motion(elimination.right),
        fixed=_motion(elimination.fixed),
        along=tuple(map(_array, elimination.along)),
        across=(
            tuple(_array(entry.real for entry in row) for row in elimination.across),
            tuple(_array(entry.imag for entry in row) for row in elimination.across),
        ),
        basis=tuple(_array(vector[row] for vector in elimination.basis) for row in range(12)),
    )


def _motion(matrix: Any) -> str:
    return _array(matrix[row, column] for row in range(3) for column in range(4))


def _array(entries: Iterable[Any]) -> str:
    return _listed(map(_literal, entries))


def _listed(items: Iterable[str]) -> str:
    return f"{{{', '.join(items)}}}"


def _literal(number: Any) -> str:
    """A number as C text; what is zero but for roundings of the working precision is zero."""
    value = float(number)
    return Real.DOUBLE.literal(Fraction(value) if abs(value) > 1e-25 else Fraction(0))
