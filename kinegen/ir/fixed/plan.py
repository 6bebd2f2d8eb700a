"""From programs to integer statements: scales are chosen, and every value is shown to fit before anything is emitted.

The scale of lengths is the finest at which no length, computed or intermediate, can leave int32_t, whatever the inputs;
sizes and errors come from `extents`. All programs of a robot share it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from kinegen.ir.fixed.draft import Draft
from kinegen.ir.fixed.kinds import Kind, find_kinds, output_kinds, refuse
from kinegen.ir.fixed.program import LARGEST, NUMBER_BITS, FixedProgram, Scales
from kinegen.ir.fixed.writer import write_statements
from kinegen.ir.program import Program
from kinegen.robot.dimension import Dimension
from kinegen.robot.expressions import evaluate
from kinegen.robot.extent import joint_box, reach
from kinegen.robot.floats import FLOATS
from kinegen.robot.model import JointType, Robot

_FINEST = 60
_FINER = 16
"""Bits by which inputs may be finer than the reach; more would be lost at once."""

_ROOM = 2.0
"""How many times its value in the file a length parameter may grow."""


def plan_fixed(robot: Robot, programs: Sequence[Program]) -> tuple[Scales, tuple[FixedProgram, ...]]:
    """Write the programs of a robot in integers.

    Args:
        robot: The robot.
        programs: Its programs.

    Returns:
        The scales, and one integer program for each program. No value overflows for any input.

    Raises:
        KinegenError: If integers cannot evaluate a program; the message says why.
    """
    kinds = [find_kinds(robot, program) for program in programs]
    scales = _input_scales(robot)
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
    """The most fraction bits with which a magnitude stays within int32_t."""
    return min(_FINEST, math.frexp(LARGEST / largest)[1] - 1)


def _input_scales(robot: Robot) -> Scales:
    """The scales of inputs; that of computed lengths is provisional."""
    box = zip(robot.variables, joint_box(robot), strict=True)
    strokes = [abs(end) for variable, ends in box if variable.type is JointType.PRISMATIC for end in ends]
    parameters = [
        _ROOM * abs(float(evaluate(parameter.value, {}, FLOATS)))
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
    """The largest length among the values and outputs of a program."""
    computed = [local for local in draft.locals if local.kind is Kind.LENGTH]
    kinds = output_kinds(draft.program)
    outputs = [local for local, kind in zip(draft.outputs, kinds, strict=True) if kind is Kind.LENGTH]
    return max((draft.extents.extent(local.place).size for local in (*computed, *outputs)), default=0.0)
