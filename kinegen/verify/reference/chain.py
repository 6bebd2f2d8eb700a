"""The chain product and the poses of frames: each convention as the matrix that its book prints.

Nothing here is fast, and nothing is simplified.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import mpmath

from kinegen.model.expression_parser import ZERO, evaluate
from kinegen.model.robot import TOOL, WRIST, Convention, Robot, Row, Step, StepKind
from kinegen.verify.reference.exact_numbers import DIGITS, Kind, Rows, digits

ORIGIN = ""
"""The frame after the fixed base transform, which has no name of its own; no file can spell this one."""


def values_of(robot: Robot, q: list[Any], params: Mapping[str, Any] | None, kind: Kind) -> dict[str, Any]:
    """Returns a value for every name of the file."""
    if len(q) != robot.dof:
        raise ValueError(f"{robot.name} has {robot.dof} joint variables, not {len(q)}")
    values = {entry.name: evaluate(entry.value, {}, kind.arithmetic) for entry in robot.parameters}
    unknown = set(params or ()) - set(values)
    if unknown:
        raise ValueError(f"{robot.name} has no parameter {sorted(unknown)}")
    values.update(params or {})
    values.update({variable.name: entry for variable, entry in zip(robot.variables, q, strict=True)})
    return values


def parents(robot: Robot) -> Iterator[tuple[str, str]]:
    """Yields every frame but the base with its parent, parents first."""
    last = robot.rows[-1].name if robot.rows else ORIGIN
    named = {row.name for row in robot.rows} | {frame.name for frame in robot.frames}
    root = robot.root
    yield ORIGIN, root
    for row in robot.rows:
        yield row.name, ORIGIN if row.parent == root else row.parent
    if not robot.is_tree:
        yield TOOL, last
        if WRIST not in named:
            yield WRIST, last
    for frame in robot.frames:
        yield frame.name, frame.parent


def chain(robot: Robot, values: Mapping[str, Any], kind: Kind) -> dict[str, Any]:
    """Multiply the links from the base outwards."""
    links = links_of(robot, values, kind)
    found = {robot.root: identity(kind)}
    for name, parent in parents(robot):
        found[name] = kind.multiply(found[parent], links[name])
    del found[ORIGIN]
    return found


def links_of(robot: Robot, values: Mapping[str, Any], kind: Kind) -> dict[str, Any]:
    """Returns the transform of every frame but the base from its parent."""
    links = {ORIGIN: _steps(robot.base, values, kind), TOOL: _steps(robot.tool, values, kind), WRIST: identity(kind)}
    for row in robot.rows:
        links[row.name] = _row(row, values, kind)
    for frame in robot.frames:
        links[frame.name] = _steps(frame.steps, values, kind)
    return links


def identity(kind: Kind) -> Any:
    """Returns the frame that stands where its parent stands."""
    return kind.matrix(((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)))


def _row(row: Row, values: Mapping[str, Any], kind: Kind) -> Any:
    """Returns the link matrix of one row, as printed for its convention."""
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


def _steps(steps: tuple[Step, ...], values: Mapping[str, Any], kind: Kind) -> Any:
    """Returns the product of a sequence of elementary transforms."""
    product = identity(kind)
    for step in steps:
        value = evaluate(step.value, values, kind.arithmetic)
        product = kind.multiply(product, kind.matrix(_elementary(step.kind, value, kind)))
    return product


def _elementary(step: StepKind, value: Any, kind: Kind) -> Rows:
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


def frames_mp(robot: Robot, q: Iterable[Any], params: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Poses of all frames for one joint vector, with `DIGITS` digits.

    Args:
        q: One joint vector, `dof` numbers; floats are taken as the exact binary numbers they are.
        params: Values of parameters that differ from the file.

    Returns:
        `base_T_frame` as 4x4 mpmath matrix by frame name, the same frames as `frames`.
    """
    with mpmath.workdps(DIGITS):
        kind = digits()
        exact = {name: mpmath.mpf(value) for name, value in (params or {}).items()}
        return chain(robot, values_of(robot, [mpmath.mpf(entry) for entry in q], exact, kind), kind)


def pose_mp(robot: Robot, q: Iterable[Any], params: Mapping[str, Any] | None = None) -> tuple[Any, ...]:
    """Poses of the tips for one joint vector, with `DIGITS` digits.

    Args:
        q: One joint vector, `dof` numbers; floats are taken as the exact binary numbers they are.
        params: Values of parameters that differ from the file.

    Returns:
        One 4x4 mpmath matrix `base_T_tip` for each of `robot.tips`.
    """
    found = frames_mp(robot, q, params)
    return tuple(found[tip] for tip in robot.tips)
