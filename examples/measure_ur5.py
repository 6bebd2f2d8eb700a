"""Simulates what a laser tracker measures of a UR5 whose table is a little wrong, and writes it as CSV.

    python examples/measure_ur5.py measured.csv

Every entry of the table is off by about 1 mm or 1 mrad, so that axes 2, 3 and 4 are no longer parallel. 40 poses have
noise of 0.05 mm and 0.1 mrad, and one of them is misread by 3 mm.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from kinegen import reference
from kinegen.io.load import load
from kinegen.model.expression_parser import evaluate
from kinegen.model.expression_values import FLOAT64
from kinegen.model.runtime_entries import with_runtime_entries
from kinegen.tools.calibrate.arm_model import from_vector, to_vector

ROBOT = Path(__file__).resolve().parent.parent / "robots" / "ur5.yaml"
POSES, MISREAD = 40, 17
NOISE, NOISE_ANGLE = 5e-5, 1e-4


def main(arguments: list[str]) -> int:
    """Write the file that is named."""
    robot, random = with_runtime_entries(load(ROBOT), ("dh",)), np.random.default_rng(7)
    truth = {}
    for parameter in robot.parameters:
        # d between nearly parallel axes may be anything, so it stays.
        size = 0.0 if parameter.name in ("d_shoulder", "d_elbow") else 1e-3
        truth[parameter.name] = float(evaluate(parameter.value, {}, FLOAT64)) + size * random.normal()
    q = random.uniform(-2.5, 2.5, (POSES, robot.dof))
    poses = reference.frames(robot, q, truth)["tool"]
    positions = poses[:, :3, 3] + NOISE * random.normal(size=(POSES, 3))
    positions[MISREAD, 2] += 3e-3
    turned = from_vector(NOISE_ANGLE * random.normal(size=(POSES, 3))) @ poses[:, :3, :3]
    joints = [f"{variable.name}[deg]" for variable in robot.variables]
    lines = [",".join([*joints, "x[mm]", "y[mm]", "z[mm]", "rx[deg]", "ry[deg]", "rz[deg]"])]
    for angles, position, turn in zip(np.degrees(q), 1e3 * positions, np.degrees(to_vector(turned)), strict=True):
        numbers = (*(f"{angle:.4f}" for angle in angles), *(f"{each:.4f}" for each in position))
        lines.append(",".join((*numbers, *(f"{each:.5f}" for each in turn))))
    Path(arguments[0]).write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
