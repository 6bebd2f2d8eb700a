"""How far results can be off: what is proven of a program in a number type, and the sentences that headers print.

The analysis is `kinegen.ir.error_analysis`; this module knows the ranges of a robot's joints and the facts of the
number types.
"""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Iterator, Mapping
from decimal import ROUND_CEILING, Context, Decimal
from fractions import Fraction
from functools import lru_cache
from types import MappingProxyType

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.routines import LINE, SINCOS
from kinegen.backends.scalar_types import ScalarType
from kinegen.errors import listed
from kinegen.ir.error_analysis import ErrorBound, NumberType, Ranges, bound, has_rules
from kinegen.ir.program import Program
from kinegen.model.joint_bounds import joint_box
from kinegen.model.outputs import Quantity
from kinegen.model.robot import JointType, JointVariable, Robot, shifts_by_joints

NUMBER_TYPES: Mapping[ScalarType, NumberType] = MappingProxyType(
    {
        real: NumberType(
            precision=precision,
            lowest=lowest,
            highest=highest,
            nearest=real.round,
            sine_error=SINCOS[real].absolute_error,
            angle_limit=SINCOS[real].limit,
        )
        for real, precision, lowest, highest in (
            (ScalarType.DOUBLE, 53, -1074, 1024),
            (ScalarType.FLOAT, 24, -149, 128),
        )
    }
)
"""IEEE 754 binary64 and binary32, with the emitted sines and cosines."""

_MARGIN = Fraction(1, 2**20)
"""Ranges are wider than limits by this part, which is far more than rounding a limit to the number type moves it."""

_TWO_DIGITS = Context(prec=2, rounding=ROUND_CEILING)


def error_bound(kernels: RobotPrograms, program: Program, real: ScalarType, widest: bool = False) -> ErrorBound:
    """Return what is proven for the joint box of a robot.

    Args:
        kernels: The robot and the values of its parameters.
        program: One of its programs.
        real: The number type.
        widest: Whether angles without limits lie anywhere in the range of the sine and cosine, not just half a turn to
            either side. Prismatic joints without limits keep the stroke of `kinegen.model.joint_bounds.joint_box`.

    Returns:
        Bounds for all joint values in the box; see `kinegen.ir.error_analysis`.
    """
    limit = SINCOS[real].limit
    joints = fraction_box(kernels.robot, limit if widest else None)
    return bound_over(program, Ranges(joints, kernels.defaults), NUMBER_TYPES[real])


def fraction_box(robot: Robot, free: float | None = None) -> tuple[tuple[Fraction, Fraction], ...]:
    """Return the joint box, and a little more, since its ends are rounded to the number type.

    `free`: how far angles without limits go to either side; as in `kinegen.model.joint_bounds.joint_box` if left out.
    """
    box = [
        (-free, free) if free is not None and _is_free_angle(variable) else ends
        for variable, ends in zip(robot.variables, joint_box(robot), strict=True)
    ]
    return tuple(
        (Fraction(low) - abs(Fraction(low)) * _MARGIN, Fraction(high) + abs(Fraction(high)) * _MARGIN)
        for low, high in box
    )


@lru_cache(maxsize=256)
def bound_over(program: Program, ranges: Ranges, real: NumberType) -> ErrorBound:
    """What is proven of a program over some ranges; computed once for headers, notes, proofs and tests of languages."""
    return bound(program, ranges, real)


def has_free_angles(robot: Robot) -> bool:
    """Return whether any angle has no limits."""
    return any(_is_free_angle(variable) for variable in robot.variables)


def _is_free_angle(variable: JointVariable) -> bool:
    return variable.limits is None and variable.type is not JointType.PRISMATIC


# Sentences ------------------------------------------------------------------------------------------------------------


def sincos_words(robot: Robot, accuracy: str) -> str:
    """Return what holds for sines and cosines, and for joint values that have none.

    `accuracy`: how they are evaluated, and up to which angle.
    """
    text = (
        f"Sines and cosines are evaluated {accuracy}; an angle beyond that, a NaN or an infinity makes every output "
        "that depends on it NaN."
    )
    if shifts_by_joints(robot):
        text += (
            " Lengths that joints move have no such range: an output that depends on a joint only through a "
            "length is infinite or NaN if the joint is infinite."
        )
    return text


