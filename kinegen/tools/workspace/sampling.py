"""Surveys a workspace, a block of samples at a time, into voxels, extremes and a cloud of points.

Threads, or processes elsewhere, evaluate blocks; one collects them in order, so that the result depends on nothing but
the robot, the options and the seed. A few blocks are under way at any time: memory is that of the grid, however many
samples there are. A cloud has one point a voxel, so it is even in space and of the size of the region, and every point
is exact: the tip's position at its joint vector.
"""

from __future__ import annotations

import io
import json
import math
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from kinegen.errors import KinegenError
from kinegen.model.robot import Robot
from kinegen.support.compat import library
from kinegen.support.dataclass import dataclass
from kinegen.tools.workspace.block_reduction import (
    Block,
    Extreme,
    Extremes,
    Line,
    Sieve,
    Sift,
    first_axis,
    in_threads,
    positions,
)
from kinegen.tools.workspace.options import SurveyOptions
from kinegen.tools.workspace.tip_samples import FloatArray, Range, Samples, Shape, Tip, find_shape, sequence
from kinegen.tools.workspace.voxels import Grid, Rim, Seeker, Voxels, fill_rim, least_size

_PILOT = 1 << 14
_SAMPLES_A_VOXEL = 12
"""On average over the box around the region. Its middle gets more and its rim fewer; the search adds the rim."""

_ROUND = (1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10)
"""Edges of voxels, times a power of ten."""

_BACK, _PERIODIC = 32, 1e-9
"""Joint vectors that are turned by a whole range, and how near the tip must come back, of its distance."""

_FEWEST_ACROSS = 10
"""Voxels along the longest side of a region, however few samples there are."""


@dataclass(frozen=True, slots=True)
class Count:
    """The measure of the region at one size of voxel and one number of poses.

    Attributes:
        poses: Poses so far: samples, then those that the search of the rim took.
        inside: Those of them with no open face.
        measure: Length, area or volume; None where the region has none in the space that holds it, or there are too few
            voxels to say.
    """

    voxel: float
    poses: int
    hit: int
    inside: int
    measure: float | None


@dataclass(frozen=True, slots=True)
class Tally:
    """The voxels of the size asked for and of half of it, and what they measure.

    Attributes:
        counts: Half of the samples, all of them, those at the rim too, and the same in voxels of half the size.
        q: Shape (dof, voxels hit), for each voxel the joint vector of the first sample that hit it.
    """

    counts: tuple[Count, Count, Count, Count]
    voxels: Voxels
    halves: Voxels
    q: FloatArray


@dataclass(frozen=True, slots=True)
class Workspace:
    """The result of a survey; lengths are in the file's unit, points in the base frame.

    Attributes:
        extremes: Extents x, y, z, distances from the base's origin (`base`) and from the first joint's axis (`axis`).
        tally: Its voxels; None where the tip stands still.
    """

    robot: str
    tip: Tip
    unit: str
    shape: Shape
    extremes: tuple[Extreme, ...]
    axis: Line | None
    tally: Tally | None
    samples: Samples
    seconds: float


def survey(
    robot: Robot, tip: Tip, ranges: tuple[Range, ...], options: SurveyOptions, sift: Sift = in_threads
) -> Workspace:
    """Survey the region that a tip reaches: extents and distances, sharpened by a search, and its measure by voxels.

    Equal options give equal results, on any number of threads or processes. By default threads of this process sift.

    Raises:
        KinegenError: If voxels are too small or too large for the region, or some joint values are for the kernel.
    """
    begin = time.perf_counter()
    samples = sequence(ranges, tip.movers, options.seed)
    # A few samples tell the kind of the region and its size, which decide the grid.
    pilot = positions(tip, samples, 0, _PILOT)
    shape = find_shape(tip, samples, pilot)
    samples = _bounded(samples, tip, pilot)
    axis = first_axis(robot, tip)
    extremes = Extremes(axis)
    grid = None
    if len(shape.axes):
        voxel = _voxel(options, np.ptp(shape.axes @ pilot, axis=1), robot.units.length)
        grid = Grid(voxel, len(shape.axes), robot.units.length)
    # All samples, then the rim, which samples reach last.
    blocks = sift(Sieve(tip, samples, shape, axis, grid), options)
    half = _collect(blocks, options.samples, extremes, grid)
    tally = None
    if grid is not None and half is not None:
        tally = _tally(grid, half, Seeker(tip, samples, shape), options.samples)
    return Workspace(
        robot=robot.name,
        tip=tip,
        unit=robot.units.length,
        shape=shape,
        extremes=extremes.sharpened(tip, samples),
        axis=axis,
        tally=tally,
        samples=samples,
        seconds=time.perf_counter() - begin,
    )


def _collect(blocks: Iterator[Block], samples: int, extremes: Extremes, grid: Grid | None) -> Voxels | None:
    """Take in all samples; returns the voxels as they are after half of them."""
    halfway = None
    for block in blocks:
        if block.start == samples // 2 and grid is not None:
            halfway = grid.whole()
        extremes.keep(block.best)
        if grid is not None and block.cells is not None:
            grid.add(block.cells, block.numbers)
    return halfway


