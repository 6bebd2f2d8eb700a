"""What `kinegen eval` costs beside reading and writing alone: `python -m benchmarks.fleet [--rows N]`.

Joint vectors of a PUMA 560 lie in a Parquet file, six columns of doubles. Measured are, each in processes of its own,
by turns, the middle of some rounds:

- `eval` to poses in one file, one worker, against pyarrow that reads the same columns and writes the same ones back
  with a column of twelve numbers more, and computes nothing;
- the most memory that both took;
- `eval` to all solutions of the inverse with two workers against one, on a system with two processors or more: of its
  400 bytes a row much of the time goes to the disk; and to the numeric inverse, where it goes to the kernel;
- runs that are killed at random moments and resumed: their files have to be those of a run that was not.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import random
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import parquet

import kinegen

ROOT = Path(__file__).resolve().parent.parent
ROBOT = ROOT / "robots" / "puma560.yaml"
COLUMNS = ("waist", "shoulder", "elbow", "forearm", "wrist_bend", "flange")
ROUNDS = 3
BLOCK = 1 << 20
"""Rows of a row group."""

STREAMED = 10_000
"""Rows of a block of `--stream`."""

SEARCHED = 400_000
"""Targets of the numeric inverse, of which each takes as long as some hundred closed forms."""

KILLED_ROWS = 1_500_000
SEED = 20240229

MEASURE = """
import json, os, resource, sys, time
from kinegen.ui.cli import main
begin = time.perf_counter()
status = main(sys.argv[1:])
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(time.perf_counter() - begin, peak / 1000, file=sys.stderr)
sys.exit(status)
"""

COPY = """
import resource, sys, time
import numpy as np, pyarrow as pa
from pyarrow import parquet
source, target = sys.argv[1:]
begin = time.perf_counter()
with parquet.ParquetFile(source) as file:
    schema = pa.schema([*file.schema_arrow, pa.field("pose", pa.list_(pa.float64(), 12))])
    numbers = pa.array(np.random.default_rng(1).random(12 << 17))
    with parquet.ParquetWriter(target, schema, compression="none", use_dictionary=False) as writer:
        for batch in file.iter_batches(1 << 17):
            poses = pa.FixedSizeListArray.from_arrays(numbers[: 12 * batch.num_rows], 12)
            writer.write_batch(pa.record_batch([*batch.columns, poses], schema=schema))
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(time.perf_counter() - begin, peak / 1000, file=sys.stderr)
"""


@dataclass(frozen=True, slots=True)
class Spent:
    """What one process took.

    Attributes:
        seconds: On a clock on the wall, without the start of Python.
        megabytes: The most memory.
    """

    seconds: float
    megabytes: float


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure and print.

    Args:
        arguments: Of the command line.
    """
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fleet", description="Measure kinegen eval.")
    parser.add_argument("--rows", type=int, default=5_000_000, help="joint vectors (5000000)")
    parser.add_argument(
        "--stream", type=int, help="only evaluate so many joint vectors that are made here, on one thread"
    )
    parser.add_argument("--kills", type=int, default=20, help="runs that are killed and resumed (20)")
    options = parser.parse_args(arguments)
    if options.stream:
        return stream(options.stream)
    print(f"{options.rows:,} joint vectors, {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}")
    with tempfile.TemporaryDirectory(prefix="kinegen-bench-") as name:
        folder = Path(name)
        data = folder / "joints.parquet"
        write_joints(data, options.rows)
        compare_poses(folder, data)
        compare_workers(folder, data)
        kill_and_resume(folder, options.kills)
    return 0


def stream(rows: int) -> int:
    """Print how long random joint vectors take from a generator through the kernel, in blocks that stay in the cache.

    Args:
        rows: Number of joint vectors.
    """
    arm = kinegen.compile(ROBOT, "pose", real="double")
    random_numbers = np.random.default_rng(SEED)
    q, poses = np.empty((STREAMED, 6)), np.empty((STREAMED, 4, 4))
    spent, highest, begin = 0.0, -np.inf, time.perf_counter()
    for first in range(0, rows, STREAMED):
        random_numbers.random(out=q)
        q *= 5.0
        q -= 2.5
        before = time.perf_counter()
        arm.fk(q, out=poses)
        spent += time.perf_counter() - before
        highest = max(highest, poses[: rows - first, 2, 3].max())
    seconds = time.perf_counter() - begin
    print(f"{rows:,} joint vectors made and evaluated in {seconds:.1f} s, {rows / seconds / 1e6:.1f} million a second")
    print(f"of these {spent:.1f} s in the kernel, {rows / spent / 1e6:.1f} million a second; highest {highest:.4f} m")
    return 0


def write_joints(path: Path, rows: int, block: int = BLOCK) -> None:
    """Write a file of random joint vectors.

    Args:
        path: The file.
        rows: Number of joint vectors.
        block: Rows of a row group.
    """
    random_numbers = np.random.default_rng(SEED)
    schema = pa.schema([(name, pa.float64()) for name in COLUMNS])
    with parquet.ParquetWriter(path, schema, compression="none", use_dictionary=False) as writer:
        for first in range(0, rows, block):
            numbers = random_numbers.uniform(-2.5, 2.5, (6, min(block, rows - first)))
            writer.write_batch(pa.record_batch(list(numbers), schema=schema))


