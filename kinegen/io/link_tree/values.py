"""Reads the numbers of a file in XML, and keeps account of those that are nearly something else.

In: texts of attributes. Out: exact expressions and directions; every change is a `Suspect`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import field
from fractions import Fraction

from kinegen.errors import RobotFileError, quote
from kinegen.io.link_tree.numbers import (
    GRID,
    NEAR_LENGTH,
    NOISE_LENGTH,
    PI_DIGITS,
    Printed,
    angle,
    angle_text,
    decimal_text,
    grid_angle,
    near_angle,
    printed,
    unit_of,
)
from kinegen.io.link_tree.records import ROTATIONS, Suspect, Vector, of_quaternion, simplified
from kinegen.io.messages import fail, within
from kinegen.model.expression_parser import Expression, Number
from kinegen.model.expression_values import scale
from kinegen.model.robot import Step
from kinegen.support.dataclass import dataclass

Quaternion = tuple[Fraction, Fraction, Fraction, Fraction]
_COARSEST = Fraction(1, 100)
"""Of directions: the largest last digit that says anything of a multiple of 15 degrees."""


@dataclass
class Values:
    """Reads numbers, and gathers what it finds odd about them; `snap` is as in `ReadOptions`."""

    snap: float | None
    suspects: list[Suspect] = field(default_factory=list)
    joint: str = ""
    line: int = 0
    where: str = ""

    @contextmanager
    def of(self, joint: str, where: str, line: int) -> Iterator[None]:
        """Read the numbers of one element."""
        before = self.joint, self.where, self.line
        self.joint, self.where, self.line = joint, where, line
        try:
            with within(where, line):
                yield
        finally:
            self.joint, self.where, self.line = before

    @contextmanager
    def at(self, line: int) -> Iterator[None]:
        """Read the numbers of an element inside that one."""
        before, self.line = self.line, line
        try:
            yield
        except RobotFileError as error:
            raise RobotFileError(error.message, error.path, error.line or line) from None
        finally:
            self.line = before

    def words(self, text: str, count: int, key: str) -> tuple[str, ...]:
        """Return the words of an attribute, of which there are so many."""
        found = tuple(text.split())
        if len(found) != count:
            plural = "" if count == 1 else "s"
            fail(f"{key}: expected {count} number{plural}, found {quote(text)}")
        return found

    def printed(self, text: str, key: str) -> Printed:
        """Return one number."""
        try_keep = self.snap == 0
        with within(key, self.line):
            return printed(text, keep=try_keep)

    def length(self, text: str, key: str) -> Fraction:
        """Return one length: every digit counts, but for the tail of a float."""
        number = self.printed(text, key)
        if number.tail:
            self._untail(number, key, turns=False)
        size = abs(number.value)
        if 0 < size < NOISE_LENGTH and self.snap:
            self._note(number, key, "0", size, changed=True)
            return Fraction(0)
        if 0 < size < NEAR_LENGTH:
            self._note(number, key, "0", size, changed=False)
        return number.value

    def lengths(self, text: str, key: str) -> Vector:
        """Return three lengths."""
        x, y, z = (self.length(word, f"{key}[{i}]") for i, word in enumerate(self.words(text, 3, key)))
        return x, y, z

    def angle(self, text: str, key: str, *, degrees: bool = False) -> Expression:
        """Return one angle, in radians, that turns something."""
        number = self.printed(text, key)
        if degrees:
            return self._in_degrees(number, key)
        share = None if self.snap == 0 else grid_angle(number, self.snap)
        if share is not None:
            gap = abs(number.value - share * PI_DIGITS)
            self._note(number, key, angle_text(share), gap, turns=True, changed=True)
            return angle(share)
        if number.tail:
            self._untail(number, key, turns=True)
        near = near_angle(number)
        if near is not None:
            gap = abs(number.value - near * PI_DIGITS)
            self._note(number, key, angle_text(near), gap, turns=True, changed=False)
        return Number(number.value)

    def _in_degrees(self, number: Printed, key: str) -> Expression:
        """Read degrees, which are exact as they are printed: no rounding lies between 90 and 89.99."""
        value, nearest = number.value, round(number.value / 15) * Fraction(15)
        gap = abs(value - nearest) * PI_DIGITS / 180
        near = 0 < gap < Fraction(1, 1000)
        if near:
            changed = bool(self.snap) and gap <= Fraction(self.snap or 0)
            self._note(number, key, f"{nearest} deg", gap, turns=True, changed=changed, degrees=True)
            value = nearest if changed else value
        return scale(Number(value))

    def bound(self, text: str, key: str, *, degrees: bool = False) -> Expression:
        """Return one limit of a joint; nothing is snapped, since no pose depends on it."""
        with within(key, self.line):
            value = printed(text, keep=self.snap == 0, largest=None).value
        return scale(Number(value)) if degrees else Number(value)

    def direction(self, text: str, key: str) -> Vector:
        """Read an axis, of any length but zero; one that differs from a special one by its last digits becomes that."""
        numbers = [self.printed(word, f"{key}[{i}]") for i, word in enumerate(self.words(text, 3, key))]
        values = [number.value for number in numbers]
        if not any(values):
            fail(f"{key}: the axis is zero; it has no direction")
        # The coordinate axis next to the direction.
        largest = max(range(3), key=lambda place: abs(values[place]))
        size = abs(values[largest])
        straight = [
            Fraction(int(math.copysign(1, values[place]))) if place == largest else Fraction(0) for place in range(3)
        ]
        aside = [place for place in range(3) if place != largest and values[place]]
        if not aside:
            if size != 1:
                self._rounded(numbers[largest], f"{key}[{largest}]", straight[largest])
            return _vector(straight)
        # The tangent of the angle between both, for small angles the angle.
        gap = max(abs(values[place]) for place in aside) / size
        if self.snap and gap <= Fraction(self.snap):
            self._tilted(text, key, straight, gap, numbers, changed=True)
            return _vector(straight)
        if gap < Fraction(1, 1000):
            self._tilted(text, key, straight, gap, numbers, changed=False)
        return _vector(values)

    def _untail(self, number: Printed, key: str, *, turns: bool) -> None:
        """Note a float without its tail."""
        gap = abs(Fraction(number.text) - number.value)
        exact, digits = decimal_text(number.value), gap / unit_of(number.text)
        self._note(number, key, exact, gap, turns=turns, changed=True, digits=digits)

    def _rounded(self, number: Printed, key: str, exact: Fraction) -> None:
        """Note an axis along a coordinate axis that is nearly of length one, such as 0.9999999."""
        gap = abs(number.value - exact)
        if gap <= number.unit:
            self._note(number, key, str(exact), Fraction(0), turns=True, changed=True, digits=gap / number.unit)

    def _tilted(
        self, text: str, key: str, exact: list[Fraction], gap: Fraction, numbers: list[Printed], *, changed: bool
    ) -> None:
        unit = min(number.unit for number in numbers)
        shown = Printed(" ".join(text.split()), Fraction(0), unit)
        self._note(shown, key, " ".join(map(str, exact)), gap, turns=True, changed=changed)

    def quaternion(self, text: str, key: str) -> tuple[Step, ...]:
        """Return a rotation by a quaternion w, x, y, z, judged as a rotation and not by its entries."""
        numbers = [self.printed(word, f"{key}[{i}]") for i, word in enumerate(self.words(text, 4, key))]
        w, x, y, z = (number.value for number in numbers)
        if not any((w, x, y, z)):
            fail(f"{key}: the quaternion is zero")
        # Entries without decimals, such as 0, say nothing of how the others were rounded.
        unit = max((number.unit for number in numbers if number.unit < 1), default=Fraction(1))
        near = _nearest_rotation((float(w), float(x), float(y), float(z)))
        angles, gap, worst = near
        shown = Printed(" ".join(text.split()), Fraction(0), unit)
        told = "rpy " + " ".join(angle_text(each) for each in angles)
        exact = simplified(Step(ROTATIONS[2 - i], angle(each)) for i, each in enumerate(reversed(angles)))
        plain = of_quaternion((w, x, y, z))
        if plain == exact:
            return exact
        by_digits = self.snap != 0 and unit <= _COARSEST and Fraction(worst) <= unit
        if by_digits or (self.snap and gap <= self.snap):
            self._note(shown, key, told, Fraction(gap), turns=True, changed=True, digits=Fraction(worst) / unit)
            return exact
        if gap < 1e-3:
            self._note(shown, key, told, Fraction(gap), turns=True, changed=False, digits=Fraction(worst) / unit)
        return plain

    def _note(
        self,
        number: Printed,
        key: str,
        exact: str,
        gap: Fraction,
        *,
        changed: bool,
        turns: bool = False,
        degrees: bool = False,
        digits: Fraction | None = None,
    ) -> None:
        counted = gap * 180 / PI_DIGITS if degrees else gap
        units = float(counted / number.unit) if digits is None else float(digits)
        where = f"{self.where}, {key}"
        self.suspects.append(
            Suspect(self.line, where, number.text, exact, units, float(gap), turns, self.joint, changed)
        )


def _vector(values: list[Fraction]) -> Vector:
    x, y, z = values
    return x, y, z


def _nearest_rotation(q: tuple[float, float, float, float]) -> tuple[tuple[Fraction, Fraction, Fraction], float, float]:
    """Find the rotation of angles in steps of 15 degrees that is nearest to a quaternion.

    Returns:
        Its roll, pitch and yaw as shares of pi, the angle between the two rotations in radians, and the greatest
        difference of their entries, where the quaternion has the length that it was given.
    """
    size = math.sqrt(sum(part * part for part in q))
    w, x, y, z = (part / size for part in q)
    # Near a pitch of 90 degrees roll and yaw turn about one axis; all of it is yaw.
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - x * z))))
    if abs(pitch) > math.pi / 2 - 1e-2:
        roll = 0.0
        yaw = math.atan2(-(2 * (x * y - w * z)), 1 - 2 * (x * x + z * z))
    else:
        roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
        yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    step = float(GRID) * math.pi
    angles = tuple(round(each / step) * GRID for each in (roll, pitch, yaw))
    # Both signs of a quaternion are the same rotation.
    exact = _as_quaternion([float(each) * math.pi for each in angles])
    dot = sum(a * b for a, b in zip(exact, (w, x, y, z), strict=True))
    exact = [part * math.copysign(size, dot) for part in exact]
    worst = max(abs(a - b) for a, b in zip(exact, q, strict=True))
    between = 2 * math.sqrt(sum((a - b) ** 2 for a, b in zip(exact, q, strict=True))) / size
    return (angles[0], angles[1], angles[2]), between, worst


def _as_quaternion(rpy: list[float]) -> list[float]:
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(each / 2), math.sin(each / 2)) for each in rpy)
    return [
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    ]
