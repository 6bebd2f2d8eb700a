"""What all solutions of an arm cost, and whether any is missed: `python -m benchmarks.complete [POSES]`.

For each arm, joint vectors are planted: random ones, and regular ones of multiples of 45 degrees, a tenth as many. The
pose of each is solved for, and one of the solutions has to be the joint vector itself. Times are those of the compiled
package on one thread. The form in NumPy is given a hundredth of the multiples of 45 degrees.
"""

from __future__ import annotations

import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.speed.arm import ROBOTS
from kinegen.driver.pipeline import build
from kinegen.driver.results import BuildOptions
from kinegen.io.load import load
from kinegen.model.joint_bounds import joint_box
from kinegen.model.outputs import COMPLETE_INVERSE, Quantity
from kinegen.runtime.extension import load_package
from kinegen.verify.complete_inverse import complete_in_numpy, drawn_multiples, least_singular_values

Array = NDArray[np.float64]

OTHERS = Path(__file__).parent / "robots"

ARMS = {
    "jaco2": 60,
    "crx10ial": 70,
    "xarm6": 90,
    "gen3_lite": 60,
    "general_6r": 250,
    "manseur_doty": 250,
    "gofa5": 90,
    "hollow_wrist": 60,
    "skew_wrist": 400,
}
"""Robots with the microseconds that are promised for a random target."""

BLOCK = 50_000
NEAR = 1e-5
STEP = 45
REGULAR = 1e-3


@dataclass
class Solved:
    """What came of some planted joint vectors."""

    poses: int = 0
    seconds: float = 0.0
    missed: int = 0
    solutions: int = 0

    def add(self, solve: Any, q: Array, targets: Array) -> None:
        """Solve for more of them."""
        start = time.process_time()
        found, valid = solve(targets)
        self.seconds += time.process_time() - start
        apart = np.abs((found - q[:, None] + np.pi) % (2 * np.pi) - np.pi).max(axis=2)
        self.missed += int((np.where(valid, apart, np.inf).min(axis=1) > NEAR).sum())
        self.solutions += int(valid.sum())
        self.poses += len(q)

    @property
    def micros(self) -> float:
        """Microseconds for one target."""
        return self.seconds / self.poses * 1e6


def main(poses: int) -> None:
    """Print a line for each arm."""
    print("arm             us a target  promised  poses      missed  solutions on average")
    print(f"                at multiples of {STEP} deg: us a target, poses, missed; poses in NumPy, missed")
    for name, promised in ARMS.items():
        random, multiples, in_numpy = measure(name, poses)
        average = random.solutions / random.poses
        print(f"{name:<15} {random.micros:11.1f} {promised:9} {random.poses:10,} {random.missed:7,} {average:8.1f}")
        counts = f"{multiples.poses:10,} {multiples.missed:7,} {in_numpy.poses:8,} {in_numpy.missed:7,}"
        print(f"                {multiples.micros:11.1f} {counts}", flush=True)


def measure(name: str, poses: int) -> tuple[Solved, Solved, Solved]:
    """Random joint vectors of a robot, multiples of 45 degrees, and a part of these in NumPy."""
    path = next(path for path in (ROBOTS / f"{name}.yaml", OTHERS / f"{name}.yaml") if path.exists())
    random, multiples, in_numpy = Solved(), Solved(), Solved()
    with tempfile.TemporaryDirectory() as folder:
        options = BuildOptions(output=Path(folder), quantities=(Quantity.POSE, COMPLETE_INVERSE))
        package = load_package(build(path, options, lambda _: None).folder)
        low, high = np.array(joint_box(load(path))).T
        generator = np.random.default_rng(5)
        for first in range(0, poses, BLOCK):
            q = generator.uniform(low, high, (min(BLOCK, poses - first), 6))
            random.add(package.complete_inverse, q, package.fk(q))
        q = _multiples(path, max(poses // 10, 100))
        multiples.add(package.complete_inverse, q, package.fk(q))
        q = q[: max(poses // 1000, 100)]
        in_numpy.add(complete_in_numpy(package, package.complete_inverse), q, package.fk(q))
    return random, multiples, in_numpy


def _multiples(path: Path, count: int) -> Array:
    """Regular joint vectors of multiples of 45 degrees."""
    robot = load(path)
    q = drawn_multiples(robot, STEP, 2 * count, np.random.default_rng(6))
    return q[least_singular_values(robot, q) > REGULAR][:count]


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000)
