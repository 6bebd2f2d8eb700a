"""Processor time of each stage of a build against the number of rows: `python -m benchmarks.rows [OUTPUTS]`.

The arms are made up: every row has a twist and two lengths that no other row near it has, so nothing folds and nothing
vanishes. Each is built in a process and a cache of its own; children, such as compilers, count. The last column is how
long a user waits, which is less where compilers run side by side.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SIZES = (7, 15, 30, 60, 120, 240)
ALL = ("all", "wait")
STAGES = ("load", "derive", "lower", "vectors", "emit", "compile", "prove", "measure", "write")

BUILD = """
import sys
from pathlib import Path
from benchmarks.speed.clock import spent
from kinegen.driver.pipeline import build
from kinegen.model.outputs import parse_quantity
from kinegen.driver.results import BuildOptions

last = spent()
def report(stage):
    global last
    now = spent()
    print(stage.name, now - last)
    last = now

quantities = tuple(map(parse_quantity, sys.argv[3].split(",")))
build(Path(sys.argv[1]), BuildOptions(output=Path(sys.argv[2]), quantities=quantities), report)
print("all", spent())
"""


def arm(rows: int) -> str:
    """A robot file of so many rows.

    Args:
        rows: Number of rows, each a revolute joint.
    """
    head = f"kinegen: 1\nname: rows{rows}\nconvention: modified\nunits: {{length: m, angle: deg}}\njoints:\n"
    return head + "".join(
        f"  - {{name: j{row}, alpha: {(37 * row) % 170 - 85}.{row * 7 % 10}, a: 0.{20 + row % 5}, d: 0.{10 + row % 7}, "
        "theta: q, limits: [-170, 170]}\n"
        for row in range(1, rows + 1)
    )


def stage_times(rows: int, outputs: str) -> dict[str, float]:
    """Build such an arm with an empty cache.

    Args:
        rows: Number of rows.
        outputs: What is built, as `--outputs` takes it.

    Returns:
        Processor time of each stage in seconds, of everything, start included, as `all`, and the time from the start to
        the end as `wait`.
    """
    with tempfile.TemporaryDirectory(prefix="kinegen-bench-") as folder:
        file = Path(folder) / f"rows{rows}.yaml"
        file.write_text(arm(rows), encoding="utf-8")
        command = [sys.executable, "-c", BUILD, str(file), str(Path(folder) / "out"), outputs]
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(Path(folder) / "cache")}
        began = time.monotonic()
        done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)
        wait = time.monotonic() - began
    times = {name: float(seconds) for name, seconds in (line.split() for line in done.stdout.splitlines())}
    return {**times, "wait": wait}


def table(
    outputs: str = "pose", sizes: tuple[int, ...] = SIZES, measure: Callable[[int, str], dict[str, float]] = stage_times
) -> Iterator[str]:
    """The lines of the table, each as soon as it is known.

    Args:
        outputs: What is built.
        sizes: Numbers of rows.
        measure: What finds the times of one size.
    """
    yield f"{f'rows, {outputs}':<12}" + "".join(f"{name:>9}" for name in (*STAGES, *ALL))
    for rows in sizes:
        times = measure(rows, outputs)
        yield f"{rows:<12}" + "".join(
            f"{times[name]:>9.2f}" if name in times else f"{'-':>9}" for name in (*STAGES, *ALL)
        )


if __name__ == "__main__":
    for line in table(*sys.argv[1:2]):
        print(line, flush=True)
