"""What a number measures."""

from __future__ import annotations

from kinegen.older import StrEnum


class Dimension(StrEnum):
    """What a parameter or a reading measures; an angle is in radians here."""

    LENGTH = "length"
    ANGLE = "angle"
    NUMBER = "number"
