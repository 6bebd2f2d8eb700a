"""Judges a calibration by errors, cross-validation and outliers, and selects the poses to measure next.

Candidates for poses are joint vectors within the limits, so each is reachable. The best one makes the determinant of
the information largest (D-optimal); then the next one, with the first counted as measured.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kinegen.errors import KinegenError
from kinegen.model.joint_bounds import joint_box
from kinegen.support.dataclass import dataclass
from kinegen.tools.calibrate.measurements import Kind
from kinegen.tools.calibrate.options import Loss
from kinegen.tools.calibrate.residuals import LEAST, Problem, outlying, row_squares
from kinegen.tools.calibrate.solve import Fit, solve

Floats = NDArray[np.float64]

REGIONS = 3
"""Parts of the measured range of a joint."""


@dataclass(frozen=True, slots=True)
class Errors:
    """Distances of the model from the measurements.

    Attributes:
        rms: Root mean square over the rows of the distance between measured and modelled, in lengths.
        worst: The largest distance.
        line: The line of the row that has it.
        rms_angle: The same of angles, in radians; None if no orientation was measured.
    """

    rms: float
    worst: float
    line: int
    rms_angle: float | None
    worst_angle: float | None


@dataclass(frozen=True, slots=True)
class Region:
    """Errors (RMS, 0 without rows) of the rows in which a joint is in a part of its measured range."""

    joint: str
    low: float
    high: float
    rows: int
    before: float
    after: float


@dataclass(frozen=True, slots=True)
class Outlier:
    """A row that does not fit.

    Attributes:
        error: Distance between measured and modelled, in lengths.
        angle: The same of the orientation, in radians; None if none was measured.
        size: Its residuals in standard deviations, root mean square.
    """

    line: int
    error: float
    angle: float | None
    size: float


@dataclass(frozen=True, slots=True)
class Crossed:
    """Cross-validation: each part of the rows against a fit to the others.

    Attributes:
        rms: Root mean square distance of the rows that were left out.
        rms_angle: The same of angles; None if no orientation was measured.
        chi: Root mean square of their residuals, in standard deviations.
    """

    folds: int
    rms: float
    rms_angle: float | None
    chi: float


def row_errors(problem: Problem, differences: Floats) -> tuple[Floats, Floats]:
    """The distance (N,) and the angle (N,) between measured and modelled; NaN where no orientation was measured."""
    rows, owners, angular = len(problem.measured.kinds), problem.owners, problem.angular
    squares = [np.bincount(owners[which], differences[which] ** 2, rows) for which in (~angular, angular)]
    turned = np.bincount(owners[angular], minlength=rows) > 0
    return np.sqrt(squares[0]), np.where(turned, np.sqrt(squares[1]), np.nan)


def errors(problem: Problem, values: Floats) -> Errors:
    """Return how far the model is from the measurements with some values of the unknowns."""
    lengths, angles = row_errors(problem, problem.differences(values))
    worst = int(np.argmax(lengths))
    rms, turned = float(np.sqrt(np.mean(lengths**2))), not np.isnan(angles).all()
    return Errors(
        rms=rms,
        worst=float(lengths[worst]),
        line=problem.measured.lines[worst],
        rms_angle=float(np.sqrt(np.nanmean(angles**2))) if turned else None,
        worst_angle=float(np.nanmax(angles)) if turned else None,
    )


def regions(fit: Fit) -> tuple[Region, ...]:
    """Return errors before and after in each third of the measured range of each joint."""
    problem = fit.problem
    before, after = (row_errors(problem, problem.differences(v))[0] for v in (problem.start, fit.values))
    found = []
    for variable in problem.arm.robot.variables:
        q = problem.measured.q[:, variable.index]
        # Thirds of the measured range, since few joints are measured all the way.
        edges = np.linspace(q.min(), q.max(), REGIONS + 1)
        if edges[0] == edges[-1]:
            continue
        place = np.clip(np.searchsorted(edges, q, side="right") - 1, 0, REGIONS - 1)
        for part in range(REGIONS):
            rows = place == part
            sizes = [float(np.sqrt(np.mean(each[rows] ** 2))) if rows.any() else 0.0 for each in (before, after)]
            ends = float(edges[part]), float(edges[part + 1])
            found.append(Region(variable.name, *ends, int(rows.sum()), *sizes))
    return tuple(found)


def outliers(fit: Fit) -> tuple[Outlier, ...]:
    """Return rows that stand out from the others, the worst first."""
    problem = fit.problem
    squares, counts = row_squares(problem, fit.values)
    _, ratios = outlying(problem, fit.values)
    lengths, angles = row_errors(problem, problem.differences(fit.values))
    # The worst row first, by how far it is beyond its limit.
    rows = sorted(np.flatnonzero(fit.outlying), key=lambda row: -ratios[row])
    return tuple(
        Outlier(
            line=problem.measured.lines[row],
            error=float(lengths[row]),
            angle=None if np.isnan(angles[row]) else float(angles[row]),
            size=float(np.sqrt(squares[row] / counts[row])),
        )
        for row in rows
    )


def cross_validated(fit: Fit, loss: Loss, folds: int, seed: int) -> Crossed | None:
    """Fit to all parts of the rows but one and judge that one; return None if a part would leave too few rows."""
    problem = fit.problem
    rows = len(problem.measured.kinds)
    if folds < 2 or rows < 2 * folds:
        return None
    # Rows are shuffled: neighbours in a file are often alike.
    part_of = np.random.default_rng(seed).permutation(np.arange(rows) % folds)
    differences, residuals = np.zeros(problem.measured.residuals), np.zeros(problem.measured.residuals)
    for part in range(folds):
        # A part that leaves too little to determine all unknowns says nothing.
        kept = problem.part(np.flatnonzero(part_of != part))
        few = any(len(fixture.rows) < LEAST[fixture.kind] for fixture in kept.fixtures)
        if few or kept.measured.independent <= int(fit.free.sum()):
            return None
        try:
            values, _ = solve(kept, fit.values, fit.free, loss)
        except KinegenError:
            return None
        # Rows are judged by the fit that has not seen them.
        mine = part_of[problem.owners] == part
        differences[mine] = problem.differences(values)[mine]
        residuals[mine] = differences[mine] / problem.sigmas[mine]
    lengths, angles = row_errors(problem, differences)
    turned = not np.isnan(angles).all()
    return Crossed(
        folds=folds,
        rms=float(np.sqrt(np.mean(lengths**2))),
        rms_angle=float(np.sqrt(np.nanmean(angles**2))) if turned else None,
        chi=float(np.sqrt(np.mean(residuals**2))),
    )


CANDIDATES = 2000


@dataclass(frozen=True, slots=True)
class Suggestion:
    """A pose to measure; by `gain` (0.1 is 10 %) standard deviations shrink, as a geometric mean."""

    q: tuple[float, ...]
    position: tuple[float, float, float]
    gain: float


def suggest(fit: Fit, count: int, seed: int) -> tuple[Suggestion, ...]:
    """Choose poses to measure, the best first.

    They are measured as poses where orientations were measured, else as positions; the seed decides the candidates.
    """
    problem, arm = fit.problem, fit.problem.arm
    parameters = len(arm.names)
    # What is fixed because it is not known well enough may become known; what no measurement knows stays out.
    exact = {each.name for each in fit.tied if each.exact}
    wanted = np.array([name not in exact for name in arm.names])
    if not wanted.any() or count < 1:
        return ()
    low, high = np.array(joint_box(arm.robot)).T
    q = np.random.default_rng(seed).uniform(low, high, (CANDIDATES, len(low)))
    poses, linear, angular = arm.derivatives(fit.values[:parameters], q)
    measured = problem.measured
    parts = [linear / np.median(measured.sigma)]
    if Kind.POSE in measured.kinds:
        parts.append(angular / np.median(measured.sigma_angle))
    slopes = np.concatenate(parts, axis=1)[..., wanted] * arm.units[wanted]
    information = _information(fit, wanted)
    found, left = list[Suggestion](), np.ones(CANDIDATES, dtype=bool)
    for _ in range(count):
        covariance = np.linalg.inv(information)
        gains = np.linalg.slogdet(np.eye(slopes.shape[1]) + slopes @ covariance @ slopes.swapaxes(1, 2))[1]
        best = int(np.argmax(np.where(left, gains, -1.0)))
        left[best] = False
        information = information + slopes[best].T @ slopes[best]
        x, y, z = map(float, poses[best, :3, 3])
        gain = 1 - float(np.exp(-gains[best] / (2 * int(wanted.sum()))))
        found.append(Suggestion(tuple(map(float, q[best])), (x, y, z), gain))
    return tuple(found)


def _information(fit: Fit, wanted: NDArray[np.bool_]) -> Floats:
    """Return the information on the wanted parameters, in units, without fixtures and weak knowledge of one unit."""
    problem = fit.problem
    parameters = len(problem.arm.names)
    columns = np.r_[wanted, np.ones(len(problem.names) - parameters, dtype=bool)]
    scaled = problem.jacobian(fit.values)[:, columns] * problem.units[columns]
    whole = scaled.T @ scaled + np.eye(int(columns.sum()))
    first = int(wanted.sum())
    # Fixtures are unknown too: the Schur complement leaves what is known of the arm in spite of that.
    mixed = whole[:first, first:]
    found: Floats = whole[:first, :first] - mixed @ np.linalg.solve(whole[first:, first:], mixed.T)
    return found
