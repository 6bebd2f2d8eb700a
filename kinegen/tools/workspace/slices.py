"""Draws a workspace: cuts through its voxels, one for each axis or plane, or the whole of a planar one.

Each panel shows what is reached in the layer of voxels around one plane, and behind it, lighter, the shadow of the
whole region. The same survey gives the same bytes. Few samples fall into one layer, so every free voxel of it beside
one that was reached becomes a target, as along the rim, until none is reached. Nothing is drawn that was not reached.
"""

from __future__ import annotations

import io
import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen.errors import KinegenError
from kinegen.support.compat import library
from kinegen.support.dataclass import dataclass
from kinegen.tools.workspace.options import MEASURES, Plane, in_words
from kinegen.tools.workspace.sampling import Tally, Workspace
from kinegen.tools.workspace.tip_samples import FloatArray
from kinegen.tools.workspace.voxels import CellArray, Seeker, Voxels

_MOST_ROUNDS = 400
_HAIR = 1e-6
"""How far a target is drawn in, of its edge, so that what arrives is inside."""


def fill_layer(workspace: Workspace, axis: int, place: int) -> NDArray[np.bool_]:
    """Search the free voxels of half the size in one layer; return which of the layer are reached.

    The layer is number `place` among `workspace.tally.halves` along the axis that is square to it; voxels go along the
    other two axes.
    """
    if workspace.tally is None:
        raise ValueError("a region without voxels has no layers")
    seeker = Seeker(workspace.tip, workspace.samples, workspace.shape)
    halves, q = workspace.tally.halves, workspace.tally.q
    reached: NDArray[np.bool_] = np.take(halves.hit, place, axis).copy()
    # The joint vector to set out from for each voxel, by its place in q; -1 where none is known.
    source = _sources(workspace, workspace.tally, axis, place)
    tried = np.full(reached.shape, -1)
    for _ in range(_MOST_ROUNDS):
        near = np.maximum(source, _beside(np.where(reached, source, -1)))
        targets = np.argwhere(~reached & (near >= 0) & (tried != near))
        if not len(targets):
            break
        start = near[tuple(targets.T)]
        tried[tuple(targets.T)] = start
        low = halves.corner[:, None] + (np.insert(targets, axis, place, axis=1).T + _HAIR) * halves.size
        _, arrived = seeker.seek(q[:, start], low, low + (1 - 2 * _HAIR) * halves.size)
        cells = np.delete(_cells(halves, seeker.tip.position(arrived)), axis, axis=0)
        reached[tuple(cells)] = True
        source[tuple(cells)] = q.shape[1] + np.arange(arrived.shape[1])
        q = np.concatenate([q, arrived], axis=1)
    return reached


