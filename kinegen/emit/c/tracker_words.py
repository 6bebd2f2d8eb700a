"""What the header of an inverse along a path says of its steps and speeds, as lines of a comment."""

from __future__ import annotations

import textwrap

from kinegen.emit.functions import LINE
from kinegen.emit.reals import Real
from kinegen.emit.tracking import TRACKING
from kinegen.outputs import Branches


def step_words(real: Real) -> tuple[str, ...]:
    """What it says of a step.

    Args:
        real: The number type.
    """
    leap, far, kept = float(TRACKING.leap), float(TRACKING.long_step), f"{float(TRACKING.kept[real]):.0e}"
    return _wrapped(
        "The solution is the nearest one that the joints reach without a leap, with an advantage for the tracker's "
        "branch, and with the whole turns that continue the joint values within their limits. A joint leaps if it goes "
        f"the long way round, or if joints that move by more than {leap:g} rad lead the tool aside. For a target more "
        f"than {far:g} rad, or {far / 3:g} of the reach, away, the way is not known and the branch decides. On a path "
        "straight through a singularity the joints go on as they were, although the name of the branch changes. "
        "Where the target leaves joints open, they keep their values, and the tool may be off by "
        f"{kept} rad or third of the reach.",
        "With max_step, no joint changes by more. Joints that would are moved by that much towards the solution, and "
        "the others bring the tool as near to the target as they can. Further steps to the same target reach it.",
    )


def speed_words(branches: Branches, real: Real) -> tuple[str, ...]:
    """What it says of joint speeds.

    Args:
        branches: The words of the inverse.
        real: The number type.
    """
    most, near, least = float(TRACKING.speed_damping), float(TRACKING.near[real]), float(TRACKING.least_damping[real])
    words = (
        "qd = (J^T J + k)^-1 J^T twist, with lengths in thirds of the reach. "
        f"k = {most:.0e} (1 - w/w0)^2 + {least:.0e} for w < w0 = {near:.0e}, else 0, after Nakamura and Hanafusa "
        "(1986). "
        "w is the product of the squared sines at which each column of J meets those before it. "
    )
    if branches.redundancy:
        words += f"The speed of {branches.redundancy}, which is given with the target, is 0. "
    if not branches.reads_attitude:
        words += "Only the velocity of the origin is asked for; the residual still has all six numbers. "
    return _wrapped(words.strip())


def _wrapped(*texts: str) -> tuple[str, ...]:
    return tuple(line for text in texts for line in textwrap.wrap(text, LINE, break_on_hyphens=False))
