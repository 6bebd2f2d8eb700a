"""Lays out the whole picture: postures, frames, dimensions, and words that keep clear of them.

No drawing library is needed but for the size of letters.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from kinegen.errors import KinegenError, quote
from kinegen.model.robot import TOOL, Robot, frame_label
from kinegen.support.dataclass import dataclass
from kinegen.tools.pictures import dimensions
from kinegen.tools.pictures.arm import bodies, draw_arm, pale, symbol_radius
from kinegen.tools.pictures.dimensions import Triad, arrows, groups, letters, tag
from kinegen.tools.pictures.labels import Layout, corners, sampled
from kinegen.tools.pictures.postures import Place, Skeleton, make_skeleton
from kinegen.tools.pictures.projection import FRAMES, INK, FloatArray, Mark, Side, Stroke, View, Words


@dataclass(frozen=True, slots=True)
class PictureOptions:
    """Options of a picture.

    Attributes:
        rows: The rows of which frames and dimensions are drawn; None for all.
        size: Length of the longer side of the robot on paper, in inches.
        width: Width of the paper in inches, of which the robot fills what words and margins leave; None for the paper
            that a robot of `size` needs.
    """

    side: Side
    frames: bool = False
    dimensions: bool = False
    rows: tuple[str, ...] | None = None
    size: float = 5.0
    width: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """A picture: its marks, and the corners of the paper, in points."""

    title: str
    marks: tuple[Mark, ...]
    corner: tuple[float, float]
    size: tuple[float, float]


_MARGIN = 9.0
_TRIES = 12
"""Sizes of a robot that are tried for a width of the paper."""

_LONE = 0.35
"""Share of the picture that the length of a robot would fill if all of it is seen from its end."""

_LONE_SYMBOL = 14.0
"""Size of its joint symbols, in points."""


def compose(robot: Robot, postures: FloatArray, options: PictureOptions) -> Sheet:
    """Lay out a picture.

    The first of the postures (n, dof), in radians and the file's length unit, is drawn in full and has frames and
    dimensions; the others are paler.

    Raises:
        KinegenError: If a row is unknown, a posture is too large to be drawn, or the paper is too narrow for the words.
    """
    _check_rows(robot, options.rows)
    if options.width is None:
        return _sheet(robot, postures, options)
    return _as_wide(robot, postures, options, 72.0 * options.width)


def _as_wide(robot: Robot, postures: FloatArray, options: PictureOptions, width: float) -> Sheet:
    """Return a sheet of a width in points: letters keep their size, so the robot is made larger or smaller."""
    best, size = None, width / 72.0
    for _ in range(_TRIES):
        found = _sheet(robot, postures, replace(options, size=size))
        across = found.size[0]
        if across <= width and (best is None or across > best.size[0]):
            best = found
        if 0.0 <= width - across < 1.0:
            break
        # What words and margins need does not grow with the robot; a little less where they went elsewhere.
        size *= (width / across) * (1.0 if across < width else 0.99)
    if best is None:
        raise KinegenError(f"width is {options.width!r} inches, too narrow for the words of {robot.name}")
    aside = (width - best.size[0]) / 2
    return replace(best, corner=(best.corner[0] - aside, best.corner[1]), size=(width, best.size[1]))


def _sheet(robot: Robot, postures: FloatArray, options: PictureOptions) -> Sheet:
    skeletons = tuple(make_skeleton(robot, q) for q in postures)
    directions = options.side.directions()
    extent, empty = _extent(skeletons, directions)
    view = View(directions, 72.0 * options.size / extent * (_LONE if empty else 1.0))
    radius = _LONE_SYMBOL / view.scale if empty else symbol_radius(skeletons, extent)
    marks: list[Mark] = []
    for number, skeleton in reversed(list(enumerate(skeletons))):
        drawn = draw_arm(skeleton, radius, view, f"-posture-{number + 1}" if number else "")
        # What is paler is behind: its depths end below those of the first posture.
        marks += [_behind(pale(mark)) if number else mark for mark in drawn]
    marks += _annotated(robot, skeletons[0], marks, radius, view, options)
    low, high = _box(marks)
    corner, size = low - _MARGIN, high - low + 2 * _MARGIN
    title = f"{robot.name}: {robot.description}" if robot.description else robot.name
    return Sheet(title, tuple(marks), (corner[0], corner[1]), (size[0], size[1]))


def _check_rows(robot: Robot, rows: tuple[str, ...] | None) -> None:
    known = [row.name for row in robot.rows]
    for name in rows or ():
        if name not in known:
            expected = ", ".join(known) or "none, since there are no rows"
            raise KinegenError(f"{robot.name} has no row {quote(name)} (expected {expected})")


def _extent(skeletons: tuple[Skeleton, ...], directions: FloatArray) -> tuple[float, bool]:
    """Return the longer side of everything as seen; 1 for a robot that has no length."""
    points = np.concatenate([skeleton.points for skeleton in skeletons])
    found = float(np.ptp(points @ directions[:2].T, axis=0).max())
    whole = float(np.ptp(points, axis=0).max())
    # What is seen from its end only has a size across.
    return (found, False) if found > 1e-6 * whole else (whole or 1.0, True)


def _behind(mark: Mark) -> Mark:
    return mark if isinstance(mark, Words) else replace(mark, depth=mark.depth - 1e7)


def _box(marks: list[Mark]) -> tuple[FloatArray, FloatArray]:
    """Return the lower left and the upper right corner of all marks."""
    points = [corners(mark) if isinstance(mark, Words) else mark.points for mark in marks]
    whole = np.concatenate(points)
    return whole.min(axis=0), whole.max(axis=0)


def _annotated(
    robot: Robot, skeleton: Skeleton, drawn: list[Mark], radius: float, view: View, options: PictureOptions
) -> list[Mark]:
    """Frames and dimensions with their words."""
    marks: list[Mark] = []
    middle = sampled(drawn).mean(axis=0)
    length = float(np.clip(3.2 * radius * view.scale, 16.0, 34.0))
    found: list[list[Triad]] = []
    if options.frames:
        found = groups(_triads(robot, skeleton, options.rows), 1e-6 * 72 * options.size / view.scale)
        marks += _offshoots(robot, skeleton, view)
        marks += [mark for group in found for mark in arrows(group, view, length)]
    if options.dimensions:
        axes = (place for place in _chosen(skeleton, options) if place.move.moving)
        marks += [mark for place in axes for mark in dimensions.axis_line(place, view, 5 * radius)]
    # Words keep clear of all that is drawn, so they come last; dimensions first, which have the fewest places.
    layout = Layout([*drawn, *marks])
    if options.dimensions:
        _put_dimensions(robot, skeleton, layout, view, middle, radius, options)
    for group in found:
        layout.put(tag(group, view, middle))
    for candidates in letters(found, view, length):
        layout.put(candidates)
    return [*marks, *layout.marks]


def _triads(robot: Robot, skeleton: Skeleton, rows: tuple[str, ...] | None) -> Iterator[Triad]:
    """The base, the rows, a tool that is not the last link itself, and named frames; chosen rows with their parents."""
    numbers = {robot.root: 0} | {row.name: row.number for row in robot.rows}
    chosen = set(rows or ()) | {row.parent for row in robot.rows if rows is not None and row.name in rows}
    for name, pose in skeleton.frames.items():
        if (name == TOOL and not robot.tool) or (rows is not None and name not in chosen):
            continue
        yield Triad(frame_label(name), numbers.get(name), pose)


def _offshoots(robot: Robot, skeleton: Skeleton, view: View) -> Iterator[Mark]:
    """Thin lines to named frames beside the links."""
    for frame in robot.frames:
        if frame.parent in skeleton.frames:
            ends = np.array([skeleton.frames[name][:3, 3] for name in (frame.parent, frame.name)])
            yield Stroke(view.place(ends), INK, 0.5, FRAMES, -1e9, dashes=(1.5, 2.0))


def _chosen(skeleton: Skeleton, options: PictureOptions) -> Iterator[Place]:
    for place in skeleton.places:
        if options.rows is None or place.frame in options.rows:
            yield place


def _put_dimensions(
    robot: Robot,
    skeleton: Skeleton,
    layout: Layout,
    view: View,
    middle: FloatArray,
    radius: float,
    options: PictureOptions,
) -> None:
    """Lengths first, since they have fewer places. An arc of a joint is about its symbol, wherever that is."""
    from kinegen.tools.pictures.dimensions import Labels

    labels = Labels(robot)
    # A number that is zero in the table is no dimension, and named frames are not of the table.
    shown = [place for place in _chosen(skeleton, options) if place.move.moving or abs(place.move.value) > 1e-12]
    named = {frame.name for frame in robot.frames}
    shown = [place for place in shown if place.frame not in named]
    for place in shown:
        candidates = [] if place.move.kind.is_rotation else dimensions.length(place, labels.of(place), view, middle)
        if candidates:
            layout.put(candidates)
    # Angles of joints stand about their symbols; several about one point are nested.
    symbols = {body.joint.name: body.centre for body in bodies(skeleton, radius)}
    centres: list[FloatArray] = []
    for place in shown:
        if place.move.kind.is_rotation:
            centre = symbols[place.frame] if place.move.moving and place.frame in symbols else place.start
            at = view.place(centre)
            level = sum(float(np.linalg.norm(at - other)) < 12.0 for other in centres)
            centres.append(at)
            layout.put(dimensions.angle(place, labels.of(place), view, centre, level % 6))
