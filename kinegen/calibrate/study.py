"""One calibration: the stages in order, and what they found as one record."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kinegen.calibrate.arm import make_arm
from kinegen.calibrate.choice import BASE_NAMES, choose
from kinegen.calibrate.fixtures import Fixture
from kinegen.calibrate.judge import (
    Crossed,
    Errors,
    Outlier,
    Region,
    cross_validated,
    errors,
    outliers,
    regions,
)
from kinegen.calibrate.measurements import Kind, Measurements, read_measurements
from kinegen.calibrate.options import Settings
from kinegen.calibrate.parallel import Prepared, prepare
from kinegen.calibrate.residuals import make_problem
from kinegen.calibrate.rewrite import rewritten
from kinegen.calibrate.solve import Fit, fit
from kinegen.calibrate.suggest import Suggestion, suggest
from kinegen.calibrate.table import read_cells
from kinegen.errors import KinegenError, shown
from kinegen.formats.as_robot_file import as_robot_file
from kinegen.formats.load import load, loads
from kinegen.robot.model import Robot
from kinegen.symbolic.inverse.family import Family
from kinegen.symbolic.inverse.recognise import recognise

_FAR, _NEAR = 20.0, 100.0
"""Positions this many times farther than the arm reaches, or nearer, are probably in another unit."""


@dataclass(frozen=True, slots=True)
class Study:
    """A calibration and what is to be said of it.

    Attributes:
        robot: The robot of the file.
        prepared: The robot that was fitted.
        fit: The fit.
        before: Errors with the numbers of the file.
        after: Errors with the calibrated numbers.
        regions: Errors by joint region.
        outliers: Rows that do not fit.
        crossed: Cross-validation; None if it was not asked for or there are too few rows.
        suggestions: Poses to measure next.
        text: The calibrated robot file.
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
    crossed: Crossed | None
    suggestions: tuple[Suggestion, ...]
    text: str
    family_before: str
    family_after: str

    def is_angle(self, name: str) -> bool:
        """Whether a varied number is an angle."""
        return self.fit.problem.arm.is_angle(name)

    def fixtures(self) -> Iterator[tuple[Fixture, NDArray[np.float64]]]:
        """The planes, spheres and anchors with their numbers (see `Fixture.centre`)."""
        problem = self.fit.problem
        first = len(problem.arm.names)
        for fixture in problem.fixtures:
            last = first + len(fixture.numbers)
            yield fixture, fixture.centre(self.fit.values[first:last])
            first = last


def calibrate(file: Path, measurements: Path, settings: Settings) -> Study:
    """Calibrate a robot.

    Args:
        file: The robot file.
        measurements: CSV or Parquet with what was measured.
        settings: What to fit, and how.

    Raises:
        KinegenError: If one of the files is bad, or the measurements do not suffice.
    """
    robot = load(file)
    try:
        choice = choose(robot, settings.fit, settings.frame)
        measured = read_measurements(read_cells(measurements), robot, settings)
        prepared = prepare(robot, choice)
        arm = make_arm(prepared, choice, settings.frame)
    except KinegenError as error:
        # What is wrong with a choice is a matter of the robot.
        raise error if error.path else KinegenError(error.message, shown(file), error.line) from None
    _check_reach(measured, robot, arm.reach, aligned=set(BASE_NAMES) <= set(choice.base))
    _check_range(measured)
    problem = make_problem(arm, measured)
    found = fit(problem, settings.loss)
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


def _check_reach(measured: Measurements, robot: Robot, reach: float, *, aligned: bool) -> None:
    """Refuse lengths that must be in another unit."""
    rows = np.concatenate([measured.rows(Kind.POSE), measured.rows(Kind.POSITION)])
    sizes = np.linalg.norm(measured.positions[rows], axis=1)
    if aligned and len(rows):
        # The base is anywhere; only differences of positions say something.
        sizes = np.linalg.norm(measured.positions[rows] - measured.positions[rows].mean(axis=0), axis=1)
    given = np.flatnonzero(~np.isnan(measured.lengths))
    # Distances and radii may be small; positions of a whole arm are not.
    for values, lines, least in ((sizes, rows, reach / _NEAR), (measured.lengths[given], given, 0.0)):
        typical, unit = float(np.median(values)) if len(values) else reach, robot.units.length
        if not least <= typical <= _FAR * reach:
            how = "larger" if typical > reach else "smaller"
            raise KinegenError(
                f"a typical measured length is {typical:.4g} {unit}, much {how} than the arm, which reaches "
                f"{reach:.4g} {unit}; write the unit in the header, as in x[mm], or add --length",
                measured.path,
                measured.lines[int(lines[0])],
            )


def _check_range(measured: Measurements) -> None:
    """Refuse joint values that kernels do not evaluate."""
    for values in (measured.q, measured.to_q):
        for row in np.flatnonzero((np.abs(values) > 1e5).any(axis=1)):
            raise KinegenError("a joint value is larger than 1e5", measured.path, measured.lines[int(row)])
