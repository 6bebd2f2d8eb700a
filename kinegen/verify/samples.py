"""Inputs on which kernels are compared: corners, special angles, random points, far values, parameters."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from kinegen.model.actuator_limits import reading_box
from kinegen.model.expression_parser import Expression, evaluate, linear, number
from kinegen.model.expression_values import FLOAT64
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.outputs import Array, Kind
from kinegen.model.robot import TOOL, JointType, Robot, Row, angles_of, lengths_of
from kinegen.verify.reference import Actuation, Kinematics, rotations

CORNERS = 4096
RANDOM = 10_000
SPECIAL = 512
SINGULAR = 8
SEED = 20240229

NEARBY = 128
"""So many multiples of 45 degrees around zero are candidates, and as many random ones, where limits allow more."""

BESIDE, DECADES = 32, 15
"""So many special points have others beside them, at so many distances."""

EVERY = 16
"""One of so many inputs besides joint vectors is special."""

FloatArray = NDArray[np.float64]
Truths = NDArray[np.bool_]


def proof_samples(robot: Robot) -> FloatArray:
    """Joint vectors for the proof of a build.

    Returns shape (N, dof): zero, all corners of the joint box (`CORNERS` of them where there are more), points at which
    several joints stand at multiples of 45 degrees or at the ends of their strokes, points right beside these, and
    random points.
    """
    if robot.dof == 0:
        return np.zeros((1, 0))
    generator = np.random.default_rng(SEED)
    box = np.array(joint_box(robot))
    zero_and_corners = (np.clip(np.zeros((1, robot.dof)), box[:, 0], box[:, 1]), _corners(box, generator))
    special = _special(robot, box, generator)
    parts = (
        *zero_and_corners,
        special,
        _nearly(special, box, np.random.default_rng(SEED + 1)),
        generator.uniform(box[:, 0], box[:, 1], (RANDOM, robot.dof)),
    )
    return np.concatenate(parts)


def _corners(box: FloatArray, generator: np.random.Generator) -> FloatArray:
    dof = len(box)
    if 2**dof <= CORNERS:
        return np.array(list(itertools.product(*box)))
    choice = generator.integers(0, 2, (CORNERS, dof))
    return np.where(choice, box[:, 1], box[:, 0])


def _special(robot: Robot, box: FloatArray, generator: np.random.Generator) -> FloatArray:
    """Points where poses are singular or entries vanish, most of them at multiples of a right angle."""
    columns = []
    for variable, (low, high) in zip(robot.variables, box, strict=True):
        if variable.type is JointType.PRISMATIC:
            candidates = np.array([low, high, np.clip(0.0, low, high)])
        else:
            steps = _eighths(low, high, generator)
            quarters = np.concatenate([steps, steps[steps % 2 == 0], steps[steps % 2 == 0]])
            candidates = quarters * (math.pi / 4) if len(quarters) else np.array([low, high])
        columns.append(generator.choice(candidates, SPECIAL))
    return np.stack(columns, axis=1)


def _nearly(special: FloatArray, box: FloatArray, generator: np.random.Generator) -> FloatArray:
    """Points as near to special ones as 1e-1 to 1e-15, in one joint."""
    points = np.repeat(special[:BESIDE], DECADES, axis=0)
    offsets = np.tile(10.0 ** -np.arange(1, DECADES + 1), BESIDE) * generator.choice((-1, 1), len(points))
    points[np.arange(len(points)), generator.integers(0, len(box), len(points))] += offsets
    return np.clip(points, box[:, 0], box[:, 1])


def _eighths(low: float, high: float, generator: np.random.Generator) -> NDArray[np.int64]:
    """The eighths of a turn between two angles: all, or where there are many, those nearest to zero and random ones."""
    first, last = math.ceil(low / (math.pi / 4)), math.floor(high / (math.pi / 4))
    if last - first < 2 * NEARBY:
        return np.arange(first, last + 1)
    middle = min(max(0, first + NEARBY // 2), last - NEARBY // 2)
    nearby = np.arange(middle - NEARBY // 2, middle + NEARBY // 2 + 1)
    return np.concatenate([nearby, generator.integers(first, last, NEARBY, endpoint=True)])


def random_joints(robot: Robot, count: int, seed: int = SEED) -> FloatArray:
    """Returns joint vectors from the joint box, shape (count, dof)."""
    low, high = np.array(joint_box(robot)).T
    return np.random.default_rng(seed).uniform(low, high, (count, robot.dof))


def singular_values(
    robot: Robot, q: FloatArray, size: float = 0.0, joints: Sequence[int] | None = None, rows: int = 6
) -> FloatArray:
    """Returns the singular values of Jacobians of the tool, largest first, shape (N, k), by some of the joints.

    Lengths are relative to `size`, the reach if left out.
    """
    weights = np.array([1 / (size or reach(robot))] * 3 + [1.0] * 3)[:rows, None]
    jacobians = Kinematics(robot, q).jacobian(TOOL)[:, :rows] * weights
    found: FloatArray = np.linalg.svd(jacobians if joints is None else jacobians[:, :, joints], compute_uv=False)
    return found


def singular_samples(robot: Robot) -> FloatArray:
    """Returns a few joint vectors at which arms are stretched, folded or aligned.

    Shape (N, dof): joints at multiples of 45 degrees and at the ends of their strokes; none without joints.
    """
    if robot.dof == 0:
        return np.zeros((0, 0))
    return _special(robot, np.array(joint_box(robot)), np.random.default_rng(SEED))[:SINGULAR]


def input_samples(robot: Robot, inputs: Sequence[Array], points: FloatArray) -> dict[str, FloatArray]:
    """Values for all inputs of a kernel.

    `points`: joint vectors, shape (N, dof). Returns for each array by name N values: the joint vectors; rates and
    accelerations in -1 to 1, some of them zero; poses within reach, with rotations of every kind and some of a quarter
    or half turn; points within reach; readings of actuators, and joint vectors that belong to readings.
    """
    generator = np.random.default_rng(SEED)
    count, extent = len(points), reach(robot)
    found = {}
    for array in inputs:
        if array.name == "q":
            found[array.name] = points
        elif array.name in ("actuators", "joints"):
            readings = _readings(robot, generator, count)
            found[array.name] = readings if array.name == "actuators" else _joints(robot, readings)
        elif array.is_pose:
            found[array.name] = _poses(generator, count, extent)
        elif array.shape == (robot.dof,):
            rates = generator.uniform(-1, 1, (count, robot.dof))
            rates[:: 2 * EVERY] = 0
            found[array.name] = np.where(np.arange(count)[:, None] % EVERY, rates, np.round(rates))
        else:
            found[array.name] = generator.uniform(-extent, extent, (count, *array.shape))
    return found


def _readings(robot: Robot, generator: np.random.Generator, count: int) -> FloatArray:
    """Actuator vectors: the middle of their box, corners of it, and random ones."""
    box = np.array(reading_box(robot))
    readings = generator.uniform(box[:, 0], box[:, 1], (count, len(box)))
    corners = generator.integers(0, 2, (len(readings[::EVERY]), len(box)))
    readings[::EVERY] = np.where(corners, box[:, 1], box[:, 0])
    readings[:1] = box.mean(axis=1)
    return readings


def _joints(robot: Robot, readings: FloatArray) -> FloatArray:
    """Joint vectors that actuators can bring about."""
    joints = Actuation(robot, readings).joints
    possible = joints[~np.isnan(joints).any(axis=1)]
    return joints if len(possible) == len(joints) else np.resize(possible, joints.shape)


def _poses(generator: np.random.Generator, count: int, extent: float) -> FloatArray:
    """Rigid displacements; every one of `EVERY` turns by a multiple of a quarter turn."""
    quaternions = generator.normal(size=(count, 4))
    special = np.clip(np.round(quaternions[::EVERY]), -1, 1)
    special[:, 0] += (special == 0).all(axis=1)
    quaternions[::EVERY] = special
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    poses = np.zeros((count, 4, 4))
    poses[:, :3, :3] = rotations(Kind.QUATERNION_WXYZ, quaternions)
    poses[:, :3, 3] = generator.uniform(-extent, extent, (count, 3))
    poses[:, 3, 3] = 1
    return poses


def vector_samples(robot: Robot, random: int = 13) -> FloatArray:
    """Returns a few joint vectors for the test vectors that are written beside the kernels.

    `random`: how many of them are random; the others are zero and both ends of all strokes and angles. Shape (N, dof);
    every entry is a multiple of 1/1024, so that floats hold it exactly.
    """
    if robot.dof == 0:
        return np.zeros((1, 0))
    generator = np.random.default_rng(SEED)
    box = np.array(joint_box(robot))
    inside = np.stack([np.ceil(box[:, 0] * 1024), np.floor(box[:, 1] * 1024)], axis=1) / 1024
    zero = np.clip(np.zeros((1, robot.dof)), inside[:, 0], inside[:, 1])
    anywhere = np.round(generator.uniform(inside[:, 0], inside[:, 1], (random, robot.dof)) * 1024) / 1024
    return np.concatenate([zero, inside.T, anywhere])


LARGEST_ANGLE = {"double": 1e5, "float": 12_000.0}
"""Magnitude in radians up to which the headers promise sines and cosines; beyond it they are NaN."""

POSES = 256
"""Joint vectors, of every size."""

SMALLEST = 2.0**-12
"""The smallest of these joint vectors have this share of the size of the largest."""

MARGIN = 0.9
STROKES = 4


def beyond_limits(robot: Robot, real: str) -> FloatArray:
    """Joint vectors within and beyond the limits of the robot file.

    Returns shape (N, dof), without rows for a robot without joints: angles up to the promised range, strokes of up to
    `STROKES` times the box. No angle in the table, and no sum of them, gets beyond what is promised.
    """
    if robot.dof == 0:
        return np.zeros((0, 0))
    generator = np.random.default_rng(SEED)
    is_stroke = np.array([variable.type is JointType.PRISMATIC for variable in robot.variables])
    strokes = STROKES * np.abs(np.array(joint_box(robot))).max(axis=1)
    # Entries of the table that do not depend on joints have no more than a few turns.
    total = (MARGIN * LARGEST_ANGLE[real] - 100) / max(1.0, sum(angle_rates(robot)))
    size = SMALLEST ** generator.uniform(0, 1, (POSES, 1))
    share = generator.uniform(-1, 1, (POSES, robot.dof))
    return share * np.where(is_stroke, strokes, size * total)


def angle_rates(robot: Robot) -> tuple[float, ...]:
    """Returns how fast the angles of the table grow with each joint variable, added up over all rows.

    One number for each variable, in radians per radian (or length unit); 0 for one that turns nothing.
    """
    return _rates(robot, angles_of)


def length_rates(robot: Robot) -> tuple[float, ...]:
    """Returns how fast the lengths of the table grow with each joint variable, added up over all rows.

    One number for each variable, in length units per radian (or length unit); 0 for one that shifts nothing.
    """
    return _rates(robot, lengths_of)


def _rates(robot: Robot, entries_of: Callable[[Row], tuple[Expression, ...]]) -> tuple[float, ...]:
    names = tuple(variable.name for variable in robot.variables)
    values = {entry.name: float(evaluate(entry.value, {}, FLOAT64)) for entry in robot.parameters}
    found = dict.fromkeys(names, 0.0)
    for entry in (entry for row in robot.rows for entry in entries_of(row)):
        factors, _ = linear(entry, frozenset(names))
        for name, factor in factors.items():
            found[name] += abs(float(evaluate(factor, values, FLOAT64)))
    return tuple(found.values())


def move_parameters(robot: Robot) -> tuple[Robot, tuple[float, ...]]:
    """Give every runtime parameter another value, so that a kernel that ignores or mixes them up is seen.

    `robot`: a robot with runtime parameters. Returns the robot with its parameters moved, each in its own way, and
    their values, which floats hold exactly.
    """
    moved: dict[str, Fraction] = {}
    for place, parameter in enumerate(robot.runtime_parameters, start=1):
        value = float(evaluate(parameter.value, {}, FLOAT64))
        moved[parameter.name] = Fraction(float(np.float32(value * (1 + place / 16) + 1 / 32)))
    values = tuple(float(value) for value in moved.values())
    return with_values(robot, values), values


def with_values(robot: Robot, values: Sequence[float]) -> Robot:
    """Returns the robot with other values of its runtime parameters, in their order."""
    given = iter(values)
    parameters = tuple(
        replace(parameter, value=number(Fraction(next(given)))) if parameter.runtime else parameter
        for parameter in robot.parameters
    )
    return replace(robot, parameters=parameters)


def parameter_sets(robot: Robot) -> FloatArray:
    """Returns the values of the robot file and the moved ones, for batches in which they alternate.

    `robot`: a robot with runtime parameters. Shape (2, parameters), in numbers that floats hold exactly.
    """
    usual = [float(evaluate(parameter.value, {}, FLOAT64)) for parameter in robot.runtime_parameters]
    return np.array([np.array(usual, np.float32).astype(float), move_parameters(robot)[1]])
