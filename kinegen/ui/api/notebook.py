"""Notebooks: the viewer as a cell, and robots in cells with the magic `%%robot`."""

from __future__ import annotations

import importlib.util
import shlex
import sys
from typing import TYPE_CHECKING, Any

from kinegen.errors import KinegenError, printable
from kinegen.ui.api.building import compile  # noqa: A004 - a name of kinegen
from kinegen.ui.api.loading import Source, load
from kinegen.ui.api.options import Words, quantities_of, words_of
from kinegen.ui.api.page import HEIGHT, Page, joints_of
from kinegen.ui.api.robot_methods import model_of

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from kinegen.ui.api.textbook_forms import ClosedForm
    from kinegen.ui.api.widget import View


def view(
    robot: Source,
    q: ArrayLike | None = None,
    *,
    outputs: Words = (),
    height: int = HEIGHT,
    widget: bool | None = None,
) -> View | Page:
    """Show a robot that moves, in a notebook: the page of `kinegen view` as a cell.

    Args:
        robot: What `load` takes: a path, a text, a mapping or a robot.
        q: Joint vector at first, shape (dof,), in radians and the robot's length unit; the home position if left out.
        outputs: Further quantities whose kernels the page gets.
        height: Height of the cell in pixels.
        widget: Whether the cell is a widget; by default where the package anywidget is installed.

    Returns:
        A widget: `view.q = [...]` moves the arm, and `view.q` has the joints that were set with the sliders. Without
        anywidget a page in a frame, whose sliders work and which Python does not hear of. Both have `html` and `save`.

    Raises:
        KinegenError: If the robot is bad, the joint vector does not fit, or a widget is asked for without anywidget.

    Example:
        >>> import kinegen
        >>> page = kinegen.view("robots/scara.yaml", [0.5, 0.6, 0.1], widget=False)
        >>> page
        <kinegen.Page of scara: shown in notebooks, save(path) writes it>
        >>> page.html.startswith("<!DOCTYPE html>")
        True
    """
    from kinegen.tools.viewer.document import ViewOptions, page

    loaded = load(robot)
    start = None if q is None else joints_of(loaded.name, loaded.dof, q)
    html = page(model_of(loaded), ViewOptions(start, quantities_of(outputs) if words_of(outputs) else ()))
    # Without anywidget the page is in a frame, and Python does not hear of its sliders.
    has_widgets = importlib.util.find_spec("anywidget") is not None
    if widget and not has_widgets:
        raise KinegenError("a widget needs the package anywidget: pip install 'kinegen[notebook]'")
    if widget is False or not has_widgets:
        return Page(loaded.name, html, height)
    from kinegen.tools.pictures import home
    from kinegen.ui.api.widget import make_view

    return make_view(loaded.name, html, start or tuple(map(float, home(loaded))), height)


USAGE = "%%robot [NAME] [--outputs LIST] [--real double|float|both] [--quiet]"


class _Words:
    """The words behind `%%robot`.

    Attributes:
        name: What the module is called in the notebook; the name of the robot if it is empty.
        outputs: What is computed; None for what `kinegen.compile` computes by default.
        real: Number types.
        quiet: Whether the closed form is left out.
    """

    outputs: str | None

    def __init__(self, line: str) -> None:
        self.name, self.outputs, self.real, self.quiet = "", None, "both", False
        try:
            words = shlex.split(line)
        except ValueError as error:
            raise KinegenError(f"%%robot: {str(error).lower()}; usage: {USAGE}") from None
        while words:
            word, _, value = words.pop(0).partition("=")
            if word == "--quiet":
                self.quiet = True
            elif word in ("--outputs", "--real"):
                value = value or (words.pop(0) if words else "")
                if not value:
                    raise KinegenError(f"%%robot: {word} needs a value; usage: {USAGE}")
                setattr(self, word[2:], value)
            elif word.isidentifier() and not self.name:
                self.name = word
            else:
                raise KinegenError(f"%%robot: unexpected {word!r}; usage: {USAGE}")


def robot_cell(shell: Any, line: str, cell: str) -> ClosedForm | None:
    """Compile the robot of a cell: `%%robot [NAME] [--outputs LIST] [--real ...] [--quiet]`.

    The module gets the name of the robot in the notebook, or NAME; `NAME_robot` is the robot itself. The cell is YAML,
    or the text of any other format that `kinegen.load` reads. A mistake is one line with the line of the cell.

    Returns:
        The closed form of the pose, which the notebook shows; None after a mistake, or with `--quiet`.
    """
    try:
        words = _Words(line)
        robot = load(cell if "\n" in cell else f"{cell}\n")
        module = compile(robot, words.outputs, real=words.real)
        form = None if words.quiet else robot.closed_form()
    except KinegenError as error:
        # Line 1 of the cell is that with %%robot.
        place = "" if error.line is None else f"line {error.line + 1} of the cell: "
        print(f"error: {place}{printable(error.message)}", file=sys.stderr)
        return None
    name = words.name or robot.name
    shell.push({name: module, f"{name}_robot": robot})
    for note in robot.notes:
        print(f"note: {printable(note)}")
    return form


def load_ipython_extension(shell: Any) -> None:
    """Add the cell magic `%%robot`; `%load_ext kinegen` calls this."""

    def robot(line: str, cell: str) -> Any:
        return robot_cell(shell, line, cell)

    robot.__doc__ = robot_cell.__doc__
    shell.register_magic_function(robot, magic_kind="cell", magic_name="robot")
