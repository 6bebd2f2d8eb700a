"""Whether a calibration finds what was wrong, and how sure it is: `python -m benchmarks.calibrate [ARMS]`.

Random arms of six and seven joints get mistakes of about 1 mm and 1 mrad in every number of their tables. 40 poses of
each are measured with noise of 0.05 mm and 0.1 mrad, written as a CSV file, and calibrated by what `kinegen calibrate`
calls. The truth is the fit to the same poses without noise, with the same parameters fixed. Times are those of the
processor, so that other programs disturb them little.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kinegen.io.load import load
from kinegen.model.expression_values import Dimension
from kinegen.tools.calibrate.arm_model import from_vector, make_arm, to_vector
from kinegen.tools.calibrate.evaluation import errors
from kinegen.tools.calibrate.fitted_parameters import choose, prepare
from kinegen.tools.calibrate.measurements import Kind, Measurements
from kinegen.tools.calibrate.options import Loss, Settings
from kinegen.tools.calibrate.residuals import Problem
from kinegen.tools.calibrate.run import calibrate
from kinegen.tools.calibrate.solve import Fit, fit

Floats = NDArray[np.float64]

ARMS, POSES = 50, 40
SIGMA, SIGMA_ANGLE = 5e-5, 1e-4
WRONG_LENGTH, WRONG_ANGLE = 1e-3, 1e-3
LIMIT = 170
SETTINGS = Settings(sigma=SIGMA, sigma_angle=SIGMA_ANGLE)
LOWEST, HIGHEST, SECONDS = 0.8, 1.25, 5.0


@dataclass(frozen=True, slots=True)
class Found:
    """One calibration.

    Attributes:
        name: The arm.
        off: Error of each parameter in its standard deviations.
        chi_square: Sum of squared residuals.
        freedom: Degrees of freedom.
        residue: What is left without noise, as the largest error in metres.
        tied: Parameters that were fixed.
        seconds: Processor time of the whole command, compilers included.
    """

    name: str
    off: Floats
    chi_square: float
    freedom: int
    residue: float
    tied: int
    seconds: float


def arm_text(seed: int) -> str:
    """A robot file: neighbouring axes are square, parallel or at an odd angle, as in arms that are built."""
    random = np.random.default_rng(seed)
    convention = ("standard", "modified")[seed % 2]
    rows = []
    joints = 6 + seed // 2 % 2
    for number in range(1, joints + 1):
        alpha = random.choice([-90, 90, 0, 180, 37.5], p=[0.35, 0.35, 0.15, 0.05, 0.1])
        a, d = (random.choice([0, round(float(random.uniform(0.05, 0.6)), 4)], p=[0.4, 0.6]) for _ in range(2))
        limits = f"limits: [{-LIMIT}, {LIMIT}]"
        rows.append(f"  - {{name: j{number}, theta: q, d: {d:g}, a: {a:g}, alpha: {alpha:g}, {limits}}}")
    head = f"kinegen: 1\nname: arm{seed}\nconvention: {convention}\nunits: {{length: m, angle: deg}}\n"
    return head + "tool: {xyz: [0.02, 0.03, 0.12]}\njoints:\n" + "\n".join(rows) + "\n"


def measured(problem: Problem, seed: int, noise: float) -> Problem:
    """The problem of an arm with mistakes; the noise is in standard deviations."""
    random = np.random.default_rng(1000 + seed)
    arm = problem.arm
    sizes = [WRONG_ANGLE if arm.dimension(name) is Dimension.ANGLE else WRONG_LENGTH for name in arm.names]
    truth = arm.start + sizes * random.normal(size=len(arm.names))
    q = random.uniform(-np.radians(LIMIT), np.radians(LIMIT), problem.measured.q.shape)
    poses = arm.poses(truth, q)
    turn = from_vector(noise * SIGMA_ANGLE * random.normal(size=(len(q), 3)))
    shift = noise * SIGMA * random.normal(size=(len(q), 3))
    found = replace(problem.measured, q=q, positions=poses[:, :3, 3] + shift, rotations=turn @ poses[:, :3, :3])
    return replace(problem, measured=found)


def write(path: Path, problem: Problem) -> None:
    """The measurements as people have them."""
    names = [f"q{number}" for number in range(1, problem.arm.robot.dof + 1)]
    given = problem.measured
    table = np.hstack([np.degrees(given.q), given.positions, np.degrees(to_vector(given.rotations))])
    lines = [",".join([*names, "x", "y", "z", "rx", "ry", "rz"])]
    lines += [",".join(repr(float(number)) for number in row) for row in table]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def calibration(seed: int, folder: Path) -> Found:
    """Make, measure and calibrate one arm.

    Args:
        seed: Decides the arm, its mistakes and the noise.
        folder: Where its files go.
    """
    file, csv = folder / f"arm{seed}.yaml", folder / f"arm{seed}.csv"
    file.write_text(arm_text(seed), encoding="utf-8")
    problem = measured(_unmeasured(file), seed, noise=1.0)
    write(csv, problem)
    # The kernels are compiled again: an empty cache knows none.
    os.environ["XDG_CACHE_HOME"] = str(folder / f"cache{seed}")
    begin = _processor_time()
    study = calibrate(file, csv, SETTINGS)
    seconds = _processor_time() - begin
    exact = fit(measured(study.fit.problem, seed, noise=0.0), Loss.HUBER)
    return _compared(file.stem, study.fit, exact, seconds)


def _processor_time() -> float:
    """Seconds that this process and the compilers that it started computed."""
    return sum(os.times()[:4])


def _unmeasured(file: Path) -> Problem:
    """The arm of a file, with poses that nobody measured."""
    robot = load(file)
    choice = choose(robot, SETTINGS.fit)
    arm = make_arm(prepare(robot, choice), choice)
    none = np.full((POSES, robot.dof), np.nan)
    lengths = np.full(POSES, np.nan)
    empty = Measurements(
        path="",
        lines=tuple(range(POSES)),
        kinds=(Kind.POSE,) * POSES,
        q=none,
        to_q=none,
        positions=none[:, :3],
        rotations=np.full((POSES, 3, 3), np.nan),
        lengths=lengths,
        fixtures=("",) * POSES,
        sigma=np.full(POSES, SIGMA),
        sigma_angle=np.full(POSES, SIGMA_ANGLE),
        stated=True,
    )
    return Problem(arm, empty, (), arm.start)


def _compared(name: str, found: Fit, exact: Fit, seconds: float) -> Found:
    if [each.name for each in found.tied] != [each.name for each in exact.tied]:
        raise SystemExit(f"{name}: with and without noise, other parameters are fixed")
    free = found.free
    off = (found.values - exact.values)[free] / found.sigma[free]
    residue = errors(exact.problem, exact.values).worst
    return Found(name, off, found.chi_square * found.freedom, found.freedom, residue, len(found.tied), seconds)


def all_found(arms: int) -> Iterator[Found]:
    """Calibrate arms one after the other."""
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(arms):
            yield calibration(seed, Path(folder))


def main(arguments: list[str]) -> int:
    """Print the figures."""
    arms = int(arguments[0]) if arguments else ARMS
    found = []
    for each in all_found(arms):
        found.append(each)
        ratio = each.chi_square / each.freedom
        print(
            f"{each.name:8} {len(each.off):3} found, {each.tied} fixed, worst {np.abs(each.off).max():.2f} sigma, "
            f"chi-square {ratio:.3f}, {each.seconds:.1f} s, {each.residue:.1e} m without noise",
            flush=True,
        )
    off = np.concatenate([each.off for each in found])
    ratios = np.array([each.chi_square / each.freedom for each in found])
    pooled = sum(each.chi_square for each in found) / sum(each.freedom for each in found)
    inside = int(np.sum((ratios > LOWEST) & (ratios < HIGHEST)))
    times = np.array([each.seconds for each in found])
    print(f"parameters within 3 sigma   {100 * np.mean(np.abs(off) < 3):.2f} % of {len(off)}   (99 % or more)")
    print(f"standard deviation          {np.std(off):.3f} sigma   (1)")
    print(f"chi-square, all residuals   {pooled:.3f}   ({LOWEST} to {HIGHEST})")
    print(f"chi-square, each arm        {ratios.min():.3f} to {ratios.max():.3f}, {inside} of {arms} within")
    print(f"processor time              {np.median(times):.1f} s, at most {times.max():.1f} s   ({SECONDS:g} s)")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
