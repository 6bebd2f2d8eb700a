"""Proofs that were made before: of the same bytes, by the same program, with the same libraries and processor.

The proof of a package takes longer than everything else in a build that changes nothing, and would give the same
numbers. What is remembered is in the user's cache folder, and is accepted on the same terms as a new proof; a damaged
or missing entry, or one of another shape, is proved again.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass

from kinegen.errors import ProofError
from kinegen.native.cache import Cache
from kinegen.native.identity import identity
from kinegen.outputs import Quantity
from kinegen.robot.model import Robot
from kinegen.verify.comparison import Proof
from kinegen.verify.staging import prove_package


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
    store, checks = Cache(), identity()
    key = "" if checks is None else store.key("proof", checks, robot, quantities, reals, _digests(contents))
    known = store.load_record(key, _Kept)
    if known is not None and _is_accepted(known.proof, robot):
        return known.proof, known.backend, True
    proof, backend = prove_package(robot, contents, quantities, reals)
    if checks is not None:
        store.save_record(key, _Kept(proof, backend))
    return proof, backend, False


@dataclass(frozen=True, slots=True)
class _Kept:
    """A proof as it is kept, with the backend that was proven."""

    proof: Proof
    backend: str


def _is_accepted(proof: Proof, robot: Robot) -> bool:
    """Whether a proof that was kept would be accepted if it was made now; one of nothing would not."""
    try:
        proof.require(robot)
    except ProofError:
        return False
    return bool(proof.comparisons)


def _digests(contents: Mapping[str, str | bytes]) -> list[tuple[str, str]]:
    return [
        (name, hashlib.sha256(content.encode() if isinstance(content, str) else content).hexdigest())
        for name, content in sorted(contents.items())
    ]
