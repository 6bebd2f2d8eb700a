"""What was measured minus what the arm gives, divided by standard deviations, and its derivative by all unknowns.

The unknowns are those of the arm, in its order, and then those of the fixtures.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from kinegen.calibrate.arm import SHARE, Arm
from kinegen.calibrate.fixtures import Fixture, find_fixtures
from kinegen.calibrate.measurements import SIZES, Kind, Measurements
from kinegen.calibrate.rotations import right_jacobian_inverse, to_vector

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Problem:
    """A calibration as a least squares problem.

    Attributes:
        arm: The arm.
        measured: The measurements.
        fixtures: Planes, spheres and anchors.
        start: Where the unknowns begin, (U,).
    """

    arm: Arm
    measured: Measurements
    fixtures: tuple[Fixture, ...]
    start: Floats

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the unknowns."""
        return (*self.arm.names, *(name for fixture in self.fixtures for name in fixture.names))

    @property
    def units(self) -> Floats:
        """What counts as one unit of each unknown, (U,)."""
        angles = [name.rsplit("_", 2)[-2] == "tilt" for fixture in self.fixtures for name in fixture.names]
        own = [SHARE if is_angle else SHARE * self.arm.reach for is_angle in angles]
        return np.append(self.arm.units, own)

    @property
    def owners(self) -> NDArray[np.intp]:
        """The row of the measurements to which each residual belongs, (R,)."""
        sizes = [SIZES[kind] for kind in self.measured.kinds]
        return np.repeat(np.arange(len(sizes)), sizes)

    @property
    def angular(self) -> NDArray[np.bool_]:
        """Which residuals are angles, (R,)."""
        return np.concatenate([np.arange(SIZES[kind]) >= 3 for kind in self.measured.kinds])

    @property
    def sigmas(self) -> Floats:
        """The standard deviation of each residual, (R,)."""
        owners = self.owners
        found: Floats = np.where(self.angular, self.measured.sigma_angle[owners], self.measured.sigma[owners])
        return found

    def differences(self, values: Floats) -> Floats:
        """Measured minus modelled, (R,), in lengths and radians."""
        return self._evaluate(values, slopes=False)[0]

    def slopes(self, values: Floats) -> Floats:
        """The derivative of `differences` by the unknowns, (R, U)."""
        return self._evaluate(values, slopes=True)[1]

    def residuals(self, values: Floats) -> Floats:
        """Differences over their standard deviations, (R,)."""
        found: Floats = self.differences(values) / self.sigmas
        return found

    def jacobian(self, values: Floats) -> Floats:
        """The derivative of `residuals`, (R, U)."""
        found: Floats = self.slopes(values) / self.sigmas[:, None]
        return found

    def part(self, rows: NDArray[np.intp]) -> Problem:
        """The same problem with some of the rows; the unknowns keep their places."""
        places = {int(row): place for place, row in enumerate(rows)}
        fixtures = tuple(
            replace(
                fixture, rows=np.array([places[int(row)] for row in fixture.rows if int(row) in places], dtype=np.intp)
            )
            for fixture in self.fixtures
        )
        return replace(self, measured=self.measured.part(rows), fixtures=fixtures)

    def _evaluate(self, values: Floats, *, slopes: bool) -> tuple[Floats, Floats]:
        """Differences, and their derivatives where they are asked for."""
        found, measured = _Blocks(self), self.measured
        mine = values[: len(self.arm.names)]
        poses, linear, angular = self._poses(mine, measured.q, slopes=slopes)
        points = poses[:, :3, 3]
        placed = np.concatenate([measured.rows(Kind.POSE), measured.rows(Kind.POSITION)])
        found.put(placed, slice(0, 3), measured.positions[placed] - points[placed], -linear[placed])
        posed = measured.rows(Kind.POSE)
        turns = to_vector(measured.rotations[posed] @ poses[posed, :3, :3].swapaxes(1, 2))
        found.put(posed, slice(3, 6), turns, -right_jacobian_inverse(turns) @ angular[posed])
        self._add_distances(found, mine, points, linear, slopes=slopes)
        self._add_fixtures(found, values, points, linear)
        return found.values, found.slopes

    def _poses(self, values: Floats, q: Floats, *, slopes: bool) -> tuple[Floats, Floats, Floats]:
        if slopes:
            return self.arm.derivatives(values, q)
        none = np.zeros((len(q), 3, len(values)))
        return self.arm.poses(values, q), none, none

    def _add_distances(self, found: _Blocks, values: Floats, points: Floats, linear: Floats, *, slopes: bool) -> None:
        """Distances between the positions of two joint vectors."""
        rows = self.measured.rows(Kind.DISTANCE)
        if not len(rows):
            return
        others, other_linear, _ = self._poses(values, self.measured.to_q[rows], slopes=slopes)
        away = others[:, :3, 3] - points[rows]
        size = np.linalg.norm(away, axis=1)
        outward = away / np.maximum(size, 1e-300)[:, None]
        slope = -np.einsum("ni,nij->nj", outward, other_linear - linear[rows])
        found.put(rows, slice(0, 1), (self.measured.lengths[rows] - size)[:, None], slope[:, None])

    def _add_fixtures(self, found: _Blocks, values: Floats, points: Floats, linear: Floats) -> None:
        """Distances from planes, spheres and anchors."""
        first = len(self.arm.names)
        for fixture in self.fixtures:
            last, rows = first + len(fixture.numbers), fixture.rows
            lengths = self.measured.lengths[rows]
            differences, by_point, own = fixture.residuals(values[first:last], points[rows], lengths)
            slope = -np.einsum("ni,nij->nj", by_point, linear[rows])
            found.put(rows, slice(0, 1), differences[:, None], slope[:, None])
            found.put_own(rows, slice(first, last), -own)
            first = last


