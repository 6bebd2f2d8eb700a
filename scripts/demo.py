"""The last part of `make demo`: a batch of poses from a generated module, as an engineer would ask for them.

python scripts/demo.py build/demo/puma560
"""

from __future__ import annotations

import importlib
import sys
import time
from pathlib import Path

import numpy as np

POSES = 100_000
REPEATS = 5


def main(package: Path) -> int:
    """Evaluates a batch through the module in a folder and prints what came out and how fast."""
    # A user has the parent folder on the path already.
    sys.path.insert(0, str(package.parent))
    robot = importlib.import_module(package.name)
    q = np.random.default_rng(1).uniform(-np.pi, np.pi, (POSES, 6))
    poses = robot.fk(q)

    # The best of a few runs: the machine's other work only ever adds time.
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        robot.fk(q, out=poses)
        times.append(time.perf_counter() - start)

    print(f"fk(q): q {q.shape} -> {poses.shape}")
    print(f"The first pose, at q = {np.array2string(q[0], precision=3)}:")
    print(np.array2string(poses[0], precision=6, suppress_small=True))
    best = min(times)
    print(
        f"{POSES:,} poses in {best * 1e3:.1f} ms, {POSES / best / 1e6:.2f} million a second: {describe(robot.backend)}"
    )
    return 0


def describe(backend: str) -> str:
    """Says in words what computed the poses."""
    if backend == "numpy":
        return "NumPy kernel (no compiled one: no C compiler was found, or the kernel was not compiled)"
    return f"{backend} kernel, one thread"


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
