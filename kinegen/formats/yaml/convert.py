"""Raw rows and frames -> the records of the model, in radians and the file's length unit, with every value checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from decimal import Decimal

from kinegen.formats.messages import fail, within
from kinegen.formats.yaml.motion import MOVING
from kinegen.formats.yaml.slots import OWN, RawFrame, RawRow, RawStep, Slot
from kinegen.formats.yaml.split import split
from kinegen.robot.dimension import Dimension
from kinegen.robot.expressions import Expression, Name, add, arcs, names, substitute
from kinegen.robot.model import Frame, JointType, JointVariable, Parameter, Row, Step
from kinegen.robot.units import join
from kinegen.robot.values import check_roots, checked_value, is_zero


@dataclass(frozen=True, slots=True)
class Converter:
    """Everything that the conversion of a slot depends on.

    Attributes:
        types: Type of each joint.
        parameters: Closed parameters, by name.
        values: Their values.
        degrees: Whether the angles of the file count in degrees.
    """

    types: Mapping[str, JointType]
    parameters: Mapping[str, Parameter]
    values: Mapping[str, Decimal]
    degrees: bool

    def slot(self, slot: Slot, joint: str | None = None) -> Expression:
        """Convert one slot.

        Args:
            slot: The slot, whose names are known to exist.
            joint: Name of its row, which `q` stands for.
        """
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
        """The joint vector."""
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

    def bounds(self, limits: tuple[Slot, Slot], remedy: str) -> tuple[Expression, Expression]:
        """Convert limits, which are constant; `remedy` says what to do where nothing lies between them."""
        low, high = (self.closed(slot) for slot in limits)
        with within("limits", limits[0].line):
            if is_zero(checked_value(low, {}) - checked_value(high, {})):
                fail(f"the two are equal; {remedy}")
            if checked_value(low, {}) > checked_value(high, {}):
                fail("the lower limit exceeds the upper limit")
        return low, high

    def closed(self, slot: Slot) -> Expression:
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


def _moved(slot: Slot, offset: Slot | None) -> Slot:
    """A slot whose own variable, if it has one, is q + offset."""
    if offset is None or OWN not in slot.words:
        return slot
    expression = substitute(slot.expression, {OWN: add(Name(OWN), offset.expression)})
    return replace(slot, expression=expression, words=(*slot.words, *offset.words))