def compare_poses(folder: Path, data: Path) -> None:
    """Print what poses cost beside copying.

    Args:
        folder: For results.
        data: Joint vectors.
    """
    ours: list[Spent] = []
    copies: list[Spent] = []
    evaluate(folder, data, "poses.parquet", "pose")  # fills the caches
    for _ in range(ROUNDS):
        # Replacing a large file takes the system a while, which is not what is compared.
        for name in ("poses.parquet", "copy.parquet"):
            (folder / name).unlink(missing_ok=True)
        ours.append(evaluate(folder, data, "poses.parquet", "pose"))
        copies.append(process([sys.executable, "-c", COPY, str(data), str(folder / "copy.parquet")]))
    ratio = middle(ours) / middle(copies)
    print(
        f"poses {middle(ours):.2f} s, reading and writing alone {middle(copies):.2f} s: {ratio:.2f} times (asked 1.15)"
    )
    memory = max(each.megabytes for each in ours)
    print(f"most memory {memory:.0f} MB (asked 512), of pyarrow {max(each.megabytes for each in copies):.0f} MB")
    for name in ("poses.parquet", "copy.parquet"):
        (folder / name).unlink()


def compare_workers(folder: Path, data: Path) -> None:
    """Print what a second worker brings.

    Args:
        folder: For results.
        data: Joint vectors; as many new ones are taken, at most eight million.
    """
    rows = min(parquet.read_metadata(data).num_rows, 8 * BLOCK)
    for output, count, block, rounds in (("inverse", rows, BLOCK, ROUNDS), ("numeric_inverse", SEARCHED, 1 << 13, 1)):
        part, poses = folder / "part.parquet", folder / "targets"
        write_joints(part, count, block)
        evaluate(folder, part, poses.name, "pose", "--drop", "*", "--part-rows", str(block))
        seconds: dict[int, list[Spent]] = {1: [], 2: []}
        words = ("--columns", "base_T_tool=pose", "--drop", "*", "--part-rows", str(block // 2))
        for _ in range(rounds):
            for workers, found in seconds.items():
                name = f"solved{workers}"
                found.append(evaluate(folder, poses, name, output, *words, "--workers", str(workers)))
                shutil.rmtree(folder / name)
        shutil.rmtree(poses)
        one, two = (middle(found) for found in seconds.values())
        print(
            f"{output}, {count:,} rows: one worker {one:.2f} s, two {two:.2f} s, start included: "
            f"{one / two:.2f} times (asked 1.8)"
        )


def kill_and_resume(folder: Path, kills: int) -> None:
    """Kill runs at random moments, resume them, and compare their files with those of a run that went through.

    Args:
        folder: For results.
        kills: How many.
    """
    data, chance = folder / "few.parquet", random.Random(SEED)
    write_joints(data, KILLED_ROWS)
    words = ("--part-rows", "65536")
    whole = evaluate(folder, data, "whole", "pose", *words).seconds
    wanted = digests(folder / "whole")
    right = finished = 0
    for place in range(kills):
        name = f"killed{place}"
        command = call(data, folder / name, "pose", *words)
        running = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(chance.uniform(0.2, 1.3) * whole)
        running.send_signal(signal.SIGKILL)
        finished += running.wait() == 0
        evaluate(folder, data, name, "pose", *words, "--resume")
        right += digests(folder / name) == wanted
    print(f"killed at {kills} random moments ({finished} had ended) and resumed: {right} with the same bytes")


def digests(folder: Path) -> dict[str, str]:
    """A digest of each file of results.

    Args:
        folder: Where they are.
    """
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(folder.iterdir())}


def evaluate(folder: Path, data: Path, name: str, outputs: str, *words: str) -> Spent:
    """Run `kinegen eval` in a process of its own.

    Args:
        folder: For results.
        data: The input.
        name: Of the output in that folder.
        outputs: What is computed.
        words: Further arguments.
    """
    return process(call(data, folder / name, outputs, *words))


def call(data: Path, output: Path, outputs: str, *words: str) -> list[str]:
    """The command of a run.

    Args:
        data: The input.
        output: The results.
        outputs: What is computed.
        words: Further arguments.
    """
    replaced = () if "--resume" in words else ("--force",)
    arguments = ["eval", str(ROBOT), str(data), "-o", str(output), "--outputs", outputs, *replaced, *words]
    return [sys.executable, "-c", MEASURE, *arguments]


def process(command: list[str]) -> Spent:
    """Run a process that prints seconds and megabytes on its last line of errors.

    Args:
        command: Its words.
    """
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(done.stderr)
    seconds, megabytes = done.stderr.splitlines()[-1].split()
    return Spent(float(seconds), float(megabytes))


def middle(found: Sequence[Spent]) -> float:
    """The middle of some times.

    Args:
        found: What processes took.
    """
    return statistics.median(each.seconds for each in found)


if __name__ == "__main__":
    raise SystemExit(main())
