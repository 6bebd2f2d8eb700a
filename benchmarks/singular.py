"""How far solutions lead from their targets beside singular sets: `python -m benchmarks.singular [FILE ...]`.

For every arm with a closed form in `robots/`, or those in the files, each singular set of its formulas is approached
from random directions, at 1 to 1e-16 of a radian or of the reach. A row holds the largest error of a solution that is
called valid, in radians or parts of the reach, at each of these distances, in double or in float.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from kinegen.derive.inverse.derive import family_of
from kinegen.derive.inverse.family import Aim
from kinegen.errors import KinegenError
from kinegen.io.load import load
from kinegen.ir.lower import program_of, runtime_defaults
from kinegen.model.joint_bounds import reach
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import Robot
from kinegen.verify import reference
from kinegen.verify.singular_samples import DECADES, Values, approaching

ROBOTS = Path(__file__).parents[1] / "robots"
INVERSE = Quantity(Kind.INVERSE)
ASKED = {np.float64: 1e-12, np.float32: 3e-5}


def main() -> int:
    """Print the table; a figure that is not met fails nothing."""
    files = [Path(each) for each in sys.argv[1:]] or sorted(ROBOTS.glob("*.yaml"))
    print(f"{'arm':<24}{'':<8}{'targets':>8}{'without':>8}{'worst':>9}{'asked':>8}   at 1, 1e-1 ... 1e-16 and 0")
    for robot in _arms(files):
        for kind, asked in ASKED.items():
            worst, without, count = _row(robot, kind)
            each = " ".join(f"{error:.0e}" for error in worst)
            found = f"{count:>8,}{without:>8}{max(worst):>9.1e}{asked:>8.0e}   {each}"
            print(f"{robot.name:<24}{np.dtype(kind).name:<8}{found}", flush=True)
    return 0


def _arms(files: list[Path]) -> Iterator[Robot]:
    """The arms that are of a family; those that are nearly of one look at the pose of each solution themselves."""
    for file in files:
        robot = load(file)
        try:
            family = family_of(robot) if robot.is_arm else None
        except KinegenError:
            continue
        if family is not None and family.defect is None:
            yield robot


def _row(robot: Robot, kind: type) -> tuple[list[float], int, int]:
    """The largest error at each distance, the targets that have no solution, and all targets."""
    family, program, approach = family_of(robot), program_of(robot, INVERSE), approaching(robot, INVERSE)
    poses = reference.pose(robot, approach.points)[:, 0]
    given = reference.redundancy(robot, approach.points).T if robot.redundancy else np.zeros((0, len(poses)))
    inputs = np.vstack([poses[:, :3].reshape(-1, 12).T, given]).astype(kind)
    known = Values(program, inputs, tuple(map(float, runtime_defaults(robot))))
    branches, dof = len(family.branches), robot.dof
    results = np.stack([known.of(operand) for operand in program.outputs], axis=1).astype(float)
    joints, valid = results[:, : branches * dof].reshape(-1, branches, dof), results[:, branches * dof :] != 0
    off = np.zeros(valid.shape)
    for branch in range(branches):
        rows = valid[:, branch]
        apart = np.abs(reference.pose(robot, joints[rows, branch])[:, 0] - poses[rows])[:, :3]
        off[rows, branch] = apart[..., 3].max(axis=1) / reach(robot)
        if family.aim is Aim.POSE:
            off[rows, branch] = np.maximum(off[rows, branch], apart[..., :3].max(axis=(1, 2)))
    worst = [float(off[approach.decades == decade].max(initial=0)) for decade in range(DECADES + 1)]
    return worst, int((~valid.any(axis=1)).sum()), len(poses)


if __name__ == "__main__":
    sys.exit(main())
