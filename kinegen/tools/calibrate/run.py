"""Runs one calibration, its stages in order, and draws its errors."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen.derive.inverse.classification import recognise
from kinegen.derive.inverse.family import Family
from kinegen.errors import KinegenError, shown
from kinegen.io.load import load, loads
from kinegen.io.robot_file.document import as_robot_file
from kinegen.model.robot import Robot
from kinegen.model.variants import frame_named
from kinegen.support.compat import library
from kinegen.support.dataclass import dataclass
from kinegen.tools.calibrate.arm_model import make_arm
from kinegen.tools.calibrate.evaluation import (
    Crossed,
    Errors,
    Outlier,
    Region,
    Suggestion,
    cross_validated,
    errors,
    outliers,
    regions,
    row_errors,
    suggest,
)
from kinegen.tools.calibrate.fitted_parameters import BASE_NAMES, Prepared, choose, prepare
from kinegen.tools.calibrate.measurement_file import read_cells
from kinegen.tools.calibrate.measurements import Measurements, read_measurements
from kinegen.tools.calibrate.options import Settings
from kinegen.tools.calibrate.plausibility import Pattern, check_fit, check_range, check_reach, patterns
from kinegen.tools.calibrate.residuals import Fixture, make_problem
from kinegen.tools.calibrate.rewrite import rewritten
from kinegen.tools.calibrate.solve import Fit, fit


@dataclass(frozen=True, slots=True)
class Study:
    """A calibration and all that is reported of it.

    Attributes:
        patterns: How the errors follow the value of a joint, which no number of the table corrects.
        crossed: Cross-validation; None if it was not asked for or there are too few rows.
        family_before: The closed-form inverse of the robot of the file; empty if it has none.
        family_after: The same after calibration; empty if it has none.
    """

    robot: Robot
    prepared: Prepared
    fit: Fit
    before: Errors
    after: Errors
    regions: tuple[Region, ...]
    outliers: tuple[Outlier, ...]
    patterns: tuple[Pattern, ...]
    crossed: Crossed | None
    suggestions: tuple[Suggestion, ...]
    text: str
    family_before: str
    family_after: str

    def fixtures(self) -> Iterator[tuple[Fixture, NDArray[np.float64]]]:
        """Yield the planes, spheres and anchors with their numbers (see `Fixture.centre`)."""
        problem = self.fit.problem
        first = len(problem.arm.names)
        for fixture in problem.fixtures:
            last = first + len(fixture.numbers)
            yield fixture, fixture.centre(self.fit.values[first:last])
            first = last


def calibrate(file: Path, measurements: Path, settings: Settings) -> Study:
    """Calibrate a robot with a CSV or Parquet file of measurements.

    Raises:
        KinegenError: If one of the files is bad, or the measurements do not suffice.
    """
    robot = load(file)
    try:
        frame = frame_named(robot, settings.frame)
        choice = choose(robot, settings.fit, frame)
        measured = read_measurements(read_cells(measurements), robot, settings)
        prepared = prepare(robot, choice)
        arm = make_arm(prepared, choice, frame)
    except KinegenError as error:
        # What is wrong with a choice is a matter of the robot.
        raise error if error.path else KinegenError(error.message, shown(file), error.line) from None
    check_reach(measured, robot, arm.reach, aligned=set(BASE_NAMES) <= set(choice.base))
    check_range(measured)
    problem = make_problem(arm, measured)
    found = fit(problem, settings.loss)
    check_fit(found)
    before, after = (errors(found.problem, values) for values in (found.problem.start, found.values))
    source, name = as_robot_file(file)
    text = rewritten(source, name, robot, prepared, found, _heading(robot, measured, before, after))
    return Study(
        robot=robot,
        prepared=prepared,
        fit=found,
        before=before,
        after=after,
        regions=regions(found),
        outliers=outliers(found),
        patterns=patterns(found),
        crossed=cross_validated(found, settings.loss, settings.folds, settings.seed),
        suggestions=suggest(found, settings.suggest, settings.seed),
        text=text,
        family_before=_family(robot),
        family_after=_family(loads(text, name)),
    )


def _family(robot: Robot) -> str:
    found = recognise(robot)
    return found.name if isinstance(found, Family) else ""


def _heading(robot: Robot, measured: Measurements, before: Errors, after: Errors) -> str:
    rows, unit = f"{len(measured.kinds)} rows of {Path(measured.path).name}", robot.units.length
    return f"Calibrated with {rows}: RMS error {before.rms:.3g} {unit} before, {after.rms:.3g} {unit} after."


_PURPOSE = "a picture"
_BEFORE, _AFTER = "#b0b0b0", "#1f5fa8"
_STYLE = {"svg.hashsalt": "kinegen", "svg.fonttype": "path", "font.size": 9}
_SIZE = (9.0, 3.4)
_RESOLUTION = 150


def draw(study: Study, kind: str) -> bytes:
    """Draw the errors of all rows as `.png` or `.svg`, and return the content of the file."""
    matplotlib, figures = library("matplotlib", _PURPOSE), library("matplotlib.figure", _PURPOSE)
    problem, unit = study.fit.problem, study.robot.units.length
    differences = [problem.differences(values) for values in (problem.start, study.fit.values)]
    lengths, angles = zip(*(row_errors(problem, each) for each in differences), strict=True)
    turned = not np.isnan(angles[0]).all()
    # Neither dates nor random identifiers: the same calibration gives the same bytes.
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
    # One scale for both histograms, wide enough for all errors.
    sizes = [np.maximum(each, floor) for each in known]
    low, high = min(map(np.min, sizes)), max(map(np.max, sizes))
    edges = np.geomspace(low / 1.1, high * 1.1, 30)
    for each, colour in zip(sizes, (_BEFORE, _AFTER), strict=True):
        panels[1].hist(each, bins=edges, color=colour, alpha=0.85)
    panels[1].set_xscale("log")
    panels[1].set_xlabel(label)
    panels[1].set_ylabel("rows")
