"""What the emitted sine-cosine pairs promise, for the emitters, the headers and the error bounds.

The statements are in `kinegen.ir.routines.sincos`. Nothing is computed here; tests/sincos proves the figures.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from kinegen.emit.reals import Real


@dataclass(frozen=True, slots=True)
class Sincos:
    """The pair of one number type.

    Attributes:
        template: Needs `prefix` and `qualifier`; defines `PREFIX_sincos(x, &s, &c)`.
        limit: Largest magnitude of an angle in radians; beyond it both results are NaN.
        absolute_error: Bound on the error of either result, whether or not the compiler contracts.
        accuracy: The same in words.
    """

    template: str
    limit: float
    absolute_error: float
    accuracy: str


SINCOS: Mapping[Real, Sincos] = MappingProxyType(
    {
        Real.DOUBLE: Sincos(
            template="c/_sincos_f64.c.jinja",
            limit=1e5,
            absolute_error=0.85 * 2.0**-53,
            accuracy="within 0.85 units in the last place for angles up to 1e5 rad",
        ),
        Real.FLOAT: Sincos(
            template="c/_sincos_f32.c.jinja",
            limit=12000.0,
            absolute_error=5.4e-8,
            accuracy="with an absolute error below 5.4e-8 for angles up to 12000 rad",
        ),
    }
)
"""The pairs by number type."""
