"""A tool whose place and rotation are set at run time, as runtime parameters in `tool:` of the robot file."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from kinegen.io.load import loads
from kinegen.verify import reference
from tests.inverse.arms import Arm, arm_of, distances, evaluate

Numbers = NDArray[np.float64]

TOOL = """\
parameters:
  x: {value: 0, dimension: length, runtime: true}
  y: {value: 0, dimension: length, runtime: true}
  z: {value: 0, dimension: length, runtime: true}
  roll: {value: 0, dimension: angle, runtime: true}
  pitch: {value: 0, dimension: angle, runtime: true}
  yaw: {value: 0, dimension: angle, runtime: true}
tool: {xyz: [x, y, z], rpy: [roll, pitch, yaw]}
"""

SCALES = {"mm": 1.0, "m": 1e-3}

JOINTS = {
    "spherical wrist": "450 90 400, 500 0 0, 50 90 0, 0 -90 430, 0 90 0, 0 0 90",
    "three parallel axes": "0 90 150, -600 0 0, -570 0 0, 0 90 130, 0 -90 120, 0 0 90",
    "position of three joints": "70 90 400, 500 0 0, 430 0 0",
}

TOOLS = {
    "none": (0, 0, 0, 0, 0, 0),
    "straight": (0, 0, 180, 0, 0, 0),
    "offset": (35, -60, 120, 0, 0, 0),
    "quarter turns": (50, 20, -10, 90, 0, -90),
    "gimbal": (-30, 80, 40, 180, 90, 90),
    "half turns": (10, 0, 200, 180, -180, 180),
    "leaning": (25, -15, 300, 20, -35, 130),
}


@cache
def arm(name: str, unit: str) -> Arm:
    """The arm in a unit of length."""
    rows = [[float(number) for number in row.split()] for row in JOINTS[name].split(",")]
    lines = [
        f"  - {{name: j{k}, a: {a * SCALES[unit]}, alpha: {alpha}, d: {d * SCALES[unit]}, theta: q}}\n"
        for k, (a, alpha, d) in enumerate(rows)
    ]
    begin = f"kinegen: 1\nname: arm\nconvention: standard\nunits: {{length: {unit}, angle: deg}}\n"
    return arm_of(loads(begin + TOOL + "joints:\n" + "".join(lines), "arm.yaml"))


def tool_of(numbers: tuple[float, ...]) -> Numbers:
    """The transform of a tool, from its last link, by three plain rotations."""
    matrix = np.eye(4)
    for axis, angle in enumerate(numbers[3:]):
        c, s = np.cos(angle), np.sin(angle)
        turn = np.eye(3)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turn[[i, i, j, j], [i, j, i, j]] = c, -s, s, c
        matrix[:3, :3] = turn @ matrix[:3, :3]
    matrix[:3, 3] = numbers[:3]
    return matrix


@pytest.mark.parametrize("unit", ["mm", "m"])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("name", JOINTS)
def test_solutions_bring_the_tip_of_any_tool_to_its_target(name: str, dtype: type, unit: str) -> None:
    """Targets are poses of the flange times the tool; the joints are those that made them."""
    made = arm(name, unit)
    is_double = dtype is np.float64
    q = np.random.default_rng(3).uniform(-1.2, 1.2, (50, made.robot.dof)) + 0.3
    flange = reference.pose(made.robot, q)[:, 0]
    for numbers in TOOLS.values():
        params = (*(SCALES[unit] * each for each in numbers[:3]), *np.radians(numbers[3:]))
        tip = flange @ tool_of(params)
        solutions, valid = evaluate(replace(made, params=params), tip.astype(dtype))
        nearest = np.where(valid > 0, distances(made, solutions, q), np.inf).min(axis=1)
        values = dict(zip(("x", "y", "z", "roll", "pitch", "yaw"), params, strict=True))
        reached = [reference.pose(made.robot, each, values)[:, 0] for each in solutions.swapaxes(0, 1)]
        apart = np.abs(np.stack(reached, axis=1) - tip[:, None])[..., :3, 3].max(axis=2) / SCALES[unit]

        assert np.median(nearest) < (1e-12 if is_double else 1e-5)
        assert nearest.max() < (1e-7 if is_double else 0.05)
        assert np.where(valid > 0, apart, 0).max() < (1e-9 if is_double else 1)