def _sources(workspace: Workspace, tally: Tally, axis: int, place: int) -> NDArray[np.int64]:
    """For each voxel of a layer the sample that hit the larger voxel around it, or -1."""
    owner = np.full(tally.voxels.hit.shape, -1)
    owner[tuple(_cells(tally.voxels, workspace.tip.position(tally.q)))] = np.arange(tally.q.shape[1])
    layer = np.take(owner, place // 2, axis)
    return np.repeat(np.repeat(layer, 2, axis=0), 2, axis=1)


def _beside(source: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the latest source among the four neighbours of each voxel, or -1."""
    wide = np.pad(source, 1, constant_values=-1)
    sides = wide[:-2, 1:-1], wide[2:, 1:-1], wide[1:-1, :-2], wide[1:-1, 2:]
    latest: NDArray[np.int64] = np.maximum.reduce(sides)
    return latest


def _cells(voxels: Voxels, points: FloatArray) -> CellArray:
    """Return the voxels around points (3, N), by their numbers."""
    last = np.array(voxels.hit.shape)[:, None] - 1
    return np.clip(((points - voxels.corner[:, None]) // voxels.size).astype(np.int64), 0, last)


FORMATS = (".png", ".svg")

_REACHED, _SHADOW, _LINES = "#1b6ca8", "#cfdfec", "#8a97a3"
_PURPOSE = "drawing slices"
# Of the picture, in inches.
_WIDTH, _ALONE, _NARROWEST, _HIGHEST = 11.0, 4.8, 5.6, 7.0
_LABELS, _TITLES, _FOOT = 0.75, 1.7, 0.45
_RESOLUTION = 150  # dots an inch, of PNG
_STYLE = {"svg.hashsalt": "kinegen", "svg.fonttype": "none", "font.family": "DejaVu Sans", "font.size": 10}


@dataclass(frozen=True, slots=True)
class Slice:
    """One panel: a cut through voxels, or their shadow, along two axes of the region.

    Attributes:
        at: Where the plane cuts the third axis; None where there is no third.
        corner: Shape (2,), coordinates of its lower left corner.
        reached: Shape (n, m), along the two axes: what the tip reaches in this plane.
        shadow: Shape (n, m), what it reaches anywhere along the third axis.
    """

    across: int
    up: int
    at: float | None
    corner: FloatArray
    size: float
    reached: NDArray[np.bool_]
    shadow: NDArray[np.bool_]


def check_picture(path: Path) -> None:
    """Refuse a picture before anything is computed for it: by the ending of its name, or without matplotlib."""
    if path.suffix.lower() not in FORMATS:
        raise KinegenError(f"{path}: slices are written as {' or '.join(FORMATS)}, expected a name with such an ending")
    library("matplotlib", _PURPOSE)


def make_slices(workspace: Workspace, planes: tuple[Plane, ...] = ()) -> tuple[Slice, ...]:
    """Cut the region at planes, or by default where it shows most.

    A region in space gets a cut across z, y and x each: upright ones through the axis of the first joint where that is
    upright, and where the cut is largest otherwise. One that lies in a plane gets that plane.

    Raises:
        KinegenError: If the tip stands still or moves along a straight line, which has no slices, or a plane misses the
            region.
    """
    if workspace.tally is None or len(workspace.shape.axes) == 1:
        raise KinegenError(f"the tip of {workspace.robot} sweeps a {workspace.shape.kind}, which has no slices")
    voxels = workspace.tally.halves
    if voxels.hit.ndim == 2:
        if planes:
            raise KinegenError(f"the tip of {workspace.robot} stays in one plane, which is drawn as a whole")
        trimmed, _ = _trimmed(voxels)
        return (Slice(0, 1, None, trimmed.corner, trimmed.size, trimmed.hit, trimmed.hit),)
    chosen = planes or tuple(_usual(workspace, voxels, axis) for axis in (2, 1, 0))
    return tuple(_cut(workspace, voxels, plane) for plane in chosen)


def _trimmed(voxels: Voxels) -> tuple[Voxels, tuple[slice, ...]]:
    """Without most of the free voxels around, and what was kept of each axis; the base stays in."""
    base = np.clip((-voxels.corner // voxels.size).astype(int), 0, np.array(voxels.hit.shape) - 1)
    hits = np.concatenate([np.argwhere(voxels.hit), base[None]])
    margin = 2 + np.ptp(hits, axis=0).max() // 40
    low = np.maximum(hits.min(axis=0) - margin, 0)
    high = np.minimum(hits.max(axis=0) + margin + 1, voxels.hit.shape)
    kept = tuple(slice(*ends) for ends in zip(low, high, strict=True))
    return Voxels(voxels.size, voxels.corner + low * voxels.size, voxels.hit[kept]), kept


def _usual(workspace: Workspace, voxels: Voxels, axis: int) -> Plane:
    """Return where to cut across an axis if nothing else is asked for."""
    line = workspace.axis
    if line is not None and axis < 2 and abs(line.direction[2]) > 1 - 1e-9:
        through = Plane(axis, round(float(line.point[axis]) / voxels.size, 6) * voxels.size)
        place = _layer(voxels, through)
        if 0 <= place < voxels.hit.shape[axis] and np.take(voxels.hit, place, axis).any():
            return through
    areas = voxels.hit.sum(axis=tuple(other for other in range(3) if other != axis))
    # In the middle of the places that are equally good, such as those of a box.
    best = np.flatnonzero(areas >= 0.995 * areas.max())
    middle = float(voxels.corner[axis] + (best[len(best) // 2] + 0.5) * voxels.size)
    return Plane(axis, float(_rounded(middle, voxels.size)))


def _layer(voxels: Voxels, plane: Plane) -> int:
    """Number of the layer of voxels that holds a plane."""
    return int((plane.at - voxels.corner[plane.axis]) // voxels.size)


def _cut(workspace: Workspace, voxels: Voxels, plane: Plane) -> Slice:
    axis, place = plane.axis, _layer(voxels, plane)
    inside = 0 <= place < voxels.hit.shape[axis]
    if not inside or not np.take(voxels.hit, place, axis).any():
        name, unit = workspace.shape.names[axis], workspace.unit
        low, high = workspace.extremes[axis].low, workspace.extremes[axis].high
        raise KinegenError(
            f"the plane {name} = {plane.at:g} {unit} misses the region, "
            f"which goes from {name} = {low:.4g} to {high:.4g} {unit}"
        )
    # The picture shows the region alone, not the whole grid.
    trimmed, kept = _trimmed(voxels)
    across, up = (other for other in range(3) if other != axis)
    reached = fill_layer(workspace, axis, place)
    shadow = voxels.hit.any(axis=axis) | reached
    part = kept[across], kept[up]
    return Slice(across, up, plane.at, trimmed.corner[[across, up]], voxels.size, reached[part], shadow[part])


def draw(workspace: Workspace, kind: str, planes: tuple[Plane, ...] = ()) -> bytes:
    """Draw the slices as a file of a kind in `FORMATS`, and return its content."""
    slices = make_slices(workspace, planes)
    matplotlib, figures = library("matplotlib", _PURPOSE), library("matplotlib.figure", _PURPOSE)
    with matplotlib.rc_context(_STYLE):
        figure = figures.Figure(figsize=_size(slices))
        widths = [each.reached.shape[0] for each in slices]
        panels = figure.subplots(1, len(slices), squeeze=False, width_ratios=widths)[0]
        for axes, each in zip(panels, slices, strict=True):
            _panel(axes, workspace, each)
        figure.suptitle(_title(workspace), fontsize=11)
        # A planar region is shown as a whole, which is no layer of some thickness.
        _legend(figure, "" if slices[0].at is None else f"{slices[0].size:g} {workspace.unit}")
        figure.tight_layout(rect=(0, _FOOT / figure.get_figheight(), 1, 1))
        buffer = io.BytesIO()
        metadata = {"Date": None} if kind.lower() == ".svg" else {}
        figure.savefig(buffer, format=kind.lower().lstrip("."), dpi=_RESOLUTION, metadata=metadata)
    return buffer.getvalue()


def _size(slices: tuple[Slice, ...]) -> tuple[float, float]:
    """Width and height of the picture in inches: all panels on one scale, as large as they fit."""
    across = sum(each.reached.shape[0] for each in slices)
    up = max(each.reached.shape[1] for each in slices)
    scale = min((_WIDTH if len(slices) > 1 else _ALONE) / across, _HIGHEST / up)
    return max(_NARROWEST, scale * across + _LABELS * len(slices)), scale * up + _TITLES


def _panel(axes: Any, workspace: Workspace, each: Slice) -> None:
    names, unit = workspace.shape.names, workspace.unit
    (left, low), (right, high) = each.corner, each.corner + np.array(each.shadow.shape) * each.size
    # A list of tones, not a scale: 0 is the paper.
    tones = np.where(each.reached, 2, np.where(each.shadow, 1, 0)).T
    palette = np.array([_rgb(tone) for tone in ("#ffffff", _SHADOW, _REACHED)], np.uint8)
    extent = (left, right, low, high)
    axes.imshow(palette[tones], origin="lower", extent=extent, interpolation="nearest", aspect="equal")
    # Every axis is counted from the base.
    x = y = 0.0
    axes.plot(x, y, marker="+", markersize=11, markeredgewidth=1.6, color="black", linestyle="none")
    axes.set_xlim(min(left, x - each.size), max(right, x + each.size))
    axes.set_ylim(min(low, y - each.size), max(high, y + each.size))
    axes.set_xlabel(f"{names[each.across]} [{unit}]")
    axes.set_ylabel(f"{names[each.up]} [{unit}]")
    axes.locator_params(nbins=7)
    axes.grid(color=_LINES, linewidth=0.4, alpha=0.5)
    if each.at is not None:
        axes.set_title(f"{names[3 - each.across - each.up]} = {each.at + 0.0:g} {unit}", fontsize=10)


def _legend(figure: Any, layer: str) -> None:
    patches, lines = (library(f"matplotlib.{name}", _PURPOSE) for name in ("patches", "lines"))
    entries = [
        patches.Patch(color=_REACHED, label=f"reached in a layer of {layer} at this plane" if layer else "reached")
    ]
    if layer:
        entries.append(patches.Patch(color=_SHADOW, label="reached in front of it or behind it"))
    entries.append(lines.Line2D([], [], marker="+", color="black", linestyle="none", markersize=9, label="base"))
    figure.legend(handles=entries, loc="lower center", ncols=len(entries), frameon=False)


def _title(workspace: Workspace) -> str:
    """Return the robot, and what its workspace measures; axes of a slanting plane are said where they lie."""
    shape, unit = workspace.shape, workspace.unit
    lines = [f"Workspace of {workspace.robot}, {workspace.tip.name}"]
    if workspace.tally is not None and shape.fills:
        counted = workspace.tally.counts[2]
        what = MEASURES[shape.dimension]
        text = in_words(counted.measure or 0.0, shape.dimension, unit)
        lines.append(f"{what} {text}, {counted.poses:,} poses")
    if shape.names == ("u", "v"):
        axes = (", ".join(f"{entry:.3f}" for entry in axis) for axis in shape.axes)
        lines.append("; ".join(f"{name} along ({text})" for name, text in zip(shape.names, axes, strict=True)))
    return "\n".join(lines)


def _rgb(shade: str) -> list[int]:
    return [int(shade[place : place + 2], 16) for place in (1, 3, 5)]


def _rounded(value: float, size: float) -> str:
    """Return a coordinate, as exactly as a voxel knows it."""
    text = f"{value:.{max(0, -math.floor(math.log10(size)))}f}"
    return text.removeprefix("-") if not text.strip("-0.") else text
