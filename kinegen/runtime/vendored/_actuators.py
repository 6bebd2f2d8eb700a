"""What the actuators of a robot can read. It needs NumPy alone."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._engines import real_array

_ROUNDINGS = 8
"""So many units in the last place of its bound may a reading be beyond it, as the inverse of an arm at a limit is."""


class ReadingCheck:
    """Refuses readings that no actuator can have, so that a kernel is not asked for what comes out as NaN.

    Readings that are coupled are each held to their own range. One that rounding moved beyond a bound is brought to it.

    What passes comes back, and goes to a kernel: `fk_actuators(check_actuators(readings))`.

    Args:
        names: Names of the actuators, in the order of the actuator vector.
        ranges: Lowest and highest reading of each, infinite where there is none.
        units: Unit of each; empty for a bare number.
    """

    def __init__(self, names: tuple[str, ...], ranges: tuple[tuple[float, float], ...], units: tuple[str, ...]) -> None:
        self._names, self._ranges, self._units = names, ranges, units

    def __call__(self, actuators: ArrayLike) -> NDArray[Any]:
        """Check one actuator vector or a batch.

        Args:
            actuators: Readings, shape (..., number of actuators).

        Returns:
            The same readings as an array; those that rounding moved beyond a bound, which they then have.

        Raises:
            ValueError: If one of them is out of range or not a finite number, naming the first such actuator; or if the
                shape is another.
            TypeError: If they are not real numbers.
        """
        array = real_array("check_actuators", "actuators", actuators)
        if array.shape[-1:] != (len(self._names),):
            raise ValueError(f"actuators has shape {array.shape}, expected (..., {len(self._names)})")
        # A bound in single precision is no tighter for readings in single precision.
        kind: np.dtype[Any] = array.dtype if array.dtype.kind == "f" else np.dtype(float)
        low, high = np.asarray(self._ranges, dtype=kind).T
        inside = (array >= low) & (array <= high)
        if inside.all() and np.isfinite(array).all():
            return array
        sizes = np.where(np.isfinite([low, high]), np.abs([low, high]), 0).max(axis=0)
        room = _ROUNDINGS * np.finfo(kind).eps * sizes
        # No range holds an infinite reading, nor one that is not a number.
        outside = ~(np.isfinite(array) & (array >= low - room) & (array <= high + room))
        if outside.any():
            self._refuse(array, tuple(int(entry) for entry in np.argwhere(outside)[0]))
        clipped: NDArray[Any] = np.clip(array, low, high)
        return clipped

    def _refuse(self, array: NDArray[Any], place: tuple[int, ...]) -> None:
        index = place[-1]
        unit = f" {self._units[index]}" if self._units[index] else ""
        low, high = self._ranges[index]
        where = f" at [{', '.join(map(str, place[:-1]))}]" if len(place) > 1 else ""
        reading = float(array[place])
        found = f"actuator '{self._names[index]}' reads {reading:.6g}{unit}{where}"
        if math.isinf(low) and math.isinf(high):
            raise ValueError(f"{found}, which is not a finite number")
        beyond = max(low - reading, reading - high)
        # A reading that rounds to the bound beside it would hide the reason.
        by = f", {beyond:.2g}{unit} beyond" if math.isfinite(beyond) else ""
        raise ValueError(f"{found}{by}; its range is {low:.6g} to {high:.6g}{unit}")
