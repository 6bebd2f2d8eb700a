"""What the reference says and what is accepted, computed once for all attempts at the same robot.

An alteration changes what kernels return, never what they must return: attempts at one robot ask for the same numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, TypeVar

import numpy as np

from kinegen.ir.error_analysis import NumberType
from kinegen.ir.program import Program
from kinegen.model.outputs import Quantity
from kinegen.verify import expectations, tolerances
from kinegen.verify.expectations import Expectation, Limits
from kinegen.verify.reference_cache import ReferenceResults

_Result = TypeVar("_Result")

_AT_MOST = 400
"""Results that are kept; the oldest goes first."""

_expectations: dict[Hashable, Expectation] = {}
_spreads: dict[Hashable, Limits] = {}


def expect(known: ReferenceResults, quantity: Quantity, _compute: Any = expectations.expect) -> Expectation:
    """As `kinegen.verify.expectations.expect`."""
    return _kept(_expectations, (*_key(known), quantity), lambda: _compute(known, quantity))


def spread(expected: Expectation, program: Program, real: NumberType, _compute: Any = tolerances._spread) -> Limits:
    """As `kinegen.verify.tolerances._spread`."""
    key = (*_key(expected.known), expected.quantity, program, real)
    return _kept(_spreads, key, lambda: _compute(expected, program, real))


def _kept(store: dict[Hashable, _Result], key: Hashable, compute: Callable[[], _Result]) -> _Result:
    if key not in store:
        while len(store) >= _AT_MOST:
            del store[next(iter(store))]
        store[key] = compute()
    return store[key]


def _key(known: ReferenceResults) -> tuple[Hashable, ...]:
    """All that decides what the reference says."""
    inputs = [(name, array.shape, _digits(array)) for name, array in sorted(known.inputs.items())]
    return type(known), known.robot, known.exact, known.unit, *inputs


def _digits(array: Any) -> Hashable:
    """All digits of numbers, also of those wider than a double."""
    if array.dtype == object:
        return tuple(array.ravel())
    high = array.astype(np.float64)
    return high.tobytes(), (array - high).astype(np.float64).tobytes()
