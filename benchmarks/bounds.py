"""Proven bounds beside the worst errors that are found: `python -m benchmarks.bounds [ROBOT ...]`.

The C kernels are compiled without contraction, and the float ones compared with the double ones, whose own errors are
less than a billionth of theirs. Two worst errors are shown: over a million random poses, and after a search that moves
the worst of them about, by less and less.
"""

from __future__ import annotations

import argparse
import ctypes
import subprocess
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kinegen.backends.accuracy import error_bound
from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.batch import emit_batch
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import lower_file
from kinegen.ir.program import Program
from kinegen.model.joint_bounds import joint_box
from kinegen.model.outputs import USUAL, Quantity
from kinegen.runtime.compiler import find_compiler
from kinegen.support.naming import function, prefix

ROBOTS = Path(__file__).resolve().parents[1] / "robots"
NAMES = ("puma560", "puma560_mm", "ur5", "stanford", "tx60", "jaco2", "panda", "iiwa14", "human_arm", "human_body")
EXACT = ("-ffp-contract=off",)
CONTRACTED = ("-ffp-contract=fast", "-mfma")

POSES = 1_000_000
CHUNK = 1 << 16
SEED = 20240229
JOINT_MAJOR = 2
"""The layout in which every number of the result is a row."""

Floats = NDArray[np.floating]


@dataclass(frozen=True)
class Arm:
    """A robot with one program, and its kernels compiled.

    Attributes:
        kernels: The robot and the program.
        library: The kernels.
    """

    kernels: RobotPrograms
    library: ctypes.CDLL

    @property
    def program(self) -> Program:
        """The one program."""
        return self.kernels.programs[0]

    @cached_property
    def box(self) -> Floats:
        """The joint box, lower and upper ends in columns."""
        return np.array(joint_box(self.kernels.robot))

    def run(self, real: ScalarType, q: Floats) -> Floats:
        """Results (outputs, n) for joint vectors (n, dof)."""
        robot, rows = self.kernels.robot, len(self.program.outputs)
        q = np.ascontiguousarray(q, np.float32 if real is ScalarType.FLOAT else np.float64)
        out = np.empty((rows, len(q)), q.dtype)
        size, address, stride = ctypes.c_size_t, ctypes.c_void_p, ctypes.c_ssize_t
        arguments: list[object] = [size(len(q)), address(q.ctypes.data), stride(robot.dof), stride(1)]
        if self.kernels.defaults:
            defaults = ctypes.c_char.in_dll(self.library, f"{prefix(robot.name, real)}_default_params")
            arguments += [address(ctypes.addressof(defaults)), stride(0)]
        batch = getattr(self.library, f"{function(robot.name, self.program.quantity.function, real)}_batch")
        batch(*arguments, address(out.ctypes.data), stride(len(q)), ctypes.c_int(JOINT_MAJOR))
        return out

    def errors(self, q: Floats) -> Floats:
        """What the float results (outputs, n) are off from the double ones, for joint vectors in float."""
        return np.asarray(np.abs(self.run(ScalarType.FLOAT, q) - self.run(ScalarType.DOUBLE, q)))

    def random(self, generator: np.random.Generator, count: int) -> Floats:
        """Joint vectors (n, dof) in float, anywhere in the joint box."""
        return self.clipped(generator.uniform(self.box[:, 0], self.box[:, 1], (count, len(self.box))))

    def clipped(self, q: Floats) -> Floats:
        """Joint vectors moved into the joint box, in float."""
        inside: Floats = np.clip(q, self.box[:, 0], self.box[:, 1]).astype(np.float32)
        return inside


def compile_arm(path: Path, quantity: Quantity, flags: Iterable[str] = EXACT) -> Arm:
    """Compile the kernels of one robot and quantity."""
    kernels = lower_file(path, (quantity,))
    with tempfile.TemporaryDirectory() as folder:
        for real in ScalarType:
            for name, text in (emit_kernel(kernels, real) | emit_batch(kernels, real)).items():
                (Path(folder) / name).write_text(text, encoding="utf-8")
        sources = sorted(str(source) for source in Path(folder).glob("*.c"))
        library = Path(folder) / "arm.so"
        settings = ("-std=c99", "-O2", "-fPIC", "-shared", *flags)
        subprocess.run([*find_compiler().command, *settings, *sources, "-o", str(library)], check=True)
        return Arm(kernels, ctypes.CDLL(str(library)))


