"""Raw actuators -> the records of the model, in radians and the file's length unit, with every value checked.

Numbers are computed for checks alone; the exact expressions go into the robot.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from decimal import Context, Decimal, localcontext

from kinegen.io.messages import fail, within
from kinegen.io.robot_file import keys
from kinegen.io.robot_file.actuators.names import Degrees, dimension_of
from kinegen.io.robot_file.actuators.read import RawActuators, RawDrive
from kinegen.io.robot_file.convert import Converter, split
from kinegen.io.robot_file.expression_fields import ExpressionField
from kinegen.model.actuators import (
    Actuators,
    Assembly,
    Coupling,
    Drive,
    Formula,
    FourBar,
    LinkageError,
    Reading,
    Triangle,
    assemble,
)
from kinegen.model.expression_parser import (
    ZERO,
    Expression,
    ExpressionError,
    evaluate,
    multiply,
    names,
    number,
    parts_of,
    power,
)
from kinegen.model.expression_values import DEGREE, FLOAT64, MAX_VALUE, Dimension, checked_value, is_zero
from kinegen.model.robot import JointType
from kinegen.support.dataclass import dataclass


def check_constants(expression: Expression, values: Mapping[str, Decimal]) -> None:
    """Refuse a part in which neither joint nor reading stands and that has no value or a huge one."""
    if any(name not in values for name in names(expression)):
        for part in parts_of(expression):
            check_constants(part, values)
        return
    try:
        value = evaluate(expression, {name: float(value) for name, value in values.items()}, FLOAT64)
    except ZeroDivisionError:
        raise ExpressionError("it divides by zero") from None
    except ValueError:
        raise ExpressionError("it holds a root, asin or acos of a number that has none") from None
    except OverflowError:
        value = math.inf
    if not abs(value) <= MAX_VALUE:
        raise ExpressionError(f"a value in it is too large (at most {MAX_VALUE:.0e})")


def is_singular(matrix: list[list[Decimal]]) -> bool:
    """Tell whether a square matrix has no inverse, by elimination with the largest pivot of each column."""
    with localcontext(Context(prec=50)):
        return _eliminates([list(row) for row in matrix])


def _eliminates(rows: list[list[Decimal]]) -> bool:
    """Tell whether elimination meets a column of zeros; `rows` is used up."""
    for column in range(len(rows)):
        pivot = max(range(column, len(rows)), key=lambda row: abs(rows[row][column]))
        if is_zero(rows[pivot][column]):
            return True
        rows[column], rows[pivot] = rows[pivot], rows[column]
        for row in range(column + 1, len(rows)):
            factor = rows[row][column] / rows[column][column]
            rows[row] = [entry - factor * above for entry, above in zip(rows[row], rows[column], strict=True)]
    return False


def resolve_actuators(raw: RawActuators, converter: Converter) -> Actuators:
    """Make the records of actuators whose names are known to exist."""
    readings: list[Reading] = []
    for index, reading in enumerate(raw.readings):
        with within(reading.where, reading.line):
            limits = converter.bounds(reading.limits, "leave them out") if reading.limits else None
        readings.append(Reading(reading.name, index, reading.dimension, limits, reading.line))
    resolver = _Resolver(converter, {reading.name: reading for reading in readings})
    drives = tuple(resolver.drive(drive) for drive in raw.drives)
    return Actuators(tuple(readings), drives, tuple((name, resolver.inverse(slot)) for name, slot in raw.inverse))


@dataclass(frozen=True, slots=True)
class _Resolver:
    """Converts entry by entry."""

    converter: Converter
    readings: dict[str, Reading]

    def drive(self, raw: RawDrive) -> Drive:
        """Convert one entry."""
        with within(raw.where, raw.line):
            match raw.form:
                case "gear" | "coupling":
                    return self._coupling(raw)
                case "linear_actuator":
                    return self._triangle(raw)
                case "four_bar":
                    return self._four_bar(raw)
            return self._formula(raw)

    def inverse(self, slot: ExpressionField) -> Expression:
        """Convert one expression of `inverse`."""
        with within("actuators: inverse", slot.line):
            return self._free(slot)

    def _free(self, slot: ExpressionField | None) -> Expression:
        """Return an expression in which joints and readings may stand in any way."""
        if slot is None:
            return ZERO
        known = [(name, parameter.dimension) for name, parameter in self.converter.parameters.items()]
        known += [(name, reading.dimension) for name, reading in self.readings.items()]
        known += [(name, dimension_of(kind)) for name, kind in self.converter.types.items()]
        with within(slot.label, slot.line):
            found = slot.expression
            if self.converter.degrees:
                angles = frozenset(name for name, dimension in known if dimension is Dimension.ANGLE)
                found = Degrees(angles).convert(found, slot.dimension)
            for word in slot.words:
                if word not in names(found) and word not in self.converter.parameters:
                    fail(f"'{word}' is multiplied by zero")
            check_constants(found, self.converter.values)
        return found

    def _linear(self, slot: ExpressionField | None, reading: Reading) -> tuple[Expression, Expression]:
        """Return factor and rest of what is linear in one reading; those of the reading itself if there is none."""
        if slot is None:
            return number(1), ZERO
        angles = frozenset(name for name, p in self.converter.parameters.items() if p.dimension is Dimension.ANGLE)
        turns = reading.dimension is Dimension.ANGLE
        kinds = {reading.name: JointType.REVOLUTE if turns else JointType.PRISMATIC}
        with within(slot.label, slot.line):
            try:
                factors, rest = split(slot, kinds, angles, degrees=self.converter.degrees)
            except ExpressionError:
                fail(f"it must be linear in '{reading.name}', as in 2*{reading.name} + 1")
            factor = factors.get(reading.name, ZERO)
            checked_value(rest, self.converter.values)
            if is_zero(checked_value(factor, self.converter.values)):
                fail(f"it must contain '{reading.name}', as in 2*{reading.name} + 1")
        return factor, rest

    def _dimension(self, joint: str) -> Dimension:
        return dimension_of(self.converter.types[joint])

    def _formula(self, raw: RawDrive) -> Formula:
        slot = raw.slots["value"][0]
        value = self._free(slot)
        inside = tuple(name for name in names(value) if name not in self.converter.parameters)
        if not inside:
            fail("its value contains neither an actuator nor a joint, so the joint cannot move", slot.line)
        return Formula(raw.joints[0], tuple(name for name in inside if name in self.readings), value, raw.line)

    def _coupling(self, raw: RawDrive) -> Coupling:
        matrix = self._gear(raw) if raw.form == "gear" else self._matrix(raw)
        rows = []
        for joint, row in zip(raw.joints, matrix, strict=True):
            scaled = zip(row, raw.actuators, strict=True)
            rows.append(tuple(self._factor(joint, entry, self.readings[name]) for entry, name in scaled))
        slots = raw.slots.get("offsets") or raw.slots.get("offset") or (None,) * len(raw.joints)
        offsets = tuple(self._free(slot) for slot in slots)
        return Coupling(raw.joints, raw.actuators, tuple(rows), offsets, raw.line)

    def _factor(self, joint: str, entry: Expression, reading: Reading) -> Expression:
        """Return what an entry of the matrix is in the units of the kernels."""
        wanted = self._dimension(joint)
        if reading.dimension not in (wanted, Dimension.NUMBER) and entry != ZERO:
            moves, reads = ("turns", "a length") if wanted is Dimension.ANGLE else ("slides", "an angle")
            fail(f"'{joint}' {moves}, but '{reading.name}' reads {reads}; write the joint as value: ... instead")
        if self.converter.degrees and wanted is Dimension.ANGLE and reading.dimension is Dimension.NUMBER:
            return multiply(DEGREE, entry)
        return entry

    def _gear(self, raw: RawDrive) -> tuple[tuple[Expression, ...], ...]:
        slot = raw.slots["ratio"][0]
        ratio = self.converter.slot(slot)
        if checked_value(ratio, self.converter.values) <= 0 or is_zero(checked_value(ratio, self.converter.values)):
            fail("ratio: it must be positive; sign: -1 reverses a joint", slot.line)
        return ((multiply(number(raw.sign), power(ratio, -1)),),)

    def _matrix(self, raw: RawDrive) -> tuple[tuple[Expression, ...], ...]:
        count, slots = len(raw.actuators), raw.slots["matrix"]
        if count != len(raw.joints):
            joints = f"{len(raw.joints)} joint{'s' if len(raw.joints) > 1 else ''}"
            fail(f"{joints} cannot be coupled to {count} actuator{'s' if count > 1 else ''}; the matrix is square")
        entries = [self._constant(slot) for slot in slots]
        rows = tuple(tuple(entries[count * i : count * i + count]) for i in range(count))
        if is_singular([[checked_value(entry, {}) for entry in row] for row in rows]):
            fail("the matrix is singular, so different readings give the same joints", slots[0].line)
        return rows

    def _constant(self, slot: ExpressionField) -> Expression:
        return self.converter.closed(slot)

    def _triangle(self, raw: RawDrive) -> Triangle:
        reading = self._turned(raw)
        if reading.dimension is Dimension.ANGLE and "length" not in raw.slots:
            fail(f"'{reading.name}' reads an angle; give the length it makes, as in length: 0.005*{reading.name} + 0.3")
        a, b = (self.converter.slot(slot) for slot in raw.slots["sides"])
        length = self._linear(raw.slot("length"), reading)
        sides = tuple(checked_value(side, self.converter.values) for side in (a, b))
        if min(sides) <= 0:
            fail("sides: both must be longer than zero", raw.slots["sides"][0].line)
        # Within its limits the actuator has to close the triangle.
        for limit, value in self._at_limits(reading, length):
            low, high = abs(sides[0] - sides[1]), sides[0] + sides[1]
            if value < low - Decimal("1e-12") or value > high + Decimal("1e-12"):
                closes = (
                    f"sides of {sides[0]:.4g} and {sides[1]:.4g} close a triangle only from {low:.4g} to {high:.4g}"
                )
                at = f"at {reading.name} = {self._shown(reading, limit)}"
                beyond = max(low - value, value - high)
                fail(f"{at} the actuator is {value:.4g} long, {beyond:.2g} beyond its triangle: {closes}")
        return Triangle(raw.joints[0], reading.name, (a, b), length, raw.sign, self._free(raw.slot("offset")), raw.line)

    def _turned(self, raw: RawDrive) -> Reading:
        """Return the reading of a linkage, whose joint turns."""
        if self._dimension(raw.joints[0]) is not Dimension.ANGLE:
            fail(f"a {raw.form} needs a revolute joint, but '{raw.joints[0]}' is prismatic")
        return self.readings[raw.actuators[0]]

    def _at_limits(self, reading: Reading, linear: tuple[Expression, Expression]) -> list[tuple[Decimal, Decimal]]:
        """Return both limits, and the value there of what is linear in the reading."""
        factor, rest = (checked_value(part, self.converter.values) for part in linear)
        limits = [checked_value(limit, {}) for limit in reading.limits or ()]
        return [(limit, factor * limit + rest) for limit in limits]

    def _shown(self, reading: Reading, value: Decimal) -> str:
        """Return a reading in the unit of the file."""
        degrees = self.converter.degrees and reading.dimension is Dimension.ANGLE
        return f"{math.degrees(value):.4g}" if degrees else f"{value:.4g}"

    def _four_bar(self, raw: RawDrive) -> FourBar:
        reading = self._turned(raw)
        ground, crank, coupler, rocker = bars = [self._constant(raw.slots[key][0]) for key in keys.BARS]
        angle = self._linear(raw.slot("angle"), reading)
        # The bars close only where none is as long as the others together.
        lengths = [checked_value(bar, {}) for bar in bars]
        for key, length in zip(keys.BARS, lengths, strict=True):
            if length <= 0:
                fail(f"{key}: it must be longer than zero", raw.slots[key][0].line)
        longest = max(lengths)
        if 2 * longest >= sum(lengths):
            key = keys.BARS[lengths.index(longest)]
            excess = 2 * longest - sum(lengths)
            compared = f"{excess:.2g} longer than" if excess else "as long as"
            fail(f"the bars never close: the {key}, {longest:.4g}, is {compared} the other three together")
        # The rocker of a parallelogram stands as its crank does, so nothing has to be followed.
        parallelogram = not raw.crossed and is_zero(lengths[0] - lengths[2]) and is_zero(lengths[1] - lengths[3])
        assembly = Assembly(1, (0, 0)) if parallelogram else self._assembly(raw, reading, angle, lengths)
        return FourBar(
            joint=raw.joints[0],
            actuator=reading.name,
            bars=(ground, crank, coupler, rocker),
            angle=angle,
            crossed=raw.crossed,
            parallelogram=parallelogram,
            ahead=assembly.ahead,
            turns=assembly.turns,
            sign=raw.sign,
            offset=self._free(raw.slot("offset")),
            line=raw.line,
        )

    def _assembly(
        self, raw: RawDrive, reading: Reading, angle: tuple[Expression, Expression], lengths: list[Decimal]
    ) -> Assembly:
        limits = self._at_limits(reading, angle)
        if not limits:
            reason = "within which the bars close and the rocker does not reverse"
            fail(f"a four_bar whose opposite bars differ needs limits of '{reading.name}', {reason}")
        bars = (float(lengths[0]), float(lengths[1]), float(lengths[2]), float(lengths[3]))
        (low, first), (high, last) = limits
        try:
            return assemble(bars, (float(first), float(last)), crossed=raw.crossed)
        except LinkageError as error:
            share = Decimal((error.angle - float(first)) / float(last - first))
            fail(f"at {reading.name} = {self._shown(reading, low + share * (high - low))} {error}")
