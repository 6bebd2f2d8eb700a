"""Times in turns: A B C A B C ..., so that a ratio compares what ran within a few milliseconds.

What is timed is the work of this process: on one core its processor time, which stands still while other work has the
core. Turns in which that happened count only where there are too few others, since caches suffer too.
"""

from __future__ import annotations

import os
import resource
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from benchmarks.speed import machine

if TYPE_CHECKING:
    from benchmarks.speed.library import Run

SAMPLE = 0.001
"""Seconds that one timing lasts, about: as many calls as it takes. Short, so that many find their core free."""

SLOW = 0.05
"""A call that takes longer, in seconds, is not repeated to warm up."""

CALM = 0.98
"""Part of its time that a case must have had its core for a turn to count."""

FEWEST = 3
"""With fewer calm turns than this, all turns count."""


@dataclass(frozen=True, slots=True)
class Repeated:
    """A call that is repeated outside Python, which so takes no part in its time.

    Attributes:
        repeat: Takes how often, and the arguments.
        arguments: The arguments.
    """

    repeat: Callable[..., object]
    arguments: tuple[object, ...]

    def __call__(self) -> None:
        """Call it once."""
        self.repeat(1, *self.arguments)


@dataclass(frozen=True, slots=True)
class Case:
    """Something to time.

    Attributes:
        key: Its name among the cases of a group.
        run: One evaluation of all poses.
        poses: How many these are.
        cores: Processors that it may run on; empty for the one that the process is pinned to.
    """

    key: str
    run: Run
    poses: int
    cores: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Timing:
    """What came out for one case.

    Attributes:
        seconds: For one pose, in each turn.
        calm: The turns that count.
    """

    seconds: tuple[float, ...]
    calm: frozenset[int]

    def median(self) -> float:
        """Seconds for a pose, median of the turns that count."""
        return statistics.median(self._counting())

    @property
    def rate(self) -> float:
        """Million poses a second, median of the turns that count."""
        return 1e-6 / self.median()

    @property
    def best(self) -> float:
        """Million poses a second in the best turn."""
        return 1e-6 / min(self.seconds)

    @property
    def spread(self) -> float:
        """Distance between the quartiles, as a part of the median."""
        counting = self._counting()
        if len(counting) < 2:
            return 0.0
        low, median, high = statistics.quantiles(counting, n=4)
        return (high - low) / median

    def _counting(self) -> list[float]:
        turns = self.calm if len(self.calm) >= FEWEST else range(len(self.seconds))
        return [self.seconds[turn] for turn in turns]


@dataclass(frozen=True, slots=True)
class Effort:
    """How long to measure.

    Attributes:
        turns: Number of calm turns that every case should get.
        patience: Seconds that a group of cases may go on for after so many turns, in search of calm ones.
    """

    turns: int
    patience: float


def measure(cases: Sequence[Case], effort: Effort) -> dict[str, Timing]:
    """Time cases in turns.

    Args:
        cases: What to time.
        effort: How long.

    Returns:
        A timing for each key.
    """
    once = {case.key: _one_call(case) for case in cases}
    calls = {key: max(1, round(SAMPLE / seconds)) for key, seconds in once.items()}
    seconds: dict[str, list[float]] = {case.key: [] for case in cases}
    calm: dict[str, set[int]] = {case.key: set() for case in cases}
    turn, latest = 0, float("inf")
    while min(map(len, calm.values())) < effort.turns and time.perf_counter() < latest:
        for case in cases:
            took, is_calm = _sample(case, calls[case.key], once[case.key] > SLOW)
            seconds[case.key].append(took / (calls[case.key] * case.poses))
            if is_calm:
                calm[case.key].add(turn)
            _counts[is_calm] += 1
        turn += 1
        if turn == effort.turns:
            latest = time.perf_counter() + effort.patience
    return {key: Timing(tuple(values), frozenset(calm[key])) for key, values in seconds.items()}


def seconds_of(run: Run) -> float:
    """Seconds of processor time of a call that cannot be repeated, since it remembers what it did."""
    begin = time.process_time()
    run()
    return time.process_time() - begin


def spent() -> float:
    """Seconds of processor time of this process and of all children that have ended, such as compilers."""
    return sum(os.times()[:4])


def spent_by_children() -> float:
    """Seconds of processor time of the children of this process that have ended, and of theirs."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def ratio(timings: Mapping[str, Timing], faster: str, slower: str) -> float:
    """How many times the rate of the one is that of the other.

    Args:
        timings: What was measured.
        faster: The one.
        slower: The other.

    Returns:
        The median over the turns that count for both; the ratio of their medians where there are too few of these.
    """
    first, second = timings[faster], timings[slower]
    both = first.calm & second.calm
    if len(both) < FEWEST:
        return second.median() / first.median()
    return statistics.median(second.seconds[turn] / first.seconds[turn] for turn in both)


_counts = [0, 0]


def calm_share() -> float:
    """Part of all samples so far that had their core to themselves."""
    return _counts[1] / max(1, sum(_counts))


def _one_call(case: Case) -> float:
    """Seconds of a call; the first one is left out, since it may compile."""
    with _Cores(case.cores):
        case.run()
        begin = time.perf_counter()
        case.run()
        return time.perf_counter() - begin


def _sample(case: Case, calls: int, is_slow: bool) -> tuple[float, bool]:
    """Seconds that some calls take, and whether they had their cores to themselves."""
    run = case.run
    with _Cores(case.cores):
        if not is_slow:
            run()  # brings its own data into the caches
        waited, busy, begin = machine.waited(), time.process_time(), time.perf_counter()
        if isinstance(run, Repeated):
            run.repeat(calls, *run.arguments)
        else:
            for _ in range(calls):
                run()
        took = time.perf_counter() - begin
        busy, waited = time.process_time() - busy, machine.waited() - waited
    if case.cores:
        return took, waited <= (1 - CALM) * took
    return min(busy or took, took), busy >= CALM * took


class _Cores:
    """Lets this thread run on other processors for a while.

    Args:
        cores: Their numbers; nothing happens where there are none, or where the system cannot pin.
    """

    def __init__(self, cores: tuple[int, ...]) -> None:
        self._cores, self._before = cores, frozenset[int]()

    def __enter__(self) -> None:
        if self._cores and hasattr(os, "sched_setaffinity"):
            self._before = frozenset(os.sched_getaffinity(0))
            os.sched_setaffinity(0, self._cores)

    def __exit__(self, *_: object) -> None:
        if self._before:
            os.sched_setaffinity(0, self._before)
