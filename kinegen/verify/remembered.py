"""Proofs that were made before: of the same bytes, by the same checks, with the same NumPy and kind of processor.

The proof of a package takes longer than everything else in a build that changes nothing, and would give the same
numbers. What is remembered lies in the user's cache folder; a damaged or missing entry is proved again.
"""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Mapping
from dataclasses import asdict
from functools import cache
from pathlib import Path
from typing import Any

import mpmath
import numpy as np

from kinegen.native.cache import Cache
from kinegen.native.compiler import processor
from kinegen.outputs import Quantity, parse_quantity
from kinegen.robot.model import Robot
from kinegen.verify.comparison import Comparison, Proof
from kinegen.verify.staging import prove_package

_PACKAGE = Path(__file__).parents[1]
_CHECKS = ("reference/*.py", "robot/*.py", "verify/*.py")
"""The code that decides what a proof says of given files."""


def proof_of(
    robot: Robot, contents: Mapping[str, str | bytes], quantities: tuple[Quantity, ...], reals: tuple[str, ...]
) -> tuple[Proof, str, bool]:
    """The proof of a package, made now or before.

    Args:
        robot: The robot.
        contents: The files of its package, by name.
        quantities: The quantities it was built for.
        reals: Its number types, `double` and `float`.

    Returns:
        The proof, which holds, the backend that was proven, and whether it was made before.

    Raises:
        CompileError: If there is a compiled module, and it does not load here.
        ProofError: If the proof does not hold.
    """
    store = Cache()
    machine = platform.python_version(), np.__version__, mpmath.__version__, processor().describe()
    key = store.key("proof", _checks(), robot, quantities, reals, machine, _digests(contents))
    known = store.load(key)
    if known is not None:
        entry = json.loads(known)
        comparisons = tuple(_restored(comparison) for comparison in entry["comparisons"])
        return Proof(entry["reach"], comparisons, tuple(entry["counts"])), entry["backend"], True
    proof, backend = prove_package(robot, contents, quantities, reals)
    store.save(key, json.dumps(_record(proof, backend)).encode())
    return proof, backend, False


def _record(proof: Proof, backend: str) -> dict[str, Any]:
    comparisons = [asdict(each) | {"quantity": str(each.quantity)} for each in proof.comparisons]
    return {"reach": proof.reach, "comparisons": comparisons, "counts": proof.counts, "backend": backend}


def _restored(entry: dict[str, Any]) -> Comparison:
    return Comparison(**{**entry, "quantity": parse_quantity(entry["quantity"]), "worst": tuple(entry["worst"])})


def _digests(contents: Mapping[str, str | bytes]) -> list[tuple[str, str]]:
    return [
        (name, hashlib.sha256(content.encode() if isinstance(content, str) else content).hexdigest())
        for name, content in sorted(contents.items())
    ]


@cache
def _checks() -> str:
    digest = hashlib.sha256()
    for pattern in _CHECKS:
        for path in sorted(_PACKAGE.glob(pattern)):
            digest.update(path.read_bytes())
    return digest.hexdigest()
