"""The kernels against what people use instead, in batches from Python."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from benchmarks.speed.arm import Arm
from benchmarks.speed.clock import Case, Effort, measure, ratio
from benchmarks.speed.kernels import Data, filled, loops
from benchmarks.speed.peers import Peer
from benchmarks.speed.rows import Row
from kinegen.backends.scalar_types import ScalarType


def batches(arm: Arm, peers: list[Peer], poses: int, effort: Effort, ask: bool) -> Iterator[Row]:
    """One number type after the other.

    Args:
        arm: The robot.
        peers: The peers of this robot.
        poses: Number of configurations; slow peers get fewer.
        effort: How long to measure.
        ask: Whether the figure is asked of this robot.

    Yields:
        A row for each peer, and one for the call from Python against the fastest of them.
    """
    for real in ScalarType:
        own = loops(Data(arm, real, poses))["call"]
        found = {f"peer {number}": peer for number, peer in enumerate(peers) if peer.real == real}
        cases = [own.case]
        for key, peer in found.items():
            count = min(poses, peer.poses)
            cases.append(Case(key, peer.batch(arm.configurations(count, real)), count))
        timings = measure(cases, effort)
        rows = {}
        for case, (key, peer) in zip(cases[1:], found.items(), strict=True):
            timing = timings[key]
            row = replace(own.row, what=peer.name, flags=peer.version, compiler="", poses=case.poses, asked=None)
            rows[key] = replace(row, value=timing.rate, best=timing.best, spread=timing.spread)
        yield from rows.values()
        if rows:
            fastest = max(rows, key=lambda key: rows[key].value)
            row = filled(own, timings)
            against = f"times the fastest peer ({rows[fastest].what})"
            share = ratio(timings, own.case.key, fastest)
            yield replace(row, ratio=share, against=against, asked=8.0 if ask else None)
