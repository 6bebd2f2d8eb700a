"""`kinegen view`: a robot as an interactive HTML page, which needs no network, or as a picture."""

from __future__ import annotations

import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kinegen.errors import KinegenError, shown
from kinegen.support.dataclass import dataclass
from kinegen.support.files.manifest import check_output, is_sealed, sealed
from kinegen.ui.cli.robot_command import RobotCommand, sample_count
from kinegen.ui.cli.terminal import complain, say, strong

if TYPE_CHECKING:
    from kinegen.model.outputs import Quantity
    from kinegen.model.robot import Robot
    from kinegen.tools.viewer.document import ViewOptions

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
        width: Width of the whole picture in inches, instead of the size; None for what the size needs.
    """

    postures: tuple[tuple[float, ...], ...] = ()
    frames: bool = False
    dimensions: bool = False
    rows: tuple[str, ...] = ()
    side: str = "auto"
    size: float = 5.0
    width: float | None = None


def is_picture(path: Path) -> bool:
    """Return whether a file is a picture, by the ending of its name."""
    return path.suffix.lower() in SUFFIXES


def write_picture(robot: Robot, path: Path, request: PictureRequest) -> None:
    """Write a picture and report it.

    Raises:
        KinegenError: If matplotlib is not installed, or the request does not suit the robot.
    """
    from kinegen.support.files.write import write_file
    from kinegen.tools.pictures import check_picture, plot

    check_picture(path)
    from kinegen.tools.pictures.figure import content

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
        width=request.width,
    )
    suffix = path.suffix.lower()
    write_file(path, sealed(content(figure, suffix), suffix))
    across, up = figure.get_size_inches()
    say(strong(f"wrote {shown(path)}"))
    say(f"  {across:.1f} x {up:.1f} inches")


def refuse_for_page(request: PictureRequest) -> None:
    """Refuse what only pictures have, for a page."""
    usual = PictureRequest()
    asked = {
        "--frames": request.frames,
        "--dimensions": request.dimensions,
        "--rows": bool(request.rows),
        "--side": request.side != usual.side,
        "--size": request.size != usual.size,
        "--width": request.width is not None,
        "more than one --q": len(request.postures) > 1,
    }
    for option, given in asked.items():
        if given:
            raise KinegenError(f"{option} is for pictures; name one with -o, such as arm.svg")


_PAGES = (".html", ".htm", ".xhtml")
_MOST_SAMPLES = 10**9


def whole_number(_context: click.Context, _parameter: click.Parameter, text: str) -> int:
    """Read a number of samples; 0 for none."""
    return sample_count(text, 0, _MOST_SAMPLES)


@click.command("view", cls=RobotCommand, short_help="Writes an interactive 3D viewer as an HTML page, or a picture.")
@click.argument("file", metavar="FILE", type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    metavar="PAGE",
    type=click.Path(path_type=Path),
    help="The page to write; by default NAME.html in this folder, after the name of the robot. A name that ends in "
    ".svg, .png or .pdf makes it a picture.",
)
@click.option("--open", "opens", is_flag=True, help="Open the page in the browser.")
@click.option(
    "--q",
    "joints",
    metavar="Q,...",
    multiple=True,
    help="Joint values at first, separated by commas, in the units of the file; by default 0, or the limit next to it. "
    "Repeat it for a picture of several postures; the first one is drawn in full.",
)
@click.option(
    "--angle", type=click.Choice(["rad", "deg"]), help="Unit of the angles in --q.  [default: that of the robot file]"
)
@click.option(
    "--outputs",
    metavar="NAMES",
    default="",
    help="Quantities whose kernels the page gets in addition to pose, frames, jacobian and what the robot has of "
    "inverse and actuators; as in 'kinegen build'.",
)
@click.option(
    "--workspace",
    metavar="N",
    default="0",
    callback=whole_number,
    help="Number of joint vectors to try, such as 1e6, for the points that the end effector reaches; without it none "
    "are drawn.",
)
@click.option("--frames", is_flag=True, help="Picture: draw the frames with their names.")
@click.option("--dimensions", is_flag=True, help="Picture: draw the entries of the table as lengths and angles.")
@click.option(
    "--rows", metavar="NAMES", default="", help="Picture: frames and dimensions of these rows only, with commas."
)
@click.option(
    "--side",
    metavar="SIDE",
    default="auto",
    help="Picture: front, back, side, left, top, bottom or isometric, or azimuth and elevation of the viewer in "
    "degrees such as -60,25.",
)
@click.option(
    "--size",
    metavar="INCHES",
    type=float,
    default=5.0,
    show_default=True,
    help="Picture: longer side of the robot.",
)
@click.option("--width", metavar="INCHES", type=float, help="Picture: width of the whole picture, instead of --size.")
@click.option("--force", is_flag=True, help="Replace PAGE even if kinegen did not write it, or it was changed since.")
def view_command(
    file: Path,
    output: Path | None,
    opens: bool,
    joints: tuple[str, ...],
    angle: str | None,
    outputs: str,
    workspace: int,
    rows: str,
    force: bool,
    **drawn: Any,
) -> None:
    """Writes a self-contained HTML file: an interactive 3D view of the arm, its table, closed form and inverse.

    It opens from the disk in any current browser, without a network. The page evaluates kernels in JavaScript and
    compares them with test vectors when it opens. A picture for a paper, as SVG, PNG or PDF, shows the arm with joint
    symbols, its frames and the dimensions of its table.

    \b
        kinegen view robots/puma560.yaml --open
        kinegen view robots/puma560.yaml -o arm.html --q 0,-90,30,0,0,0
        kinegen view robots/ur5.yaml -o arm.svg --frames --dimensions --side front
    """  # noqa: D301 - click's mark of a paragraph that stays as it is
    from kinegen.io.load import load
    from kinegen.tools.viewer.document import ViewOptions

    if angle and not joints:
        raise click.UsageError("--angle is for the joint values of --q")
    robot = load(file)
    target = Path(f"{robot.name}.html") if output is None else output
    _check_suffix(target)
    check_output(target, (file,), force=force, is_own=is_sealed)
    # The same options are read for both; what suits only one is refused for the other.
    postures = tuple(_joint_values(robot, text, angle or robot.units.angle) for text in joints)
    names = tuple(name.strip() for name in rows.split(",") if name.strip())
    request = PictureRequest(postures, rows=names, **drawn)
    if is_picture(target):
        if outputs or workspace:
            raise click.UsageError("--outputs and --workspace are for pages; a picture has no kernels")
        write_picture(robot, target, request)
    else:
        refuse_for_page(request)
        options = ViewOptions(postures[0] if postures else None, _quantities(outputs), workspace)
        _write_page(robot, target, options)
    if opens:
        _open(target)


def _write_page(robot: Robot, target: Path, options: ViewOptions) -> None:
    from kinegen.support.files.write import write_file
    from kinegen.tools.viewer.document import page

    content = sealed(page(robot, options).encode(), target.suffix.lower())
    write_file(target, content)
    say(strong(f"wrote {shown(target)}"))
    say(f"  {len(content) / 1e6:.2f} MB; open it in a browser")


def _check_suffix(target: Path) -> None:
    """See that the name says what is wanted."""
    if target.suffix.lower() not in (*_PAGES, *SUFFIXES):
        raise KinegenError(
            f"{shown(target)}: the name ends in {target.suffix or 'no suffix'} (expected {_PAGES[0]} for a page, or "
            f"{', '.join(SUFFIXES)} for a picture)"
        )


def _joint_values(robot: Robot, text: str, angle: str) -> tuple[float, ...]:
    from kinegen.ui.cli.show import read_values

    words = tuple(word.strip() for word in text.split(",")) if text.strip() else ()
    return tuple(float(value) for value in read_values(robot, words, deg=angle == "deg"))


def _quantities(text: str) -> tuple[Quantity, ...]:
    from kinegen.model.outputs import parse_quantity

    return tuple(dict.fromkeys(parse_quantity(name.strip()) for name in text.split(",") if name.strip()))


def _open(target: Path) -> None:
    if not webbrowser.open(target.resolve().as_uri()):
        complain(f"warning: no browser was found; open {shown(target)} in one")
