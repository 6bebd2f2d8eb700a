"""What holds of integer kernels with a sine and cosine of a board, which are coarser than the emitted ones.

The statements stay as they are; the analysis is made once more with larger errors of sines and cosines. Where a value
might then leave its range, smaller errors are tried.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from kinegen.ir.fixed.draft import Draft
from kinegen.ir.fixed.kinds import find_kinds
from kinegen.ir.fixed.program import NUMBER_BITS, FixedProgram, Operation, Pair, Scales
from kinegen.ir.fixed.values import OUTWARD
from kinegen.ir.fixed.writer import write_statements
from kinegen.robot.model import Robot

COARSEST = 18
"""Sines and cosines within 2^-18: what a CORDIC of 24 steps is good for, with its rounding."""


@dataclass(frozen=True, slots=True)
class CoarsePair:
    """Sines and cosines with which nothing overflows.

    Attributes:
        bits: Each may be off by 2^-bits.
        halves: The same where products are made of 16-bit halves.
        errors: For each program and output the proven bound on its error at `bits`, in units of its last place.
    """

    bits: int
    halves: int
    errors: tuple[tuple[float, ...], ...]


def coarse_pair(robot: Robot, programs: Sequence[FixedProgram], scales: Scales) -> CoarsePair | None:
    """The coarsest pair, of those that are not coarser than `COARSEST`, with which no value leaves its range.

    Args:
        robot: The robot.
        programs: Its integer programs.
        scales: Their scales.

    Returns:
        The pair and what is proven with it; None without sines, or where only the emitted pair is good enough.
    """
    if not any(each.operator is Operation.SINCOS for program in programs for each in program.statements):
        return None
    found: CoarsePair | None = None
    for bits in range(COARSEST, NUMBER_BITS):
        drafts = _drafts(robot, programs, scales, bits)
        if any(draft.too_large() for draft in drafts):
            continue
        found = found or CoarsePair(bits, bits, tuple(draft.errors for draft in drafts))
        if all(draft.splits(program) for draft, program in zip(drafts, programs, strict=True)):
            return replace(found, halves=bits)
    return None


def _drafts(robot: Robot, programs: Sequence[FixedProgram], scales: Scales, bits: int) -> list[Draft]:
    """The programs once more, with sines and cosines that are off by as much as 2^-bits."""
    each = math.ldexp(1.0, NUMBER_BITS - bits)
    pair = Pair(each, each * math.sqrt(2.0) * OUTWARD)
    exact = [program.program for program in programs]
    return [write_statements(robot, program, find_kinds(robot, program), scales, pair) for program in exact]
