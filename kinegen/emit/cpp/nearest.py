"""The function that chooses the solution nearest to a joint vector, as the C++ templates print it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

from kinegen.emit.cpp.syntax import number
from kinegen.emit.inverse import inverse_of
from kinegen.emit.kernels import Kernels
from kinegen.emit.limits import LARGEST
from kinegen.emit.nearest import FARTHEST_STROKE, MOST_TURNS, turnings
from kinegen.emit.reals import Real

POSE = 16
"""Numbers of a pose."""

_ROUNDING = (Fraction(3 * 2**51), Fraction(3 * 2**22))
"""Adding and subtracting this rounds to a whole number, in double and in float."""


@dataclass(frozen=True, slots=True)
class Nearest:
    """What the choice needs, as numbers of the template's type.

    Attributes:
        joints: For each joint a whole turn (0 if it shifts), its inverse, both limits, and what is too far away.
        branches: The number of solutions.
        rounding: What is added and subtracted to round to a whole number.
        largest: The largest number.
        far: From where on a joint value is near to nothing, in words.
        inverse: Name of the function that gives all solutions.
        target: Name of the pose.
        given: How many numbers are given besides the target.
        ahead: Numbers of a target and of what is given besides it.
    """

    joints: tuple[tuple[str, str, str, str, str], ...]
    branches: int
    rounding: str
    largest: str
    far: str
    inverse: str
    target: str
    given: int
    ahead: int


def nearest_of(kernels: Kernels) -> Nearest | None:
    """What the templates lay out; None where there is no closed-form inverse."""
    found = inverse_of(kernels)
    if found is None:
        return None
    inverse, branches = found
    both = zip(*(turnings(kernels.robot, branches, real) for real in Real), strict=True)
    joints = []
    for double, single in both:
        turn, other = Fraction(double.turn), Fraction(single.turn)
        far, near = (
            each * MOST_TURNS[real] if each else Fraction(FARTHEST_STROKE)
            for each, real in zip((turn, other), Real, strict=True)
        )
        low, high = (
            number(Fraction(getattr(double, end)), Fraction(getattr(single, end))) for end in ("lowest", "highest")
        )
        per_turn = number(1 / turn, 1 / other) if turn else number(turn)
        joints.append((number(turn, other), per_turn, low, high, number(far, near)))
    shifts = any(map(math.isinf, branches.turns))
    turns = any(map(math.isfinite, branches.turns))
    far_words = [f"{MOST_TURNS[Real.DOUBLE]} whole turns ({MOST_TURNS[Real.FLOAT]} in float)"] * turns
    far_words += [f"1e15 {kernels.robot.units.length}"] * shifts
    return Nearest(
        joints=tuple(joints),
        branches=len(branches.names),
        rounding=number(*_ROUNDING),
        largest=number(LARGEST[Real.DOUBLE], LARGEST[Real.FLOAT]),
        far=" or ".join(far_words),
        inverse=inverse.quantity.function,
        target=inverse.signature.inputs[0].name,
        given=branches.given,
        ahead=POSE + branches.given,
    )
