"""Robotics Toolbox for Python: a DHRobot, and its elementary transform sequence, which is evaluated in C."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from benchmarks.speed.arm import Arm, Array, Link
from benchmarks.speed.peers import Peer


def peers(arm: Arm) -> Iterator[Peer]:
    """Doubles alone."""
    rtb: Any = importlib.import_module("roboticstoolbox")
    sequence = _sequence(rtb, arm)
    yield Peer(
        name="Robotics Toolbox, ETS.eval",
        package="roboticstoolbox-python",
        real="double",
        batch=lambda q: _batch(sequence, q),
        result=np.asarray,
        single=lambda q: (sequence.eval, q),
        poses=10_000,
    )


def _batch(sequence: Any, q: Array) -> Callable[[], Any]:
    return lambda: sequence.eval(q)


def _sequence(rtb: Any, arm: Arm) -> Any:
    sequence = rtb.ETS()
    for link in arm.links:
        for step in _steps(rtb.ET, link):
            sequence *= step
    # Products of constants are taken out beforehand, as the toolbox recommends.
    return sequence.compile()


def _steps(et: Any, link: Link) -> list[Any]:
    turn = [et.Rz(float(link.theta))] + ([et.Rz(jindex=link.joint)] if link.joint is not None else [])
    if link.standard:
        return [*turn, et.tz(float(link.d)), et.tx(float(link.a)), et.Rx(float(link.alpha))]
    return [et.Rx(float(link.alpha)), et.tx(float(link.a)), *turn, et.tz(float(link.d))]
