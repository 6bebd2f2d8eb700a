"""The bounds of a program's results, entry by entry and summed up for each frame."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal, localcontext

from kinegen.ir.bounds.analysis import analyse
from kinegen.ir.bounds.graph import Ranges
from kinegen.ir.bounds.numbers import UPWARDS, NumberType, UnboundedError
from kinegen.ir.program import Operator, Program
from kinegen.outputs import Kind, Quantity

_PLACES = (Kind.POSE, Kind.FRAMES, Kind.POSITION)
"""Kinds of results that say where frames are."""

_WITHOUT_RULES = (Operator.SQRT, Operator.ATAN2, Operator.SELECT_LT)


@dataclass(frozen=True, slots=True)
class FrameBound:
    """How far the result for one frame can be off.

    Attributes:
        frame: Its name.
        position: Error of x, y and z, in the length unit of the program.
        rotation: Largest error of an entry of the rotation; None where the program computes positions alone.
    """

    frame: str
    position: tuple[float, float, float]
    rotation: float | None


@dataclass(frozen=True, slots=True)
class ErrorBound:
    """How far the results of a program can be off; infinite if they may overflow, or if there are no rules for it.

    Attributes:
        quantity: What the program computes.
        entries: Bound for each output of the program, in its order.
        frames: The same summed up for each frame, where poses or positions are computed.
    """

    quantity: Quantity
    entries: tuple[float, ...]
    frames: tuple[FrameBound, ...]

    @property
    def position(self) -> tuple[float, float, float]:
        """The largest errors of x, y and z among all frames."""
        x, y, z = (max(column) for column in zip(*(frame.position for frame in self.frames), strict=True))
        return x, y, z

    @property
    def rotation(self) -> float | None:
        """The largest error of an entry of a rotation among all frames."""
        return max((frame.rotation for frame in self.frames if frame.rotation is not None), default=None)


def has_rules(program: Program) -> bool:
    """Whether there are rules for all operations of a program; roots, arc tangents and selections have none."""
    return not program.uses(*_WITHOUT_RULES)


def bound(program: Program, ranges: Ranges, real: NumberType) -> ErrorBound:
    """Prove bounds on the errors of a program.

    Args:
        program: The program.
        ranges: Where its inputs lie.
        real: The number type it is evaluated in.

    Returns:
        Bounds that hold for all inputs in the ranges for which no angle leaves the range of the sine and cosine; see
        the package for what exactly is proven.
    """
    with localcontext(UPWARDS):
        try:
            entries = tuple(_float(output.error) for output in analyse(program, ranges, real))
        except UnboundedError:
            entries = (math.inf,) * len(program.outputs)
    frames = tuple(_frames(program, entries)) if program.quantity.kind in _PLACES else ()
    return ErrorBound(program.quantity, entries, frames)


def _frames(program: Program, entries: tuple[float, ...]) -> Iterator[FrameBound]:
    size = len(entries) // len(program.frames)
    for index, name in enumerate(program.frames):
        yield _frame(name, entries[index * size : (index + 1) * size])


def _float(number: Decimal) -> float:
    """The nearest double that is not smaller."""
    nearest = float(number)
    return nearest if Decimal(nearest) >= number else math.nextafter(nearest, math.inf)


def _frame(name: str, entries: tuple[float, ...]) -> FrameBound:
    if len(entries) == 3:
        return FrameBound(name, (entries[0], entries[1], entries[2]), None)
    rotation = max(entry for place, entry in enumerate(entries) if place % 4 != 3)
    return FrameBound(name, (entries[3], entries[7], entries[11]), rotation)
