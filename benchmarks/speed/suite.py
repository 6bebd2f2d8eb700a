"""All benchmarks in their order."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.speed import clock, machine
from benchmarks.speed.against import batches
from benchmarks.speed.arm import Arm, load_arm
from benchmarks.speed.c_text import floor_operations, operations
from benchmarks.speed.calls import single, threads
from benchmarks.speed.clock import Effort
from benchmarks.speed.instructions import count
from benchmarks.speed.kernels import builds, peak, shares, sizes
from benchmarks.speed.peers import Absent, Peer, load_peers
from benchmarks.speed.rows import Results, Row, on_processor
from kinegen.backends.scalar_types import ScalarType

ASKED = "puma560"
"""The robot for which figures are asked; threads, sizes and builds are measured with it alone."""


@dataclass(frozen=True, slots=True)
class Suite:
    """A run of the benchmarks.

    Attributes:
        folder: Where packages are built.
        cores: The processors, the one that the process is pinned to standing first.
        poses: Configurations in a batch.
        effort: How long to measure each group.
        wait: Seconds to wait before each group, at most, for other work to end.
        say: Told what is being measured.
    """

    folder: Path
    cores: tuple[int, ...]
    poses: int
    effort: Effort
    wait: float
    say: Callable[[str], None]

    def run(self, robots: Sequence[str], parts: Sequence[str]) -> Results:
        """Measure.

        Args:
            robots: Names of files in robots/.
            parts: What to measure.

        Returns:
            The results.
        """
        before = machine.load()
        rows: list[Row] = []
        absent: list[tuple[str, str, str]] = []
        counted: list[dict[str, object]] = []
        arms = [load_arm(name, self.folder) for name in robots]
        for arm in arms:
            rows += self._own(arm, parts)
        for arm in arms:
            peers: list[Peer] = []
            if "peers" in parts:
                self.say(f"{arm.name}: loading the peers")
                found = list(load_peers(arm))
                peers = [each for each in found if isinstance(each, Peer)]
                absent += [(arm.name, each.name, each.reason) for each in found if isinstance(each, Absent)]
            rows += self._with_peers(arm, parts, peers)
        for arm in arms:
            if "instructions" in parts:
                self.say(f"{arm.name}: counting instructions")
                counted += count(arm)
        return Results(
            machine=machine.describe(self.cores),
            load=(before, machine.load()),
            calm=clock.calm_share(),
            rows=on_processor(rows, machine.processor_name()),
            absent=tuple(absent),
            operations={arm.name: _operations(arm) for arm in arms},
            peak=peak(arms[0]) if "sizes" in parts else {},
            instructions=tuple(counted),
        )

    def _own(self, arm: Arm, parts: Sequence[str]) -> Iterator[Row]:
        asked = arm.name == ASKED
        if "shares" in parts:
            self._begin(f"{arm.name}: kernels and C loops")
            yield from shares(arm, self.poses, self.effort, asked)
        if "sizes" in parts and asked:
            self._begin(f"{arm.name}: sizes")
            yield from sizes(arm, (self.poses // 100, self.poses // 10, self.poses, 10 * self.poses), self.effort)
        if "builds" in parts and asked:
            self._begin(f"{arm.name}: compilers and flags")
            yield from builds(arm, self.poses, self.effort)
        if "threads" in parts and asked:
            self._begin(f"{arm.name}: threads")
            for poses in (self.poses, 10 * self.poses):
                yield from threads(arm, poses, self.effort, self.cores, asked=poses == self.poses)

    def _with_peers(self, arm: Arm, parts: Sequence[str], peers: list[Peer]) -> Iterator[Row]:
        if "peers" in parts:
            self._begin(f"{arm.name}: peers in batches")
            fewer = Effort(max(3, self.effort.turns // 4), self.effort.patience)
            yield from batches(arm, peers, self.poses, fewer, arm.name == ASKED)
        if "single" in parts:
            self._begin(f"{arm.name}: single calls")
            yield from single(arm, peers, self.effort, arm.name == ASKED)

    def _begin(self, text: str) -> None:
        self.say(text)
        if not machine.await_quiet(self.wait):
            self.say("  (the machine is busy)")


def _operations(arm: Arm) -> dict[str, float]:
    found: dict[str, float] = {}
    for real in ScalarType:
        found[f"{real} kernel"] = operations(arm.program, real)
        found[f"{real} floor"] = floor_operations(arm.program, real)
    return found
