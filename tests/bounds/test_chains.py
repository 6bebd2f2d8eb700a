"""Random robots of every kind: kernels stay within their bounds, and so does the most unlucky arithmetic."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings

from kinegen.backends.accuracy import error_bound
from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.dispatch import derive
from kinegen.ir.lower import lower
from kinegen.model.joint_bounds import joint_box
from kinegen.model.outputs import USUAL, Quantity
from kinegen.model.robot import Robot
from kinegen.verify import reference
from tests.bounds.arithmetic import Adversary, Floats, run
from tests.chains import exact_defaults, robots
from tests.sincos.library import COMPILERS

SEED = 20240229
POSES = 64

pytestmark = pytest.mark.skipif(not COMPILERS, reason="needs gcc or clang for the sine and cosine (apt install gcc)")


def kernels_of(robot: Robot, quantity: Quantity) -> RobotPrograms:
    return RobotPrograms(robot, (lower(derive(robot, quantity)),), exact_defaults(robot))


def poses(robot: Robot, count: int = POSES) -> Floats:
    """Joint vectors in the joint box that both number types hold."""
    box = np.array(joint_box(robot)).reshape(robot.dof, 2)
    q = np.random.default_rng(SEED).uniform(box[:, 0], box[:, 1], (count, robot.dof))
    return np.trunc(q * 1024) / 1024


def proven(kernels: RobotPrograms, real: ScalarType) -> Floats:
    return np.array(error_bound(kernels, kernels.programs[0], real).entries)


@pytest.mark.parametrize("quantity", USUAL)
@settings(max_examples=20)
@given(robot=robots())
def test_float_results_stay_within_their_bounds(quantity: Quantity, robot: Robot) -> None:
    kernels = kernels_of(robot, quantity)
    q = poses(robot)
    results = [run(kernels.programs[0], q, kernels.defaults, real) for real in (ScalarType.FLOAT, ScalarType.DOUBLE)]
    off = np.abs(results[0] - results[1]).max(axis=1)
    # The parameters are rounded to either type, and both bounds count that.
    assert (off <= proven(kernels, ScalarType.FLOAT) + proven(kernels, ScalarType.DOUBLE)).all()


@settings(max_examples=20)
@given(robot=robots())
def test_double_results_stay_within_their_bounds(robot: Robot) -> None:
    """Against fifty digits, straight from the table."""
    kernels = kernels_of(robot, Quantity.FRAMES)
    q = poses(robot, count=2)
    found = run(kernels.programs[0], q, kernels.defaults, ScalarType.DOUBLE)
    bounds = proven(kernels, ScalarType.DOUBLE)
    for place, vector in enumerate(q):
        known = reference.frames_mp(robot, vector)
        exact = [known[frame][row, column] for frame in robot.frame_names for row in range(3) for column in range(4)]
        with mpmath.workdps(50):
            off = [float(abs(mpmath.mpf(float(one)) - true)) for one, true in zip(found[:, place], exact, strict=True)]

        assert (np.array(off) <= bounds + 1e-45).all()


@pytest.mark.parametrize("quantity", [Quantity.POSE, Quantity.FRAMES])
@settings(max_examples=12)
@given(robot=robots(most_rows=4))
def test_no_adversary_gets_past_the_bound(quantity: Quantity, robot: Robot) -> None:
    kernels = kernels_of(robot, quantity)
    program = kernels.programs[0]
    adversary = Adversary(program, kernels.defaults)
    outputs = {operand: number for number, operand in enumerate(program.outputs)}.values()
    bounds, sharp = proven(kernels, ScalarType.FLOAT), proven(kernels, ScalarType.DOUBLE)
    for output in outputs:
        found = adversary.errors(poses(robot, 16).astype(np.float32), output).max()

        assert found <= bounds[output] * (1 + 1e-6) + 16 * sharp[output] + 1e-15
