"""A picture of the errors before and after a calibration: row by row, and how many are how large."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen.calibrate.judge import row_errors
from kinegen.calibrate.study import Study
from kinegen.workspace.optional import library

_PURPOSE = "a picture"
_BEFORE, _AFTER = "#b0b0b0", "#1f5fa8"
_STYLE = {"svg.hashsalt": "kinegen", "svg.fonttype": "path", "font.size": 9}
_SIZE = (9.0, 3.4)
_RESOLUTION = 150


def draw(study: Study, kind: str) -> bytes:
    """Draw the errors of all rows.

    Args:
        study: A calibration.
        kind: `.png` or `.svg`.

    Returns:
        The content of the file.

    Raises:
        KinegenError: If matplotlib is not installed.
    """
    matplotlib, figures = library("matplotlib", _PURPOSE), library("matplotlib.figure", _PURPOSE)
    problem, unit = study.fit.problem, study.robot.units.length
    differences = [problem.differences(values) for values in (problem.start, study.fit.values)]
    lengths, angles = zip(*(row_errors(problem, each) for each in differences), strict=True)
    turned = not np.isnan(angles[0]).all()
    with matplotlib.rc_context(_STYLE):
        figure = figures.Figure(figsize=(_SIZE[0], _SIZE[1] * (2 if turned else 1)))
        panels = figure.subplots(2 if turned else 1, 2, squeeze=False, width_ratios=(2, 1))
        _rows(panels[0], lengths, f"error [{unit}]")
        if turned:
            _rows(panels[1], angles, "error of the orientation [rad]")
        panels[0][0].legend(frameon=False, ncols=2)
        figure.suptitle(f"Calibration of {study.robot.name}: {len(problem.measured.kinds)} rows")
        figure.tight_layout()
        buffer = io.BytesIO()
        metadata = {"Date": None} if kind == ".svg" else {}
        figure.savefig(buffer, format=kind.lstrip("."), dpi=_RESOLUTION, metadata=metadata)
    return buffer.getvalue()


def _rows(panels: Any, errors: tuple[NDArray[np.float64], ...], label: str) -> None:
    """Errors of each row on the left, and a histogram of their sizes on the right; sizes on a logarithmic scale."""
    places = np.arange(1, len(errors[0]) + 1)
    known = [each[~np.isnan(each)] for each in errors]
    floor = max(float(np.max(known[0], initial=0.0)) * 1e-6, 1e-15)
    for each, colour, name in zip(errors, (_BEFORE, _AFTER), ("before", "after"), strict=True):
        panels[0].semilogy(places, np.maximum(each, floor), "o", markersize=3.5, color=colour, label=name)
    panels[0].set_xlabel("row")
    panels[0].set_ylabel(label)
    panels[0].grid(color="#dddddd", linewidth=0.5)
    sizes = [np.maximum(each, floor) for each in known]
    low, high = min(map(np.min, sizes)), max(map(np.max, sizes))
    edges = np.geomspace(low / 1.1, high * 1.1, 30)
    for each, colour in zip(sizes, (_BEFORE, _AFTER), strict=True):
        panels[1].hist(each, bins=edges, color=colour, alpha=0.85)
    panels[1].set_xscale("log")
    panels[1].set_xlabel(label)
    panels[1].set_ylabel("rows")
