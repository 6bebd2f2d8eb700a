"""The page of a robot in a frame of a notebook, and joint vectors for it."""

from __future__ import annotations

import os
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from kinegen.errors import KinegenError
from kinegen.support.files.write import write_file

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

HEIGHT = 600
"""Height of a cell in pixels."""


def joints_of(name: str, dof: int, q: ArrayLike) -> tuple[float, ...]:
    """Return a joint vector as numbers.

    Raises:
        KinegenError: If it has another length, or an entry is not finite.
    """
    import numpy as np

    try:
        values = np.asarray(q, dtype=np.float64)
    except (TypeError, ValueError):
        raise KinegenError(f"{name}: a joint vector is {dof} real numbers") from None
    if values.shape != (dof,):
        raise KinegenError(f"{name}: the joint vector has shape {values.shape}, expected ({dof},)")
    if not np.isfinite(values).all():
        raise KinegenError(f"{name}: the joint vector has an entry that is not finite")
    return tuple(map(float, values))


class Page:
    """The page of a robot; a notebook shows it in a frame. `kinegen.view` makes it.

    Args:
        name: Name of the robot.
        html: The page.
        height: Height of the frame in pixels.
    """

    def __init__(self, name: str, html: str, height: int = HEIGHT) -> None:
        self.name, self.html, self.height = name, html, int(height)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the page to a file, which any browser opens from the disk."""
        write_file(Path(path), self.html)
        return Path(path)

    def __repr__(self) -> str:
        return f"<kinegen.Page of {self.name}: shown in notebooks, save(path) writes it>"

    def _repr_html_(self) -> str:
        frame = f'style="width: 100%; border: 0; height: {self.height}px" srcdoc="{escape(self.html)}"'
        return f'<iframe title="{escape(self.name)}" sandbox="allow-scripts" allow="clipboard-write" {frame}></iframe>'
