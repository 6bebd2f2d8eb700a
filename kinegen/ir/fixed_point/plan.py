"""From programs to integer statements: scales are chosen, and every value is shown to fit.

The scale of lengths is the finest at which no length, computed or intermediate, can leave int32_t, whatever the inputs;
all programs of a robot share it. A board's own sine and cosine are coarser than the emitted ones: the statements stay,
and the analysis is made once more with larger errors, the largest with which no value may leave its range.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from kinegen.ir.fixed_point.program import LARGEST, NUMBER_BITS, FixedProgram, Operation, Pair, Scales
from kinegen.ir.fixed_point.ranges import OUTWARD
from kinegen.ir.fixed_point.value_classes import Kind, find_kinds, output_kinds, refuse
from kinegen.ir.fixed_point.writer import Draft, write_statements
from kinegen.ir.program import Program
from kinegen.model.expression_parser import evaluate
from kinegen.model.expression_values import FLOAT64, Dimension
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.robot import JointType, Robot
from kinegen.support.dataclass import dataclass

_FINEST = 60
_FINER = 16
"""Bits by which inputs may be finer than the reach; more would be lost at once."""

_ROOM = 2.0
"""How many times its value in the file a length parameter may grow."""


def plan_fixed(robot: Robot, programs: Sequence[Program]) -> tuple[Scales, tuple[FixedProgram, ...]]:
    """Write the programs of a robot in integers.

    Returns the scales, and one integer program for each program. No value overflows for any input.

    Raises:
        KinegenError: If integers cannot evaluate a program; the message says why.
    """
    kinds = [find_kinds(robot, program) for program in programs]
    scales = _input_scales(robot)
    # A trial at a provisional scale gives the sizes, from which the scale follows.
    trial = [write_statements(robot, program, kind, scales) for program, kind in zip(programs, kinds, strict=True)]
    largest = max((_largest_length(draft) for draft in trial), default=0.0)
    bits = fitting_bits(largest) if largest else NUMBER_BITS
    # Errors count too, and depend on the scale: where they tip a value over the edge, one bit less is enough.
    for length in (bits, bits - 1):
        if length < 0:
            break
        scales = Scales(length, scales.stroke, scales.parameter)
        drafts = [write_statements(robot, program, kind, scales) for program, kind in zip(programs, kinds, strict=True)]
        overflows = [name for draft in drafts for name in draft.overflows()]
        if not overflows:
            return scales, tuple(draft.settled() for draft in drafts)
    if bits < 1:
        raise refuse(robot, f"lengths reach {largest:.3g} {robot.units.length}, which 31 bits do not hold")
    raise refuse(robot, f"the value {overflows[0]} may leave the range of its scale")


def fitting_bits(largest: float) -> int:
    """Return the most fraction bits with which a magnitude stays within int32_t."""
    return min(_FINEST, math.frexp(LARGEST / largest)[1] - 1)


def _input_scales(robot: Robot) -> Scales:
    """Return the scales of inputs; that of computed lengths is provisional."""
    box = zip(robot.variables, joint_box(robot), strict=True)
    strokes = [abs(end) for variable, ends in box if variable.type is JointType.PRISMATIC for end in ends]
    parameters = [
        _ROOM * abs(float(evaluate(parameter.value, {}, FLOAT64)))
        for parameter in robot.runtime_parameters
        if parameter.dimension is Dimension.LENGTH
    ]
    finest = fitting_bits(reach(robot, robot.frame_names)) + _FINER
    return Scales(
        length=NUMBER_BITS,
        stroke=min(finest, fitting_bits(max(strokes, default=0.0) or 1.0)),
        parameter=min(finest, fitting_bits(max(parameters, default=0.0) or reach(robot))),
    )


def _largest_length(draft: Draft) -> float:
    computed = [local for local in draft.locals if local.kind is Kind.LENGTH]
    kinds = output_kinds(draft.program)
    outputs = [local for local, kind in zip(draft.outputs, kinds, strict=True) if kind is Kind.LENGTH]
    return max((draft.extents.extent(local.place).size for local in (*computed, *outputs)), default=0.0)


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
    """Return the coarsest pair, of those that are not coarser than `COARSEST`, with which no value leaves its range.

    Returns the pair and what is proven with it; None without sines, or where only the emitted pair is good enough.
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
    """Return the programs once more, with sines and cosines that are off by as much as 2^-bits."""
    each = math.ldexp(1.0, NUMBER_BITS - bits)
    pair = Pair(each, each * math.sqrt(2.0) * OUTWARD)
    exact = [program.program for program in programs]
    return [write_statements(robot, program, find_kinds(robot, program), scales, pair) for program in exact]
