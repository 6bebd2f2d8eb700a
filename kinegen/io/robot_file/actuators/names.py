"""The names in `actuators` looked up, and their expressions in the units of the kernels.

Every joint is driven once, every reading used, and nothing used before it is known.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import NoReturn

from kinegen.errors import quote
from kinegen.io.messages import expected, fail, within
from kinegen.io.robot_file.actuators.read import RawActuators, RawDrive, RawReading
from kinegen.io.robot_file.convert import MOVING, STILL
from kinegen.io.robot_file.expression_fields import ExpressionField
from kinegen.io.robot_file.parameters import RawParameter
from kinegen.model.expression_parser import (
    Atan2,
    Call,
    Expression,
    Name,
    Pi,
    Product,
    Sum,
    add,
    is_arc,
    multiply,
    rebuilt,
)
from kinegen.model.expression_values import DEGREE, HALF_TURN, RADIAN, Dimension
from kinegen.model.robot import JointType
from kinegen.support.dataclass import dataclass

TURNED = frozenset({"sin", "cos"})
"""Functions of an angle."""


@dataclass(frozen=True, slots=True)
class Degrees:
    """Converts the expressions of a file in degrees; one in radians needs none of it.

    `angles` are the names whose values are angles, in radians: joints, readings and parameters.
    Everything counts in degrees where an angle or a bare number is wanted: the value of a revolute joint, of a reading
    that is no length, and what sine and cosine take; there `asin`, `acos`, `atan` and `atan2` give degrees, and `pi` is
    half a turn. Where a length is wanted, as in the table, and inside of other functions, angles are in radians, as the
    kernels have them.
    """

    angles: frozenset[str]

    def convert(self, expression: Expression, dimension: Dimension) -> Expression:
        """Convert an expression whose value has some dimension."""
        match dimension:
            case Dimension.ANGLE:
                return _scaled(self._in_degrees(expression))
            case Dimension.NUMBER:
                return self._in_degrees(expression)
            case _:
                return self._plain(expression)

    def _in_degrees(self, expression: Expression) -> Expression:
        """Return the same number of degrees, with every name in radians."""
        match expression:
            case Name(name) if name in self.angles:
                return multiply(RADIAN, expression)
            case Pi():
                return HALF_TURN
            case Call() | Atan2() if is_arc(expression):
                return multiply(RADIAN, self._plain(expression))
            case Call(function, _) if function in TURNED:
                return self._plain(expression)
        return rebuilt(expression, self._in_degrees)

    def _plain(self, expression: Expression) -> Expression:
        """Return the same number; only what sine and cosine take is converted."""
        match expression:
            case Call(function, argument) if function in TURNED:
                return Call(function, self.convert(argument, Dimension.ANGLE))
        return rebuilt(expression, self._plain)


def _scaled(expression: Expression) -> Expression:
    """Convert degrees to radians term by term, so that what was multiplied by `RADIAN` is as it was."""
    match expression:
        case Sum(terms):
            return add(*(_scaled(term) for term in terms))
        case Product(factors) if inner := [factor for factor in factors if isinstance(factor, Sum)]:
            rest = list(factors)
            rest.remove(inner[0])
            return multiply(*rest, _scaled(inner[0]))
    return multiply(DEGREE, expression)


_OWN = frozenset({"length", "angle"})
"""Entries in which the reading of the form stands."""

_FOLLOWING = frozenset({"offset", "offsets", "value"})
"""Entries in which earlier joints may stand; they measure what the joint does."""


def with_names(raw: RawActuators, parameters: tuple[RawParameter, ...], types: Mapping[str, JointType]) -> RawActuators:
    """Look every name up, and give every expression its dimension."""
    names = _Names(raw, {parameter.name: parameter.line for parameter in parameters}, types)
    for reading in raw.readings:
        names.check_reading(reading)
    drives = tuple(names.drive(drive) for drive in raw.drives)
    names.check_complete()
    return replace(raw, drives=drives, inverse=tuple((name, names.inverse(name, slot)) for name, slot in raw.inverse))


def formula_slots(raw: RawActuators) -> Iterator[tuple[str, ExpressionField]]:
    """Return every expression of `actuators`, with what messages call its entry."""
    for reading in raw.readings:
        yield from ((reading.where, slot) for slot in reading.limits or ())
    for drive in raw.drives:
        yield from ((drive.where, slot) for slots in drive.slots.values() for slot in slots)
    yield from (("actuators: inverse", slot) for _, slot in raw.inverse)


class _Names:
    """The names of a file, and which joints the entries so far have driven."""

    def __init__(self, raw: RawActuators, parameters: Mapping[str, int], types: Mapping[str, JointType]) -> None:
        self._readings = {reading.name: reading for reading in raw.readings}
        self._below = {joint: drive.line for drive in reversed(raw.drives) for joint in drive.joints}
        self._parameters = parameters
        self._types = types
        self._moving = tuple(name for name, kind in types.items() if kind in MOVING)
        self._driven: dict[str, int] = {}
        self._used: set[str] = set()
        self._formed: dict[str, int] = {}
        self._line = raw.line

    def check_reading(self, reading: RawReading) -> None:
        """Check that a reading has a name of its own, and constant limits."""
        with within(reading.where, reading.line):
            if reading.name in self._types:
                fail("a joint has this name too; actuators have names of their own")
            if reading.name in self._parameters:
                fail(f"a parameter has this name too (line {self._parameters[reading.name]})")
            for slot in reading.limits or ():
                self._check(slot, (), ())

    def drive(self, drive: RawDrive) -> RawDrive:
        """Check one entry, and give its expressions the dimension of the joint."""
        with within(drive.where, drive.line):
            for joint in drive.joints:
                self._check_joint(joint)
            for name in drive.actuators:
                if name not in self._readings:
                    fail(f"there is no actuator {quote(name)} {expected(name, self._readings)}")
            self._used.update(drive.actuators)
            self._formed |= dict.fromkeys(drive.actuators, drive.line)
            slots = {key: self._slots(drive, key, slots) for key, slots in drive.slots.items()}
            if value := drive.slot("value"):
                self._used.update(self._readings.keys() & set(value.words))
            self._driven |= dict.fromkeys(drive.joints, drive.line)
        return replace(drive, slots=slots)

    def _slots(self, drive: RawDrive, key: str, slots: tuple[ExpressionField, ...]) -> tuple[ExpressionField, ...]:
        readings = tuple(self._readings) if key == "value" else drive.actuators if key in _OWN else ()
        for slot in slots:
            for word in slot.words:
                if word in drive.joints:
                    fail(
                        f"{slot.label}: '{word}' is what the entry drives; only joints above it are allowed here",
                        slot.line,
                    )
            self._check(slot, tuple(self._driven) if key in _FOLLOWING else (), readings, ordered=key in _FOLLOWING)
        if key not in _FOLLOWING:
            return slots
        kinds = (self._types[joint] for joint in drive.joints)
        return tuple(replace(slot, dimension=dimension_of(kind)) for slot, kind in zip(slots, kinds, strict=True))

    def _check_joint(self, joint: str) -> None:
        if joint not in self._types:
            fail(f"there is no joint {quote(joint)} {expected(joint, self._moving)}")
        if joint not in self._moving:
            fail(f"'{joint}' has no variable of its own ({STILL[self._types[joint]]})")
        if joint in self._driven:
            fail(f"'{joint}' is driven twice (first on line {self._driven[joint]})")

    def check_complete(self) -> None:
        """Check that every joint is driven and every reading used."""
        for joint in self._moving:
            if joint not in self._driven:
                fail(f"actuators: joint '{joint}' has no actuator; add an entry {{joint: {joint}, ...}}", self._line)
        for reading in self._readings.values():
            if reading.name not in self._used:
                fail(f"{reading.where}: no joint follows it; use it or remove it", reading.line)

    def inverse(self, name: str, slot: ExpressionField) -> ExpressionField:
        """Check one expression of `inverse`."""
        with within("actuators: inverse", slot.line):
            if name not in self._readings:
                fail(f"there is no actuator {quote(name)} {expected(name, self._readings)}")
            if name in self._formed:
                fail(f"the form on line {self._formed[name]} gives '{name}' already; leave it out")
            self._check(slot, self._moving, ())
        return replace(slot, dimension=self._readings[name].dimension)

    def _check(
        self, slot: ExpressionField, joints: tuple[str, ...], readings: tuple[str, ...], *, ordered: bool = False
    ) -> None:
        """Refuse a name that nothing defines, or that has no value where the expression stands."""
        with within(slot.label, slot.line):
            for word in slot.words:
                if word in self._parameters or word in joints or word in readings:
                    continue
                if ordered and word in self._below:
                    fail(f"joint '{word}' is driven on line {self._below[word]}; only joints above it are allowed here")
                self._refuse(word, joints, readings)

    def _refuse(self, word: str, joints: tuple[str, ...], readings: tuple[str, ...]) -> NoReturn:
        if word in self._types and word not in self._moving:
            fail(f"joint '{word}' has no variable of its own ({STILL[self._types[word]]})")
        if word in self._types or word in self._readings:
            kind = "joint" if word in self._types else "actuator"
            here = ", ".join(quote(name) for name in (*joints, *readings))
            fail(f"{kind} '{word}' is not allowed here " + (f"(only {here})" if here else "; this entry is constant"))
        known = (*readings, *joints, *self._parameters)
        fail(f"undefined name {quote(word)} {expected(word, known)}" if known else f"undefined name {quote(word)}")


def dimension_of(kind: JointType) -> Dimension:
    """Return what the variable of a joint measures."""
    return Dimension.LENGTH if kind is JointType.PRISMATIC else Dimension.ANGLE
