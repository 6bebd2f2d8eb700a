"""Fits by weighted least squares with a robust loss, and gives standard deviations.

Unknowns that the measurements cannot distinguish are fixed. They are found from the derivatives of the residuals, in
standard deviations, by unknowns counted in units (a hundredth of the reach, a hundredth of a radian): a singular value
below 1 belongs to a combination that is not known even to one unit, and for each of these one unknown is fixed.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from kinegen.errors import KinegenError
from kinegen.support.compat import library
from kinegen.support.dataclass import dataclass
from kinegen.tools.calibrate.fitted_parameters import BASE_NAMES, TOOL_NAMES
from kinegen.tools.calibrate.measurements import Measurements
from kinegen.tools.calibrate.options import Loss
from kinegen.tools.calibrate.residuals import Problem, outlying

Floats = NDArray[np.float64]

LEAST = 1.0
"""The smallest singular value of a combination that counts as known."""

EXACT = 1e-8
"""Below this share of the largest singular value no measurement of this kind knows the combination."""

_PART = 5e-3
"""The share of a combination, of its largest, from which an unknown is a part of it."""

_MOUNT_WEIGHT, _FIXTURE_WEIGHT = 0.2, 0.05
"""An entry of the table is rather fixed than base or tool, or a fixture, which are in no data sheet."""

_FIXED_WEIGHT = 10.0
"""What is fixed already stays so, unless another is clearly better: otherwise equals would be exchanged for ever."""


@dataclass(frozen=True, slots=True)
class Tied:
    """An unknown that is fixed because it cannot be distinguished from others.

    Attributes:
        partners: The others that move what was measured in the same way, with their factors: one unit of `name` is
            the sum of factor times unit of each; empty if `name` moves nothing that was measured.
        sigma: Standard deviation of the combination, in units; infinite if no measurement of this kind knows it.
    """

    name: str
    partners: tuple[tuple[str, float], ...]
    sigma: float

    @property
    def exact(self) -> bool:
        """Tell whether more measurements of the same kind could not help."""
        return bool(np.isinf(self.sigma))


def tied(
    names: tuple[str, ...], jacobian: Floats, units: Floats, fixed: frozenset[str] = frozenset()
) -> tuple[Tied, ...]:
    """Find the unknowns to fix, in the order of `names`, from the derivative of the residuals (R, U).

    Unknowns count in `units`, (U,). Those in `fixed` are judged as all others, but rather chosen than equal ones.
    """
    scaled = jacobian * units
    # The triangular factor has the same singular values, and one row for each unknown at most.
    _, sizes, directions = np.linalg.svd(np.linalg.qr(scaled, mode="r"), full_matrices=True)
    sizes = np.r_[sizes, np.zeros(len(names) - len(sizes))]
    limit = EXACT * max(sizes[0], 1e-300) if len(sizes) else 0.0
    lost = (sizes < LEAST) | (sizes <= limit)
    if not lost.any():
        return ()
    lost_directions = directions[lost]
    picked = _pick(
        lost_directions, np.array([_weight(name) * (_FIXED_WEIGHT if name in fixed else 1) for name in names])
    )
    # Combinations in which one of the picked is 1 and the others 0.
    combinations = np.linalg.solve(lost_directions[:, picked], lost_directions)
    sigmas = np.where(sizes[lost] <= limit, np.inf, 1 / np.maximum(sizes[lost], 1e-300))
    found = []
    for place, combination in zip(picked, combinations, strict=True):
        parts = [
            (names[other], -float(share))
            for other, share in enumerate(combination)
            if other != place and abs(share) > _PART * np.abs(combination).max()
        ]
        # A combination is as uncertain as the worst of the directions that it is made of.
        shares = np.abs(lost_directions @ combination)
        worst = float(sigmas[shares > _PART * shares.max()].max())
        found.append(Tied(names[place], tuple(parts), worst))
    order = {name: place for place, name in enumerate(names)}
    return tuple(sorted(found, key=lambda each: order[each.name]))


def _weight(name: str) -> float:
    if name in BASE_NAMES or name in TOOL_NAMES:
        return _MOUNT_WEIGHT
    return _FIXTURE_WEIGHT if name.startswith(("plane_", "sphere_", "anchor_")) else 1.0


def _pick(directions: Floats, weights: Floats) -> list[int]:
    """One unknown for each direction, so that the others determine it well: columns of a pivoted QR decomposition."""
    left, picked = directions.copy(), list[int]()
    for _ in range(len(directions)):
        sizes = np.linalg.norm(left, axis=0) * weights
        sizes[picked] = -1.0
        # Of unknowns that are equal but for rounding, the last in the table is fixed.
        place = int(np.flatnonzero(sizes >= sizes.max() * (1 - 1e-6))[-1])
        picked.append(place)
        axis = left[:, place] / np.linalg.norm(left[:, place])
        left -= np.outer(axis, axis @ left)
    return picked


BEND = 3.0
"""Residuals beyond this many standard deviations count less than squared."""

_ROUNDS = 12
_SCALINGS = 8
_EVALUATIONS = 200
_TOLERANCE = 1e-12


@dataclass(frozen=True, slots=True)
class Fit:
    """A calibration that is done; `tied` were fixed because nothing distinguishes them from others.

    Attributes:
        problem: The problem, with the uncertainties that the fit found where none were stated.
        sigma: Standard deviations, (U,); zero where fixed.
        outlying: The rows that stand out from the others, (N,).
        chi_square: Sum of squared residuals over degrees of freedom, without these rows; close to 1 if the
            uncertainties are right.
        freedom: Degrees of freedom: the residuals of the other rows minus free unknowns.
    """

    problem: Problem
    values: Floats
    free: NDArray[np.bool_]
    tied: tuple[Tied, ...]
    sigma: Floats
    outlying: NDArray[np.bool_]
    chi_square: float
    freedom: int
    evaluations: int


def fit(problem: Problem, loss: Loss) -> Fit:
    """Calibrate; every unknown that is fixed is still tied at the solution, and too few measurements are an error."""
    # What the measurements know changes on the way to the solution, so all unknowns are judged again there.
    fixed = tied(problem.names, problem.jacobian(problem.start), problem.units)
    tries, evaluations = dict[frozenset[str], _Try](), 0
    start = problem.start
    for _ in range(_ROUNDS):
        names = _names(fixed)
        free = np.array([name not in names for name in problem.names])
        _check_freedom(problem, free)
        problem, values, used = _scaled(problem, np.where(free, start, problem.start), free, loss)
        evaluations += used
        judged = tied(problem.names, problem.jacobian(values), problem.units, names)
        tries[names] = _Try(problem, values, free, fixed, judged)
        if _names(judged) in tries:
            break
        fixed, start = judged, values
    return _with_sigma(_chosen(tries, _names(judged)), evaluations, loss)


@dataclass(frozen=True, slots=True)
class _Try:
    """A solution with some unknowns fixed, and what is tied there."""

    problem: Problem
    values: Floats
    free: NDArray[np.bool_]
    fixed: tuple[Tied, ...]
    judged: tuple[Tied, ...]


def _names(found: tuple[Tied, ...]) -> frozenset[str]:
    return frozenset(each.name for each in found)


def _chosen(tries: dict[frozenset[str], _Try], judged: frozenset[str]) -> _Try:
    """The try that is confirmed at its own solution; of several that lead to each other, the one that fixes least.

    A combination that is just known with one of them and just not with the other is better varied, with a large
    standard deviation, than fixed at a wrong value, with small ones of the others.
    """
    last = next(reversed(tries))
    if judged == last:
        return tries[last]
    order = list(tries)
    cycle = order[order.index(judged) :] if judged in tries else order[-1:]
    for names in sorted(cycle, key=len):
        if not any(each.exact and each.name not in names for each in tries[names].judged):
            return tries[names]
    return tries[last]


def solve(problem: Problem, start: Floats, free: NDArray[np.bool_], loss: Loss) -> tuple[Floats, int]:
    """Return the unknowns (U,) with the free ones at their best fit, and how often residuals were computed."""
    least_squares = library("scipy.optimize", "calibration", "calibrate").least_squares
    units = problem.units[free]

    def values_of(steps: Floats) -> Floats:
        values = start.copy()
        values[free] += steps * units
        return values

    # Unknowns are counted in units, so that one tolerance suits lengths and angles.
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
    # Uncertainties and the fit depend on each other, and settle within a few rounds.
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
    measured, unknowns = problem.measured, int(free.sum())
    residuals, rows = measured.independent, len(measured.kinds)
    if residuals <= unknowns:
        repeated = " at different joint vectors" if residuals < measured.residuals else ""
        raise KinegenError(
            f"{rows} rows measure {residuals} numbers{repeated}, too few for {unknowns} unknowns; measure more poses, "
            "or vary less (--fit)",
            problem.measured.path,
        )


def weights(residuals: Floats, loss: Loss) -> Floats:
    """Return what the square of each residual counts, (R,): 1 within three standard deviations, less beyond."""
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


def _with_sigma(chosen: _Try, evaluations: int, loss: Loss) -> Fit:
    problem, values, free = chosen.problem, chosen.values, chosen.free
    reasons = {each.name: each for each in (*chosen.fixed, *chosen.judged)}
    fixed = tuple(reasons[name] for name, is_free in zip(problem.names, free, strict=True) if not is_free)
    residuals = problem.residuals(values)
    scaled = problem.jacobian(values)[:, free] * problem.units[free]
    # Outliers count less in the covariance, as they did in the fit.
    covariance = np.linalg.inv(scaled.T @ (weights(residuals, loss)[:, None] * scaled))
    sigma = np.zeros(len(values))
    sigma[free] = np.sqrt(np.diag(covariance)) * problem.units[free]
    # Chi square judges the model, which outliers are no part of.
    outside = outlying(problem, values)[0]
    inside = ~outside[problem.owners]
    freedom = max(int(inside.sum()) - int(free.sum()), 1)
    chi_square = float(np.sum(residuals[inside] ** 2)) / freedom
    return Fit(problem, values, free, fixed, sigma, outside, chi_square, freedom, evaluations)
