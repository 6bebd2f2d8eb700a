"""Arms with known mistakes, and what a laser tracker would measure of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kinegen.io.load import load
from kinegen.tools.calibrate.arm_model import Arm, from_vector, make_arm
from kinegen.tools.calibrate.fitted_parameters import Prepared, choose, prepare
from kinegen.tools.calibrate.measurements import Kind, Measurements

ROOT = Path(__file__).resolve().parents[2]
ROBOTS = ROOT / "robots"

SIGMA, SIGMA_ANGLE = 5e-5, 1e-4


def arm_of(file: Path, *words: str) -> tuple[Prepared, Arm]:
    """The arm of a robot file with what the words vary."""
    robot = load(file)
    choice = choose(robot, words)
    prepared = prepare(robot, choice)
    return prepared, make_arm(prepared, choice)


def wrong(arm: Arm, seed: int = 0, share: float = 0.1) -> NDArray[np.float64]:
    """Values that are off by about 1 mm and 1 mrad on an arm of 1 m."""
    return arm.start + share * arm.units * np.random.default_rng(seed).normal(size=len(arm.start))


def measured(
    arm: Arm, values: NDArray[np.float64], q: NDArray[np.float64], kind: Kind = Kind.POSE, noise: float = 1.0
) -> Measurements:
    """What is measured of an arm with some values, with noise in standard deviations."""
    random, rows = np.random.default_rng(1), len(q)
    poses = arm.poses(values, q)
    shift = noise * SIGMA * random.normal(size=(rows, 3))
    turn = from_vector(noise * SIGMA_ANGLE * random.normal(size=(rows, 3)))
    return Measurements(
        path="measured.csv",
        lines=tuple(range(2, rows + 2)),
        kinds=(kind,) * rows,
        q=q,
        to_q=np.full_like(q, np.nan),
        positions=poses[:, :3, 3] + shift,
        rotations=turn @ poses[:, :3, :3],
        lengths=np.full(rows, np.nan),
        fixtures=("",) * rows,
        sigma=np.full(rows, SIGMA),
        sigma_angle=np.full(rows, SIGMA_ANGLE),
        stated=True,
    )


def joint_vectors(arm: Arm, rows: int, seed: int = 2) -> NDArray[np.float64]:
    """Random joint vectors, two radians or two lengths to either side."""
    return np.random.default_rng(seed).uniform(-2, 2, (rows, arm.robot.dof))
