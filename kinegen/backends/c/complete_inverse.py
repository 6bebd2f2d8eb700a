"""The complete inverse: `jaco2_complete_inverse.h` and `.c`, every solution of an arm with six turning joints."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from typing import Any

import mpmath

from kinegen.backends.bundle import RobotPrograms, provenance
from kinegen.backends.c.arguments import braced, wrapped_prototype
from kinegen.backends.c.kernel import model_macro
from kinegen.backends.complete_inverse import elimination_choice
from kinegen.backends.complete_inverse.elimination import Elimination
from kinegen.backends.complete_inverse.elimination_choice import SHIFTS, Limits, complete_of, limits_of
from kinegen.backends.routines import ROUTINES, Routine
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import rendered
from kinegen.ir.program import Operator
from kinegen.model.outputs import COMPLETE_INVERSE, POSE_AND_JACOBIAN
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import c_file, comment_text, complete_file, function, guard, macro, prefix

_PI = Fraction(3.141592653589793)

SWEEPS = 480
"""QR steps: thirty for each eigenvalue."""

STEPS = 24
"""Newton steps from one candidate."""

STACK = 17000
"""Bytes of the stack that a call takes at most, with all that it calls: gcc 12 needs 15,800 on x86-64, ARM and RISC-V,
clang 14 needs 16,400. The largest arrays are the matrices of one elimination."""


@dataclass(frozen=True, slots=True)
class EliminationText:
    """Holds the constants of one elimination as C text."""

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
    """Holds what the templates `c/complete_inverse.h.jinja` and `c/complete_inverse.c.jinja` are given."""

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


def emit_complete_inverse(kernels: RobotPrograms) -> dict[str, str]:
    """Prints the header and the source of the complete inverse, which is in double alone.

    The kernel of pose and Jacobian is among the programs.
    """
    context = complete_context(kernels)
    templates = {context.header: "c/complete_inverse.h", context.source: "c/complete_inverse.c"}
    return rendered(templates, k=context, prefix=context.prefix, qualifier="static")


def complete_context(kernels: RobotPrograms) -> CompleteContext:
    """Returns everything the templates lay out, as finished text."""
    robot = kernels.robot
    header, source = (complete_file(robot.name, suffix) for suffix in "hc")
    stem, most = prefix(robot.name, ScalarType.DOUBLE), macro(robot.name, "COMPLETE_SOLUTIONS")
    name = function(robot.name, COMPLETE_INVERSE.function, ScalarType.DOUBLE)
    # Callers size the array by a macro.
    solutions = f"double solutions[{most}][{macro(robot.name, 'DOF')}]"
    prototype = f"int {name}(const double base_T_tool[16], {solutions})"
    complete = complete_of(robot)
    return CompleteContext(
        **_numbers(limits_of(robot)),
        header=header,
        source=source,
        kernel_header=c_file(robot.name, "h", ScalarType.DOUBLE),
        guard=guard(header),
        most=most,
        provenance=provenance(robot),
        title=f"Complete inverse kinematics of {robot.name}, double precision",
        description=comment_text(robot.description),
        prefix=stem,
        model=model_macro(robot),
        real=ScalarType.DOUBLE.value,
        format="f64",
        function=name,
        kernel=function(robot.name, POSE_AND_JACOBIAN.function, ScalarType.DOUBLE),
        prototype=prototype,
        declaration=wrapped_prototype(prototype),
        routines=tuple(ROUTINES[ScalarType.DOUBLE][operator] for operator in (Operator.SQRT, Operator.ATAN2)),
        eliminations=tuple(map(_text, complete.eliminations, SHIFTS)),
        reach=_literal(complete.scale),
        attempts=len(elimination_choice.ASIDES),
        sweeps=SWEEPS,
        steps=STEPS,
        candidates=24,
        stack=STACK,
    )


def _numbers(limits: Limits) -> dict[str, str]:
    return {
        "lowest": _array(limits.lowest),
        "highest": _array(limits.highest),
        "middle": _array(limits.middle),
        "is_limited": braced(str(int(limited)) for limited in limits.is_limited),
        "accepted": f"{elimination_choice.ACCEPTED:.0e}",
        "accepted_square": _literal(elimination_choice.ACCEPTED**2),
        "merged": _literal(elimination_choice.MERGED),
        "nearly_real": _literal(elimination_choice.NEARLY_REAL),
        "longest_step": _literal(0.4),
        "room": _literal(elimination_choice.ROOM),
        "rigid": _literal(elimination_choice.RIGID**2),
        "farthest": _literal(elimination_choice.FARTHEST),
        "huge": _literal(elimination_choice.HUGE),
        "asides": _array(elimination_choice.ASIDES),
        "least_pivot": _literal(elimination_choice.LEAST_PIVOT),
        "small_pivot": _literal(elimination_choice.SMALL_PIVOT),
        "half_turn": ScalarType.DOUBLE.literal(_PI),
        "turn": ScalarType.DOUBLE.literal(2 * _PI),
    }


def _text(elimination: Elimination, shift: float) -> EliminationText:
    # Tables are rounded once, from more digits than a double has.
    with mpmath.workdps(30):
        turned = [mpmath.cos(shift), mpmath.sin(shift)]
    return EliminationText(
        order=braced(map(str, elimination.order)),
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
    return braced(map(_literal, entries))


def _literal(number: Any) -> str:
    """Returns a number as C text; what is zero but for roundings of the working precision is zero."""
    value = float(number)
    return ScalarType.DOUBLE.literal(Fraction(value) if abs(value) > 1e-25 else Fraction(0))
