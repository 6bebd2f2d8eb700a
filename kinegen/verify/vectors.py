"""Test vectors: joint vectors with what the kernels must return for them, from the 50-digit reference."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from decimal import ROUND_CEILING, Context
from fractions import Fraction
from operator import add, mul, neg, sub, truediv
from typing import Any

import mpmath
import numpy as np

from kinegen.backends.accuracy import NUMBER_TYPES
from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.test_vectors import Expected, Vectors
from kinegen.backends.inverse import solved_chain
from kinegen.backends.scalar_types import ScalarType
from kinegen.ir.program import Constant, Operand, Operator, Program, RuntimeParameter, Temporary, Variable
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.outputs import INVERSES, Array, Kind, Quantity, Signature
from kinegen.model.robot import JointType, JointVariable, Robot
from kinegen.verify.expected_results import subjects
from kinegen.verify.reference import DIGITS, Kinematics, redundancy
from kinegen.verify.reference_cache import PLACES, Numbers, ReferenceResults, quantity_frames
from kinegen.verify.rounding import COARSE, coarse_spread
from kinegen.verify.samples import SEED, FloatArray, input_samples, vector_samples

TARGETS = 8
"""Targets in a self-test."""

TARGET_CANDIDATES = 200
"""Joint vectors among which those are chosen that are far from singular ones."""

_INNER = 0.9
"""The part of each range, about its middle, in which they lie: rounding must not carry a solution past a limit."""

_DECIMALS = 9
"""Decimals of what is compared: far above what rounding moves."""

_GRID = 1024
"""Joint values are multiples of one part of so many, which floats hold exactly."""


def inverse_targets(robot: Robot) -> tuple[Numbers, FloatArray]:
    """Poses that an inverse has to solve, as exactly as 50 digits can say.

    `robot`: the robot, which has one tip. Returns poses of the tip, shape (N, 4, 4), and their joint vectors (N, dof):
    of random ones well within the limits those whose Jacobian, with lengths relative to the reach, is farthest from
    losing a rank.
    """
    box = np.array([_narrow(*entry) for entry in zip(robot.variables, joint_box(robot), strict=True)])
    middle, half = box.mean(axis=1), np.ptp(box, axis=1) / 2 * _INNER
    parts = np.random.default_rng(SEED).uniform(-1, 1, (TARGET_CANDIDATES, robot.dof))
    points = np.round((middle + parts * half) * _GRID) / _GRID
    (tip,) = robot.tips
    weights = np.array([1 / reach(robot)] * 3 + [1.0] * 3)[:, None]
    least = np.linalg.svd(Kinematics(robot, points).jacobian(tip) * weights, compute_uv=False).min(axis=1)
    # Rounded, since libraries for matrices round in ways of their own: a tie has to stay one on every machine.
    chosen = points[np.argsort(-np.round(least, _DECIMALS), kind="stable")[:TARGETS]]
    return Kinematics(robot, chosen, exact=True).pose(tip), chosen


def _narrow(variable: JointVariable, ends: tuple[float, float]) -> tuple[float, float]:
    """Of more than a whole turn the middle one: a solution may be turned back to it."""
    low, high = ends
    if variable.type is JointType.PRISMATIC or high - low <= 2 * math.pi:
        return ends
    return max(low, -math.pi), min(high, math.pi)


Row = tuple[Fraction, ...]

PAIRS = 24
"""Sines and cosines in the self-test of the pair."""

LARGE, FEW = 128, 4
"""Kernels with a result of more numbers than the first, but for poses, have no more rows than the second."""

CANDIDATES, SAFE = 96, 0.3
"""Joint vectors among which those are chosen that lie at least so far from every jump (see `Subject.margin`)."""

FAR = 16
"""Readings at which rounding moves a number by so many times more than it usually does are put elsewhere."""

_DRIVEN = ("actuators", "joints")
_TWO_DIGITS = Context(prec=2, rounding=ROUND_CEILING)
_RATES = ("qd", "qdd")
_NEGLIGIBLE = 1e-40
_EXACT: Mapping[Operator, Callable[..., Fraction]] = {
    Operator.ADD: add,
    Operator.SUB: sub,
    Operator.MUL: mul,
    Operator.DIV: truediv,
    Operator.NEG: neg,
}


def compute_vectors(kernels: RobotPrograms) -> Vectors:
    """Returns the test vectors of a robot, for all its kernels.

    Returns:
        Inputs, results and how far rounding moves them. A kernel whose numbers jump at every pose, by what rounding
        leaves of a zero, has no vectors. The inverse, which gives several results for one pose, has targets instead.
    """
    robot = kernels.robot
    programs = tuple(program for program in kernels.programs if program.quantity.kind not in INVERSES)
    given = given_arrays(robot, programs)
    values = vector_inputs(robot, programs)
    known = ReferenceResults(robot, values, exact=True)
    spreads = {program.quantity: coarse_spread(robot, program, values)[1] for program in programs}
    # Where rounding decides a result there is no number to expect.
    safe = [
        program for program in programs if _is_safe(known, program) and np.isfinite(spreads[program.quantity]).all()
    ]
    parameters = dict(zip((parameter.name for parameter in robot.runtime_parameters), kernels.defaults, strict=True))
    inputs = {name: _rows(value) for name, value in values.items()}
    # An inverse is tried at targets: it has several results for one pose.
    has_inverse = any(program.quantity.kind is Kind.INVERSE for program in kernels.programs)
    has_targets = (kernels.numeric_inverse and robot.is_arm) or has_inverse
    chain = solved_chain(kernels)
    targets = _targets(chain) if has_targets else ()
    expected = {
        program.quantity: vector_results(known, program.signature, spreads[program.quantity]) for program in safe
    }
    return Vectors(
        inputs=inputs,
        expected=expected,
        pairs=vector_pairs(programs, {name: _rows(_upper(given[name], values[name])) for name in values}, parameters),
        targets=targets,
        given=_given(chain, targets) if robot.redundancy and has_inverse else (),
    )


def given_arrays(robot: Robot, programs: Sequence[Program]) -> dict[str, Array]:
    """Returns the inputs of some programs by name, joint vectors among them."""
    given = {array.name: array for program in programs for array in program.signature.inputs}
    return {"q": Array("q", (robot.dof,))} | given if "q" not in given else given


def vector_inputs(robot: Robot, programs: Sequence[Program]) -> dict[str, FloatArray]:
    """Returns the inputs of the test vectors.

    `programs`: the programs of its kernels, but for the inverse. Arrays of N inputs by name; floats hold every entry
    exactly.
    """
    given = given_arrays(robot, programs)
    samples = input_samples(robot, tuple(given.values()), _safe_samples(robot, programs))
    values = {name: rounded(value * _speeds(robot, name)) for name, value in samples.items()}
    for name in _DRIVEN:
        readers = [program for program in programs if [array.name for array in program.signature.inputs] == [name]]
        if readers:
            values[name] = _firm(robot, readers, given[name], values[name])
    return values


def _firm(robot: Robot, readers: Sequence[Program], array: Array, usual: FloatArray) -> FloatArray:
    """Readings, or joints of them, away from dead centres: others in the place of those with a wide spread."""
    more = input_samples(robot, (array,), np.zeros((CANDIDATES, robot.dof)))[array.name]
    candidates = np.concatenate([usual, rounded(more)])
    wide = np.zeros(len(candidates), dtype=bool)
    for program in readers:
        inputs = {"q": candidates, array.name: candidates}
        spread = coarse_spread(robot, program, inputs)[1].max(axis=1, initial=0.0)
        usually = np.median(spread)
        wide |= ~np.isfinite(spread) | (np.isfinite(usually) & (spread > FAR * usually))
    others = iter(candidates[len(usual) :][~wide[len(usual) :]])
    return np.stack([next(others, row) if is_wide else row for row, is_wide in zip(usual, wide, strict=False)])


def _targets(robot: Robot) -> tuple[tuple[Row, Row], ...]:
    with mpmath.workdps(DIGITS):
        return tuple(zip(*map(_rows, inverse_targets(robot)), strict=True))


def _given(robot: Robot, targets: tuple[tuple[Row, Row], ...]) -> tuple[Row, ...]:
    """Returns what an inverse is given besides each target."""
    joints = np.array([[float(entry) for entry in row] for _, row in targets])  # multiples of one part of a power of 2
    values = redundancy(robot, joints, exact=True)
    return _rows(values.reshape(len(values), -1))


def _speeds(robot: Robot, name: str) -> FloatArray:
    """What rates in -1 to 1 are multiplied with: joints that slide go their reach, lest nobody notice them in mm."""
    if name not in _RATES:
        return np.ones(1)
    return np.array([reach(robot) if each.type is JointType.PRISMATIC else 1.0 for each in robot.variables])


def rounded(values: FloatArray) -> FloatArray:
    """Returns the same numbers, such that floats hold them exactly."""
    return values.astype(np.float32).astype(np.float64)


def vector_results(known: ReferenceResults, signature: Signature, spread: FloatArray) -> tuple[Expected, ...]:
    """Returns what a kernel must return.

    `known`: the reference at the inputs, in 50 digits; `spread`: how far units of floats move its numbers at these
    inputs, shape (N, outputs). For each result, rows of numbers: of each frame in turn all entries, of a 4x4 matrix the
    upper three rows. Where one of them is large, all have fewer rows than there are inputs.
    """
    frames = quantity_frames(known.robot, signature.quantity)
    is_small = signature.quantity.kind in PLACES or max(array.size for array in signature.results) <= LARGE
    count = known.count if is_small else min(FEW, known.count)
    expected: list[Expected] = []
    start = 0
    with mpmath.workdps(DIGITS):
        for subject, array in zip(subjects(signature.quantity), signature.results, strict=True):
            blocks = [_flat(_upper(array, subject.returned(known, frame))) for frame in frames]
            rows = _rows(np.concatenate(blocks, axis=1)[:count])
            columns = spread[:count, start : start + array.size].max(axis=0)
            expected.append(Expected(rows, subject.turns, {real: _spreads(columns, real) for real in ScalarType}))
            start += array.size
    return tuple(expected)


def _spreads(columns: FloatArray, real: ScalarType) -> Row:
    """Returns the spread in units of a number type, rounded up to two digits: the same on all machines."""
    part = Fraction(2**COARSE.precision, 2 ** NUMBER_TYPES[real].precision)
    return tuple(Fraction(_TWO_DIGITS.create_decimal(float(entry))) * part for entry in columns)


def _safe_samples(robot: Robot, programs: Sequence[Program]) -> FloatArray:
    """Joint vectors at which no number jumps: all of the usual ones where none ever does."""
    usual = vector_samples(robot)
    delicate = [program.quantity for program in programs if _has_jumps(program)]
    if not delicate:
        return usual
    candidates = vector_samples(robot, CANDIDATES)
    known = ReferenceResults(robot, {"q": candidates})
    good = np.ones(len(candidates), dtype=bool)
    for quantity in delicate:
        together = good & (_margins(known, quantity) > SAFE)
        good = together if together.sum() >= min(FEW, len(candidates)) else good
    return candidates[good][: len(usual)]


def _is_safe(known: ReferenceResults, program: Program) -> bool:
    """Returns whether a kernel has to return these numbers at all inputs, and not what rounding makes of them.

    Where a margin is zero at all poses, numbers are certain if the program leaves out what vanishes.
    """
    if not _has_jumps(program):
        return True
    margins = _margins(known, program.quantity)
    vanishes = any(isinstance(output, Constant) for output in program.outputs)
    return bool((margins > SAFE).all() or (vanishes and (margins < _NEGLIGIBLE).all()))


def _has_jumps(program: Program) -> bool:
    return any(subject.margin is not None for subject in subjects(program.quantity))


def _margins(known: ReferenceResults, quantity: Quantity) -> Numbers:
    """Returns the smallest distance from a jump over all frames, shape (N,)."""
    frames = quantity_frames(known.robot, quantity)
    margins = [
        each.margin(known, frame).astype(np.float64) for each in subjects(quantity) if each.margin for frame in frames
    ]
    smallest: Numbers = np.min(margins, axis=0)
    return smallest


def _upper(array: Array, values: Numbers) -> Numbers:
    """Matrices without their last rows."""
    return values[..., :3, :] if array.is_pose else values


def _flat(values: Numbers) -> Numbers:
    return values.reshape(len(values), math.prod(values.shape[1:]))


def _rows(values: Numbers) -> tuple[Row, ...]:
    return tuple(tuple(_fraction(entry) for entry in row) for row in _flat(values))


def vector_pairs(
    programs: tuple[Program, ...], inputs: Mapping[str, tuple[Row, ...]], parameters: Mapping[str, Fraction]
) -> tuple[tuple[Fraction, Fraction, Fraction], ...]:
    """Angles that kernels take the sine and cosine of, and both.

    Returns angle, sine and cosine, ascending; `PAIRS` at most, evenly picked. Floats hold the angles exactly.
    """
    exact = {
        angle
        for program in programs
        for rows in zip(*(inputs[array.name] for array in program.signature.inputs), strict=True)
        for angle in _angles(program, tuple(itertools.chain(*rows)), parameters)
    }
    angles = sorted({Fraction(ScalarType.FLOAT.round(angle)) for angle in exact})
    chosen = angles[:: math.ceil(len(angles) / PAIRS) or 1]
    with mpmath.workdps(50):
        results = [mpmath.cos_sin(mpmath.mpf(angle.numerator) / angle.denominator) for angle in chosen]
        return tuple((angle, _fraction(s), _fraction(c)) for angle, (c, s) in zip(chosen, results, strict=True))


def _angles(program: Program, row: Row, parameters: Mapping[str, Fraction]) -> Iterator[Fraction]:
    """Yields the arguments of the sines and cosines of one call, in exact arithmetic."""
    known: dict[Operand, Fraction] = {Variable(index): entry for index, entry in enumerate(row)}
    known |= {RuntimeParameter(name): value for name, value in parameters.items()}
    pairs = [place for place, each in enumerate(program.statements) if each.operator is Operator.SINCOS]
    for statement in program.statements[: max(pairs, default=-1) + 1]:
        known |= {operand: operand.value for operand in statement.operands if isinstance(operand, Constant)}
        operands = [known[operand] for operand in statement.operands if operand in known]
        if statement.operator is Operator.SINCOS:
            yield from operands  # none if it comes from a sine, a root or the like
        elif len(operands) == statement.operator.arity and statement.operator in _EXACT:
            known[Temporary(statement.name)] = _EXACT[statement.operator](*operands)


def _fraction(value: Any) -> Fraction:
    """Returns the exact value of an mpmath number; what 50 digits leave of a zero is zero."""
    if abs(value) < _NEGLIGIBLE:
        return Fraction(0)
    sign, mantissa, exponent, _ = mpmath.mpf(value)._mpf_  # mpmath offers no public way
    magnitude = Fraction(int(mantissa)) * Fraction(2) ** int(exponent)
    return -magnitude if sign else magnitude
