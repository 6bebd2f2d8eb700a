"""pytorch_kinematics: a serial chain from URDF text, on the processor, one thread."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from benchmarks.speed.arm import Arm, Array
from benchmarks.speed.peers import Peer
from benchmarks.speed.placements import urdf


def peers(arm: Arm) -> Iterator[Peer]:
    """Both number types."""
    torch: Any = importlib.import_module("torch")
    kinematics: Any = importlib.import_module("pytorch_kinematics")
    torch.set_num_threads(1)
    for real in ("double", "float"):
        chain = chain_of(torch, kinematics, arm, torch.float64 if real == "double" else torch.float32)
        yield Peer(
            name="pytorch_kinematics",
            package="pytorch_kinematics",
            real=real,
            batch=partial(_batch, torch, chain),
            result=lambda result: np.asarray(result.numpy()),
            single=partial(_single, torch, chain),
        )


def chain_of(torch: Any, kinematics: Any, arm: Arm, real: Any) -> Any:
    """The arm as it reads it from a URDF, in one number type."""
    # The lengths are rounded to the default type when the text is read.
    default = torch.get_default_dtype()
    torch.set_default_dtype(real)
    try:
        return kinematics.build_serial_chain_from_urdf(urdf(arm), "tool").to(dtype=real)
    finally:
        torch.set_default_dtype(default)


def _batch(torch: Any, chain: Any, q: Array) -> Callable[[], Any]:
    tensor = torch.from_numpy(q)
    one = _one(torch, chain)
    return lambda: one(tensor)


def _single(torch: Any, chain: Any, q: Array) -> tuple[Callable[[Any], Any], Any]:
    return _one(torch, chain), torch.from_numpy(q)


def _one(torch: Any, chain: Any) -> Callable[[Any], Any]:
    def run(q: Any) -> Any:
        with torch.no_grad():
            return chain.forward_kinematics(q).get_matrix()

    return run
