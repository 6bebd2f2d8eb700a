"""What dimensions say: the symbol of an entry, what the file has there, and its value in the units of the file."""

from __future__ import annotations

import math
import re

from kinegen.pictures.skeleton import Place
from kinegen.robot.model import Convention, Robot
from kinegen.textbook.notation import TableText
from kinegen.textbook.table import Table, read_table

_LETTERS = {"theta": "θ", "alpha": "α", "beta": "β", "a": "a", "d": "d"}
_LOWER = str.maketrans("0123456789-", "₀₁₂₃₄₅₆₇₈₉₋")
_NUMBER = re.compile(r"-?[0-9.]+\Z")


def lowered(index: int) -> str:
    """A number as an index."""
    return str(index).translate(_LOWER)


class Labels:
    """The texts of all dimensions of a robot.

    Args:
        robot: The robot.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.table: Table = read_table(robot)
        self.rows = {row.name: row for row in self.table.rows}
        self.steps = {frame.name: frame.steps for frame in self.table.frames}

    def of(self, place: Place) -> str:
        """Such as `a₂ = 0.4318 m`, `θ₁ = q1 + 90° = 120°`, or `Tx = 20 mm` in an elementary sequence."""
        parts = [self._symbol(place), self._written(place), self._value(place)]
        kept = [part for number, part in enumerate(parts) if part and part not in parts[:number]]
        return " = ".join(kept)

    def _symbol(self, place: Place) -> str:
        """The letter and index of the convention's books; alpha and a of a modified table are those of i-1."""
        row = self.rows.get(place.frame)
        if row is None or not place.move.entry:
            return place.move.kind.value
        before = row.convention is Convention.MODIFIED and place.move.entry in ("a", "alpha")
        return _LETTERS[place.move.entry] + lowered(row.number - before)

    def _written(self, place: Place) -> str:
        """The entry as the file has it, unless it is only a number or the symbol itself."""
        row = self.rows.get(place.frame)
        steps = row.steps if row is not None else self.steps.get(place.frame, ())
        if place.move.entry and row is not None:
            sum_ = row.entries[self.table.columns.index(place.move.entry)]
        elif place.number < len(steps):
            sum_ = steps[place.number].value
        else:
            return ""
        text = "" if sum_ is None else TableText().entry(sum_)
        plain = self._symbol(place).translate(str.maketrans("₀₁₂₃₄₅₆₇₈₉", "0123456789"))
        if _NUMBER.match(text) or text == plain or len(text) > 24:
            return ""
        text = re.sub(r"\bpi\b", "π", text.replace("*", "·"))
        return re.sub(r"([+-] [0-9.]+)\Z", r"\1°", text) if self._in_degrees(place) else text

    def _in_degrees(self, place: Place) -> bool:
        return place.move.kind.is_rotation and self.robot.units.angle == "deg"

    def _value(self, place: Place) -> str:
        value = place.move.value
        if self._in_degrees(place):
            return f"{_plain(math.degrees(value))}°"
        return f"{_plain(value)} {'rad' if place.move.kind.is_rotation else self.robot.units.length}"


def _plain(value: float) -> str:
    """Six digits, or all before the point, without an exponent up to 1e12; a minus sign as printers have it."""
    text = f"{value:.6g}" if abs(value) < 1e6 else f"{value:.12g}"
    return text.replace("-", "\u2212") if float(text) else "0"
