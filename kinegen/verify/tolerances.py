"""How far a kernel may be from the reference."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Tolerances:
    """Largest accepted errors: entries of a rotation as they are, positions relative to the robot's reach.

    Attributes:
        double: About 450 units of rounding. The longest chain in `robots/` loses twenty of them, a wrong sign or
            constant loses 1e13.
        float: About 17 units of rounding; seven joints lose about five.
    """

    double: float = 1e-13
    float: float = 2e-6


TOLERANCES = Tolerances()
