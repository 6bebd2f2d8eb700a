"""Finds measurements that do not belong to a robot, and errors that no number of its table corrects.

Small errors are a matter of calibration. What is left of the reach after a fit is a matter of a wrong unit, a wrong
column, another frame or another robot, and no table is written from it.

An error may follow the value of a joint, as of a gear factor or an eccentric gear. The derivative of the residuals by
such an error is that by the joint, times the value of the joint or its sine and cosine. What the fitted unknowns can do
of it is projected out, so the rest is what one more number would explain.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from kinegen.errors import KinegenError
from kinegen.io.columns import METRES
from kinegen.model.robot import JointType, JointVariable, Robot
from kinegen.support.compat import StrEnum
from kinegen.support.dataclass import dataclass
from kinegen.tools.calibrate.evaluation import row_errors
from kinegen.tools.calibrate.fitted_parameters import BASE_NAMES, TOOL_NAMES
from kinegen.tools.calibrate.measurements import Kind, Measurements
from kinegen.tools.calibrate.residuals import Problem
from kinegen.tools.calibrate.solve import Fit

Floats = NDArray[np.float64]

_FAR, _NEAR = 20.0, 100.0
"""Positions this many times farther than the arm reaches, or nearer, are probably in another unit."""

_MOST_LEFT, _MOST_TURNED = 0.05, 0.1
"""A fit that leaves half of the rows farther off than this share of the reach, or this many radians, is not one."""

_TURNS = 4 * math.pi
"""An arm whose joints turn farther than this is rare; the values are probably degrees that are called radians."""

_ALIKE = 0.05
"""How near a ratio of sizes has to be to that of two units."""


def check_reach(measured: Measurements, robot: Robot, reach: float, *, aligned: bool) -> None:
    """Refuse lengths that must be in another unit."""
    rows = np.concatenate([measured.rows(Kind.POSE), measured.rows(Kind.POSITION)])
    sizes = np.linalg.norm(measured.positions[rows], axis=1)
    if aligned and len(rows):
        # The base is anywhere; only differences of positions say something.
        sizes = np.linalg.norm(measured.positions[rows] - measured.positions[rows].mean(axis=0), axis=1)
    given = np.flatnonzero(~np.isnan(measured.lengths))
    # Distances and radii may be small; positions of a whole arm are not.
    for values, lines, least in ((sizes, rows, reach / _NEAR), (measured.lengths[given], given, 0.0)):
        typical, unit = float(np.median(values)) if len(values) else reach, robot.units.length
        if not least <= typical <= _FAR * reach:
            how = "larger" if typical > reach else "smaller"
            raise KinegenError(
                f"a typical measured length is {typical:.4g} {unit}, much {how} than the arm, which reaches "
                f"{reach:.4g} {unit}; write the unit in the header, as in x[mm], or add --length",
                measured.path,
                measured.lines[int(lines[0])],
            )


def check_range(measured: Measurements) -> None:
    """Refuse joint values that kernels do not evaluate."""
    for values in (measured.q, measured.to_q):
        for row in np.flatnonzero((np.abs(values) > 1e5).any(axis=1)):
            raise KinegenError("a joint value is larger than 1e5", measured.path, measured.lines[int(row)])


def check_fit(fit: Fit) -> None:
    """Refuse measurements if half of the rows are far from every fit with numbers near those of the file."""
    problem, robot = fit.problem, fit.problem.arm.robot
    lengths, angles = row_errors(problem, problem.differences(fit.values))
    left, unit = float(np.median(lengths)), robot.units.length
    turned = 0.0 if np.isnan(angles).all() else float(np.nanmedian(angles))
    if left > _MOST_LEFT * problem.arm.reach:
        raise KinegenError(
            f"the measurements do not belong to this robot: after the fit half of them are still more than {left:.3g} "
            f"{unit} away, of a reach of {problem.arm.reach:.4g} {unit}; {_reason(problem)}",
            problem.measured.path,
        )
    if turned > _MOST_TURNED:
        raise KinegenError(
            f"the measured orientations do not belong to this robot: after the fit half of them are still more than "
            f"{math.degrees(turned):.3g} degrees away, the positions {left:.3g} {unit}; {_turned_reason(problem)}",
            problem.measured.path,
        )


def _reason(problem: Problem) -> str:
    """Return what is probably wrong."""
    variables = problem.arm.robot.variables
    turning = [variable for variable in variables if variable.type is not JointType.PRISMATIC]
    sizes = {variable: float(np.abs(problem.measured.q[:, variable.index]).max()) for variable in turning}
    far = max(turning, key=lambda variable: sizes[variable], default=None)
    if far is not None and sizes[far] > _TURNS:
        return f"joint {far.name} is at {sizes[far]:.4g} rad, {sizes[far] / 2 / math.pi:.0f} turns: are these degrees?"
    if said := _unit_reason(problem):
        return said
    if far is not None and len(problem.measured.q) > 3 and sizes[far] < math.radians(2 * math.pi):
        return f"no joint turns by more than {math.degrees(sizes[far]):.3g} degrees: are these radians?"
    is_fitted = set(BASE_NAMES) <= set(problem.arm.names)
    base = "" if is_fitted else "if the pose of the base is not known, add base to --fit; "
    return f"{base}compare the columns, the frame and the file (kinegen doctor looks for mistakes in a table)"


def _unit_reason(problem: Problem) -> str:
    """Return the two units whose ratio is that of the sizes of what was measured and of the arm."""
    measured = problem.measured
    rows = np.concatenate([measured.rows(Kind.POSE), measured.rows(Kind.POSITION)])
    if len(rows) < 3:
        return ""
    modelled = problem.arm.poses(problem.start[: len(problem.arm.names)], measured.q[rows])[:, :3, 3]
    ours, theirs = (float(np.linalg.norm(each - each.mean(axis=0))) for each in (modelled, measured.positions[rows]))
    ratio = theirs / max(ours, 1e-300)
    for one in METRES:
        for other in METRES:
            if one != other and abs(ratio / (METRES[one] / METRES[other]) - 1) < _ALIKE:
                return (
                    f"they spread {ratio:.4g} times as far as the arm: are the lengths, which were taken for {one}, in "
                    f"{other}?"
                )
    return ""


def _turned_reason(problem: Problem) -> str:
    tool = "" if set(TOOL_NAMES) <= set(problem.arm.names) else "; if the tool is turned add tool to --fit"
    return f"are they written in another form (another order of roll, pitch, yaw, or of the quaternion)?{tool}"


MOST_PATTERNS = 3

_LEAST_RATIO = 30.0
"""The ratio of variances (F) from which a pattern is no chance ..."""

_LEAST_SHARE = 0.2
"""... and the share of the squared errors that are left which it has to explain to be worth a line."""

_STEP = 1e-6
_INDEPENDENT = 1e-6
"""The part of a derivative that the unknowns must leave, or they can do the same."""


class Shape(StrEnum):
    """Ways in which an error follows a joint."""

    GEAR = "gear"
    TURN = "once per turn"


@dataclass(frozen=True, slots=True)
class Pattern:
    """An error that follows a joint.

    Attributes:
        size: The factor minus 1 of a gear; for an error once per turn its amplitude in radians.
        explained: Share of the squared errors that it and those before it explain.
    """

    joint: str
    shape: Shape
    size: float
    explained: float


def patterns(fit: Fit) -> tuple[Pattern, ...]:
    """Look for errors that follow a joint, without outliers: what explains most first, then what it leaves."""
    problem = fit.problem
    inside = ~fit.outlying[problem.owners]
    residuals = problem.residuals(fit.values)[inside]
    known = (problem.jacobian(fit.values)[:, fit.free] * problem.units[fit.free])[inside]
    trials = [(each, shape, columns[inside]) for each, shape, columns in _trials(problem, fit.values)]
    found = list[Pattern]()
    whole = float(np.sum(_without(known, residuals) ** 2))
    while len(found) < MOST_PATTERNS:
        best = _best(known, residuals, trials, whole)
        if best is None:
            break
        found.append(best[0])
        known = np.hstack([known, best[1]])
    return tuple(found)


def _best(
    known: Floats,
    residuals: Floats,
    trials: list[tuple[JointVariable, Shape, Floats]],
    whole: float,
) -> tuple[Pattern, Floats] | None:
    """Return the trial that explains most of what the known columns leave, and its columns."""
    basis = np.linalg.qr(known)[0]
    left = residuals - basis @ (basis.T @ residuals)
    before, best = float(left @ left), None
    for variable, shape, columns in trials:
        # What the unknowns can do of the error is no pattern of its own.
        free = columns - basis @ (basis.T @ columns)
        if np.linalg.norm(free) < _INDEPENDENT * np.linalg.norm(columns) or not np.isfinite(columns).all():
            continue
        sizes, *_ = np.linalg.lstsq(free, -left, rcond=None)
        after = float(np.sum((left + free @ sizes) ** 2))
        # It has to explain enough to be worth a line, and more than chance would (an F test).
        freedom = len(residuals) - known.shape[1] - columns.shape[1]
        gained = before - after
        if freedom < 1 or gained < _LEAST_SHARE * before:
            continue
        if gained * freedom < _LEAST_RATIO * columns.shape[1] * max(after, 1e-300):
            continue
        if best is None or after < best[0]:
            size = float(sizes[0] if shape is Shape.GEAR else np.linalg.norm(sizes))
            best = after, Pattern(variable.name, shape, size, 1 - after / whole), columns
    return None if best is None else (best[1], best[2])


def _without(known: Floats, residuals: Floats) -> Floats:
    basis = np.linalg.qr(known)[0]
    found: Floats = residuals - basis @ (basis.T @ residuals)
    return found


def _trials(problem: Problem, values: Floats) -> Iterator[tuple[JointVariable, Shape, Floats]]:
    """Yield the derivatives (R, 1 or 2) of the residuals by every error that is looked for."""
    for variable in problem.arm.robot.variables:
        place = variable.index
        yield variable, Shape.GEAR, _slope(problem, values, place, lambda q: q)[:, None]
        if variable.type is not JointType.PRISMATIC:
            waves = [_slope(problem, values, place, wave) for wave in (np.sin, np.cos)]
            yield variable, Shape.TURN, np.stack(waves, axis=1)


def _slope(problem: Problem, values: Floats, place: int, follows: Callable[[Floats], Floats]) -> Floats:
    """Return the derivative of the residuals by an error of one joint that is a function of its value."""
    measured, ends = problem.measured, list[Floats]()
    for step in (-_STEP, _STEP):
        q, to_q = measured.q.copy(), measured.to_q.copy()
        q[:, place] += step * follows(q[:, place])
        to_q[:, place] += step * follows(to_q[:, place])
        ends.append(replace(problem, measured=replace(measured, q=q, to_q=to_q)).residuals(values))
    found: Floats = (ends[1] - ends[0]) / (2 * _STEP)
    return found
