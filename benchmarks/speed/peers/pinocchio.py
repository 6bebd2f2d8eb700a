"""Pinocchio: a model of revolute joints built in code, and a Python loop over the configurations."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from benchmarks.speed.arm import Arm, Array
from benchmarks.speed.peers import Peer
from benchmarks.speed.placements import placements


def peers(arm: Arm) -> Iterator[Peer]:
    """Doubles alone; its kinematics take one configuration at a time."""
    pin: Any = importlib.import_module("pinocchio")
    model, frame = _model(pin, arm)
    data = model.createData()

    def one(q: Array) -> Any:
        pin.forwardKinematics(model, data, q)
        return pin.updateFramePlacement(model, data, frame)

    yield Peer(
        name="Pinocchio, Python loop",
        package="pin",
        real="double",
        batch=lambda q: _batch(one, q),
        result=lambda result: np.stack([each.homogeneous for each in result]),
        single=lambda q: (one, q),
        single_name="Pinocchio",
        poses=10_000,
    )


def _batch(one: Callable[[Array], Any], q: Array) -> Callable[[], Any]:
    rows = list(q)
    # The placement that comes back is a view that the next call overwrites, so each is copied.
    return lambda: [one(row).copy() for row in rows]


def _model(pin: Any, arm: Arm) -> tuple[Any, int]:
    model, joint = pin.Model(), 0
    before, tail = placements(arm)
    for number, matrix in enumerate(before):
        joint = model.addJoint(joint, pin.JointModelRZ(), _se3(pin, matrix), f"joint{number}")
    return model, model.addFrame(pin.Frame("tool", joint, 0, _se3(pin, tail), pin.FrameType.OP_FRAME))


def _se3(pin: Any, matrix: Array) -> Any:
    return pin.SE3(np.ascontiguousarray(matrix[:3, :3]), matrix[:3, 3].copy())
