"""What all solutions of an arm cost, and whether any is missed: `python -m benchmarks.complete [POSES]`.

For each arm, random joint vectors are planted: the pose of each is solved for, and one of the solutions has to be the
joint vector itself. Times are those of the compiled package on one thread.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.speed.arm import ROBOTS
from kinegen.formats.load import load
from kinegen.native.package import load_package
from kinegen.outputs import COMPLETE_INVERSE, Quantity
from kinegen.pipeline import build
from kinegen.results import BuildOptions
from kinegen.robot.extent import joint_box

ARMS = {"jaco2": 60, "crx10ial": 60, "xarm6": 60, "gen3_lite": 60, "general_6r": 250, "manseur_doty": 250}
"""Robots with the microseconds that are promised for a target."""

BLOCK = 50_000
NEAR = 1e-5


def main(poses: int) -> None:
    """Print a line for each arm."""
    print("arm           us a target  promised  poses      missed  solutions on average")
    for name, promised in ARMS.items():
        seconds, missed, solutions = measure(name, poses)
        print(f"{name:<13} {seconds / poses * 1e6:11.1f} {promised:9} {poses:10,} {missed:7,} {solutions / poses:8.1f}")


def measure(name: str, poses: int) -> tuple[float, int, int]:
    """Seconds, missed joint vectors and solutions for so many poses of a robot."""
    path = Path(ROBOTS / f"{name}.yaml")
    low, high = np.array(joint_box(load(path))).T
    random = np.random.default_rng(5)
    seconds, missed, solutions = 0.0, 0, 0
    with tempfile.TemporaryDirectory() as folder:
        options = BuildOptions(output=Path(folder), quantities=(Quantity.POSE, COMPLETE_INVERSE))
        package = load_package(build(path, options, lambda _: None).folder)
        for first in range(0, poses, BLOCK):
            q = random.uniform(low, high, (min(BLOCK, poses - first), 6))
            targets = package.fk(q)
            start = time.process_time()
            found, valid = package.complete_inverse(targets)
            seconds += time.process_time() - start
            apart = np.abs((found - q[:, None] + np.pi) % (2 * np.pi) - np.pi).max(axis=2)
            missed += int((np.where(valid, apart, np.inf).min(axis=1) > NEAR).sum())
            solutions += int(valid.sum())
    return seconds, missed, solutions


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000)
