"""Reduces a block of samples to numbers of voxels and extents, and sharpens the extents.

The farthest of ten million samples still stands short of the rim. A compass search from there, along the joints and
within their ranges, goes the rest of the way: it needs no derivative and stops at a bound as willingly as inside.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np

from kinegen.errors import KinegenError
from kinegen.model.robot import JointType, Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.system import cores
from kinegen.tools.workspace.options import SurveyOptions
from kinegen.tools.workspace.tip_samples import FloatArray, IndexArray, Samples, Shape, Tip
from kinegen.tools.workspace.voxels import CellArray, Grid
from kinegen.verify import reference

_WIDEST_STEP, _FINEST_STEP = 0.02, 1e-9
"""Of a joint's range."""

_MOVES, _STARTS = 500, 4

_TOGETHER, _STRIDES = 5, np.array([0.5, 1.0, 2.0, 4.0])
"""Moves that are taken together for a direction, and how far it is tried, of their sum."""

_PARALLEL = 1e-6

Figure = Callable[[FloatArray], FloatArray]
"""Points (3, N) to one number each, of which the smallest or the largest is sought."""

Best = dict[tuple[str, int], tuple[float, int]]
"""By name of a figure and sign, 1 for the smallest and -1 for the largest: its value times the sign, the sample."""


@dataclass(frozen=True, slots=True)
class Line:
    """The axis of a revolute joint that stands still in the base frame: a point and a unit vector, (3,)."""

    name: str
    point: FloatArray
    direction: FloatArray

    def distance_squared(self, points: FloatArray) -> FloatArray:
        """Squared distances of points (3, N)."""
        away = points - self.point[:, None]
        squares: FloatArray = (away * away).sum(axis=0) - (self.direction @ away) ** 2
        return np.maximum(squares, 0.0)


@dataclass(frozen=True, slots=True)
class Extreme:
    """The smallest and the largest value of a figure: x, y, z, `base` or `axis`."""

    name: str
    low: float
    high: float


def first_axis(robot: Robot, tip: Tip) -> Line | None:
    """Return the axis of the first joint that moves the tip; None where it slides, or a radian of it turns nothing."""
    if not tip.movers or robot.variables[tip.movers[0]].type is not JointType.REVOLUTE:
        return None
    variable = robot.variables[tip.movers[0]]
    q = np.zeros((2, robot.dof))
    q[1, variable.index] = 1.0
    before, after = reference.frames(robot, q)[variable.name]
    moved = after @ np.linalg.inv(before)
    R, t = moved[:3, :3], moved[:3, 3]
    twice_sine = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    length = float(np.linalg.norm(twice_sine))
    if length < _PARALLEL:
        return None
    # The axis stays where it is: (I - R) point = t, and of its points the one next to the origin.
    point = np.linalg.lstsq(np.eye(3) - R, t, rcond=_PARALLEL)[0]
    return Line(variable.name, point, twice_sine / length)


def figures(axis: Line | None) -> Iterator[tuple[str, Figure]]:
    """Yield what is sought, by name; distances are squared, which keeps them smooth at nothing."""
    yield "x", lambda points: points[0]
    yield "y", lambda points: points[1]
    yield "z", lambda points: points[2]
    yield "base", lambda points: (points * points).sum(axis=0)
    if axis is not None:
        yield "axis", axis.distance_squared


def best_of(points: FloatArray, start: int, axis: Line | None) -> Best:
    """Return the best of some samples, from number `start`, by name and sign; they lead to points (3, N)."""
    found: Best = {}
    for name, figure in figures(axis):
        values = figure(points)
        for sign, place in ((1, int(values.argmin())), (-1, int(values.argmax()))):
            found[name, sign] = (sign * float(values[place]), start + place)
    return found


class Extremes:
    """Keeps the samples with the smallest and the largest figures, about the first joint's axis if it has one."""

    def __init__(self, axis: Line | None) -> None:
        self._figures = dict(figures(axis))
        self._best: dict[tuple[str, int], list[tuple[float, int]]] = {}

    def keep(self, found: Best) -> None:
        """Keep the best, a few of them, since a search from one can end on a lesser peak."""
        for key, entry in found.items():
            self._best[key] = sorted([*self._best.get(key, []), entry])[:_STARTS]

    def sharpened(self, tip: Tip, samples: Samples) -> tuple[Extreme, ...]:
        """Return the extremes, each searched on from the best samples; distances are no longer squared."""
        found = {}
        for (name, sign), entries in self._best.items():
            value = _signed(tip, self._figures[name], sign)
            starts = samples.at(np.array([index for _, index in entries])).T
            found[name, sign] = sign * min(_descend(value, start, samples) for start in starts)
        lengths = {key: value if key[0] in "xyz" else float(np.sqrt(max(value, 0.0))) for key, value in found.items()}
        return tuple(Extreme(name, lengths[name, 1], lengths[name, -1]) for name in self._figures)


