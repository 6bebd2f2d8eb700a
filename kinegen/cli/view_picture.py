"""`kinegen view -o arm.svg`: the picture for a paper that the command writes instead of a page."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from kinegen.cli.terminal import say, strong
from kinegen.errors import KinegenError, shown

if TYPE_CHECKING:
    from kinegen.robot.model import Robot

SUFFIXES = (".svg", ".png", ".pdf")
"""Endings of the files that are pictures."""


@dataclass(frozen=True, slots=True)
class PictureRequest:
    """What a picture should show.

    Attributes:
        postures: Joint vectors in radians and the file's length unit; none for the posture that is drawn by default.
        frames: Whether frames have their arrows and names.
        dimensions: Whether the entries of the table have dimension lines and arcs.
        rows: The rows whose frames and dimensions are drawn; none for all.
        side: From where the robot is seen.
        size: Length of the longer side of the robot on paper, in inches.
    """

    postures: tuple[tuple[float, ...], ...] = ()
    frames: bool = False
    dimensions: bool = False
    rows: tuple[str, ...] = ()
    side: str = "auto"
    size: float = 5.0


def is_picture(path: Path) -> bool:
    """Whether a file is a picture, by the ending of its name."""
    return path.suffix.lower() in SUFFIXES


def write_picture(robot: Robot, path: Path, request: PictureRequest) -> None:
    """Write a picture and report it.

    Args:
        robot: The robot.
        path: Where it goes.
        request: What it shows.

    Raises:
        KinegenError: If matplotlib is not installed, or the request does not suit the robot.
    """
    from kinegen.pictures import check_picture, plot, save

    check_picture(path)
    q = [list(posture) for posture in request.postures] or None
    figure = plot(
        robot,
        # A robot without joints has one posture, of no numbers.
        q if robot.dof else None,
        frames=request.frames,
        dimensions=request.dimensions,
        rows=request.rows or None,
        side=request.side,
        size=request.size,
    )
    save(figure, path)
    across, up = figure.get_size_inches()
    say(strong(f"wrote {shown(path)}"))
    say(f"  {across:.1f} x {up:.1f} inches")


def refuse_for_page(request: PictureRequest) -> None:
    """Refuse what only pictures have, for a page.

    Raises:
        KinegenError: If something of it is asked for.
    """
    usual = PictureRequest()
    asked = {
        "--frames": request.frames,
        "--dimensions": request.dimensions,
        "--rows": bool(request.rows),
        "--side": request.side != usual.side,
        "--size": request.size != usual.size,
        "more than one --q": len(request.postures) > 1,
    }
    for option, given in asked.items():
        if given:
            raise KinegenError(f"{option} is for pictures; name one with -o, such as arm.svg")
