"""One row of the table as elementary transforms, by convention.

In: a row of the robot. Out: turns about x, y, z and shifts along them, with exact sympy values. Nothing is multiplied
here, and nothing looks further than one row.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import sympy as sp

from kinegen.robot.expressions import ZERO, Arithmetic, Expression, evaluate
from kinegen.robot.model import Convention, Robot, Row, Step

X, Y, Z = 0, 1, 2

EXACT = Arithmetic(
    number=lambda value: sp.Rational(value.numerator, value.denominator),
    pi=sp.pi,
    functions={"sqrt": sp.sqrt, "asin": sp.asin, "acos": sp.acos, "atan": sp.atan, "atan2": sp.atan2},
)
"""Exact sympy numbers."""


@dataclass(frozen=True, slots=True)
class Turn:
    """A rotation by `angle` (radians) about axis 0, 1 or 2."""

    axis: int
    angle: sp.Expr


@dataclass(frozen=True, slots=True)
class Shift:
    """A translation by `length` along axis 0, 1 or 2."""

    axis: int
    length: sp.Expr


Elementary = Turn | Shift

Values = Mapping[str, sp.Expr]
"""What each name of a robot file stands for: a symbol, or an exact number."""


def symbols(robot: Robot, keep_parameters: bool) -> dict[str, sp.Expr]:
    """The sympy value of every name.

    Args:
        robot: The robot.
        keep_parameters: Whether parameters stay symbols, as people read them; otherwise only runtime parameters do
            and the others become exact numbers.

    Returns:
        Real symbols for joint variables; symbols or numbers for parameters.
    """
    values: dict[str, sp.Expr] = {variable.name: sp.Symbol(variable.name, real=True) for variable in robot.variables}
    for parameter in robot.parameters:
        symbol = keep_parameters or parameter.runtime
        values[parameter.name] = (
            sp.Symbol(parameter.name, real=True) if symbol else evaluate(parameter.value, {}, EXACT)
        )
    return values


def row_transforms(row: Row, values: Values) -> tuple[Elementary, ...]:
    """The elementary transforms of one row, from its parent frame to its own.

    - standard: `Rz(theta) Tz(d) Tx(a) Rx(alpha)` (Paul 1981, eq. 2.30; Siciliano et al. 2009, eq. 2.52);
    - modified: `Rx(alpha) Tx(a) Rz(theta) Tz(d)` (Craig 2005, eq. 3.5);
    - modified_prev_d: `Rx(alpha) Rz(theta) T(a, 0, d)`, Craig's axes with the offsets after the turn;
    - hayati: `Rz(theta) Tx(a) Rx(alpha) Ry(beta)` (Hayati and Mirmirani 1985), for nearly parallel axes.

    Args:
        row: The row.
        values: A sympy value for each name.

    Returns:
        Turns and shifts, left to right, without those that are identities.
    """
    if row.convention is Convention.ETS:
        return step_transforms(row.steps, values)
    alpha, a, d, theta, beta = (_exact(entry, values) for entry in (row.alpha, row.a, row.d, row.theta, row.beta))
    match row.convention:
        case Convention.STANDARD:
            sequence: tuple[Elementary, ...] = (Turn(Z, theta), Shift(Z, d), Shift(X, a), Turn(X, alpha))
        case Convention.MODIFIED:
            sequence = (Turn(X, alpha), Shift(X, a), Turn(Z, theta), Shift(Z, d))
        case Convention.MODIFIED_PREV_D:
            sequence = (Turn(X, alpha), Turn(Z, theta), Shift(X, a), Shift(Z, d))
        case Convention.HAYATI:
            sequence = (Turn(Z, theta), Shift(X, a), Turn(X, alpha), Turn(Y, beta))
    return tuple(step for step in sequence if not is_identity(step))


def step_transforms(steps: tuple[Step, ...], values: Values) -> tuple[Elementary, ...]:
    """The elementary transforms of a sequence written out in the file."""
    sequence = (
        Turn(step.kind.axis, _exact(step.value, values))
        if step.kind.is_rotation
        else Shift(step.kind.axis, _exact(step.value, values))
        for step in steps
    )
    return tuple(step for step in sequence if not is_identity(step))


def inverse(step: Elementary) -> Elementary:
    """The transform that undoes `step`."""
    return Turn(step.axis, -step.angle) if isinstance(step, Turn) else Shift(step.axis, -step.length)


def is_identity(step: Elementary) -> bool:
    """Whether a transform does nothing, exactly."""
    return bool((step.angle if isinstance(step, Turn) else step.length) == 0)


def _exact(entry: Expression | None, values: Values) -> sp.Expr:
    return sp.expand(evaluate(ZERO if entry is None else entry, values, EXACT))
