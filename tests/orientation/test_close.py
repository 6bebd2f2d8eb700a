"""Derivatives of orientations beside their singularities: right to the error that the pages state, down to rounding."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest

from kinegen.derive.dispatch import derive
from kinegen.io.load import loads
from kinegen.ir.lower import lower
from kinegen.model.outputs import Kind, parse_quantity
from kinegen.verify.reference import Kinematics, Orientation
from tests.evaluation import run

UNITS = 10
"""Relative error that docs/orientation.md states, in units of rounding over the distance from the singularity."""

ARM = (
    "kinegen: 1\nname: arm\nconvention: standard\nunits: {length: m, angle: deg}\njoints:\n"
    "  - {name: a, d: 0.1, a: 0.2, alpha: 37, theta: q}\n"
    "  - {name: b, d: 0.1, a: 0.2, alpha: -90, theta: q + 11}\n"
    "  - {name: c, d: 0.1, a: 0.2, alpha: 90, theta: q}\n"
    "  - {name: d, d: 0.1, a: 0.2, alpha: 23, theta: q}\n"
)
FORMS = {"rpy_zyx": (2, 0), "rpy_xyz": (0, 2), "euler_zyz": (2, 2)}
"""Which entry of the rotation is one in magnitude at the singularity."""


def singular(form: str) -> np.ndarray:
    """A joint vector right at the singularity, found by Newton steps on the distance from it."""
    robot = loads(ARM, "arm")
    with mpmath.workdps(60):
        i, j = FORMS[form]
        q = np.array([[0.4, 0.9, 0.7, -0.3]])
        for _ in range(60):
            motion = Kinematics(robot, q)
            rotation, angular = motion.pose("tool")[0, :3, :3], motion.jacobian("tool")[0, 3:]
            others = [k for k in range(3) if k != j]
            rates = np.array([np.cross(angular.T, rotation[:, k])[:, i] for k in others])
            q = q - np.linalg.pinv(rates) @ rotation[i, others]
    return q


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("power", range(1, 14))
def test_the_error_is_some_units_over_the_distance(form: str, power: int) -> None:
    robot = loads(ARM, "arm")
    steps = np.random.default_rng(power).normal(size=(20, 4)) * 10.0**-power
    q = singular(form) + steps
    motion = Kinematics(robot, q, exact=True)
    turned = Orientation(motion.pose("tool")[:, :3, :3])
    right = turned.jacobian(Kind(form), motion.jacobian("tool")[:, 3:]).astype(np.float64)
    distance = turned.margin(Kind(form)).astype(np.float64)
    program = lower(derive(robot, parse_quantity(f"{form}_jacobian")))
    found = run(robot, program, q).reshape(right.shape)
    relative = np.abs(found - right).max(axis=(1, 2)) / np.maximum(1, np.abs(right).max(axis=(1, 2)))

    assert (relative * distance)[distance > 1e-14].max(initial=0) < UNITS * 2.0**-53
    assert distance.min() < 10.0 ** (1 - power)
    assert math.isfinite(np.abs(found).max())
