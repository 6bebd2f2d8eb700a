"""Columns of a file -> what was measured at each joint vector, in radians and the length unit of the robot file."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from kinegen.errors import KinegenError, quote
from kinegen.io.columns import METRES, RADIANS, Cells
from kinegen.model.robot import JointType, Robot
from kinegen.support.compat import StrEnum
from kinegen.support.dataclass import dataclass
from kinegen.tools.calibrate.arm_model import from_quaternion, from_rpy, from_vector
from kinegen.tools.calibrate.measurement_file import (
    ORIENTATIONS,
    POSITION,
    QUATERNION,
    ROLL_PITCH_YAW,
    TO,
    Column,
    read_header,
)
from kinegen.tools.calibrate.options import Settings

Floats = NDArray[np.float64]

DEFAULT_SIGMA, DEFAULT_SIGMA_ANGLE = 1e-4, 2e-4
"""What a fit starts with where no uncertainty is stated, in metres and radians; it is then estimated."""

_QUATERNION_SLACK = 0.01


class Kind(StrEnum):
    """Kinds of measurements."""

    POSE = "pose"
    POSITION = "position"
    DISTANCE = "distance"
    ANCHOR = "anchor"
    PLANE = "plane"
    SPHERE = "sphere"


SIZES = {Kind.POSE: 6, Kind.POSITION: 3, Kind.DISTANCE: 1, Kind.ANCHOR: 1, Kind.PLANE: 1, Kind.SPHERE: 1}
"""Residuals of a row."""


_SAME = 9
"""Decimals to which joint vectors are compared: what differs less is one pose."""


@dataclass(frozen=True, slots=True)
class Measurements:
    """N rows of measurements, in radians and the length unit of the robot file.

    Attributes:
        q: Joint vectors, (N, dof).
        to_q: The other joint vector of a distance, (N, dof); NaN elsewhere.
        positions: (N, 3); NaN where no position was measured.
        rotations: (N, 3, 3); NaN where no orientation was measured.
        lengths: Distances, and known radii of spheres, (N,); NaN elsewhere.
        fixtures: The plane, sphere or anchor of each row; empty elsewhere.
        sigma: Standard deviations of lengths, (N,).
        sigma_angle: Standard deviations of angles, (N,).
        stated: Whether the uncertainties are those of the user; otherwise they are to be estimated.
        angles: The units in which angles of joints were read where their titles state several; else empty.
    """

    path: str
    lines: tuple[int, ...]
    kinds: tuple[Kind, ...]
    q: Floats
    to_q: Floats
    positions: Floats
    rotations: Floats
    lengths: Floats
    fixtures: tuple[str, ...]
    sigma: Floats
    sigma_angle: Floats
    stated: bool
    angles: str = ""

    @property
    def residuals(self) -> int:
        """Return numbers that were measured."""
        return sum(SIZES[kind] for kind in self.kinds)

    @property
    def independent(self) -> int:
        """Return numbers that were measured, those of one pose once: measured again, it shows no new unknown."""
        vectors = np.nan_to_num(np.round(np.concatenate([self.q, self.to_q], axis=1), _SAME)) + 0.0
        rows = zip(self.kinds, self.fixtures, map(tuple, vectors.tolist()), strict=True)
        return sum(SIZES[kind] for kind, *_ in set(rows))

    def rows(self, kind: Kind) -> NDArray[np.intp]:
        """Return the rows of one kind."""
        return np.array([place for place, each in enumerate(self.kinds) if each is kind], dtype=np.intp)

    def part(self, rows: NDArray[np.intp]) -> Measurements:
        """Return some of the rows."""
        return replace(
            self,
            lines=tuple(self.lines[row] for row in rows),
            kinds=tuple(self.kinds[row] for row in rows),
            fixtures=tuple(self.fixtures[row] for row in rows),
            q=self.q[rows],
            to_q=self.to_q[rows],
            positions=self.positions[rows],
            rotations=self.rotations[rows],
            lengths=self.lengths[rows],
            sigma=self.sigma[rows],
            sigma_angle=self.sigma_angle[rows],
        )


def read_measurements(cells: Cells, robot: Robot, settings: Settings) -> Measurements:
    """Read all rows; the first defect is an error with its line."""
    columns = read_header(cells, robot, settings)
    if not cells.rows:
        raise cells.fail("there is a header but no measurement below it", cells.header_line)
    reader = _Reader(cells, columns, robot)
    joints = [f"q{number}" for number in range(1, robot.dof + 1)]
    q = np.stack([reader.numbers(role, needed=True) for role in joints], axis=1)
    to_q = np.stack([reader.numbers(TO + role) for role in joints], axis=1)
    positions = np.stack([reader.numbers(role) for role in POSITION], axis=1)
    lengths, fixtures, kinds = reader.kinds(to_q, positions, reader.rotations_given())
    # Uncertainties of columns, else of options, else of a good instrument.
    unit = METRES[robot.units.length]
    sigma, is_sigma = reader.uncertainty("sigma", settings.sigma and settings.sigma / unit, DEFAULT_SIGMA / unit)
    sigma_angle, is_angle = reader.uncertainty("sigma_angle", settings.sigma_angle, DEFAULT_SIGMA_ANGLE)
    _check_units(cells, columns, robot, q)
    angles = {each.unit for role, each in columns.items() if role.removeprefix(TO) in joints and each.unit in RADIANS}
    return Measurements(
        path=cells.path,
        lines=cells.lines,
        kinds=kinds,
        q=q,
        to_q=to_q,
        positions=positions,
        rotations=reader.rotations(),
        lengths=lengths,
        fixtures=fixtures,
        sigma=sigma,
        sigma_angle=sigma_angle,
        stated=is_sigma and (is_angle or Kind.POSE not in kinds),
        angles=" and ".join(sorted(angles)) if len(angles) > 1 else "",
    )


@dataclass(frozen=True, slots=True)
class _Reader:
    """Reads cells by the role of their column."""

    cells: Cells
    columns: dict[str, Column]
    robot: Robot

    def numbers(self, role: str, *, needed: bool = False) -> Floats:
        """Return one column in kernel units, (N,); NaN where a cell is empty or there is no such column."""
        if role not in self.columns:
            return np.full(len(self.cells.rows), np.nan)
        column = self.columns[role]
        found = [self._number(row[column.place], column, line, needed) for row, line in self._rows()]
        return np.array(found) * column.scale

    def texts(self, role: str) -> list[str]:
        """Return one column of names; empty where there is none."""
        if role not in self.columns:
            return [""] * len(self.cells.rows)
        return [row[self.columns[role].place] for row, _ in self._rows()]

    def rotations_given(self) -> NDArray[np.bool_]:
        """Tell whether each row has an orientation; one that is not complete is an error."""
        form = self._form()
        if form is None:
            return np.zeros(len(self.cells.rows), dtype=bool)
        return self._complete(np.stack([self.numbers(role) for role in form], axis=1), form)

    def rotations(self) -> Floats:
        """Orientations (N, 3, 3); NaN where there are none."""
        form = self._form()
        found = np.full((len(self.cells.rows), 3, 3), np.nan)
        if form is None:
            return found
        numbers = np.stack([self.numbers(role) for role in form], axis=1)
        given = self._complete(numbers, form)
        if form is QUATERNION:
            for row in np.flatnonzero(given):
                size = float(np.linalg.norm(numbers[row]))
                if abs(size - 1) > _QUATERNION_SLACK:
                    raise self._fail(row, f"the quaternion has length {size:.4g} (expected 1)")
        convert = from_quaternion if form is QUATERNION else from_rpy if form is ROLL_PITCH_YAW else from_vector
        found[given] = convert(numbers[given])
        return found

    def kinds(
        self, to_q: Floats, positions: Floats, turned: NDArray[np.bool_]
    ) -> tuple[Floats, tuple[str, ...], tuple[Kind, ...]]:
        """Return the length, the fixture and the kind of every row; each row measures one thing."""
        placed = self._complete(positions, POSITION)
        second = self._complete(to_q, tuple(f"{TO}{variable.name}" for variable in self.robot.variables))
        distances, radii = self.numbers("distance"), self.numbers("radius")
        # Lengths are not signed.
        for role, values in (("distance", distances), ("radius", radii)):
            for bad in np.flatnonzero(values < 0):
                raise self._fail(bad, f"{role} is negative")
        names = {kind: self.texts(kind) for kind in ("anchor", "plane", "sphere")}
        # The filled cells of a row say what it measures.
        kinds: list[Kind] = []
        for row in range(len(self.cells.rows)):
            has = {kind for kind, texts in names.items() if texts[row]}
            far = not math.isnan(distances[row])
            found = [
                *([Kind.POSE if turned[row] else Kind.POSITION] if placed[row] else []),
                *([Kind.DISTANCE] if far and second[row] else []),
                *([Kind.ANCHOR] if far and "anchor" in has else []),
                *(Kind(name) for name in ("plane", "sphere") if name in has),
            ]
            if len(found) != 1:
                reason = "more than one thing: " + ", ".join(found) if found else "nothing; fill x, y, z or a distance"
                raise self._fail(row, f"this row measures {reason}")
            if turned[row] and not placed[row]:
                raise self._fail(row, "there is an orientation but no position")
            kinds.append(found[0])
        # Radii of spheres stand in the place of distances.
        fixtures = tuple(names[str(kind)][row] if str(kind) in names else "" for row, kind in enumerate(kinds))
        spheres = np.array([kind is Kind.SPHERE for kind in kinds])
        return np.where(spheres, radii, distances), fixtures, tuple(kinds)

    def uncertainty(self, role: str, given: float | None, default: float) -> tuple[Floats, bool]:
        """Standard deviations (N,), of the column, the option or the default; and whether they are stated."""
        found = self.numbers(role)
        for row in np.flatnonzero(found <= 0):
            raise self._fail(row, f"{role} must be positive")
        is_stated = bool(given) or not np.isnan(found).any()
        return np.where(np.isnan(found), given or default, found), is_stated

    def _form(self) -> tuple[str, ...] | None:
        return next((group for group in ORIENTATIONS if group[0] in self.columns), None)

    def _rows(self) -> zip[tuple[tuple[str, ...], int]]:
        return zip(self.cells.rows, self.cells.lines, strict=True)

    def _number(self, text: str, column: Column, line: int, needed: bool) -> float:
        title = quote(self.cells.header[column.place])
        if not text:
            if needed:
                raise self.cells.fail(f"column {title} is empty", line)
            return math.nan
        try:
            value = float(text)
        except ValueError:
            hint = (
                "; write a decimal point"
                if text.replace(",", ".", 1).replace(".", "", 1).lstrip("+-").isdigit()
                else ""
            )
            raise self.cells.fail(f"column {title} has {quote(text)}, which is not a number{hint}", line) from None
        if not math.isfinite(value):
            raise self.cells.fail(f"column {title} has {quote(text)}; leave the cell empty or the row out", line)
        return value

    def _complete(self, values: Floats, names: tuple[str, ...]) -> NDArray[np.bool_]:
        """Return which rows have all values of a group; a row with only some of them is an error."""
        given = ~np.isnan(values)
        for row in np.flatnonzero(given.any(axis=1) & ~given.all(axis=1)):
            missing = [name for name, is_there in zip(names, given[row], strict=True) if not is_there]
            raise self._fail(row, f"{', '.join(missing)} is empty beside the others of {', '.join(names)}")
        return np.asarray(given.all(axis=1))

    def _fail(self, row: int | np.intp, message: str) -> KinegenError:
        return self.cells.fail(message, self.cells.lines[int(row)])


def _check_units(cells: Cells, columns: dict[str, Column], robot: Robot, q: Floats) -> None:
    """Refuse angles of joints that must be in the other unit, where nobody stated the unit."""
    turning = [v.index for v in robot.variables if v.type is not JointType.PRISMATIC]
    turning = [index for index in turning if not columns[f"q{index + 1}"].stated]
    if not turning:
        return
    largest = float(np.abs(q[:, turning]).max())
    # A robot that is measured moves its joints by more than a few degrees ...
    if robot.units.angle == "deg" and len(q) > 3 and largest < math.radians(2 * math.pi):
        raise cells.fail(
            f"no joint turns by more than {math.degrees(largest):.3g} degrees; if these are radians, add --angle rad, "
            "else --angle deg",
            cells.header_line,
        )
    # ... and by no more than a few turns.
    if robot.units.angle == "rad" and largest > 8 * math.pi:
        raise cells.fail(
            f"a joint is at {largest:.4g} rad, {largest / 2 / math.pi:.0f} turns; if these are degrees, add --angle "
            "deg, else --angle rad",
            cells.header_line,
        )
