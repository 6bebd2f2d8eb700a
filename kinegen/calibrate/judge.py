"""How good a calibration is: errors before and after, by row and by joint region, cross-validation, outliers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinegen.calibrate.fixtures import LEAST
from kinegen.calibrate.measurements import SIZES
from kinegen.calibrate.options import Loss
from kinegen.calibrate.residuals import Problem
from kinegen.calibrate.solve import Fit, solve
from kinegen.errors import KinegenError
from kinegen.workspace.optional import library

Floats = NDArray[np.float64]

REGIONS = 3
"""Parts of the measured range of a joint."""

_CHANCE = 1e-3
"""Chance that a file without outliers has a row that is reported as one."""


@dataclass(frozen=True, slots=True)
class Errors:
    """How far the model is from the measurements.

    Attributes:
        rms: Root mean square over the rows of the distance between measured and modelled, in lengths.
        worst: The largest distance.
        line: The line of the row that has it.
        rms_angle: The same of angles, in radians; None if no orientation was measured.
        worst_angle: The largest angle.
    """

    rms: float
    worst: float
    line: int
    rms_angle: float | None
    worst_angle: float | None


@dataclass(frozen=True, slots=True)
class Region:
    """Errors of the rows in which a joint is in a part of its measured range.

    Attributes:
        joint: Its name.
        low: Lower end, in radians or lengths.
        high: Upper end.
        rows: Number of rows.
        before: Root mean square of the distances with the file's numbers; 0 without rows.
        after: The same with the calibrated ones.
    """

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
        line: Its line.
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
        folds: Parts.
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
    """How far the model is from the measurements with some values of the unknowns."""
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
    """Errors before and after in each third of the measured range of each joint."""
    problem = fit.problem
    before, after = (row_errors(problem, problem.differences(v))[0] for v in (problem.start, fit.values))
    found = []
    for variable in problem.arm.robot.variables:
        q = problem.measured.q[:, variable.index]
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
    """Rows whose residuals are larger than noise makes them, the worst first."""
    chi2 = library("scipy.stats", "calibration", "calibrate").chi2
    problem = fit.problem
    differences = problem.differences(fit.values)
    squares = np.bincount(problem.owners, (differences / problem.sigmas) ** 2)
    counts = np.array([SIZES[kind] for kind in problem.measured.kinds])
    limits = chi2.isf(_CHANCE / len(counts), counts)
    lengths, angles = row_errors(problem, differences)
    rows = sorted(np.flatnonzero(squares > limits), key=lambda row: -squares[row] / limits[row])
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
    """Fit to all parts of the rows but one, and look at the one.

    Args:
        fit: The fit to all rows.
        loss: How residuals count.
        folds: Number of parts.
        seed: Decides which row is in which part.

    Returns:
        What was found; None if a part would leave too few rows.
    """
    problem = fit.problem
    rows = len(problem.measured.kinds)
    if folds < 2 or rows < 2 * folds:
        return None
    part_of = np.random.default_rng(seed).permutation(np.arange(rows) % folds)
    differences, residuals = np.zeros(problem.measured.residuals), np.zeros(problem.measured.residuals)
    for part in range(folds):
        kept = problem.part(np.flatnonzero(part_of != part))
        few = any(len(fixture.rows) < LEAST[fixture.kind] for fixture in kept.fixtures)
        if few or kept.measured.residuals <= int(fit.free.sum()):
            return None
        try:
            values, _ = solve(kept, fit.values, fit.free, loss)
        except KinegenError:
            return None
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
