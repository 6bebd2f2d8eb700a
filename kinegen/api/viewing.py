"""The viewer as a cell of a notebook."""

from __future__ import annotations

import importlib.util
from typing import TYPE_CHECKING

from kinegen.api.loading import Source, load
from kinegen.api.options import quantities_of
from kinegen.api.page import HEIGHT, Page, joints_of
from kinegen.api.robot import model_of
from kinegen.api.words import Words, words_of
from kinegen.errors import KinegenError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from kinegen.api.widget import View


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
    from kinegen.viewer.document import page
    from kinegen.viewer.options import ViewOptions

    loaded = load(robot)
    start = None if q is None else joints_of(loaded.name, loaded.dof, q)
    html = page(model_of(loaded), ViewOptions(start, quantities_of(outputs) if words_of(outputs) else ()))
    has_widgets = importlib.util.find_spec("anywidget") is not None
    if widget and not has_widgets:
        raise KinegenError("a widget needs the package anywidget: pip install 'kinegen[notebook]'")
    if widget is False or not has_widgets:
        return Page(loaded.name, html, height)
    from kinegen.api.widget import make_view
    from kinegen.pictures import home

    return make_view(loaded.name, html, start or tuple(map(float, home(loaded))), height)
