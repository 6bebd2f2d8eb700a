"""How far a kernel may be from the reference: what rounding can do to it, and no more.

Two answers are known, and the smaller one counts for each entry of a result. The proven bound of `ir/error_analysis/`
holds everywhere in the joint box; it has no rules for roots, arc tangents and selections, and gets wide for derivatives
of long chains. The spread of `rounding` belongs to each input by itself, and so follows the condition beside
dead centres and singularities; `SPREADS` times its root mean square is accepted. What the reference can lose is added.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from kinegen.backends.accuracy import NUMBER_TYPES, bound_over, fraction_box
from kinegen.backends.scalar_types import ScalarType
from kinegen.ir.error_analysis import NumberType, Ranges, has_rules
from kinegen.ir.lower import program_of, runtime_defaults
from kinegen.ir.program import Program
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.outputs import Quantity
from kinegen.model.robot import JointType, Robot
from kinegen.verify.expectations import Expectation, Limits, expect
from kinegen.verify.reference import WIDE_UNIT
from kinegen.verify.reference_cache import ReferenceResults, Split
from kinegen.verify.rounding import SPREADS, TRIALS, apart, parameters_of, trials_at
from kinegen.verify.samples import SEED, FloatArray, length_rates

SHARP = 64
"""Proven bounds below so many units of rounding are taken as they are, without a look at the spread."""

LOST = 1 / 8
"""Where more than this share of the largest result is accepted, no digit is left and nothing is compared."""

LIBRARY_SINE = 4
"""Units in the last place by which NumPy's sine and cosine may be off; the C kernels have their own."""

_LOSS = 64
"""Units of rounding that the reference may lose for each row; it loses about ten."""

_READ = 16
"""The same for a rotation made of three angles or of a quaternion, which is made in float64 of what kernels return."""


def number_type(real: str, *, library: bool = False) -> NumberType:
    """Returns the facts of a number type. `library`: whether sines and cosines are NumPy's."""
    plain = NUMBER_TYPES[ScalarType(real)]
    return replace(plain, sine_error=LIBRARY_SINE * float(plain.unit)) if library else plain


def accepted(expectation: Expectation, program: Program, real: NumberType, *, within: bool = True) -> Limits:
    """Returns what is accepted of each entry of a result at each input.

    `program`: what the kernel was printed from, or the same of a robot with other values of its parameters; `within`:
    whether the inputs lie where samples are taken from, which is what the proven bound is for. For each result and
    frame, of the entries that are lengths and of all others, shape (N or 1, entries) each.
    """
    proven = _proven(expectation, program, real) if within else None
    lost = _losses(expectation, within=within)
    unit = float(real.unit)
    scales = expectation.length_scale, expectation.number_scale
    if proven is not None and all(
        limit.max(initial=0) <= SHARP * unit * scale
        for _, split in _each(proven)
        for limit, scale in zip(split, scales)
    ):
        return _mapped(proven, lambda part, limit: limit + lost[part])
    spread = _spread(expectation, program, real)
    if proven is not None:
        spread = tuple(
            tuple((_smaller(a, c), _smaller(b, d)) for (a, b), (c, d) in zip(one, other, strict=True))
            for one, other in zip(proven, spread, strict=True)
        )
    far = [LOST * scale for scale in scales]
    return _mapped(spread, lambda part, limit: np.where(limit > far[part], np.inf, limit) + lost[part])


def _smaller(proven: FloatArray, spread: FloatArray) -> FloatArray:
    """Returns the smaller limit; where the spread has none, an angle is too large, of which the bound says nothing."""
    return np.where(np.isinf(spread), np.inf, np.minimum(proven, spread))


def accepted_error(robot: Robot, real: str) -> float:
    """Returns the largest error of a pose that is accepted of a robot's kernels anywhere in its joint box.

    For entries of a rotation; for positions relative to the reach. Not less than `LEAST` units of rounding.
    """
    program = program_of(robot, Quantity.POSE)
    if not has_rules(program):
        return max(
            LEAST * float(NUMBER_TYPES[ScalarType(real)].unit),
            _pose_spread(robot, program, NUMBER_TYPES[ScalarType(real)]),
        )
    found = bound_over(program, Ranges(fraction_box(robot), runtime_defaults(robot)), NUMBER_TYPES[ScalarType(real)])
    shares = [found.rotation or 0.0, *(error / reach(robot) for error in found.position)] if found.frames else []
    return max([LEAST * float(NUMBER_TYPES[ScalarType(real)].unit), *shares])


def _pose_spread(robot: Robot, program: Program, real: NumberType) -> float:
    """The spread of the entries of poses, as a share of the reach where they are lengths: for roots of parameters."""
    low, high = np.array(joint_box(robot)).reshape(-1, 2).T
    points = np.random.default_rng(SEED).uniform(low, high, (_POSES, robot.dof))
    expectation = expect(ReferenceResults(robot, {"q": points}), Quantity.POSE)
    splits = [split for frames in _spread(expectation, program, real) for split in frames]
    return max(float(max(lengths.max() / reach(robot), numbers.max())) for lengths, numbers in splits)


_POSES = 64
"""Joint vectors at which the spread of poses is looked at."""

LEAST = 34
"""Units of rounding that are accepted of any arm where its own bound is not looked at."""


# The proven bound -----------------------------------------------------------------------------------------------------


