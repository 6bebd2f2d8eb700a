"""The command: measures, prints the table, writes the file."""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path

from benchmarks.speed import machine

RESULTS = Path(__file__).resolve().parents[1] / "results" / "speed.json"
PARTS = ("shares", "sizes", "builds", "threads", "peers", "single", "instructions")
ROBOTS = ("puma560", "ur5", "panda", "human_body")


def main(arguments: list[str] | None = None) -> int:
    """Run the benchmarks.

    Args:
        arguments: Of the command line.

    Returns:
        0; a figure that is not met is told in the table and fails nothing, since machines differ.
    """
    options = _options(arguments)
    cores = machine.pin(options.core)
    # Set before JAX is imported.
    os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1")
    os.environ.setdefault("JAX_PLATFORMS", "cpu")
    from benchmarks.speed.clock import Effort
    from benchmarks.speed.suite import Suite
    from benchmarks.speed.table import render

    effort = Effort(options.turns, options.patience)
    with tempfile.TemporaryDirectory(prefix="kinegen-bench-") as folder:
        suite = Suite(Path(folder), cores, options.poses, effort, options.wait, _say)
        results = suite.run(options.robots.split(","), options.parts.split(","))
    for line in render(results):
        print(line)
    results.save(options.output)
    print(f"\nwritten to {options.output}")
    return 0


def _options(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.speed", description="Measure the batch kernels.")
    parser.add_argument("--robots", default=",".join(ROBOTS), help="names of files in robots/ (%(default)s)")
    parser.add_argument("--parts", default=",".join(PARTS), help="what to measure (%(default)s)")
    parser.add_argument("--poses", type=int, default=100_000, help="configurations in a batch (%(default)s)")
    parser.add_argument("--turns", type=int, default=25, help="measurements of each row (%(default)s)")
    parser.add_argument("--patience", type=float, default=20, help="seconds to look for calm turns (%(default)s)")
    parser.add_argument("--wait", type=float, default=0, help="seconds to wait for other work to end (%(default)s)")
    parser.add_argument("--core", type=int, help="the core to use (the last one)")
    parser.add_argument("--output", type=Path, default=RESULTS, help="file of results (benchmarks/results/speed.json)")
    return parser.parse_args(arguments)


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
