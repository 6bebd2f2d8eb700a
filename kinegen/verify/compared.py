"""One comparison: what the reference says at the inputs of a kernel, and how far the kernel is from it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from kinegen.outputs import Array, Quantity
from kinegen.robot.model import Robot
from kinegen.verify.comparison import Comparison
from kinegen.verify.expectation import Expectation, expect
from kinegen.verify.known import Known
from kinegen.verify.samples import FloatArray, input_samples
from kinegen.verify.tolerances import accepted_error
from kinegen.verify.ways import Arrays


class Store:
    """The reference at the inputs of all kernels of one number type, each asked once."""

    def __init__(self, robot: Robot, dtype: Any, *, exact: bool) -> None:
        self._robot, self._dtype, self._exact = robot, dtype, exact
        self._known: dict[Any, Known] = {}

    def expect(self, quantity: Quantity, arrays: Sequence[Array], points: FloatArray) -> tuple[Arrays, Expectation]:
        """The inputs of a kernel, and what it must return for them."""
        key = len(points), *(array.name for array in arrays)
        known = self._known.get(key)
        if known is None:
            values = input_samples(self._robot, arrays, points)
            rounded = {name: value.astype(self._dtype).astype(np.float64) for name, value in values.items()}
            known = self._known[key] = Known(self._robot, rounded, exact=self._exact)
        return tuple(known.inputs[array.name].astype(self._dtype) for array in arrays), expect(known, quantity)


def compare(
    expectation: Expectation, target: str, results: Arrays, real: str, *, row: str = "", more: float = 0.0
) -> Comparison:
    """Hold the results of a kernel against what it must return.

    Args:
        expectation: What it must return.
        target: The kernel and how it was called, for people.
        results: What it returned, N configurations each.
        real: Its number type.
        row: What it counts as in a report.
        more: What is accepted beyond the usual error, relative as that one is.
    """
    known = expectation.known
    position, rotation = expectation.errors(results)
    relative = accepted_error(known.robot, real) + more
    severity = np.maximum(position / expectation.length_scale, rotation / expectation.number_scale)
    place, column = np.unravel_index(np.argmax(np.nan_to_num(severity, nan=np.inf)), severity.shape)
    return Comparison(
        target=target,
        quantity=expectation.quantity,
        poses=known.count,
        position_error=float(position.max()),
        rotation_error=float(rotation.max()),
        position_tolerance=relative * expectation.length_scale,
        rotation_tolerance=relative * expectation.number_scale,
        worst=tuple(float(entry) for entry in known.joints[place]),
        frame=expectation.frames[int(column)],
        real=real,
        row=row,
    )
