"""What headers and modules say of a closed-form inverse: its branches, and what it asks of a target."""

from __future__ import annotations

import textwrap

from kinegen.emit.aim import aim_lines
from kinegen.emit.kernels import Kernels
from kinegen.emit.reals import Real
from kinegen.ir.program import Program
from kinegen.outputs import Allowance, Branches, Kind
from kinegen.robot.model import Robot
from kinegen.tables.seen import chain_of


def inverse_of(kernels: Kernels) -> tuple[Program, Branches] | None:
    """The program of a robot's inverse and its branches, or None where there is no such kernel."""
    found = ((program, program.signature.branches) for program in kernels.programs)
    return next(((program, branches) for program, branches in found if branches), None)


def solved_chain(kernels: Kernels) -> Robot:
    """The chain for which the inverse is solved: the robot, or the way between two frames of a tree."""
    found = inverse_of(kernels)
    return kernels.robot if found is None else chain_of(kernels.robot, found[0].quantity)


def branches_of(kernels: Kernels) -> Branches | None:
    """The branches of a robot's inverse, or None where there is no such kernel."""
    found = inverse_of(kernels)
    return None if found is None else found[1]


def allowed(allowance: Allowance, real: Real) -> float:
    """How far off a number of one type may be."""
    return allowance.of(real is Real.FLOAT)


def notes_of(kernels: Kernels, program: Program, width: int, reals: tuple[Real, ...]) -> tuple[str, ...]:
    """What is said of the solutions of an inverse, as lines of a comment; nothing of other kernels.

    Args:
        kernels: The robot and its programs.
        program: One of these.
        width: Longest line.
        reals: The number types that the lines are about.
    """
    if program.quantity.kind is Kind.AXIS_INVERSE:
        return aim_lines(width)
    branches = branches_of(kernels) if program.quantity.kind is Kind.INVERSE else None
    return () if branches is None else branch_lines(branches, width, reals)


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
    rooms = [sorted({f"{allowed(room, real):.1e}" for room in branches.rooms}, key=float) for real in reals]
    texts = [each[0] if len(each) == 1 else f"{each[0]} to {each[-1]} (by joint)" for each in rooms]
    return _by_type(texts, reals)


def _rigid_lines(branches: Branches, reals: tuple[Real, ...]) -> tuple[str, ...]:
    """What the rotation of a target must be; nothing where it is not read."""
    if not branches.reads_attitude:
        return ()
    bound = _by_type([f"{allowed(branches.rigid, real):.0e}" for real in reals], reals)
    return (
        "  the rotation must have orthonormal, right-handed columns, or no solution is valid: their deviation, as the",
        f"  root of a sum of squares, must be less than {bound}",
    )


def _by_type(texts: list[str], reals: tuple[Real, ...]) -> str:
    """One text for one number type, or both of them."""
    return (
        texts[0] if len(reals) == 1 or texts[0] == texts[1] else f"{texts[0]} in {reals[0]}, {texts[1]} in {reals[1]}"
    )