class _Blocks:
    """Collects residuals in the order of the rows."""

    def __init__(self, problem: Problem) -> None:
        sizes = [SIZES[kind] for kind in problem.measured.kinds]
        self._first = np.concatenate([[0], np.cumsum(sizes)]).astype(np.intp)
        self._arm = len(problem.arm.names)
        self.values: Floats = np.zeros(int(self._first[-1]))
        self.slopes: Floats = np.zeros((len(self.values), len(problem.start)))

    def put(self, rows: NDArray[np.intp], part: slice, values: Floats, slopes: Floats) -> None:
        """Residuals (n, k) of some rows, and their derivatives by the unknowns of the arm (n, k, P)."""
        places = self._first[rows][:, None] + np.arange(part.start, part.stop)
        self.values[places] = values
        self.slopes[places, : self._arm] = slopes

    def put_own(self, rows: NDArray[np.intp], columns: slice, slopes: Floats) -> None:
        """Derivatives (n, K) of single residuals by the unknowns of a fixture."""
        self.slopes[self._first[rows], columns] = slopes


def make_problem(arm: Arm, measured: Measurements) -> Problem:
    """A calibration, from the values of the file.

    The base begins where it fits positions best, if all of it is varied; fixtures begin at their best fits.
    """
    start = _aligned(arm, measured)
    points = arm.poses(start, measured.q)[:, :3, 3]
    fixtures = find_fixtures(measured, points)
    more = sum(len(fixture.numbers) for fixture in fixtures)
    return Problem(arm, measured, fixtures, np.r_[start, np.zeros(more)])


def _aligned(arm: Arm, measured: Measurements) -> Floats:
    """The values of the file, with the base that brings modelled positions nearest to measured ones."""
    rows = np.concatenate([measured.rows(Kind.POSE), measured.rows(Kind.POSITION)])
    if len(rows) < 4 or not {f"base_{number}" for number in ("x", "y", "z", "rx", "ry", "rz")} <= set(arm.names):
        return arm.start
    before = arm.poses(arm.start, measured.q[rows])[:, :3, 3]
    after = measured.positions[rows]
    u, _, v = np.linalg.svd((after - after.mean(axis=0)).T @ (before - before.mean(axis=0)))
    turn = u @ np.diag([1.0, 1.0, np.linalg.det(u @ v)]) @ v
    move = np.eye(4)
    move[:3, :3], move[:3, 3] = turn, after.mean(axis=0) - turn @ before.mean(axis=0)
    found = arm.with_base(arm.start, move @ arm.base(arm.start))
    # A tool that is far from what the file says can make the alignment worse than none.
    misses = [np.linalg.norm(arm.poses(v, measured.q[rows])[:, :3, 3] - after) for v in (arm.start, found)]
    return found if misses[1] < misses[0] else arm.start
