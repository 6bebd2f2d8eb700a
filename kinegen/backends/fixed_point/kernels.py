"""The integer programs of a robot, with their scales and errors, and what the header says of these."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache

from kinegen.backends.accuracy import two_digits
from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.routines import LINE
from kinegen.errors import KinegenError
from kinegen.ir.fixed_point.binary_angles import EXACT, PI, TURN, binary_angle
from kinegen.ir.fixed_point.plan import CoarsePair, coarse_pair, plan_fixed
from kinegen.ir.fixed_point.program import NUMBER_BITS, FixedProgram, Scales, nearest_integer
from kinegen.ir.lower import as_derived
from kinegen.ir.program import Program, count
from kinegen.model.expression_parser import Expression, evaluate
from kinegen.model.expression_values import Dimension
from kinegen.model.robot import JointType, JointVariable, Parameter, Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import Q30, sincos_macro


@dataclass(frozen=True, slots=True)
class FixedKernels:
    """Holds a robot, its exact programs, and one integer program for each.

    Attributes:
        scales: Fraction bits of lengths.
        coarse: What holds with a coarser sine and cosine; None where there is none.
    """

    kernels: RobotPrograms
    scales: Scales
    programs: tuple[FixedProgram, ...]
    coarse: CoarsePair | None

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self.kernels.robot

    @property
    def defaults(self) -> tuple[int, ...]:
        """The file's values of the runtime parameters, as the kernels take them."""
        parameters = zip(self.robot.runtime_parameters, self.kernels.defaults, strict=True)
        return tuple(
            signed_angle(binary_angle(value))
            if parameter.dimension is Dimension.ANGLE
            else nearest_integer(value * 2**self.scales.parameter)
            for parameter, value in parameters
        )


@lru_cache(maxsize=8)
def fixed_kernels(kernels: RobotPrograms) -> FixedKernels:
    """Write the programs of a robot in integers; their vectors, their text and their proof ask for the same ones.

    The search for fewer operations may take a sum of two sines as a factor: integers would lose a bit to it everywhere.
    What it found is written where no result loses anything, and what was there before it elsewhere.

    Raises:
        KinegenError: If integers cannot evaluate one; the message says why.
    """
    exact = tuple(_least_without_loss(kernels.robot, program) for program in kernels.programs)
    kernels = replace(kernels, programs=exact)
    # Scales are common to all programs, so that results of one have the units of another.
    scales, programs = plan_fixed(kernels.robot, exact)
    return FixedKernels(kernels, scales, programs, coarse_pair(kernels.robot, programs, scales))


def _least_without_loss(robot: Robot, searched: Program) -> Program:
    """Returns the program that the search found if it has fewer operations and no larger bound, else the one before."""
    plain = as_derived(robot, searched.quantity)
    if count(searched).weight >= count(plain).weight:
        return plain
    try:
        scales, (found,) = plan_fixed(robot, (searched,))
    except KinegenError:
        return plain
    before, (kept,) = plan_fixed(robot, (plain,))
    losses = (new / 2**bits > old / 2**had for new, bits, old, had in _errors(found, kept))
    return plain if scales.length < before.length or any(losses) else searched


def _errors(found: FixedProgram, kept: FixedProgram) -> Iterator[tuple[float, int, float, int]]:
    """Returns bounds and fraction bits of the outputs of two programs."""
    return zip(found.errors, found.bits, kept.errors, kept.bits, strict=True)


def signed_angle(angle: int) -> int:
    """Returns a binary angle as the int32_t of the same bits."""
    return angle - TURN if angle >= TURN // 2 else angle


def range_end(bits: int) -> str:
    """Returns where the range of an int32_t ends at a scale."""
    return f"{math.ldexp(1.0, 31 - bits):.6g}"


def joint_lines(robot: Robot, scales: Scales) -> tuple[str, ...]:
    """Returns one line for each entry of the joint vector: place, name, type, unit, limits."""
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
    """Returns a limit in the unit of the joint; more than a turn stays what it is."""
    value: Fraction = evaluate(limit, {}, EXACT)
    return nearest_integer(value * 2**scales.stroke if is_stroke else value * TURN / (2 * PI))


def parameter_lines(fixed: FixedKernels) -> Iterator[str]:
    """Yields one line for each runtime parameter: name, unit, value in the file."""
    for parameter, value in zip(fixed.robot.runtime_parameters, fixed.defaults, strict=True):
        yield f"{parameter.name}  [{_parameter_unit(fixed, parameter)}]  {value}"


def _parameter_unit(fixed: FixedKernels, parameter: Parameter) -> str:
    if parameter.dimension is Dimension.ANGLE:
        return "1/2^32 turn"
    return f"1/2^{fixed.scales.parameter} {fixed.robot.units.length}"


def largest_errors(program: FixedProgram) -> tuple[tuple[float, float, float], float]:
    """Returns the proven errors of x, y and z and of rotations, over all frames, in units of the last place."""
    return largest(program, program.errors)


def largest(program: FixedProgram, errors: Sequence[float]) -> tuple[tuple[float, float, float], float]:
    """Returns the same for other errors of its outputs."""
    entries = 12 if program.program.quantity.is_pose else 3
    axes = range(3, 12, 4) if entries == 12 else range(3)

    def worst(places: Sequence[int]) -> float:
        return max((errors[place] for place in range(len(errors)) if place % entries in places), default=0.0)

    x, y, z = (worst((axis,)) for axis in axes)
    return (x, y, z), worst([place for place in range(entries) if place not in axes])


def error_text(fixed: FixedKernels, program: FixedProgram) -> str:
    """Returns the proven errors in words."""
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
    """Says what the header says of the sine-cosine pair and of the macro that replaces it."""
    name = sincos_macro(fixed.robot.name, Q30)
    text = (
        f"Sines and cosines are within 8.9e-10. A macro {name}(angle, s, c), defined where {source} is compiled, "
        "replaces them: angle is a uint32_t in 1/2^32 turn, whose bits as an int32_t are the angle divided by pi in "
        "q1.31; it stores the sine and cosine at s and c, pointers to int32_t, in 1/2^30. The bits of results "
        "are then its own."
    )
    return tuple(textwrap.wrap(f"{text} {_coarse_text(fixed)}", LINE - 3, break_long_words=False))


def _coarse_text(fixed: FixedKernels) -> str:
    coarse = fixed.coarse
    if coarse is None:
        return "The proven bounds apply only to sines and cosines within 8.9e-10."
    found = [largest(program, errors) for program, errors in zip(fixed.programs, coarse.errors, strict=True)]
    position = [max(each[axis] for each, _ in found) for axis in range(3)]
    has_rotation = any(program.program.quantity.is_pose for program in fixed.programs)
    words = _words(fixed, position, max(rotation for _, rotation in found), has_rotation=has_rotation)
    halves = f" (2^-{coarse.halves} where products are made of halves)" if coarse.halves != coarse.bits else ""
    return (
        f"If each is within 2^-{coarse.bits} of the exact one{halves}, no operation overflows, and the proven "
        f"errors of all functions are: {words}."
    )
