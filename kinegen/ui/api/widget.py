"""The viewer as an anywidget: joints go from Python to the page and back."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import anywidget
import traitlets

from kinegen.ui.api.page import Page, joints_of


class View(anywidget.AnyWidget):
    """The page of a robot as a widget; `kinegen.view` makes it.

    Attributes:
        q: The joint vector, in radians and the robot's length unit: set it to move the arm, read it after the sliders
            were moved, and `observe` it.
        name: Name of the robot.
    """

    _esm = Path(__file__).with_name("widget.js")

    q: Any = traitlets.TraitType(()).tag(sync=True)
    page = traitlets.Unicode().tag(sync=True)
    title = traitlets.Unicode().tag(sync=True)
    height = traitlets.Int().tag(sync=True)

    def __init__(self, name: str, html: str, start: tuple[float, ...], height: int) -> None:
        self.name, self._dof = name, len(start)
        super().__init__(q=list(start), page=html, title=name, height=height)

    @traitlets.validate("q")
    def _checked(self, proposal: Any) -> list[float]:
        return list(joints_of(self.name, self._dof, proposal["value"]))

    @property
    def html(self) -> str:
        """The page."""
        return str(self.page)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the page to a file, which any browser opens from the disk."""
        return Page(self.name, self.html).save(path)

    def __repr__(self) -> str:
        return f"<kinegen.View of {self.name}: q = {self.q}>"


def make_view(name: str, html: str, start: tuple[float, ...], height: int) -> View:
    """Return a widget with a page, a joint vector at first and a height in pixels."""
    return View(name, html, start, height)
