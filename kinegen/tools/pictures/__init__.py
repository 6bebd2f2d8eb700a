"""Pictures of robots for papers, by matplotlib: the arm with joint symbols, frames and the dimensions of its table.

In: a `Robot` and joint vectors. Out: a figure of matplotlib, or the bytes of an SVG, PNG or PDF file.

    postures    the posture that is shown at first, and a posture as points and lines in space
    projection  the side from which a robot is seen, and strokes, areas and words on paper
    arm         joint symbols, links, base and gripper
    dimensions  entries of the table as dimension lines and arcs, and frames with their names
    labels      where words go
    sheet       the whole picture
    figure      matplotlib
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from kinegen.errors import KinegenError, quote, shown
from kinegen.model.robot import Robot
from kinegen.support.compat import library
from kinegen.support.files.write import write_file
from kinegen.tools.pictures.postures import home
from kinegen.tools.pictures.projection import AUTO, SIDES, FloatArray, Side, find_side
from kinegen.tools.pictures.sheet import PictureOptions, compose

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["FORMATS", "SIDES", "PictureOptions", "Side", "check_picture", "home", "plot", "save"]

FORMATS = (".svg", ".png", ".pdf")
"""Endings of the files that `save` writes."""

MOST_POSTURES = 50
"""More postures than this cannot be told apart in one figure."""

SMALLEST, LARGEST = 0.5, 40.0
"""Bounds of `size`, in inches."""


def plot(
    robot: Robot,
    q: ArrayLike | None = None,
    *,
    frames: bool = False,
    dimensions: bool = False,
    rows: Sequence[str] | None = None,
    side: str | Sequence[float] = AUTO,
    size: float = 5.0,
    width: float | None = None,
) -> Figure:
    """Draw a robot as textbooks do.

    Revolute joints are cylinders, prismatic joints are boxes, and the base is a hatched plate. Symbols of joints whose
    axes meet are drawn beside each other on their axes.

    Args:
        robot: The robot.
        q: A joint vector, shape (dof,), or several, shape (n, dof), in radians and the file's length unit. The first
            one is drawn in full, the others are paler. By default `home(robot)`.
        frames: Draw the frames with their names: x red, y green, z blue.
        dimensions: Draw the entries of the table that are not zero as dimension lines and arcs, with their symbols and
            values. A length that is seen from its end is left out.
        rows: Names of the rows whose frames and dimensions are drawn; all by default.
        side: A name (`front`, `back`, `side`, `left`, `top`, `bottom`, `isometric`), or azimuth and elevation of the
            viewer in degrees. `auto` is `top` for an arm in a horizontal plane and `isometric` for any other.
        size: Length of the longer side of the robot on paper, in inches.
        width: Width of the whole picture in inches, instead of `size`; pictures of one width have letters of one size.

    Returns:
        A figure of matplotlib, on white; one unit of its axes is 1/72 inch. `save` writes it.

    Raises:
        KinegenError: If matplotlib is not installed, q has another shape or a value that is not finite, or an argument
            is not one of those above.

    Example:
        >>> import kinegen
        >>> figure = kinegen.plot(kinegen.load("robots/scara.yaml"), [0.5, 0.6, 0.1], frames=True)
        >>> len(figure.axes)
        1
    """
    library("matplotlib", "a figure", "plot")
    from kinegen.tools.pictures.figure import make_figure

    for name, inches in (("size", size), ("width", size if width is None else width)):
        if not SMALLEST <= inches <= LARGEST:
            raise KinegenError(f"{name} is {inches!r} (expected inches from {SMALLEST:g} to {LARGEST:g})")
    chosen = None if rows is None else (rows,) if isinstance(rows, str) else tuple(rows)
    options = PictureOptions(find_side(side, robot), frames, dimensions, chosen, float(size), width)
    return make_figure(compose(robot, _postures(robot, q), options))


def save(figure: Figure, path: str | Path) -> None:
    """Write a figure; the same figure gives the same bytes, without dates, with letters as paths or embedded.

    Args:
        figure: What `plot` returned.
        path: A file whose name ends in `.svg`, `.png` or `.pdf`.

    Raises:
        KinegenError: If the name ends otherwise.
        WriteError: If the file cannot be written.
    """
    check_picture(path)
    from kinegen.tools.pictures.figure import content

    write_file(Path(path), content(figure, Path(path).suffix.lower()))


def check_picture(path: str | Path) -> None:
    """Refuse a file before anything is computed for it: by the ending of its name, or without matplotlib."""
    if Path(path).suffix.lower() not in FORMATS:
        raise KinegenError(f"{shown(path)}: a picture is written as {', '.join(FORMATS[:-1])} or {FORMATS[-1]}")
    library("matplotlib", "a figure", "plot")


def _postures(robot: Robot, q: ArrayLike | None) -> FloatArray:
    """Joint vectors, shape (n, dof)."""
    if q is None:
        return home(robot)[None]
    try:
        found = np.asarray(q, dtype=np.float64)
    except (TypeError, ValueError):
        raise KinegenError(f"{quote(str(q))} is not a joint vector (expected {robot.dof} numbers)") from None
    # One vector is a picture of one posture.
    if found.ndim not in (1, 2) or found.shape[-1] != robot.dof:
        raise KinegenError(f"q has shape {found.shape} (expected ({robot.dof},) or (n, {robot.dof}))")
    found = found if found.ndim == 2 else found[None]
    if not 0 < len(found) <= MOST_POSTURES:
        raise KinegenError(f"there are {len(found)} postures (expected 1 to {MOST_POSTURES})")
    if not all(math.isfinite(each) for each in found.flat):
        raise KinegenError("q has a value that is not finite")
    return found
