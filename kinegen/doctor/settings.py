"""How a table and some poses are read as a whole: convention, units, base and tool, form of the orientations.

In: what the file and the user say. Out: `Change`s of it, each of which may be a mistake. A fact that the user has
stated is not questioned.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from kinegen.doctor import readings
from kinegen.doctor.poses import Observations
from kinegen.doctor.table import Table
from kinegen.older import StrEnum
from kinegen.robot.model import TOOL, Convention

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
OTHER = {"deg": "rad", "rad": "deg"}
CONVENTIONS = (Convention.STANDARD, Convention.MODIFIED, Convention.MODIFIED_PREV_D)
"""The conventions that a table can be in; a table in one of them has the entries of the others."""


class Mount(StrEnum):
    """What is done with the base or the tool of the file."""

    GIVEN = "given"
    REVERSED = "reversed"
    DROPPED = "dropped"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class Setting:
    """How table and poses are read.

    Attributes:
        convention: Of the rows that follow the file's.
        table_angle: Unit of the table's angles.
        table_length: Unit of the table's lengths.
        joint_angle: Unit of the joint values of the poses.
        pose_angle: Unit of the orientations of the poses.
        pose_length: Unit of the positions, and of the values of prismatic joints.
        form: How the orientations are written (see `readings`); empty where there are none.
        base: What is done with the base.
        tail: What is done with the tool.
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

    @property
    def scale(self) -> float:
        """What a length of the table measures in the unit of the poses."""
        return METRES[self.table_length] / METRES[self.pose_length]

    @property
    def reading(self) -> tuple[str, str, str, str]:
        """What decides how a line of the poses is understood."""
        return self.joint_angle, self.pose_angle, self.pose_length, self.form


@dataclass(frozen=True, slots=True)
class Change:
    """One mistake in how table and poses are read.

    Attributes:
        words: What it is, for people.
        fields: New values of fields of `Setting`.
        in_file: Whether the file has to change; otherwise only the poses are read in another way.
    """

    words: str
    fields: tuple[tuple[str, Any], ...]
    in_file: bool = True

    @property
    def places(self) -> frozenset[str]:
        """What it is about; two changes of one place exclude each other."""
        return frozenset(name for name, _ in self.fields)

    def apply(self, setting: Setting) -> Setting:
        """The setting after it."""
        return replace(setting, **dict(self.fields))


def stated(table: Table, observed: Observations) -> Setting:
    """How the file and the user say that table and poses are to be read."""
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
        for form in readings.others(start.form):
            words = f"the orientations of the poses are {readings.WORDS[form]}"
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
    turned = (("pose_angle", poses),) if start.form in readings.ANGLES else ()
    if table.turns.any():
        words = f"the angles of the file are in {file}"
        yield Change(f"{words}, those of the poses in {start.joint_angle}", (("table_angle", file),))
        if not observed.stated_angle:
            yield Change(f"{words}, and those of the poses too", (("table_angle", file), *joints, *turned))
    if start.form == "rotation_vector":
        words = "the rotation vectors of the poses are in deg"
        yield Change(words, (("pose_angle", "deg"),), in_file=False)
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
    ends = [("base", "base", table.base)]
    if table.frame == TOOL:
        ends.append(("tail", "tool", table.tail))
    for field, name, slots in ends:
        if any(table.constants[place] for place in slots):
            yield Change(f"the transform '{name}' is the wrong way, its inverse fits", ((field, Mount.REVERSED),))
            yield Change(f"the transform '{name}' does not belong there", ((field, Mount.DROPPED),))
