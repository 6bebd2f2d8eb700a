"""Raw rows and frames -> the records of the model: joint types, then linear functions in kernel units.

A variable may stand only in theta and d of a table row, or in the steps of an elementary sequence.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import replace
from decimal import Decimal

from kinegen.errors import quote
from kinegen.io.messages import expected, fail, within
from kinegen.io.robot_file.expression_fields import OWN, ExpressionField, RawFrame, RawRow, RawStep
from kinegen.model.expression_parser import (
    Expression,
    Linear,
    Name,
    add,
    arcs,
    linear,
    multiply,
    names,
    substitute,
    without_arcs,
)
from kinegen.model.expression_values import (
    HALF_TURN,
    RADIAN,
    Dimension,
    check_roots,
    checked_value,
    is_zero,
    join,
    radians,
    scale,
)
from kinegen.model.robot import Frame, JointType, JointVariable, Parameter, Row, Step
from kinegen.support.dataclass import dataclass

MOVING = frozenset({JointType.REVOLUTE, JointType.PRISMATIC, JointType.SCREW})
"""The types that have a variable of their own."""

_NUMBERED = re.compile(r"q_?[0-9]+\Z")
"""How textbooks and printed tables call the joint variables."""

_NOT_FINITE = frozenset({"nan", "inf", "infinity"})

STILL = {JointType.FIXED: "it is fixed", JointType.FOLLOWER: "it follows other joints"}
"""Why a row has no variable of its own."""


def joint_types(rows: tuple[RawRow, ...]) -> dict[str, JointType]:
    """Find the type of every joint from where its variable stands, and compare it with `type:`."""
    joints = frozenset(row.name for row in rows)
    types: dict[str, JointType] = {}
    for row in rows:
        with within(row.where, row.line):
            types[row.name] = kind = _joint_type(row, joints)
            if row.declared not in (None, str(kind)):
                fail(f"type is {row.declared}, but {_reason(row, kind)}")
            if row.limits and kind not in MOVING:
                fail(
                    f"limits need a joint variable, and the row has none ({_why_still(row, kind)})", row.limits[0].line
                )
            if row.offset:
                _check_offset(row, row.offset, kind)
    return types


def _why_still(row: RawRow, kind: JointType) -> str:
    """Say why a row has no variable, and what is written where one is meant."""
    if kind is not JointType.FIXED:
        return STILL[kind]
    words = [word for slot in row.slots if slot.axis is not None for word in slot.words]
    meant = next((word for word in words if word.lower() == OWN or _NUMBERED.match(word)), None)
    return (
        f"write {OWN} for {quote(meant)}" if meant else f"{STILL[kind]}; write {OWN} where one is, as in theta: {OWN}"
    )


def _check_offset(row: RawRow, offset: ExpressionField, kind: JointType) -> None:
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


def check_names(slot: ExpressionField, parameters: Collection[str], types: Mapping[str, JointType]) -> None:
    """Refuse a name that nothing defines, or that has no value where the slot stands."""
    own = (OWN,) if slot.axis is not None else ()
    moving = [name for name, kind in types.items() if kind in MOVING] if slot.axis is not None else []
    # Say why a name has no value here, and what could be meant.
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
            elif own and _NUMBERED.match(name):
                fail(f"undefined name {quote(name)}; the joint variable of every row is {OWN}, without a number")
            elif options := [*own, *parameters, *moving]:
                fail(f"undefined name {quote(name)} {expected(name, options)}")
            else:
                fail(f"undefined name {quote(name)} (the file has no parameters)")


def _refuse_joint(slot: ExpressionField, name: str, kind: JointType) -> None:
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
    # One place decides the type; two have to be a screw.
    if len(own) == 1:
        return JointType.REVOLUTE if own[0].dimension is Dimension.ANGLE else JointType.PRISMATIC
    if not _is_screw(row, own):
        places = ", ".join(slot.label for slot in own[:4])
        why = "only a screw has it twice, in a rotation and a translation along one axis"
        fail(f"q is in {places}; {why}", own[1].line)
    return JointType.SCREW


def _is_screw(row: RawRow, own: list[ExpressionField]) -> bool:
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


def split(slot: ExpressionField, types: Mapping[str, JointType], angles: frozenset[str], *, degrees: bool) -> Linear:
    """Convert a slot to kernel units, as a linear function of the joint variables.

    Raises:
        ExpressionError: If a variable does not stand linearly.
    """
    found = linear(slot.expression, frozenset(types))
    if not degrees or slot.dimension is not Dimension.ANGLE:
        return found
    factors = {name: _in_degrees(factor, angles) for name, factor in found.factors.items()}
    # A revolute variable counts in the same unit as the angle; a prismatic one does not.
    factors |= {name: scale(each) for name, each in factors.items() if types[name] is JointType.PRISMATIC}
    return Linear(factors, radians(found.offset, angles))


def _in_degrees(factor: Expression, angles: frozenset[str]) -> Expression:
    """Return the same number of degrees, with every name and arc in radians."""
    hidden, found = without_arcs(factor)
    in_degrees = {name: multiply(RADIAN, Name(name)) for name in angles.union(found)}
    return substitute(substitute(hidden, in_degrees, HALF_TURN), found)


@dataclass(frozen=True, slots=True)
class Converter:
    """The types, closed parameters and units on which the conversion of a slot depends."""

    types: Mapping[str, JointType]
    parameters: Mapping[str, Parameter]
    values: Mapping[str, Decimal]
    degrees: bool

    def slot(self, slot: ExpressionField, joint: str | None = None) -> Expression:
        """Convert a slot whose names are known to exist; `q` in it stands for `joint`."""
        angles = frozenset(name for name, known in self.parameters.items() if known.dimension is Dimension.ANGLE)
        with within(slot.label, slot.line):
            self._check_arcs(slot.expression)
            types = {**self.types, OWN: self.types[joint]} if joint else self.types
            factors, offset = split(slot, types, angles, degrees=self.degrees)
            checked_value(offset, self.values)
            for word in slot.words:
                if word not in types:
                    continue
                if word not in factors or is_zero(checked_value(factors[word], self.values)):
                    fail(f"'{word}' is multiplied by zero")
            found = join({joint if name == OWN and joint else name: factor for name, factor in factors.items()}, offset)
            check_roots(found, self.values, [name for name, known in self.parameters.items() if known.runtime])
        return found

    def _check_arcs(self, expression: Expression) -> None:
        """Refuse a runtime parameter in an arc: kernels get such angles as constants."""
        for name in (name for arc in arcs(expression) for name in names(arc)):
            if name in self.parameters and self.parameters[name].runtime:
                where = "is not allowed in asin, acos, atan or atan2"
                fail(f"'{name}' is set at run time and {where}; make the angle a parameter")

    def row(self, raw: RawRow) -> Row:
        """Convert one row of the table."""
        with within(raw.where, raw.line):
            if raw.offset:
                self.slot(raw.offset)
            entries = {slot.label: self.slot(_moved(slot, raw.offset), raw.name) for slot in raw.entries}
            steps = tuple(Step(step.kind, self.slot(_moved(step.slot, raw.offset), raw.name)) for step in raw.steps)
        kind = self.types[raw.name]
        return Row(
            name=raw.name,
            number=raw.number,
            parent=raw.parent,
            convention=raw.convention,
            alpha=entries.get("alpha"),
            a=entries.get("a"),
            d=entries.get("d"),
            theta=entries.get("theta"),
            beta=entries.get("beta"),
            steps=steps,
            type=kind,
            variable=raw.name if kind in MOVING else None,
            line=raw.line,
        )

    def variables(self, rows: tuple[RawRow, ...]) -> tuple[JointVariable, ...]:
        """Return the joint vector."""
        moving = [row for row in rows if self.types[row.name] in MOVING]
        return tuple(
            JointVariable(row.name, index, self.types[row.name], self._limits(row), row.line)
            for index, row in enumerate(moving)
        )

    def _limits(self, row: RawRow) -> tuple[Expression, Expression] | None:
        if row.limits is None:
            return None
        with within(row.where, row.line):
            return self.bounds(row.limits, "a joint that cannot move is a fixed row")

    def bounds(self, limits: tuple[ExpressionField, ExpressionField], remedy: str) -> tuple[Expression, Expression]:
        """Convert limits, which are constant; `remedy` says what to do where nothing lies between them."""
        low, high = (self.closed(slot) for slot in limits)
        with within("limits", limits[0].line):
            if is_zero(checked_value(low, {}) - checked_value(high, {})):
                fail(f"the two are equal; {remedy}")
            if checked_value(low, {}) > checked_value(high, {}):
                fail("the lower limit exceeds the upper limit")
        return low, high

    def closed(self, slot: ExpressionField) -> Expression:
        """Convert a slot that is constant, and put the parameters in."""
        for name in slot.words:
            if self.parameters[name].runtime:
                are = "are" if slot.label == "limits" else "is"
                fail(f"{slot.label}: '{name}' is set at run time, but {slot.label} {are} constant", slot.line)
        return substitute(self.slot(slot), {name: self.parameters[name].value for name in slot.words})

    def frame(self, raw: RawFrame) -> Frame:
        """Convert one named frame."""
        return Frame(raw.name, raw.parent, self.steps(raw), raw.line, raw.tip)

    def steps(self, raw: RawFrame) -> tuple[Step, ...]:
        """Convert the steps of base, tool or a named frame."""
        with within(raw.where, raw.line):
            return tuple(self._step(step) for step in raw.steps)

    def _step(self, raw: RawStep) -> Step:
        return Step(raw.kind, self.slot(raw.slot))


def _moved(slot: ExpressionField, offset: ExpressionField | None) -> ExpressionField:
    """Return a slot whose own variable, if it has one, is q + offset."""
    if offset is None or OWN not in slot.words:
        return slot
    expression = substitute(slot.expression, {OWN: add(Name(OWN), offset.expression)})
    return replace(slot, expression=expression, words=(*slot.words, *offset.words))
