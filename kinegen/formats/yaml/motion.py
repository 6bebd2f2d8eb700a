"""What moves: which joint variables stand in which row, and what that makes of each joint.

In: raw rows. Out: the type of every joint. A variable may stand only in theta and d of a table row, or in the steps of
an elementary sequence.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

from kinegen.errors import quote
from kinegen.formats.messages import expected, fail, within
from kinegen.formats.yaml.slots import OWN, RawRow, Slot
from kinegen.robot.dimension import Dimension
from kinegen.robot.expressions import Name
from kinegen.robot.model import JointType

MOVING = frozenset({JointType.REVOLUTE, JointType.PRISMATIC, JointType.SCREW})
"""The types that have a variable of their own."""

_NOT_FINITE = frozenset({"nan", "inf", "infinity"})

STILL = {JointType.FIXED: "it is fixed", JointType.FOLLOWER: "it follows other joints"}
"""Why a row has no variable of its own."""


def joint_types(rows: tuple[RawRow, ...]) -> dict[str, JointType]:
    """Find the type of every joint from where its variable stands.

    Raises:
        RobotFileError: If a variable stands where none may, or `type:` says something else.
    """
    joints = frozenset(row.name for row in rows)
    types: dict[str, JointType] = {}
    for row in rows:
        with within(row.where, row.line):
            types[row.name] = kind = _joint_type(row, joints)
            if row.declared not in (None, str(kind)):
                fail(f"type is {row.declared}, but {_reason(row, kind)}")
            if row.limits and kind not in MOVING:
                fail(f"limits need a joint variable, and the row has none ({STILL[kind]})", row.limits[0].line)
            if row.offset:
                _check_offset(row, row.offset, kind)
    return types


def _check_offset(row: RawRow, offset: Slot, kind: JointType) -> None:
    """Refuse an offset that has no q to be added to, or that could be read in two ways."""
    with within("offset", offset.line):
        if kind not in MOVING:
            fail(f"it is added to q, and the row has no q ({STILL[kind]})")
        own = [slot for slot in row.slots if OWN in slot.words]
        if len(own) > 1:
            places = " and ".join(slot.label for slot in own)
            fail(f"q is in {places}; write the sum there and leave offset out")
        if own[0].expression != Name(OWN):
            fail(f"{own[0].label} is not q alone, so offset could be read in two ways; write the sum there instead")


def with_dimensions(rows: tuple[RawRow, ...], types: Mapping[str, JointType]) -> tuple[RawRow, ...]:
    """Give offset and limits the dimension of their variable: a length for a prismatic joint, else an angle."""
    return tuple(_with_dimensions(row, types[row.name]) for row in rows)


def _with_dimensions(row: RawRow, kind: JointType) -> RawRow:
    dimension = Dimension.LENGTH if kind is JointType.PRISMATIC else Dimension.ANGLE
    offset = row.offset and replace(row.offset, dimension=dimension)
    limits = row.limits and (replace(row.limits[0], dimension=dimension), replace(row.limits[1], dimension=dimension))
    return replace(row, offset=offset, limits=limits)


def check_names(slot: Slot, parameters: Collection[str], types: Mapping[str, JointType]) -> None:
    """Refuse a name that nothing defines, or that has no value where the slot stands.

    Args:
        slot: Any slot.
        parameters: Names of the parameters.
        types: Type of each joint.
    """
    own = (OWN,) if slot.axis is not None else ()
    moving = [name for name, kind in types.items() if kind in MOVING] if slot.axis is not None else []
    for name in slot.words:
        if name in parameters or name in own:
            continue
        with within(slot.label, slot.line):
            if name in types:
                _refuse_joint(slot, name, types[name])
            elif name == OWN:
                fail("q is the variable of a row and has no meaning here")
            elif name.lower() in _NOT_FINITE:
                fail(f"{quote(name)} is not a finite number")
            elif options := [*own, *parameters, *moving]:
                fail(f"undefined name {quote(name)} {expected(name, options)}")
            else:
                fail(f"undefined name {quote(name)} (the file has no parameters)")


def _refuse_joint(slot: Slot, name: str, kind: JointType) -> None:
    if slot.axis is None:
        fail(f"joint variable '{name}' is not allowed here; this entry is constant")
    if kind not in MOVING:
        fail(f"joint '{name}' has no variable of its own ({STILL[kind]})")


def _joint_type(row: RawRow, joints: frozenset[str]) -> JointType:
    own = [slot for slot in row.slots if OWN in slot.words]
    for slot in row.slots:
        if row.name in slot.words:
            fail(f"{slot.label}: the joint's own variable is written q, not '{row.name}'", slot.line)
    for slot in own:
        if slot.axis is None:
            fail(f"{slot.label}: q is not allowed here (only in theta, d or an ets step)", slot.line)
    if not own:
        follows = any(joints.intersection(slot.words) for slot in row.slots)
        return JointType.FOLLOWER if follows else JointType.FIXED
    if len(own) == 1:
        return JointType.REVOLUTE if own[0].dimension is Dimension.ANGLE else JointType.PRISMATIC
    if not _is_screw(row, own):
        places = ", ".join(slot.label for slot in own[:4])
        fail(f"q is in {places}; only a screw has it twice, in a turn and a shift along one axis", own[1].line)
    return JointType.SCREW


def _is_screw(row: RawRow, own: list[Slot]) -> bool:
    if len(own) != 2 or own[0].dimension is own[1].dimension or own[0].axis != own[1].axis:
        return False
    # A turn about another axis between the two would tilt one against the other.
    first, last = (row.slots.index(slot) for slot in own)
    between = row.slots[first:last] if row.steps else ()
    return all(slot.dimension is Dimension.LENGTH or slot.axis == own[0].axis for slot in between)


def _reason(row: RawRow, kind: JointType) -> str:
    places = [slot.label for slot in row.slots if OWN in slot.words]
    if places:
        return f"q is in {' and '.join(places)}, so the joint is {kind}"
    return f"the row has no q, so the joint is {kind}"
