"""A robot as elementary transforms with numbers, and the settings in which table and poses are read.

A `Table` has one slot for each angle and length on the way from the base to the measured frame: a constant, and its
coefficients of the joint variables, in radians and the file's length unit. Thousands of variants of it are evaluated at
once. Each `Change` of a setting may be a mistake. A fact that the user has stated is not questioned.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen.errors import KinegenError
from kinegen.model.expression_parser import Expression, evaluate, linear
from kinegen.model.expression_values import FLOAT64, METRES
from kinegen.model.joint_bounds import parameter_values
from kinegen.model.robot import TOOL, WRIST, Convention, JointType, Robot, Row, Step, StepKind
from kinegen.model.row_transforms import ENTRY_KINDS, ROW_TRANSFORMS
from kinegen.support.compat import StrEnum
from kinegen.support.dataclass import dataclass
from kinegen.tools.doctor import observed_poses
from kinegen.tools.doctor.observed_poses import FloatArray, Observations

BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Slot:
    """One angle or length.

    Attributes:
        entry: `alpha`, `a`, `d`, `theta`, `beta`, or `ets 2 (Tx)` for a step.
        step: Place of a step in its list, from 0; -1 for an entry of a table row.
    """

    entry: str
    kind: StepKind
    step: int = -1


@dataclass(frozen=True, slots=True)
class TableRow:
    """The slots of one row, by their places in `Table.slots`.

    Attributes:
        follows: Whether it has the convention of the file.
        slots: Place of each entry, or of each step of an elementary sequence in order.
    """

    name: str
    number: int
    convention: Convention
    follows: bool
    slots: Mapping[str, int]
    moves: bool

    @property
    def label(self) -> str:
        """Return how messages name the row."""
        return f"joint {self.number} ({self.name})"

    def order(self, convention: Convention) -> tuple[int, ...]:
        """Return its slots from left to right, where the file has this convention."""
        own = convention if self.follows else self.convention
        keys = self.slots if own is Convention.ETS else (key for _, key in ROW_TRANSFORMS[own])
        return tuple(self.slots[key] for key in keys)


@dataclass(frozen=True, slots=True)
class Table:
    """The way from the base to the measured frame; steps before and after the rows are `base` and `tail`.

    Attributes:
        constants: Their constants, shape (slots,).
        coefficients: Their coefficients of the joint variables, shape (slots, dof).
        prismatic: Which joint variables are lengths, shape (dof,).
    """

    robot: Robot
    frame: str
    slots: tuple[Slot, ...]
    constants: FloatArray
    coefficients: FloatArray
    base: tuple[int, ...]
    rows: tuple[TableRow, ...]
    tail: tuple[int, ...]
    prismatic: BoolArray

    @property
    def turns(self) -> BoolArray:
        """Return which slots are angles, shape (slots,)."""
        return np.array([slot.kind.is_rotation for slot in self.slots], dtype=bool)

    @property
    def reach(self) -> float:
        """Return the sum of the sizes of all lengths; 1 where there is none, so that it can divide."""
        return float(np.abs(self.constants[~self.turns]).sum()) or 1.0


class _Builder:
    """Collects slots."""

    def __init__(self, robot: Robot) -> None:
        self.slots: list[Slot] = []
        self.constants: list[float] = []
        self.coefficients: list[list[float]] = []
        self._names = [variable.name for variable in robot.variables]
        self._values = parameter_values(robot)

    def add(self, slot: Slot, expression: Expression) -> int:
        """Add a slot; returns its place."""
        factors, offset = linear(expression, frozenset(self._names))
        found = {name: float(evaluate(factor, self._values, FLOAT64)) for name, factor in factors.items()}
        self.slots.append(slot)
        self.constants.append(float(evaluate(offset, self._values, FLOAT64)))
        self.coefficients.append([found.get(name, 0.0) for name in self._names])
        return len(self.slots) - 1

    def steps(self, steps: tuple[Step, ...]) -> tuple[int, ...]:
        """Add the steps of a transform."""
        return tuple(
            self.add(Slot(f"step {index + 1} ({step.kind})", step.kind, index), step.value)
            for index, step in enumerate(steps)
        )

    def row(self, row: Row, robot: Robot) -> TableRow:
        """Add a row."""
        if row.convention is Convention.ETS:
            found = {self.slots[place].entry: place for place in self.steps(row.steps)}
        else:
            entries = [(key, kind, getattr(row, key)) for key, kind in ENTRY_KINDS.items()]
            found = {key: self.add(Slot(key, kind), value) for key, kind, value in entries if value is not None}
        moves = any(any(self.coefficients[place]) for place in found.values())
        follows = row.convention is robot.convention
        return TableRow(row.name, row.number, row.convention, follows, found, moves)


def table_of(robot: Robot, frame: str) -> Table:
    """Make the table for a row, `TOOL`, `WRIST` or a named frame; any other is an error."""
    link, steps = _way(robot, frame)
    builder = _Builder(robot)
    # Slots are in the order of the product, base first.
    base = builder.steps(() if link is None else robot.base)
    rows = tuple(builder.row(row, robot) for row in _rows(robot, link))
    tail = builder.steps(steps)
    return Table(
        robot,
        frame,
        tuple(builder.slots),
        np.array(builder.constants),
        np.array(builder.coefficients).reshape(len(builder.slots), robot.dof),
        base,
        rows,
        tail,
        np.array([variable.type is JointType.PRISMATIC for variable in robot.variables], dtype=bool),
    )


def _way(robot: Robot, frame: str) -> tuple[str | None, tuple[Step, ...]]:
    """Return the row that a frame is on, None for the root, and the steps from there to it."""
    frames = {entry.name: entry for entry in robot.frames}
    last = robot.rows[-1].name if robot.rows else robot.root
    steps: tuple[Step, ...] = ()
    # Named frames hang on others, and at last on a row or the root.
    while frame in frames:
        steps = frames[frame].steps + steps
        frame = frames[frame].parent
    if any(row.name == frame for row in robot.rows):
        return frame, steps
    if frame == robot.root and steps:
        return None, steps
    if frame in (TOOL, WRIST) and not robot.is_tree:
        return last, (robot.tool if frame == TOOL else ()) + steps
    raise KinegenError(f"unknown frame {frame!r} (expected {', '.join(robot.frame_names)})")


def _rows(robot: Robot, link: str | None) -> tuple[Row, ...]:
    """Return the rows from the base to a link, in order."""
    by_name = {row.name: row for row in robot.rows}
    found: list[Row] = []
    while link in by_name:
        found.append(by_name[link])
        link = found[-1].parent
    return tuple(reversed(found))


OTHER = {"deg": "rad", "rad": "deg"}
CONVENTIONS = (Convention.STANDARD, Convention.MODIFIED, Convention.MODIFIED_PREV_D)
"""The conventions that a table can be in; a table in one of them has the entries of the others."""


class Mount(StrEnum):
    """Uses of the base or the tool of the file."""

    GIVEN = "given"
    REVERSED = "reversed"
    DROPPED = "dropped"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class Setting:
    """The way in which table and poses are read.

    Attributes:
        convention: Of the rows that follow the file's.
        pose_length: Unit of the positions, and of the values of prismatic joints.
        form: How the orientations are written (see `observed_poses`); empty where there are none.
        mix: What the values of the poses are multiplied by for those of the joints, (dof, dof); empty for nothing.
    """

    convention: Convention
    table_angle: str
    table_length: str
    joint_angle: str
    pose_angle: str
    pose_length: str
    form: str
    base: Mount = Mount.GIVEN
    tail: Mount = Mount.GIVEN
    mix: tuple[tuple[float, ...], ...] = ()

    def matrix(self, count: int) -> FloatArray:
        """Return what the values of the poses are multiplied by for those of the joints, shape (count, count)."""
        return np.array(self.mix) if self.mix else np.eye(count)

    @property
    def scale(self) -> float:
        """Return what a length of the table measures in the unit of the poses."""
        return METRES[self.table_length] / METRES[self.pose_length]

    @property
    def reading(self) -> tuple[object, ...]:
        """Return what decides how a line of the poses is understood."""
        return self.joint_angle, self.pose_angle, self.pose_length, self.form, self.mix


@dataclass(frozen=True, slots=True)
class Change:
    """One mistake in how table and poses are read: new fields of `Setting`, and whether the file has to change."""

    words: str
    fields: tuple[tuple[str, Any], ...]
    in_file: bool = True

    @property
    def places(self) -> frozenset[str]:
        """Return what it is about; two changes of one place exclude each other."""
        return frozenset(name for name, _ in self.fields)

    def apply(self, setting: Setting) -> Setting:
        """Return the setting after it."""
        return replace(setting, **dict(self.fields))


def stated(table: Table, observed: Observations) -> Setting:
    """Return how the file and the user say that table and poses are to be read."""
    units = table.robot.units
    return Setting(
        convention=table.robot.convention,
        table_angle=units.angle,
        table_length=units.length,
        joint_angle=observed.angle,
        pose_angle=_angle_of(observed.form, observed.angle),
        pose_length=observed.length,
        form=observed.form,
    )


def _angle_of(form: str, angle: str) -> str:
    """Rotation vectors are in radians, also where a device shows joint values in degrees."""
    return "rad" if form == "rotation_vector" else angle


def changes(table: Table, observed: Observations) -> tuple[Change, ...]:
    """Everything that may be wrong with how table and poses are read, one at a time."""
    start = stated(table, observed)
    found = [*_conventions(table, start), *_angles(table, start, observed), *_lengths(table, start, observed)]
    found += [*_mounts(table)]
    if start.form and not observed.stated_form:
        for form in observed_poses.others(start.form):
            words = f"the orientations of the poses are {observed_poses.WORDS[form]}"
            angle = _angle_of(form, observed.angle)
            turned = (("pose_angle", angle),) * (angle != start.pose_angle)
            found.append(Change(words, (("form", form), *turned), in_file=False))
    return tuple(found)


def _conventions(table: Table, start: Setting) -> Iterator[Change]:
    if not any(row.follows and row.convention in CONVENTIONS for row in table.rows):
        return
    for convention in CONVENTIONS:
        if convention is not start.convention:
            yield Change(f"the convention of the table is {convention}", (("convention", convention),))


def _angles(table: Table, start: Setting, observed: Observations) -> Iterator[Change]:
    """Degrees or radians: in the table, in the joint values, in the orientations, or in several of them."""
    file, poses = OTHER[start.table_angle], OTHER[start.joint_angle]
    joints = (("joint_angle", poses),) if bool((~table.prismatic).any()) else ()
    turned = (("pose_angle", poses),) if start.form in observed_poses.ORIENTATION_ANGLES else ()
    # The file may be wrong alone, or file and poses in the same way.
    if table.turns.any():
        words = f"the angles of the file are in {file}"
        yield Change(f"{words}, those of the poses in {start.joint_angle}", (("table_angle", file),))
        if not observed.stated_angle:
            yield Change(f"{words}, and those of the poses too", (("table_angle", file), *joints, *turned))
    if start.form == "rotation_vector":
        yield Change("the rotation vectors of the poses are in deg", (("pose_angle", "deg"),), in_file=False)
    # What the user has stated is not questioned.
    if observed.stated_angle:
        return
    if joints:
        yield Change(f"the joint values of the poses are in {poses}", joints, in_file=False)
    if turned:
        yield Change(f"the orientations of the poses are in {poses}", turned, in_file=False)
    if joints and turned:
        yield Change(f"joint values and orientations of the poses are in {poses}", (*joints, *turned), in_file=False)


def _lengths(table: Table, start: Setting, observed: Observations) -> Iterator[Change]:
    if table.turns.all():
        return
    for unit in METRES:
        if unit != start.table_length:
            yield Change(
                f"the lengths of the file are in {unit}, the poses in {start.pose_length}", (("table_length", unit),)
            )
        if unit != start.pose_length and not observed.stated_length:
            yield Change(f"the positions of the poses are in {unit}", (("pose_length", unit),), in_file=False)


def _mounts(table: Table) -> Iterator[Change]:
    # Only the tool stands behind the last row; the transforms of named frames are not tried.
    ends = [("base", "base", table.base), ("tail", "tool", table.tail)][: 1 + (table.frame == TOOL)]
    for field, name, slots in ends:
        if any(table.constants[place] for place in slots):
            yield Change(f"the transform '{name}' is the wrong way, its inverse fits", ((field, Mount.REVERSED),))
            yield Change(f"the transform '{name}' does not belong there", ((field, Mount.DROPPED),))
