"""The runtime parameters of a call: one set for all configurations, or arrays that broadcast with the batch.

It needs NumPy alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from numpy.typing import NDArray

from ._engines import real_array

Values = float | NDArray[Any]
"""The values of one parameter: a number for all configurations, or an array (...) that broadcasts with the batch."""


def checked_params(name: str, params: Any, usual: Any) -> Any:
    """Runtime parameters for a call: those given, if they are the package's `Params`, or else the usual ones."""
    if usual is None and isinstance(params, dict) and not params:
        return None  # all values of a robot that has no runtime parameters
    if params is not None and type(params) is not type(usual):
        if usual is None:
            raise TypeError(f"{name}: params is given, but the robot has no runtime parameters")
        expected = type(usual).__qualname__
        raise TypeError(f"{name}: params is of type {type(params).__qualname__}, expected {expected}")
    return usual if params is None else params


def settled_params(name: str, params: Any) -> tuple[Any, dict[str, NDArray[Any]]]:
    """Look at the values of all parameters.

    Args:
        name: Who asks, for the message.
        params: What `checked_params` gave.

    Returns:
        The parameters, as plain numbers where each has one value; and otherwise their arrays by name, such as
        `params.L1`, in order.

    Raises:
        TypeError: If one of them is not a real number or an array of such.
        ValueError: If it is a list of lists of different lengths.
    """
    if params is None or all(isinstance(value, (float, int)) for value in params):
        return params, {}
    arrays = {f"params.{label}": real_array(name, f"params.{label}", value) for label, value in _pairs(params)}
    if any(array.ndim for array in arrays.values()):
        return params, arrays
    return params._make(float(array) for array in arrays.values()), {}


def _pairs(params: Any) -> Sequence[tuple[str, Any]]:
    named: Mapping[str, Any] = params._asdict()
    return tuple(named.items())
