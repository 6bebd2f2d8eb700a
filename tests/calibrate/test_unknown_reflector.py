"""A tracker at an unknown place and a reflector at an unknown point, against a least squares fit written here.

The tables are random, with twists that are multiples of 90 degrees or anything between. The file has no tool, so at the
start the reflector is on the last axis, where fewer numbers are known than at the solution. The matrices and the fit
of this module share nothing with kinegen.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from kinegen.tools.calibrate.options import Loss, Settings
from kinegen.tools.calibrate.run import Study, calibrate

Floats = NDArray[np.float64]

ROWS, NOISE = 60, 3e-5
FIT = ("theta", "a", "d", "alpha", "base", "tool")
ENTRIES = ("theta", "d", "a", "alpha")
ARMS = [*range(4), *(pytest.param(seed, marks=pytest.mark.long) for seed in range(4, 50))]


@dataclass(frozen=True)
class Arm:
    """A random table, the true one, and what was measured; radians and metres."""

    names: tuple[str, ...]
    table: Floats
    truth: Floats
    q: Floats
    points: Floats


def moved(table: Floats, q: Floats) -> tuple[Floats, Floats]:
    """Rotations (N, 3, 3) and positions (N, 3) of the last frame of a standard table."""
    rotation, place = np.tile(np.eye(3), (len(q), 1, 1)), np.zeros((len(q), 3))
    for (theta, d, a, alpha), angle in zip(table, q.T, strict=True):
        c, s = np.cos(theta + angle), np.sin(theta + angle)
        place = place + np.einsum("nij,nj->ni", rotation, np.stack([a * c, a * s, np.full_like(c, d)], axis=1))
        ca, sa = np.cos(alpha), np.sin(alpha)
        zero = np.zeros_like(c)
        turn = np.stack([c, -s * ca, s * sa, s, c * ca, -c * sa, zero, zero + sa, zero + ca], axis=1)
        rotation = rotation @ turn.reshape(-1, 3, 3)
    return rotation, place


def seen(values: Floats, table: Floats, free: list[int], q: Floats) -> Floats:
    """What a tracker measures: the free entries, then base (place, rotation vector) and reflector."""
    entries = table.copy()
    entries.flat[free] += values[: len(free)]
    place, turn, reflector = values[len(free) :].reshape(3, 3)
    rotation, position = moved(entries, q)
    return (position + rotation @ reflector) @ Rotation.from_rotvec(turn).as_matrix().T + place


def random_arm(seed: int) -> Arm:
    """An arm of six joints; of the first and last row only what base and tool cannot do is wrong."""
    rng = np.random.default_rng(seed)
    alpha = np.radians(np.where(rng.random(6) < 0.6, rng.choice([-90, 90], 6), rng.uniform(30, 150, 6)))
    lengths = rng.uniform(0.1, 0.5, (2, 6)) * (rng.random((2, 6)) < 0.6)
    table = np.column_stack([rng.choice([0, np.pi / 2], 6), *lengths, alpha])
    errors = rng.normal(0, 1, (6, 4)) * (5e-4, 3e-4, 3e-4, 5e-4)
    errors[0, :2], errors[5] = 0, 0
    q = np.round(rng.uniform(-2, 2, (ROWS, 6)), 6)
    mount = np.r_[rng.uniform(-2, 2, 3), Rotation.random(random_state=seed).as_rotvec(), rng.uniform(0.05, 0.2, 3)]
    points = seen(mount, table + errors, [], q) + rng.normal(0, NOISE, (ROWS, 3))
    return Arm(tuple(f"j{row}" for row in range(1, 7)), table, np.append(errors, mount), q, points)


def written(arm: Arm, folder: Path) -> Study:
    """What kinegen makes of it."""
    rows = [
        f"  - {{name: {name}, theta: q + {theta!r}, d: {d!r}, a: {a!r}, alpha: {alpha!r}}}"
        for name, (theta, d, a, alpha) in zip(arm.names, arm.table.tolist(), strict=True)
    ]
    head = ["kinegen: 1", "name: arm", "convention: standard", "units: {length: m, angle: rad}", "joints:"]
    (folder / "arm.yaml").write_text("\n".join([*head, *rows, ""]), encoding="utf-8")
    numbers = np.hstack([arm.q, arm.points])
    lines = [",".join([*arm.names, "x", "y", "z"]), *(",".join(map(repr, row)) for row in numbers.tolist())]
    (folder / "points.csv").write_text("\n".join([*lines, ""]), encoding="utf-8")
    settings = Settings(fit=FIT, angle="rad", sigma=NOISE, loss=Loss.LINEAR, folds=0)
    return calibrate(folder / "arm.yaml", folder / "points.csv", settings)


@pytest.mark.parametrize("seed", ARMS)
def test_all_that_is_known_at_the_solution_is_fitted(seed: int, tmp_path: Path) -> None:
    arm = random_arm(seed)
    found = written(arm, tmp_path).fit
    names = found.problem.names
    free = {name for name, is_free in zip(names, found.free, strict=True) if is_free}

    # Base and tool can do theta and d of the first row, and all of the last; everything else is known.
    known = [(row, column) for row in range(6) for column in range(4)]
    known = [(row, column) for row, column in known if row != 5 and (row, column) not in ((0, 0), (0, 1))]
    entries = [f"{ENTRIES[column]}_{arm.names[row]}" for row, column in known]
    mounts = [*(f"base_{n}" for n in ("x", "y", "z", "rx", "ry", "rz")), "tool_x", "tool_y", "tool_z"]
    assert free == {*entries, *mounts}

    flat = [4 * row + column for row, column in known]
    truth = np.r_[arm.truth[flat], arm.truth[24:]]
    own = least_squares(
        lambda v: ((seen(v, arm.table, flat, arm.q) - arm.points) / NOISE).ravel(), truth, x_scale="jac", xtol=1e-14
    )
    covariance = np.linalg.inv(own.jac.T @ own.jac)
    sigma = np.sqrt(np.diag(covariance))
    ours = np.array([found.values[names.index(name)] - found.problem.arm.start[names.index(name)] for name in entries])
    ours_sigma = np.array([found.sigma[names.index(name)] for name in entries])
    count = len(entries)

    assert (np.abs(ours - own.x[:count]) < 0.02 * sigma[:count]).all()
    assert ours_sigma == pytest.approx(sigma[:count], rel=0.02)
    off = ours - truth[:count]
    assert np.abs(off / ours_sigma).max() < 4.2
    # Errors of different numbers depend on each other, so they are judged together.
    assert off @ np.linalg.solve(covariance[:count, :count], off) < chi2.isf(1e-5, count)
    assert abs(found.chi_square - 1) < 4 * np.sqrt(2 / found.freedom)
