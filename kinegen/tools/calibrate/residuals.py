"""Computes measured minus modelled over standard deviations, and the derivative by all unknowns.

The unknowns are those of the arm, in its order, and then those of the fixtures: a plane is n p = c, a sphere |p - m| =
r, an anchor a point from which distances were measured. Each begins at the best fit to the points of the table as it
is, and its numbers are corrections to that.

An outlier is found by noise as large as the other rows show it, and at least as large as was stated. If the model is
wrong all rows are far off, and none of them is an outlier.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from kinegen.errors import KinegenError
from kinegen.support.compat import library
from kinegen.support.dataclass import dataclass
from kinegen.tools.calibrate.arm_model import SHARE, Arm, right_jacobian_inverse, to_vector
from kinegen.tools.calibrate.measurements import SIZES, Kind, Measurements

Floats = NDArray[np.float64]

NUMBERS = {Kind.PLANE: ("tilt_1", "tilt_2", "offset"), Kind.ANCHOR: ("x", "y", "z"), Kind.SPHERE: ("x", "y", "z")}
RADIUS = "radius"
LEAST = {Kind.PLANE: 3, Kind.ANCHOR: 4, Kind.SPHERE: 4}
"""Points that determine a fixture, without any for the arm."""


@dataclass(frozen=True, slots=True)
class Fixture:
    """One plane, sphere or anchor, the rows that measured it, and the names of its unknowns.

    Attributes:
        start: For a plane its normal and offset, for the others the centre and a radius, (4,).
        axes: For a plane the two directions in which the normal can tilt, (2, 3).
    """

    kind: Kind
    name: str
    rows: NDArray[np.intp]
    numbers: tuple[str, ...]
    start: Floats
    axes: Floats

    @property
    def names(self) -> tuple[str, ...]:
        """Return names of the unknowns, as reports print them."""
        return tuple(f"{self.kind}_{self.name}_{number}" for number in self.numbers)

    def residuals(self, values: Floats, points: Floats, lengths: Floats) -> tuple[Floats, Floats, Floats]:
        """Return measured minus modelled distances (N,) and their derivatives.

        These are those of the modelled, by the point (N, 3) and by the unknowns (N, K); `lengths` are measured
        distances or known radii.
        """
        if self.kind is Kind.PLANE:
            return self._plane(values, points)
        away = points - self.start[:3] - values[:3]
        size = np.linalg.norm(away, axis=1)
        outward = away / np.maximum(size, 1e-300)[:, None]
        columns = [-outward]
        if RADIUS in self.numbers:
            lengths = np.full(len(points), self.start[3] + values[3])
            columns.append(np.full((len(points), 1), -1.0))
        return lengths - size, outward, np.hstack(columns)

    def _plane(self, values: Floats, points: Floats) -> tuple[Floats, Floats, Floats]:
        tilted = self.start[:3] + values[:2] @ self.axes
        size = np.linalg.norm(tilted)
        normal = tilted / size
        turning = self.axes @ (np.eye(3) - np.outer(normal, normal)) / size
        by_unknowns = np.hstack([points @ turning.T, np.full((len(points), 1), -1.0)])
        return self.start[3] + values[2] - points @ normal, np.tile(normal, (len(points), 1)), by_unknowns

    def centre(self, values: Floats) -> Floats:
        """The normal and offset of a plane, or the centre and radius of a sphere, (4,); an anchor has radius 0."""
        if self.kind is Kind.PLANE:
            tilted = self.start[:3] + values[:2] @ self.axes
            return np.append(tilted / np.linalg.norm(tilted), self.start[3] + values[2])
        radius = self.start[3] + values[3] if RADIUS in self.numbers else 0.0
        return np.append(self.start[:3] + values[:3], radius)


def find_fixtures(measured: Measurements, points: Floats) -> tuple[Fixture, ...]:
    """Find the fixtures, at their best fits to points (N, 3); refuse one with too few rows, or unlike rows."""
    keys = dict.fromkeys(
        (kind, name) for kind, name in zip(measured.kinds, measured.fixtures, strict=True) if kind in NUMBERS
    )
    return tuple(_fixture(kind, name, measured, points) for kind, name in keys)


def _fixture(kind: Kind, name: str, measured: Measurements, points: Floats) -> Fixture:
    each = zip(measured.kinds, measured.fixtures, strict=True)
    rows = np.array([row for row, place in enumerate(each) if place == (kind, name)], dtype=np.intp)
    line = measured.lines[int(rows[0])]
    lengths = measured.lengths[rows]
    is_free = kind is Kind.SPHERE and bool(np.isnan(lengths).all())
    if kind is Kind.SPHERE and not is_free and np.isnan(lengths).any():
        raise KinegenError(f"sphere {name!r} has a radius in some of its rows only", measured.path, line)
    if len(rows) <= LEAST[kind]:
        need = f"it takes more than {LEAST[kind]}"
        raise KinegenError(f"{kind} {name!r} has {len(rows)} rows, which say nothing of the arm ({need})",
                           measured.path, line)  # fmt: skip
    numbers = (*NUMBERS[kind], *([RADIUS] if is_free else []))
    where = points[rows]
    if kind is Kind.PLANE:
        middle = where.mean(axis=0)
        directions = np.linalg.svd(where - middle)[2]
        return Fixture(kind, name, rows, numbers, np.r_[directions[2], directions[2] @ middle], directions[:2])
    known = np.where(np.isnan(lengths), 0.0, lengths)
    # |p|^2 - d^2 = 2 m p + (r^2 - |m|^2) is linear in the centre m.
    left = np.hstack([2 * where, np.ones((len(rows), 1))])
    found = np.linalg.lstsq(left, (where**2).sum(axis=1) - known**2, rcond=None)[0]
    radius = float(np.sqrt(max(found[3] + found[:3] @ found[:3], 0.0)))
    return Fixture(kind, name, rows, numbers, np.r_[found[:3], radius], np.zeros((2, 3)))


@dataclass(frozen=True, slots=True)
class Problem:
    """A calibration as a least squares problem; the unknowns, (U,), begin at `start`."""

    arm: Arm
    measured: Measurements
    fixtures: tuple[Fixture, ...]
    start: Floats

    @property
    def names(self) -> tuple[str, ...]:
        """Return names of the unknowns."""
        return (*self.arm.names, *(name for fixture in self.fixtures for name in fixture.names))

    @property
    def units(self) -> Floats:
        """Return what counts as one unit of each unknown, (U,)."""
        angles = [name.rsplit("_", 2)[-2] == "tilt" for fixture in self.fixtures for name in fixture.names]
        own = [SHARE if is_angle else SHARE * self.arm.reach for is_angle in angles]
        return np.append(self.arm.units, own)

    @property
    def owners(self) -> NDArray[np.intp]:
        """Return the row of the measurements to which each residual belongs, (R,)."""
        sizes = [SIZES[kind] for kind in self.measured.kinds]
        return np.repeat(np.arange(len(sizes)), sizes)

    @property
    def angular(self) -> NDArray[np.bool_]:
        """Return which residuals are angles, (R,)."""
        return np.concatenate([np.arange(SIZES[kind]) >= 3 for kind in self.measured.kinds])

    @property
    def sigmas(self) -> Floats:
        """Return the standard deviation of each residual, (R,)."""
        owners = self.owners
        found: Floats = np.where(self.angular, self.measured.sigma_angle[owners], self.measured.sigma[owners])
        return found

    def differences(self, values: Floats) -> Floats:
        """Measured minus modelled, (R,), in lengths and radians."""
        return self._evaluate(values, slopes=False)[0]

    def slopes(self, values: Floats) -> Floats:
        """Return the derivative of `differences` by the unknowns, (R, U)."""
        return self._evaluate(values, slopes=True)[1]

    def residuals(self, values: Floats) -> Floats:
        """Differences over their standard deviations, (R,)."""
        found: Floats = self.differences(values) / self.sigmas
        return found

    def jacobian(self, values: Floats) -> Floats:
        """Return the derivative of `residuals`, (R, U)."""
        found: Floats = self.slopes(values) / self.sigmas[:, None]
        return found

    def part(self, rows: NDArray[np.intp]) -> Problem:
        """Return the same problem with some of the rows; the unknowns keep their places."""
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
    """Begin a calibration at the values of the file, with a base that is all varied where it fits positions best."""
    start = _aligned(arm, measured)
    points = arm.poses(start, measured.q)[:, :3, 3]
    fixtures = find_fixtures(measured, points)
    more = sum(len(fixture.numbers) for fixture in fixtures)
    return Problem(arm, measured, fixtures, np.r_[start, np.zeros(more)])


def _aligned(arm: Arm, measured: Measurements) -> Floats:
    """Return the values of the file, with the base that brings modelled positions nearest to measured ones."""
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


_CHANCE = 1e-3
"""Chance that a file without outliers has a row that is reported as one."""


def row_squares(problem: Problem, values: Floats) -> tuple[Floats, NDArray[np.intp]]:
    """Return the sum of the squared residuals of each row (N,), in variances, and how many residuals it has (N,)."""
    counts = np.array([SIZES[kind] for kind in problem.measured.kinds], dtype=np.intp)
    squares = np.bincount(problem.owners, problem.residuals(values) ** 2, len(counts))
    return np.asarray(squares, dtype=np.float64), counts


def outlying(problem: Problem, values: Floats) -> tuple[NDArray[np.bool_], Floats]:
    """Find the rows that noise does not explain, and how far each is beyond its limit, as a ratio of squares, (N,)."""
    chi2 = library("scipy.stats", "calibration", "calibrate").chi2
    squares, counts = row_squares(problem, values)
    # The median is that of the rows which are no outliers, as long as these are more than half.
    spread = max(1.0, float(np.median(squares / chi2.median(counts))))
    ratios: Floats = squares / (spread * chi2.isf(_CHANCE / len(counts), counts))
    return np.asarray(ratios > 1), ratios
