"""The choice of the solution nearest to a joint vector, with the operations and the numbers of C."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass

from kinegen.emit.c.nearest import Nearest, NearestJoint, nearest_of
from kinegen.emit.inverse import inverse_of
from kinegen.emit.kernels import Kernels
from kinegen.emit.matlab.syntax import CLASS, WIDTH, matlab_text, number
from kinegen.emit.nearest import MOST_TURNS
from kinegen.emit.reals import Real
from kinegen.outputs import Array

_CHOICE = (
    "The nearest is the one with the least sum of squared differences to q0, joint by joint. Joints that turn first "
    "take the whole turns that bring them nearest to q0, as far as their limits allow. Of two solutions equally near, "
    "the one in the first branch is taken. exists is false, and q NaN, where no branch is valid, or where an entry of "
    "q0 is NaN, infinite, or more than {double} whole turns ({single} of singles) from zero. q0 may be outside the "
    "limits."
)


@dataclass(frozen=True, slots=True)
class Turn:
    """One joint: its row, whether it turns, and its numbers."""

    row: int
    turns: bool
    values: str
    farthest: str


@dataclass(frozen=True, slots=True)
class Choosing:
    """The choice in one number type.

    Attributes:
        kind: The number type, as MATLAB names it.
        joints: The joints.
        last: The row of the last joint.
        rounding: What is added and subtracted to round to a whole number.
        largest: The largest number of the type.
    """

    kind: str
    joints: tuple[Turn, ...]
    last: int
    rounding: str
    largest: str


@dataclass(frozen=True, slots=True)
class Choice:
    """What the template `matlab/inverse_nearest.m.jinja` is given.

    Attributes:
        lines: What is chosen, in words.
        branches: Number of branches.
        types: The choice in each number type.
        turned: Whether any joint turns.
        inverse: Name of the function that gives all solutions.
        target: Name of the pose.
        words: What the pose is.
        given: How many numbers are given besides the target.
    """

    lines: tuple[str, ...]
    branches: int
    types: tuple[Choosing, ...]
    turned: bool
    inverse: str
    target: str
    words: str
    given: int


def choice_of(kernels: Kernels) -> Choice | None:
    """What the template lays out; None where there is no closed-form inverse."""
    solved = inverse_of(kernels)
    found = [(real, nearest_of(kernels, real)) for real in Real]
    types = tuple(_choosing(real, each) for real, each in found if each is not None)
    if solved is None or not types:
        return None
    inverse, branches = solved
    text = _CHOICE.format(double=MOST_TURNS[Real.DOUBLE], single=MOST_TURNS[Real.FLOAT])
    return Choice(
        lines=tuple(textwrap.wrap(matlab_text(text), WIDTH, break_on_hyphens=False)),
        branches=len(branches.names),
        types=types,
        turned=any(joint.turns for joint in types[0].joints),
        inverse=inverse.quantity.function,
        target=inverse.signature.inputs[0].name,
        words=_target_words(inverse.signature.inputs[0]),
        given=branches.given,
    )


def _target_words(target: Array) -> str:
    """What the pose is, without the layout of other languages."""
    return target.words.partition(",")[0] or "pose of the tool in the base frame"


def _choosing(real: Real, found: Nearest) -> Choosing:
    return Choosing(
        kind=CLASS[real],
        joints=tuple(_turn(real, joint) for joint in found.joints),
        last=found.last + 1,
        rounding=number(real, found.rounding),
        largest=number(real, found.largest),
    )


def _turn(real: Real, joint: NearestJoint) -> Turn:
    values = (joint.turn, joint.per_turn, joint.lowest, joint.highest)
    return Turn(
        row=joint.index + 1,
        turns=joint.turns,
        values=", ".join(number(real, value) for value in values),
        farthest=number(real, joint.farthest),
    )
