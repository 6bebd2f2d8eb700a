"""What headers and modules say of a closed-form inverse: its branches, and what it asks of a target."""

from __future__ import annotations

import math
import textwrap
from dataclasses import dataclass

from kinegen.emit.kernels import Kernels
from kinegen.outputs import Kind


@dataclass(frozen=True, slots=True)
class Branches:
    """The words of an inverse.

    Attributes:
        family: What such arms are called.
        names: The branches, in the order of the results.
        meanings: What the words in their names mean; sentences.
        conditions: What a target must be, and what is chosen where there is a choice; sentences.
        turns: What a whole turn of each joint is in its variable; infinite for one that shifts.
    """

    family: str
    names: tuple[str, ...]
    meanings: tuple[str, ...]
    conditions: tuple[str, ...]
    turns: tuple[float, ...]


def branches_of(kernels: Kernels) -> Branches | None:
    """The words of a robot's inverse, or None where there is no such kernel."""
    if not any(program.quantity.kind is Kind.INVERSE for program in kernels.programs):
        return None
    # Here, so that printing other kernels needs no sympy.
    from kinegen.symbolic.inverse.derive import family_of

    family = family_of(kernels.robot)
    turns = tuple(2 * math.pi / abs(float(joint.rate)) if joint.turns else math.inf for joint in family.axes.joints)
    return Branches(family.name, family.branches, family.meanings, family.conditions, turns)


def branch_lines(branches: Branches, width: int) -> tuple[str, ...]:
    """The words as lines of a comment, of at most so many characters."""
    lines = (
        f"Family: {branches.family}. Rows of solutions:",
        *(f"  {index}  {name}" for index, name in enumerate(branches.names)),
        *branches.meanings,
        "valid is 1 for a solution within the limits, else 0; its row then holds anything. Targets:",
        *(f"  {condition}" for condition in branches.conditions),
    )
    return tuple(part for line in lines for part in textwrap.wrap(line, width, subsequent_indent="    "))