def _signed(tip: Tip, figure: Figure, sign: int) -> Callable[[FloatArray], FloatArray]:
    """Joint vectors to what is to become small."""
    return lambda q: sign * figure(tip.position(q))


def _descend(value: Callable[[FloatArray], FloatArray], q: FloatArray, samples: Samples) -> float:
    """Return the smallest value that a compass search reaches within the bounds."""
    best = float(value(q[:, None])[0])
    directions = np.zeros((len(q), 2 * len(samples.movers)))
    for place, mover in enumerate(samples.movers):
        directions[mover, 2 * place : 2 * place + 2] = np.array([1.0, -1.0]) * np.ptp(samples.box[mover])
    step, before = _WIDEST_STEP, q
    for move in range(_MOVES * bool(samples.movers)):
        # Also on in the direction of the last moves together, which leads along a narrow valley.
        onward = (q - before)[:, None] * _STRIDES
        tries = q[:, None] + np.concatenate([step * directions, onward], axis=1)
        tries = np.clip(tries, samples.bounds[:, :1], samples.bounds[:, 1:])
        values = value(tries)
        place = int(values.argmin())
        before = q if move % _TOGETHER == 0 else before
        if values[place] < best:
            best, q = float(values[place]), tries[:, place]
        elif step > _FINEST_STEP:
            step /= 2
        else:
            break
    return best


_BLOCK = 1 << 16
"""Samples that fit into a processor's second cache together with what becomes of them."""


@dataclass(frozen=True, slots=True)
class Block:
    """The result of one block of samples, from number `start`.

    Attributes:
        cells: Numbers of half-size voxels (D, n) that they hit; None where none are counted.
        numbers: Shape (n,), the sample that hit each, ascending for each voxel.
    """

    start: int
    best: Best
    cells: CellArray | None
    numbers: IndexArray


@dataclass(frozen=True, slots=True)
class Sieve:
    """Reduces blocks of samples; without a `grid` no voxels are counted, and `axis` is that of the first joint."""

    tip: Tip
    samples: Samples
    shape: Shape
    axis: Line | None
    grid: Grid | None

    def sift(self, start: int, end: int) -> Block:
        """Return the block of the samples from `start` to before `end`."""
        points = positions(self.tip, self.samples, start, end)
        along = points if len(self.shape.axes) == 3 else self.shape.axes @ points
        cells = None if self.grid is None else self.grid.cells(along)
        return Block(start, best_of(points, start, self.axis), cells, np.arange(start, end))


Sift = Callable[[Sieve, SurveyOptions], Iterator[Block]]
"""Puts all samples through a sieve; the blocks come in order."""


def in_threads(sieve: Sieve, options: SurveyOptions) -> Iterator[Block]:
    """Have threads of this process reduce blocks, a few ahead, and yield them in order."""
    threads = options.threads or cores()
    with ThreadPoolExecutor(threads, "kinegen-workspace") as pool:
        waiting: deque[Future[Block]] = deque()
        try:
            for start, end in spans(options.samples):
                waiting.append(pool.submit(sieve.sift, start, end))
                # A few blocks are ahead, so that memory is bounded and no thread is idle.
                if len(waiting) > 2 * threads:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for future in waiting:
                future.cancel()


def spans(samples: int) -> Iterator[tuple[int, int]]:
    """Yield where blocks begin and end; one begins at half of the samples."""
    for low, high in ((0, samples // 2), (samples // 2, samples)):
        for start in range(low, high, _BLOCK):
            yield start, min(start + _BLOCK, high)


def positions(tip: Tip, samples: Samples, start: int, end: int) -> FloatArray:
    """Return the points (3, N) to which some samples lead; refuse samples for which the kernel gives none."""
    points = tip.position(samples.at(np.arange(start, end)))
    if not np.isfinite(points).all():
        raise KinegenError(
            "some joint values within the limits are too large for the kernel, which then gives no position; "
            "expected limits of a few turns"
        )
    return points