def accuracy_lines(kernels: RobotPrograms, source: str) -> tuple[str, ...]:
    """Return what the errors that a header states are the errors of, and for which inputs and machines they hold.

    `source`: the file with the sine and cosine. Returns lines of a comment; none where no function states any.
    """
    stated = [program for program in kernels.programs if _is_stated(program)]
    if not stated:
        return ()
    where = "each function" if len(stated) == len(kernels.programs) else "functions that take only joint values"
    unlimited = list(_unlimited(kernels.robot))
    ranges = f" (or, where there are none, {listed(unlimited)})" if unlimited else ""
    inputs = f" for the joint values passed in, anywhere within their limits{ranges}" if kernels.robot.dof else ""
    defaults = " for the parameters of the file" if kernels.defaults else ""
    pair = f", and for the sine and cosine of {source}" if any(program.angles for program in kernels.programs) else ""
    return _wrapped(
        f"Proven errors, stated at {where}: the largest difference between a result and the exact value of the table"
        f"{inputs}{defaults}. They hold for rounding to nearest with subnormal numbers, with or without "
        f"contraction{pair}."
    )


def _unlimited(robot: Robot) -> Iterator[str]:
    """Yield what is assumed of joints without limits."""
    angles = [f"q[{variable.index}]" for variable in robot.variables if _is_free_angle(variable)]
    if angles:
        yield f"half a turn to either side for {listed(angles)}"
    for variable, (low, high) in zip(robot.variables, joint_box(robot), strict=True):
        if variable.limits is None and not _is_free_angle(variable):
            yield f"{low:.6g} to {high:.6g} {robot.units.length} for q[{variable.index}]"


def error_lines(kernels: RobotPrograms, program: Program, real: ScalarType) -> tuple[str, ...]:
    """Return the proven errors of one function, in the file's length unit.

    Returns lines of a comment: for the joint box, and for the widest range if any angle has no limits. None for
    functions of more than the joint vector, whose other inputs have no known range, nor where there is nothing to
    compute.
    """
    robot = kernels.robot
    if not _is_stated(program):
        return ()
    if not has_rules(program):
        return ("No bound is derived for functions with roots, arc tangents or selections.",)
    of = f" of any {'frame' if program.quantity == Quantity.FRAMES else 'tip'}" if len(program.frames) > 1 else ""
    errors = _errors(error_bound(kernels, program, real), robot.units.length)
    text = f"Proven error{of}: {errors}."
    if has_free_angles(robot):
        free = listed([f"q[{variable.index}]" for variable in robot.variables if _is_free_angle(variable)])
        limit = f"{SINCOS[real].limit:.6g} rad"
        wide = _errors(error_bound(kernels, program, real, widest=True), robot.units.length)
        if wide == errors:
            text += f" The same for {free} anywhere up to {limit}."
        else:
            text += f" For {free} anywhere up to {limit}, as far as sums of angles are too: {wide}."
    return _wrapped(text)


def _is_stated(program: Program) -> bool:
    return bool(program.outputs) and all(given.name == "q" for given in program.signature.inputs)


def _errors(proven: ErrorBound, length: str) -> str:
    if not proven.frames:
        return f"any entry <= {two_digits(max(proven.entries))}"
    parts = [f"|p{axis}| <= {two_digits(error)} {length}" for axis, error in zip("xyz", proven.position, strict=True)]
    if proven.rotation is not None:
        parts.append(f"rotation entries <= {two_digits(proven.rotation)}")
    return ", ".join(parts)


def _wrapped(text: str) -> tuple[str, ...]:
    """Return lines of a comment; no line ends between a number and its unit or what it bounds."""
    whole = re.sub(r"(?<=\d) (?=(?:m|cm|mm|in|rad)\b)|(?<=<=) | (?=<=)", "~", text)
    lines = textwrap.wrap(whole, LINE, break_long_words=False, break_on_hyphens=False)
    return tuple(line.replace("~", " ") for line in lines)


def two_digits(error: float) -> str:
    """Return a bound with two digits, never smaller than it is."""
    if math.isinf(error):
        return "infinity"
    rounded = _TWO_DIGITS.create_decimal(Decimal(error))
    return f"{rounded:.1e}".replace("e+", "e") if rounded else "0"
