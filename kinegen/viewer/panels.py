"""The data of the panels: tables, the closed form, the inverse."""

from __future__ import annotations

from typing import Any

from kinegen.emit.kernels import Kernels
from kinegen.viewer.formula import formula_model
from kinegen.viewer.rows import rows_model
from kinegen.viewer.solve import inverse_model

PANEL_SCRIPTS = (
    "algebra.js",
    "story.js",
    "solve.js",
    "spectrum.js",
    "cloud.js",
    "shapes.js",
    "subject.js",
    "table.js",
    "formula.js",
    "inverse.js",
    "motion.js",
)
"""The scripts of the panels in the order in which they run, behind those of the core; the first five need no page."""


def panel_data(kernels: Kernels) -> dict[str, Any]:
    """What the panels show besides the robot.

    Args:
        kernels: The robot and its programs.

    Returns:
        `tables` (see `rows`), `formula` and `inverse` (see `solve`), as JSON.
    """
    robot = kernels.robot
    return {"tables": rows_model(robot), "formula": formula_model(robot), "inverse": inverse_model(kernels)}
