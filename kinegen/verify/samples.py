"""Joint vectors on which kernels are compared: corners of the joint box, special angles, random points."""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from kinegen.robot.extent import joint_box
from kinegen.robot.model import JointType, Robot

CORNERS = 4096
RANDOM = 10_000
SPECIAL = 512
SEED = 20240229

FloatArray = NDArray[np.float64]


def proof_samples(robot: Robot) -> FloatArray:
    """Joint vectors for the proof of a build.

    Args:
        robot: The robot.

    Returns:
        Shape (N, dof): zero, all corners of the joint box (`CORNERS` of them where there are more), points at which
        several joints stand at multiples of 45 degrees or at the ends of their strokes, and random points.
    """
    if robot.dof == 0:
        return np.zeros((1, 0))
    generator = np.random.default_rng(SEED)
    box = np.array(joint_box(robot))
    parts = (
        np.clip(np.zeros((1, robot.dof)), box[:, 0], box[:, 1]),
        _corners(box, generator),
        _special(robot, box, generator),
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
            steps = np.arange(math.ceil(low / (math.pi / 4)), math.floor(high / (math.pi / 4)) + 1)
            quarters = np.concatenate([steps, steps[steps % 2 == 0], steps[steps % 2 == 0]])
            candidates = quarters * (math.pi / 4) if len(quarters) else np.array([low, high])
        columns.append(generator.choice(candidates, SPECIAL))
    return np.stack(columns, axis=1)


def vector_samples(robot: Robot) -> FloatArray:
    """A few joint vectors for the test vectors that are written beside the kernels.

    Args:
        robot: The robot.

    Returns:
        Shape (N, dof); every entry is a multiple of 1/1024, so that floats hold it exactly.
    """
    if robot.dof == 0:
        return np.zeros((1, 0))
    generator = np.random.default_rng(SEED)
    box = np.array(joint_box(robot))
    inside = np.stack([np.ceil(box[:, 0] * 1024), np.floor(box[:, 1] * 1024)], axis=1) / 1024
    zero = np.clip(np.zeros((1, robot.dof)), inside[:, 0], inside[:, 1])
    random = np.round(generator.uniform(inside[:, 0], inside[:, 1], (13, robot.dof)) * 1024) / 1024
    return np.concatenate([zero, inside.T, random])
