"""The independent numeric reference: chain products straight from the robot, in float64 and with 50 digits.

In: a `Robot` and joint vectors. Out: the poses of its frames. Every kernel is held to this module, so it shares nothing
with `symbolic/` and `ir/`: each convention stands here as the 4x4 matrix that its book prints, and the matrices are
multiplied in the plainest way. Nothing here is fast, and nothing is simplified.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinegen.robot.expressions import ZERO, Arithmetic, evaluate
from kinegen.robot.model import BASE, TOOL, WRIST, Convention, Robot, Row, Step, StepKind

FloatArray = NDArray[np.float64]
Rows = tuple[tuple[Any, Any, Any, Any], ...]

DIGITS = 50
"""Decimal digits of the mpmath reference."""

_ORIGIN = ""
"""The frame after the fixed base transform, which has no name of its own; no file can spell this one."""


# Kinds of numbers -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Kind:
    """What the chain product needs to know about the numbers it works in."""

    arithmetic: Arithmetic
    sin: Callable[[Any], Any]
    cos: Callable[[Any], Any]
    matrix: Callable[[Rows], Any]
    multiply: Callable[[Any, Any], Any]


def _stack(rows: Rows) -> FloatArray:
    """Stack entries of shape (N,) or () to matrices (N, 4, 4) or (4, 4)."""
    entries = np.broadcast_arrays(*(np.asarray(entry, dtype=np.float64) for row in rows for entry in row))
    return np.stack(entries, axis=-1).reshape(*entries[0].shape, 4, 4)


_FLOATS = _Kind(
    arithmetic=Arithmetic(number=float, pi=np.pi, functions={"sqrt": np.sqrt}),
    sin=np.sin,
    cos=np.cos,
    matrix=_stack,
    multiply=np.matmul,
)


def _digits() -> _Kind:
    """The numbers of mpmath at the precision in force; pi is fixed here, so it must be called inside `workdps`."""

    def number(value: Fraction) -> Any:
        return mpmath.mpf(value.numerator) / value.denominator

    return _Kind(
        arithmetic=Arithmetic(number=number, pi=+mpmath.pi, functions={"sqrt": mpmath.sqrt}),
        sin=mpmath.sin,
        cos=mpmath.cos,
        matrix=lambda rows: mpmath.matrix([list(row) for row in rows]),
        multiply=lambda left, right: left * right,
    )


# Public functions -----------------------------------------------------------------------------------------------------


def frames(robot: Robot, q: ArrayLike, params: Mapping[str, float] | None = None) -> dict[str, FloatArray]:
    """Poses of all frames for a batch of joint vectors, in float64.

    Args:
        robot: The robot.
        q: Joint vectors, shape (N, dof), or (dof,) for one; radians and the file's length unit.
        params: Values of parameters that differ from the file, in radians and the file's length unit.

    Returns:
        `base_T_frame` of shape (N, 4, 4) by frame name: the base, every row, the wrist and the tool of a chain, and
        every named frame.
    """
    batch = np.atleast_2d(np.asarray(q, dtype=np.float64))
    values = _values(robot, list(batch.T), params, _FLOATS)
    found = _chain(robot, values, _FLOATS)
    return {name: np.broadcast_to(matrix, (len(batch), 4, 4)) for name, matrix in found.items()}


def pose(robot: Robot, q: ArrayLike, params: Mapping[str, float] | None = None) -> FloatArray:
    """Poses of the tips for a batch of joint vectors, in float64.

    Args:
        robot: The robot.
        q: Joint vectors, shape (N, dof), or (dof,) for one; radians and the file's length unit.
        params: Values of parameters that differ from the file.

    Returns:
        `base_T_tip` of shape (N, tips, 4, 4), tips in the order of `robot.tips`.
    """
    found = frames(robot, q, params)
    return np.stack([found[tip] for tip in robot.tips], axis=1)


def frames_mp(robot: Robot, q: Iterable[Any], params: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Poses of all frames for one joint vector, with `DIGITS` digits.

    Args:
        robot: The robot.
        q: One joint vector, `dof` numbers; floats are taken as the exact binary numbers they are.
        params: Values of parameters that differ from the file.

    Returns:
        `base_T_frame` as 4x4 mpmath matrix by frame name, the same frames as `frames`.
    """
    with mpmath.workdps(DIGITS):
        kind = _digits()
        exact = {name: mpmath.mpf(value) for name, value in (params or {}).items()}
        return _chain(robot, _values(robot, [mpmath.mpf(entry) for entry in q], exact, kind), kind)


def pose_mp(robot: Robot, q: Iterable[Any], params: Mapping[str, Any] | None = None) -> tuple[Any, ...]:
    """Poses of the tips for one joint vector, with `DIGITS` digits.

    Args:
        robot: The robot.
        q: One joint vector, `dof` numbers; floats are taken as the exact binary numbers they are.
        params: Values of parameters that differ from the file.

    Returns:
        One 4x4 mpmath matrix `base_T_tip` for each of `robot.tips`.
    """
    found = frames_mp(robot, q, params)
    return tuple(found[tip] for tip in robot.tips)


# The chain ------------------------------------------------------------------------------------------------------------


def _values(robot: Robot, q: list[Any], params: Mapping[str, Any] | None, kind: _Kind) -> dict[str, Any]:
    """A value for every name of the file."""
    if len(q) != robot.dof:
        raise ValueError(f"{robot.name} has {robot.dof} joint variables, not {len(q)}")
    values = {entry.name: evaluate(entry.value, {}, kind.arithmetic) for entry in robot.parameters}
    unknown = set(params or ()) - set(values)
    if unknown:
        raise ValueError(f"{robot.name} has no parameter {sorted(unknown)}")
    values.update(params or {})
    values.update({variable.name: entry for variable, entry in zip(robot.variables, q, strict=True)})
    return values