def _bounded(samples: Samples, tip: Tip, pilot: FloatArray) -> Samples:
    """The samples, where a search goes on without end only along joints whose turn leads the tip back to its start.

    A joint that turns may also push something along, as a screw does, or a slide that follows it.
    """
    bounds, size = samples.bounds.copy(), max(float(np.abs(pilot).max()), np.finfo(float).tiny)
    q = samples.at(np.arange(_BACK))
    for mover in tip.movers:
        around = q.copy()
        around[mover] += np.ptp(samples.box[mover])
        away = float(np.abs(tip.position(around) - pilot[:, :_BACK]).max())
        if np.isinf(bounds[mover]).any() and not away <= _PERIODIC * size:
            bounds[mover] = samples.box[mover]
    return replace(samples, bounds=bounds)


def _voxel(options: SurveyOptions, lengths: FloatArray, unit: str) -> float:
    """Return the size asked for, or a round one that samples can fill, in a region of some lengths."""
    if options.voxel is not None:
        if options.voxel > lengths.max() / 2:
            raise KinegenError(
                f"voxels of {options.voxel:g} {unit} are too large for a region of {lengths.max():.4g} {unit}: "
                f"expected {lengths.max() / _FEWEST_ACROSS:.2g} {unit} or less"
            )
        return options.voxel
    size = float(np.prod(lengths) * _SAMPLES_A_VOXEL / options.samples) ** (1 / len(lengths))
    size = max(min(size, float(lengths.max()) / _FEWEST_ACROSS), least_size(lengths))
    power = 10.0 ** math.floor(math.log10(size))
    return next(factor * power for factor in _ROUND if factor * power >= size * (1 - 1e-9))


def _tally(grid: Grid, half: Voxels, seeker: Seeker, number: int) -> Tally:
    full, samples = grid.whole(), seeker.samples
    # What does not fill its space has no rim that is worth a search.
    rim = fill_rim(grid, seeker, number) if seeker.shape.fills else Rim(0, np.empty((len(samples.box), 0)))
    voxels, halves = grid.whole(), grid.halves()
    stages = ((half, number // 2), (full, number), (voxels, number + rim.poses), (halves, number + rim.poses))
    first, second, third, last = (
        Count(each.size, poses, each.count, each.inside, (each.measure or None) if seeker.shape.fills else None)
        for each, poses in stages
    )
    firsts = grid.firsts()
    q = np.concatenate([samples.at(firsts[firsts < number]), rim.q[:, firsts[firsts >= number] - number]], axis=1)
    return Tally((first, second, third, last), voxels, halves, q)


FORMATS = (".npz", ".parquet")

_PURPOSE = "a Parquet cloud"


def check_cloud(path: Path) -> None:
    """Refuse a cloud before it is computed: by the ending of its name, or without pyarrow where it takes that."""
    if path.suffix.lower() not in FORMATS:
        raise KinegenError(f"{path}: clouds are written as {' or '.join(FORMATS)}, expected a name with such an ending")
    if path.suffix.lower() == ".parquet":
        library("pyarrow.parquet", _PURPOSE)


def make_cloud(workspace: Workspace) -> tuple[FloatArray, FloatArray]:
    """Return points (N, 3) and their joint vectors (N, dof) in sample order; one where the tip stands still."""
    q = workspace.samples.at(np.zeros(1, np.int64)) if workspace.tally is None else workspace.tally.q
    return np.ascontiguousarray(workspace.tip.position(q).T), np.ascontiguousarray(q.T)


def pack(workspace: Workspace, ranges: tuple[Range, ...], kind: str) -> bytes:
    """Return the content of a cloud file, of a kind in `FORMATS`.

    An NPZ file holds the arrays `points` (N, 3) and `q` (N, dof), and `joints`, `robot`, `tip`, `unit`, `voxel`; a
    Parquet file the columns `x`, `y`, `z` and one named `q_JOINT` for each joint, and the rest as the metadata
    `kinegen`.
    """
    points, q = make_cloud(workspace)
    names = [each.name for each in ranges]
    about = {
        "robot": workspace.robot,
        "tip": workspace.tip.name,
        "unit": workspace.unit,
        "voxel": 0.0 if workspace.tally is None else workspace.tally.voxels.size,
    }
    buffer = io.BytesIO()
    # One file has arrays, the other columns; both say what they are of.
    if kind.lower() == ".npz":
        np.savez_compressed(buffer, points=points, q=q, joints=np.array(names, "U"), **about)  # type: ignore[arg-type]
        return buffer.getvalue()
    pyarrow, parquet = library("pyarrow", _PURPOSE), library("pyarrow.parquet", _PURPOSE)
    columns = dict(zip("xyz", points.T, strict=True)) | {
        f"q_{name}": column for name, column in zip(names, q.T, strict=True)
    }
    table = pyarrow.table({name: np.ascontiguousarray(column) for name, column in columns.items()})
    parquet.write_table(table.replace_schema_metadata({"kinegen": json.dumps(about)}), buffer, compression="zstd")
    return buffer.getvalue()
