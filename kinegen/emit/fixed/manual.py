"""What the headers of integer kernels say of inputs and errors."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Sequence
from fractions import Fraction

from kinegen.emit.accuracy import two_digits
from kinegen.emit.fixed.kernels import FixedKernels
from kinegen.emit.functions import LINE
from kinegen.ir.fixed.program import NUMBER_BITS, FixedProgram, Scales
from kinegen.ir.fixed.rounding import nearest_integer
from kinegen.ir.fixed.turns import EXACT, PI, TURN
from kinegen.naming import Q30, sincos_macro
from kinegen.robot.dimension import Dimension
from kinegen.robot.expressions import Expression, evaluate
from kinegen.robot.model import JointType, JointVariable, Parameter, Robot


def range_end(bits: int) -> str:
    """Where the range of an int32_t ends at a scale."""
    return f"{math.ldexp(1.0, 31 - bits):.6g}"


def joint_lines(robot: Robot, scales: Scales) -> tuple[str, ...]:
    """One line for each entry of the joint vector: place, name, type, unit, limits."""
    width = max((len(variable.name) for variable in robot.variables), default=0)
    lines = []
    for variable in robot.variables:
        named = f"q[{variable.index}]  {variable.name:<{width}}  {variable.type.value:<9}"
        lines.append(f"{named}  {_joint_range(robot, variable, scales)}")
    return tuple(lines)


def _joint_range(robot: Robot, variable: JointVariable, scales: Scales) -> str:
    is_stroke = variable.type is JointType.PRISMATIC
    unit = f"1/2^{scales.stroke} {robot.units.length}" if is_stroke else "1/2^32 turn"
    if variable.limits is None:
        return f"{unit}  no limits"
    low, high = (_joint_value(limit, is_stroke, scales) for limit in variable.limits)
    return f"{unit}  {low} to {high}"


def _joint_value(limit: Expression, is_stroke: bool, scales: Scales) -> int:
    """A limit in the unit of the joint; more than a turn stays what it is."""
    value: Fraction = evaluate(limit, {}, EXACT)
    return nearest_integer(value * 2**scales.stroke if is_stroke else value * TURN / (2 * PI))


def parameter_lines(fixed: FixedKernels) -> Iterator[str]:
    """One line for each runtime parameter: name, unit, value in the file."""
    for parameter, value in zip(fixed.robot.runtime_parameters, fixed.defaults, strict=True):
        yield f"{parameter.name}  [{_parameter_unit(fixed, parameter)}]  {value}"


def _parameter_unit(fixed: FixedKernels, parameter: Parameter) -> str:
    if parameter.dimension is Dimension.ANGLE:
        return "1/2^32 turn"
    return f"1/2^{fixed.scales.parameter} {fixed.robot.units.length}"


def largest_errors(program: FixedProgram) -> tuple[tuple[float, float, float], float]:
    """The proven errors of x, y and z and of the entries of a rotation, over all frames, in units of the last place."""
    return largest(program, program.errors)


def largest(program: FixedProgram, errors: Sequence[float]) -> tuple[tuple[float, float, float], float]:
    """The same for other errors of its outputs."""
    entries = 12 if program.program.quantity.is_pose else 3
    axes = range(3, 12, 4) if entries == 12 else range(3)

    def worst(places: Sequence[int]) -> float:
        return max((errors[place] for place in range(len(errors)) if place % entries in places), default=0.0)

    x, y, z = (worst((axis,)) for axis in axes)
    return (x, y, z), worst([place for place in range(entries) if place not in axes])


def error_text(fixed: FixedKernels, program: FixedProgram) -> str:
    """The proven errors in words."""
    return _words(fixed, *largest_errors(program), has_rotation=program.program.quantity.is_pose)


def _words(fixed: FixedKernels, position: Sequence[float], rotation: float, *, has_rotation: bool) -> str:
    length = fixed.robot.units.length
    parts = [
        f"|p{axis}| <= {two_digits(math.ldexp(error, -fixed.scales.length))} {length}"
        for axis, error in zip("xyz", position, strict=True)
    ]
    if has_rotation:
        parts.append(f"rotation entries <= {two_digits(math.ldexp(rotation, -NUMBER_BITS))}")
    return ", ".join(parts)


def above_one(fixed: FixedKernels) -> int:
    """By how much rounding may take an entry of a rotation beyond 1, in units of the last place."""
    return math.floor(max((largest_errors(program)[1] for program in fixed.programs), default=0.0))


def sincos_lines(fixed: FixedKernels, source: str) -> tuple[str, ...]:
    """What the header says of the sine-cosine pair and of the macro that replaces it."""
    name = sincos_macro(fixed.robot.name, Q30)
    text = (
        f"Sines and cosines are within 8.9e-10. A macro {name}(angle, s, c), defined where {source} is compiled, "
        "replaces them: angle is a uint32_t in 1/2^32 turn, whose bits as an int32_t are the angle divided by pi in "
        "q1.31; it stores the sine and cosine at s and c, pointers to int32_t, in 1/2^30. The bits of results "
        "are then its own."
    )
    return tuple(textwrap.wrap(f"{text} {_coarse_text(fixed)}", LINE - 3, break_long_words=False))


def _coarse_text(fixed: FixedKernels) -> str:
    """What is proven with a pair of one's own."""
    coarse = fixed.coarse
    if coarse is None:
        return "The proofs hold only for sines and cosines within 8.9e-10."
    found = [largest(program, errors) for program, errors in zip(fixed.programs, coarse.errors, strict=True)]
    position = [max(each[axis] for each, _ in found) for axis in range(3)]
    has_rotation = any(program.program.quantity.is_pose for program in fixed.programs)
    words = _words(fixed, position, max(rotation for _, rotation in found), has_rotation=has_rotation)
    halves = f" (2^-{coarse.halves} where products are made of halves)" if coarse.halves != coarse.bits else ""
    return (
        f"If each is within 2^-{coarse.bits} of the exact one{halves}, no operation overflows, and the proven "
        f"errors of all functions are: {words}."
    )
