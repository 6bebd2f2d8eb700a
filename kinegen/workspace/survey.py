"""The survey of a workspace: samples through the kernel into voxels and extremes, a block at a time.

Threads, or processes elsewhere, draw blocks of samples, evaluate the kernel and number the voxels; one collects, in the
order of the blocks, so that the result depends on nothing but the robot, the options and the seed. A few blocks are
under way at any time: the memory taken is that of the grid, however many samples there are.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from kinegen.errors import KinegenError
from kinegen.robot.model import Robot
from kinegen.workspace.options import SurveyOptions
from kinegen.workspace.ranges import Range
from kinegen.workspace.reach import Extreme, Extremes, Line, first_axis
from kinegen.workspace.rim import Rim, Seeker, fill_rim
from kinegen.workspace.sample import FloatArray, Samples, sequence
from kinegen.workspace.shape import Shape, find_shape
from kinegen.workspace.sieve import Block, Sieve, Sift, in_threads, positions
from kinegen.workspace.tip import Tip
from kinegen.workspace.voxels import Grid, Voxels

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
    """What the region measured at one size of voxel and one number of poses.

    Attributes:
        voxel: Edge of a voxel.
        poses: Poses so far: samples, then those that the search of the rim took.
        hit: Voxels that were hit.
        measure: Length, area or volume; None where the region has none in the space that holds it.
    """

    voxel: float
    poses: int
    hit: int
    measure: float | None


@dataclass(frozen=True, slots=True)
class Tally:
    """What the voxels say.

    Attributes:
        counts: Half of the samples, all of them, those at the rim too, and the same in voxels of half the size.
        voxels: The voxels of the size asked for.
        halves: Those of half the size.
        q: Shape (dof, voxels hit), for each voxel the joint vector of the first sample that hit it.
    """

    counts: tuple[Count, Count, Count, Count]
    voxels: Voxels
    halves: Voxels
    q: FloatArray


@dataclass(frozen=True, slots=True)
class Workspace:
    """What a survey found; lengths are in the file's unit, points in the base frame.

    Attributes:
        robot: Name of the robot.
        tip: Its tip.
        unit: Unit of lengths.
        shape: What kind of region the tip sweeps.
        extremes: Extents x, y, z, distances from the base's origin (`base`) and from the first joint's axis (`axis`).
        axis: That axis; None where the first joint slides.
        tally: Its voxels; None where the tip stands still.
        samples: The sequence that the numbers of samples stand for.
        seconds: What sampling took.
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
    """Survey the region that a tip reaches.

    Args:
        robot: The robot.
        tip: Its tip.
        ranges: What each joint variable runs through.
        options: How many samples, and how fine.
        sift: Who puts the samples through the kernel; by default threads of this process.

    Returns:
        Extents and distances, sharpened by a search; length, area or volume by voxels. Equal options give equal
        results, on any number of threads or processes.

    Raises:
        KinegenError: If voxels are too small or too large for the region, or some joint values are for the kernel.
    """
    begin = time.perf_counter()
    samples = sequence(ranges, tip.movers, options.seed)
    pilot = positions(tip, samples, 0, _PILOT)
    shape = find_shape(tip, samples, pilot)
    samples = _bounded(samples, tip, pilot)
    axis = first_axis(robot, tip)
    extremes = Extremes(axis)
    grid = None
    if len(shape.axes):
        voxel = _voxel(options, np.ptp(shape.axes @ pilot, axis=1), robot.units.length)
        grid = Grid(voxel, len(shape.axes), robot.units.length)
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
    """The size asked for, or a round one that samples can fill, in a region of some lengths."""
    if options.voxel is not None:
        if options.voxel > lengths.max() / 2:
            raise KinegenError(
                f"voxels of {options.voxel:g} {unit} are too large for a region of {lengths.max():.4g} {unit}: "
                f"expected {lengths.max() / _FEWEST_ACROSS:.2g} {unit} or less"
            )
        return options.voxel
    size = float(np.prod(lengths) * _SAMPLES_A_VOXEL / options.samples) ** (1 / len(lengths))
    size = min(size, float(lengths.max()) / _FEWEST_ACROSS)
    power = 10.0 ** math.floor(math.log10(size))
    return next(factor * power for factor in _ROUND if factor * power >= size * (1 - 1e-9))


def _tally(grid: Grid, half: Voxels, seeker: Seeker, number: int) -> Tally:
    full, samples = grid.whole(), seeker.samples
    # What does not fill its space has no rim that is worth a search.
    rim = fill_rim(grid, seeker, number) if seeker.shape.fills else Rim(0, np.empty((len(samples.box), 0)))
    voxels, halves = grid.whole(), grid.halves()
    stages = ((half, number // 2), (full, number), (voxels, number + rim.poses), (halves, number + rim.poses))
    first, second, third, last = (
        Count(each.size, poses, each.count, each.measure if seeker.shape.fills else None) for each, poses in stages
    )
    firsts = grid.firsts()
    q = np.concatenate([samples.at(firsts[firsts < number]), rim.q[:, firsts[firsts >= number] - number]], axis=1)
    return Tally((first, second, third, last), voxels, halves, q)