def _proven(expectation: Expectation, program: Program, real: NumberType) -> Limits | None:
    """Returns the proven bound, the same for all inputs; None where there is none."""
    robot = expectation.known.robot
    ranges = _ranges(robot, program)
    if ranges is None or not has_rules(program) or expectation.is_read:
        return None
    entries = bound_over(program, Ranges(ranges, tuple(parameters_of(robot, program).values())), real).entries
    if not all(map(math.isfinite, entries)):
        return None
    results = shaped(program, np.array([entries]), last_row=0.0)
    return _splits(expectation, results)


def _ranges(robot: Robot, program: Program) -> tuple[tuple[Fraction, Fraction], ...] | None:
    """Returns where `verify.samples` takes the inputs of a program from; None for readings of actuators."""
    found: list[tuple[Fraction, Fraction]] = []
    extent = Fraction(reach(robot))
    for array in program.signature.inputs:
        if array.name == "q":
            found += fraction_box(robot)
        elif array.name in ("actuators", "joints"):
            return None
        elif array.is_pose:
            found += [_around(extent if place % 4 == 3 else Fraction(1)) for place in range(array.size)]
        else:
            found += [_around(Fraction(1) if array.shape == (robot.dof,) else extent)] * array.size
    return tuple(found)


def _around(size: Fraction) -> tuple[Fraction, Fraction]:
    return -size * (1 + Fraction(1, 2**20)), size * (1 + Fraction(1, 2**20))


# The spread -----------------------------------------------------------------------------------------------------------


def _spread(expectation: Expectation, program: Program, real: NumberType) -> Limits:
    """`SPREADS` times the root mean square, at each input or in the middle of all inputs, where that is more."""
    known = expectation.known
    trials = trials_at(known.robot, program, known.inputs, known.count, real)
    found = (_splits(expectation, shaped(program, outputs)) for outputs in trials)
    plain = next(found)
    squares = [[[np.zeros(part.shape) for part in split] for split in frames] for frames in plain]
    for other in found:
        for (result, column), split in _each(plain):
            for part, (one, two) in enumerate(zip(split, other[result][column], strict=True)):
                squares[result][column][part] += apart(one, two) ** 2
    return tuple(
        tuple(
            (_limit(lengths, split[0]), _limit(numbers, split[1]))
            for (lengths, numbers), split in zip(totals, splits, strict=True)
        )
        for totals, splits in zip(squares, plain, strict=True)
    )


def _limit(squares: FloatArray, plain: Any) -> FloatArray:
    """Returns what is accepted after all trials; anything where there is no number."""
    return np.where(np.isnan(plain.astype(np.float64)), np.inf, SPREADS * _at_least_usual(np.sqrt(squares / TRIALS)))


def _at_least_usual(spread: FloatArray) -> FloatArray:
    """Returns the spread of each entry, but not less than the largest one of an input in the middle of all inputs."""
    if not spread.size:
        return spread
    usual: FloatArray = np.maximum(spread, np.median(spread.max(axis=1)))
    return usual


# Arrays ---------------------------------------------------------------------------------------------------------------


def shaped(program: Program, outputs: FloatArray, last_row: float = 1.0) -> tuple[FloatArray, ...]:
    """Returns the numbers of a program as arrays, as a package gives them."""
    found, start = [], 0
    for array in program.signature.results:
        block = outputs[:, start : start + array.size]
        start += array.size
        if array.is_pose:
            upper = block.reshape(len(block), -1, 3, 4)
            last = np.broadcast_to([0.0, 0.0, 0.0, last_row], (*upper.shape[:2], 1, 4))
            block = np.concatenate([upper, last], axis=2)
        found.append(block.reshape(len(block), *array.shape))
    return tuple(found)


def _splits(expectation: Expectation, results: tuple[FloatArray, ...]) -> Limits:
    """Results apart into lengths and all other entries, for each result and frame."""
    return tuple(
        tuple(expectation.parts(place, column, result) for column in range(len(expectation.frames)))
        for place, result in enumerate(results)
    )


def _each(limits: Limits) -> Iterator[tuple[tuple[int, int], Split]]:
    for result, frames in enumerate(limits):
        for column, split in enumerate(frames):
            yield (result, column), split


def _mapped(limits: Limits, change: Callable[[int, Any], Any]) -> Limits:
    return tuple(tuple((change(0, lengths), change(1, numbers)) for lengths, numbers in frames) for frames in limits)


def _losses(expectation: Expectation, *, within: bool) -> tuple[FloatArray, FloatArray]:
    """What the reference may lose, of lengths and of all other entries; for each input, where these lie anywhere."""
    known = expectation.known
    robot = known.robot
    unit = 1e-30 if known.exact else WIDE_UNIT
    box = zip(robot.variables, joint_box(robot), strict=True)
    angles = [max(-low, high) for variable, (low, high) in box if variable.type is not JointType.PRISMATIC]
    relative = _LOSS * unit * (2 + len(robot.rows) + len(robot.frames)) * (1 + max(angles, default=0.0))
    relative += _READ * 2.0**-53 if known.exact and expectation.is_read else 0.0
    lengths = np.array([[expectation.length_scale]])
    if not within:
        # The reference shifts by lengths that follow joints, and these may cancel in what it returns.
        shifts = np.abs(known.joints.astype(np.float64)) @ np.array(length_rates(robot))
        lengths = np.maximum(lengths, shifts[:, None] * expectation.number_scale)
    return relative * lengths, np.array(relative * expectation.number_scale)
