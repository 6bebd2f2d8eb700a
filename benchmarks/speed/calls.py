"""What Python sees: threads, and the time of a single call."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import repeat
from typing import Any

import numpy as np

from benchmarks.speed.arm import Arm, Array
from benchmarks.speed.clock import Case, Effort, measure
from benchmarks.speed.kernels import CALL, Data, Entry, entry, filled
from benchmarks.speed.peers import Peer
from benchmarks.speed.rows import TIME, Row
from kinegen.backends.scalar_types import ScalarType

CALLS = 2000
"""Calls in one sample."""

SINGLE = "one call"


def threads(arm: Arm, poses: int, effort: Effort, cores: tuple[int, ...], *, asked: bool) -> Iterator[Row]:
    """Two threads against one.

    Args:
        arm: The robot.
        poses: Number of configurations.
        effort: How long to measure.
        cores: The processors; with fewer than two of them there is nothing to measure.
        asked: Whether the figure is asked of this size.

    Yields:
        Rows for one and for two threads, both number types.
    """
    if len(cores) < 2:
        return
    for real in ScalarType:
        data = Data(arm, real, poses)
        one = entry(data, CALL, partial(arm.package.fk, data.q, out=data.out, threads=1))
        two = entry(data, CALL, partial(arm.package.fk, data.q, out=data.out, threads=2))
        two = Entry(replace(two.case, key="two", cores=cores), replace(two.row, threads=2))
        timings = measure([one.case, two.case], effort)
        yield filled(one, timings)
        yield filled(two, timings, ("times one thread", one), 1.8 if asked and real is ScalarType.DOUBLE else None)


def single(arm: Arm, peers: list[Peer], effort: Effort, ask: bool) -> Iterator[Row]:
    """One configuration from Python, the peers' way too.

    Args:
        arm: The robot.
        peers: The peers; those that have no form for one configuration are left out.
        effort: How long to measure.
        ask: Whether the figures are asked of this robot.

    Yields:
        Rows in microseconds.
    """
    q = arm.configurations(1, "double")[0]
    out = np.empty((4, 4))
    forms: dict[str, tuple[Callable[[], object], float | None]] = {
        "fk(q)": (partial(_calls, arm.package.fk, q), 0.4),
        "fk(q, out=T)": (partial(_calls_with_out, arm.package.fk, q, out), 0.3),
        "step = fk.bind(q, T); step()": (partial(_calls_alone, arm.package.fk.bind(q, out)), 0.2),
    }
    for peer in peers:
        if peer.single is not None and peer.real == "double":
            forms[peer.single_name or peer.name] = (partial(_calls, *peer.single(q)), None)
    timings = measure([Case(what, run, CALLS) for what, (run, _) in forms.items()], effort)
    versions = {peer.single_name or peer.name: peer.version for peer in peers}
    for what, (_, asked) in forms.items():
        timing = timings[what]
        yield Row(
            robot=arm.name,
            what=f"{SINGLE}: {what}",
            layout="4x4",
            real="double",
            threads=1,
            poses=1,
            flags=versions.get(what, ""),
            compiler="",
            value=timing.median() * 1e6,
            best=1 / timing.best,
            spread=timing.spread,
            unit=TIME,
            asked=asked if ask else None,
        )


def _calls(function: Callable[[Any], object], q: Array) -> None:
    for _ in repeat(None, CALLS):
        function(q)


def _calls_with_out(function: Callable[..., object], q: Array, out: Array) -> None:
    for _ in repeat(None, CALLS):
        function(q, out=out)


def _calls_alone(function: Callable[[], object]) -> None:
    for _ in repeat(None, CALLS):
        function()
