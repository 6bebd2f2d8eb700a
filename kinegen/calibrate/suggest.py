"""Which poses to measure next: those that shrink the uncertainty of all parameters together most.

Candidates are joint vectors within the limits, so each is reachable. The best of them is the one that makes the
determinant of the information largest (D-optimal); then the next one, with the first counted as measured.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinegen.calibrate.measurements import Kind
from kinegen.calibrate.solve import Fit
from kinegen.robot.extent import joint_box

Floats = NDArray[np.float64]

CANDIDATES = 2000


@dataclass(frozen=True, slots=True)
class Suggestion:
    """A pose to measure.

    Attributes:
        q: The joint vector, in radians and lengths.
        position: Where the measured frame is there, in the axes of the base.
        gain: How far the standard deviations shrink by this pose, as a geometric mean: 0.1 is 10 %.
    """

    q: tuple[float, ...]
    position: tuple[float, float, float]
    gain: float


def suggest(fit: Fit, count: int, seed: int) -> tuple[Suggestion, ...]:
    """Choose poses to measure.

    Args:
        fit: The fit.
        count: Number of poses.
        seed: Decides the candidates.

    Returns:
        The poses, the best first; they are measured as poses where orientations were measured, else as positions.
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
    """What is known of the wanted parameters, in units, with fixtures and weak knowledge of one unit taken out."""
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
