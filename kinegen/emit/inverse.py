"""What headers and modules say of a closed-form inverse: its branches, and what it asks of a target."""

from __future__ import annotations

import math
import textwrap
from dataclasses import dataclass

from kinegen.emit.kernels import Kernels
from kinegen.emit.reals import Real
from kinegen.outputs import Kind
from kinegen.robot.extent import reach


@dataclass(frozen=True, slots=True)
class Branches:
    """The words of an inverse.

    Attributes:
        family: What such arms are called.
        names: The branches, in the order of the results.
        meanings: What the words in their names mean; sentences.
        conditions: What a target must be, and what is chosen where there is a choice; sentences.
        turns: What a whole turn of each joint is in its variable; infinite for one that shifts.
        rooms: How far outside its limits a joint of a valid solution may be, in double and in single precision.
        rigid: How far the columns of a target may be from those of a rotation, likewise.
        reads_attitude: Whether the rotation of a target is read.
    """

    family: str
    names: tuple[str, ...]
    meanings: tuple[str, ...]
    conditions: tuple[str, ...]
    turns: tuple[float, ...]
    rooms: dict[Real, tuple[float, ...]]
    rigid: dict[Real, float]
    reads_attitude: bool


def branches_of(kernels: Kernels) -> Branches | None:
    """The words of a robot's inverse, or None where there is no such kernel."""
    if not any(program.quantity.kind is Kind.INVERSE for program in kernels.programs):
        return None
    # Here, so that printing other kernels needs no sympy.
    from kinegen.symbolic.expressions import number_of
    from kinegen.symbolic.inverse.derive import family_of
    from kinegen.symbolic.inverse.solve import reads_attitude
    from kinegen.symbolic.inverse.thresholds import RIGID, thresholds_of

    family = family_of(kernels.robot)
    near = thresholds_of(family, reach(kernels.robot))
    rooms = {
        real: tuple(number_of(near.room(joint), single=real is Real.FLOAT) for joint in family.axes.joints)
        for real in Real
    }
    rigid = {real: number_of(RIGID, single=real is Real.FLOAT) for real in Real}
    turns = tuple(2 * math.pi / abs(float(joint.rate)) if joint.turns else math.inf for joint in family.axes.joints)
    words = family.name, family.branches, family.meanings, family.conditions
    return Branches(*words, turns, rooms, rigid, reads_attitude(family))


def branch_lines(branches: Branches, width: int, reals: tuple[Real, ...]) -> tuple[str, ...]:
    """The words as lines of a comment, of at most so many characters.

    Args:
        branches: The words.
        width: Longest line.
        reals: The number types that the lines are about.

    Returns:
        The lines.
    """
    lines = (
        f"Family: {branches.family}. Rows of solutions:",
        *(f"  {index}  {name}" for index, name in enumerate(branches.names)),
        *branches.meanings,
        "valid is 1 for a solution within the limits, else 0; then its row is arbitrary. Valid rows are finite.",
        f"Rounding may move a joint at its limit outside it: valid up to {_rooms(branches, reals)}. Targets:",
        *_rigid_lines(branches, reals),
        *(f"  {condition}" for condition in branches.conditions),
    )
    return tuple(part for line in lines for part in textwrap.wrap(line, width, subsequent_indent="    "))


def _rooms(branches: Branches, reals: tuple[Real, ...]) -> str:
    """How far outside its limits a joint may be found, in words."""
    rooms = [sorted({f"{room:.1e}" for room in branches.rooms[real]}, key=float) for real in reals]
    texts = [each[0] if len(each) == 1 else f"{each[0]} to {each[-1]} (by joint)" for each in rooms]
    return _by_type(texts, reals)


def _rigid_lines(branches: Branches, reals: tuple[Real, ...]) -> tuple[str, ...]:
    """What the rotation of a target must be; nothing where it is not read."""
    if not branches.reads_attitude:
        return ()
    bound = _by_type([f"{branches.rigid[real]:.0e}" for real in reals], reals)
    return (
        "  the rotation must have orthonormal, right-handed columns, or no solution is valid: their deviation, as the",
        f"  root of a sum of squares, must be less than {bound}",
    )


def _by_type(texts: list[str], reals: tuple[Real, ...]) -> str:
    """One text for one number type, or both of them."""
    return (
        texts[0] if len(reals) == 1 or texts[0] == texts[1] else f"{texts[0]} in {reals[0]}, {texts[1]} in {reals[1]}"
    )
