"""The fit: weighted least squares with a robust loss, what cannot be distinguished fixed, and standard deviations."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from kinegen.calibrate.identify import Tied, tied
from kinegen.calibrate.measurements import Measurements
from kinegen.calibrate.options import Loss
from kinegen.calibrate.residuals import Problem
from kinegen.errors import KinegenError
from kinegen.workspace.optional import library

Floats = NDArray[np.float64]

BEND = 3.0
"""Residuals beyond this many standard deviations count less than squared."""

_OUTSIDE = 2 * BEND
"""Residuals beyond this many standard deviations are outliers, and do not count for chi-square ..."""

_MOST_INSIDE = 0.9
"""... unless there are so many of them that they are the rule."""

_ROUNDS = 4
_SCALINGS = 8
_EVALUATIONS = 200
_TOLERANCE = 1e-12


@dataclass(frozen=True, slots=True)
class Fit:
    """A calibration that is done.

    Attributes:
        problem: The problem, with the uncertainties that the fit found where none were stated.
        values: The unknowns, (U,).
        free: Which of them were varied, (U,).
        tied: Those that were fixed because nothing distinguishes them from others.
        sigma: Standard deviations, (U,); zero where fixed.
        chi_square: Sum of squared residuals over degrees of freedom, without outliers; close to 1 if the uncertainties
            are right.
        freedom: Degrees of freedom: these residuals minus free unknowns.
        evaluations: Times the residuals were computed.
    """

    problem: Problem
    values: Floats
    free: NDArray[np.bool_]
    tied: tuple[Tied, ...]
    sigma: Floats
    chi_square: float
    freedom: int
    evaluations: int


def fit(problem: Problem, loss: Loss) -> Fit:
    """Calibrate.

    Args:
        problem: The problem.
        loss: How residuals count.

    Returns:
        The fit; what was fixed is still tied at the solution.

    Raises:
        KinegenError: If SciPy is not installed, or there are too few measurements.
    """
    free, found = np.ones(len(problem.names), dtype=bool), list[Tied]()
    values, evaluations = problem.start, 0
    # What the measurements know can change on the way to the solution, so it is looked at again there.
    for _ in range(_ROUNDS):
        more = tied(problem.names, problem.jacobian(values), problem.units, free)
        if more:
            found += more
            fixed = {each.name for each in found}
            free = np.array([name not in fixed for name in problem.names])
            values = np.where(free, values, problem.start)
        elif evaluations:
            break
        _check_freedom(problem, free)
        problem, values, used = _scaled(problem, values, free, loss)
        evaluations += used
    order = {name: place for place, name in enumerate(problem.names)}
    return _with_sigma(
        problem, values, free, tuple(sorted(found, key=lambda each: order[each.name])), evaluations, loss
    )


def solve(problem: Problem, start: Floats, free: NDArray[np.bool_], loss: Loss) -> tuple[Floats, int]:
    """The values of the free unknowns that fit best; the others keep theirs.

    Args:
        problem: The problem.
        start: Where to begin, (U,).
        free: Which unknowns are varied, (U,).
        loss: How residuals count.

    Returns:
        All unknowns, and how often the residuals were computed.
    """
    least_squares = library("scipy.optimize", "calibration", "calibrate").least_squares
    units = problem.units[free]

    def values_of(steps: Floats) -> Floats:
        values = start.copy()
        values[free] += steps * units
        return values

    found = least_squares(
        lambda steps: problem.residuals(values_of(steps)),
        np.zeros(len(units)),
        lambda steps: problem.jacobian(values_of(steps))[:, free] * units,
        method="trf",
        x_scale="jac",
        loss=str(loss),
        f_scale=BEND,
        xtol=_TOLERANCE,
        ftol=_TOLERANCE,
        gtol=_TOLERANCE,
        max_nfev=_EVALUATIONS,
    )
    return values_of(found.x), int(found.nfev)


def _scaled(problem: Problem, start: Floats, free: NDArray[np.bool_], loss: Loss) -> tuple[Problem, Floats, int]:
    """Solve; where no uncertainties were stated, with those that the residuals show."""
    values, evaluations = solve(problem, start, free, loss)
    if problem.measured.stated:
        return problem, values, evaluations
    for _ in range(_SCALINGS):
        after = replace(problem, measured=_rescaled(problem, values, free))
        change = np.max(np.abs(np.log(after.sigmas / problem.sigmas)))
        problem = after
        values, used = solve(problem, values, free, loss)
        evaluations += used
        if change < 1e-3:
            break
    return problem, values, evaluations


def _rescaled(problem: Problem, values: Floats, free: NDArray[np.bool_]) -> Measurements:
    """Uncertainties of lengths and of angles, so that the residuals of each are as large as they should be."""
    residuals, angular = problem.residuals(values), problem.angular
    share = len(residuals) / max(len(residuals) - int(free.sum()), 1)
    factors = [1.0, 1.0]
    for place, which in enumerate((~angular, angular)):
        if which.any():
            # The median is not moved by outliers; 0.6745 is that of a normal distribution.
            spread = float(np.median(np.abs(residuals[which]))) / 0.6745 if len(residuals) > 20 else 0.0
            inner = np.clip(residuals[which], -BEND * spread, BEND * spread) if spread else residuals[which]
            factors[place] = max(float(np.sqrt(np.mean(inner**2) * share)), 1e-9)
    measured = problem.measured
    return replace(measured, sigma=measured.sigma * factors[0], sigma_angle=measured.sigma_angle * factors[1])


def _check_freedom(problem: Problem, free: NDArray[np.bool_]) -> None:
    residuals, unknowns = problem.measured.residuals, int(free.sum())
    if residuals <= unknowns:
        rows = len(problem.measured.kinds)
        raise KinegenError(
            f"{rows} rows measure {residuals} numbers, too few for {unknowns} unknowns; measure more poses, or vary "
            "less (--fit)",
            problem.measured.path,
        )


def weights(residuals: Floats, loss: Loss) -> Floats:
    """What the square of each residual counts, (R,): 1 within three standard deviations, less beyond."""
    size = np.maximum(np.abs(residuals) / BEND, 1e-300)
    match loss:
        case Loss.LINEAR:
            return np.ones_like(residuals)
        case Loss.HUBER:
            return np.minimum(1.0, 1 / size)
        case Loss.SOFT_L1:
            return np.asarray(1 / np.sqrt(1 + size**2))
        case _:
            return np.asarray(1 / (1 + size**2))


def _with_sigma(
    problem: Problem, values: Floats, free: NDArray[np.bool_], found: tuple[Tied, ...], evaluations: int, loss: Loss
) -> Fit:
    residuals = problem.residuals(values)
    scaled = problem.jacobian(values)[:, free] * problem.units[free]
    covariance = np.linalg.inv(scaled.T @ (weights(residuals, loss)[:, None] * scaled))
    sigma = np.zeros(len(values))
    sigma[free] = np.sqrt(np.diag(covariance)) * problem.units[free]
    inside = np.abs(residuals) < _OUTSIDE
    if np.mean(inside) < _MOST_INSIDE:
        inside[:] = True
    freedom = max(int(inside.sum()) - int(free.sum()), 1)
    chi_square = float(np.sum(residuals[inside] ** 2)) / freedom
    return Fit(problem, values, free, found, sigma, chi_square, freedom, evaluations)