def _parents(robot: Robot) -> Iterator[tuple[str, str]]:
    """Every frame but the base with its parent, parents first."""
    last = robot.rows[-1].name if robot.rows else _ORIGIN
    named = {row.name for row in robot.rows} | {frame.name for frame in robot.frames}
    yield _ORIGIN, BASE
    for row in robot.rows:
        yield row.name, _ORIGIN if row.parent == BASE else row.parent
    if not robot.is_tree:
        yield TOOL, last
        if WRIST not in named:
            yield WRIST, last
    for frame in robot.frames:
        yield frame.name, frame.parent


def _chain(robot: Robot, values: Mapping[str, Any], kind: _Kind) -> dict[str, Any]:
    """Multiply the links from the base outwards."""
    links = _links(robot, values, kind)
    found = {BASE: _identity(kind)}
    for name, parent in _parents(robot):
        found[name] = kind.multiply(found[parent], links[name])
    del found[_ORIGIN]
    return found


def _links(robot: Robot, values: Mapping[str, Any], kind: _Kind) -> dict[str, Any]:
    """The transform of every frame but the base from its parent."""
    links = {_ORIGIN: _steps(robot.base, values, kind), TOOL: _steps(robot.tool, values, kind), WRIST: _identity(kind)}
    for row in robot.rows:
        links[row.name] = _row(row, values, kind)
    for frame in robot.frames:
        links[frame.name] = _steps(frame.steps, values, kind)
    return links


def _identity(kind: _Kind) -> Any:
    return kind.matrix(((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)))


def _row(row: Row, values: Mapping[str, Any], kind: _Kind) -> Any:
    """The link matrix of one row, as printed for its convention."""
    if row.convention is Convention.ETS:
        return _steps(row.steps, values, kind)
    alpha, a, d, theta, beta = (
        evaluate(ZERO if entry is None else entry, values, kind.arithmetic)
        for entry in (row.alpha, row.a, row.d, row.theta, row.beta)
    )
    ct, st, ca, sa = kind.cos(theta), kind.sin(theta), kind.cos(alpha), kind.sin(alpha)
    match row.convention:
        case Convention.STANDARD:
            upper = _standard(ct, st, ca, sa, a=a, d=d)
        case Convention.MODIFIED:
            upper = _modified(ct, st, ca, sa, a=a, d=d)
        case Convention.MODIFIED_PREV_D:
            upper = _modified_prev_d(ct, st, ca, sa, a=a, d=d)
        case Convention.HAYATI:
            upper = _hayati(ct, st, ca, sa, cb=kind.cos(beta), sb=kind.sin(beta), a=a)
    return kind.matrix((*upper, (0, 0, 0, 1)))


def _standard(ct: Any, st: Any, ca: Any, sa: Any, *, a: Any, d: Any) -> Rows:
    """Paul, Robot Manipulators, 1981, eq. 2.31; Siciliano et al., Robotics, 2009, eq. 2.52."""
    return ((ct, -st * ca, st * sa, a * ct), (st, ct * ca, -ct * sa, a * st), (0, sa, ca, d))


def _modified(ct: Any, st: Any, ca: Any, sa: Any, *, a: Any, d: Any) -> Rows:
    """Craig, Introduction to Robotics, 3rd ed., eq. 3.6, with alpha and a of the link before."""
    return ((ct, -st, 0, a), (st * ca, ct * ca, -sa, -sa * d), (st * sa, ct * sa, ca, ca * d))


def _modified_prev_d(ct: Any, st: Any, ca: Any, sa: Any, *, a: Any, d: Any) -> Rows:
    """Craig's turns, with the point (a, 0, d) of the turned frame as new origin."""
    return (
        (ct, -st, 0, a * ct),
        (st * ca, ct * ca, -sa, a * st * ca - d * sa),
        (st * sa, ct * sa, ca, a * st * sa + d * ca),
    )


def _hayati(ct: Any, st: Any, ca: Any, sa: Any, *, cb: Any, sb: Any, a: Any) -> Rows:
    """Hayati, Robot arm geometric link parameter estimation, CDC 1983: the link between nearly parallel axes."""
    return (
        (ct * cb - st * sa * sb, -st * ca, ct * sb + st * sa * cb, a * ct),
        (st * cb + ct * sa * sb, ct * ca, st * sb - ct * sa * cb, a * st),
        (-ca * sb, sa, ca * cb, 0),
    )


def _steps(steps: tuple[Step, ...], values: Mapping[str, Any], kind: _Kind) -> Any:
    """The product of a sequence of elementary transforms."""
    product = _identity(kind)
    for step in steps:
        value = evaluate(step.value, values, kind.arithmetic)
        product = kind.multiply(product, kind.matrix(_elementary(step.kind, value, kind)))
    return product


def _elementary(step: StepKind, value: Any, kind: _Kind) -> Rows:
    last = (0, 0, 0, 1)
    if not step.is_rotation:
        x, y, z = (value if step.value[1] == axis else 0 for axis in "xyz")
        return ((1, 0, 0, x), (0, 1, 0, y), (0, 0, 1, z), last)
    c, s = kind.cos(value), kind.sin(value)
    match step:
        case StepKind.RX:
            return ((1, 0, 0, 0), (0, c, -s, 0), (0, s, c, 0), last)
        case StepKind.RY:
            return ((c, 0, s, 0), (0, 1, 0, 0), (-s, 0, c, 0), last)
        case _:
            return ((c, -s, 0, 0), (s, c, 0, 0), (0, 0, 1, 0), last)