def worst_random(arm: Arm, poses: int = POSES, seed: int = SEED) -> Floats:
    """The largest error of each output over random poses."""
    generator = np.random.default_rng(seed)
    worst = np.zeros(len(arm.program.outputs))
    for start in range(0, poses, CHUNK):
        found = arm.errors(arm.random(generator, min(CHUNK, poses - start)))
        worst = np.maximum(worst, found.max(axis=1))
    return worst


def worst_searched(arm: Arm, rounds: int = 10, kept: int = 64, tries: int = 20_000) -> Floats:
    """The largest error of each output after moving the worst random poses about, by less and less."""
    generator = np.random.default_rng(SEED)
    q = arm.random(generator, CHUNK)
    errors = arm.errors(q)
    worst: Floats = errors.max(axis=1)
    for output in np.flatnonzero(worst):
        best, score = q[np.argsort(errors[output])[-kept:]], np.sort(errors[output])[-kept:]
        for turn in range(rounds):
            moved = best[generator.integers(0, kept, tries)]
            step = generator.normal(scale=10.0 ** (-0.5 - 0.5 * turn), size=moved.shape)
            moved = arm.clipped(moved + step * (generator.random(moved.shape) < 0.5))
            found = arm.errors(moved)
            worst = np.maximum(worst, found.max(axis=1))
            both, scores = np.concatenate([best, moved]), np.concatenate([score, found[output]])
            order = np.argsort(scores)[-kept:]
            best, score = both[order], scores[order]
    return worst


def coordinates(entries: Floats, quantity: Quantity) -> dict[str, float]:
    """The largest number for each coordinate and for the entries of rotations, over all frames."""
    table = np.asarray(entries).reshape(-1, 12 if quantity.is_pose else 3)
    if not quantity.is_pose:
        return {f"p{axis}": float(table[:, place].max()) for place, axis in enumerate("xyz")}
    found = {f"p{axis}": float(table[:, 4 * place + 3].max()) for place, axis in enumerate("xyz")}
    return found | {"rotation": float(np.delete(table, (3, 7, 11), axis=1).max())}


def proven(arm: Arm, real: ScalarType = ScalarType.FLOAT) -> Floats:
    """The proven bound of each output."""
    return np.array(error_bound(arm.kernels, arm.program, real).entries)


def lines(name: str, quantity: Quantity, poses: int) -> Iterator[str]:
    """The lines of the table for one robot."""
    arm = compile_arm(ROBOTS / f"{name}.yaml", quantity)
    bounds, sharp = proven(arm), coordinates(proven(arm, ScalarType.DOUBLE), quantity)
    rows = [coordinates(each, quantity) for each in (bounds, worst_random(arm, poses), worst_searched(arm))]
    for coordinate, bound in rows[0].items():
        observed = rows[1][coordinate], rows[2][coordinate]
        if max(observed) > sharp[coordinate]:
            ratios = "".join(f"{worst:10.1e}{bound / worst:7.2f}" for worst in observed)
            yield f"{name:12} {quantity:9} {coordinate:9}{bound:10.1e}{ratios}"


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("robots", nargs="*", default=NAMES, help="names of robots, without .yaml")
    parser.add_argument("--poses", type=int, default=POSES, help="random poses for each robot")
    arguments = parser.parse_args()
    print("float kernels, errors in the robot's length unit; ratio: bound by error")
    print(f"{'robot':12} {'output':9} {'':9}{'bound':>10}{'random':>10}{'ratio':>7}{'search':>10}{'ratio':>7}")
    for name in arguments.robots:
        for quantity in USUAL:
            print(*lines(name, quantity, arguments.poses), sep="\n")


if __name__ == "__main__":
    main()
