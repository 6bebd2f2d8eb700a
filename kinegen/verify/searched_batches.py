"""Batches of a numeric inverse: a target has the same result in every batch, whatever else is searched for beside it.

Lanes of a tile share nothing but the instructions. So lengths below two tiles, parts, threads and blocks may not change
a bit of a result, nor may neighbours that are no poses, that are out of reach, or that take all restarts. Without
contraction the results have the bits of the search for one target, too.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen.errors import ProofError
from kinegen.native.package import runnable_variants, select_variant
from kinegen.outputs import NUMERIC_INVERSE
from kinegen.robot.extent import joint_box
from kinegen.robot.model import Robot
from kinegen.verify.calls import LONGEST
from kinegen.verify.impossible import unchecked
from kinegen.verify.samples import SEED
from kinegen.verify.tips import tip_targets, turned_weights
from kinegen.verify.ways import DTYPES

FloatArray = NDArray[np.float64]

LONG = 1100
"""More than threads take in one turn."""

_RESTARTS = 2
_STEP = 2654435761
"""From the seed of one target to that of the next, modulo 2^32."""


def require_search_batches(robot: Robot, package: ModuleType, real: str, params: Any = None) -> None:
    """Search for batches in several ways, and refuse a search that gives other bits in one of them.

    Args:
        robot: The robot, with the values of the runtime parameters that are tried.
        package: Its generated package, imported and compiled.
        real: A number type that it was built for.
        params: The package's `Params`; None where there are none, or for those of the robot file.

    Raises:
        ProofError: Naming the way that gives something else.
    """
    targets, starts = _mixed(robot, LONG, real)
    weights = {"weights": turned_weights(robot)} if robot.is_tree else {}
    with unchecked(sys.modules[type(package.numeric_inverse).__module__]):
        for variant in runnable_variants(package) or ("",):
            if variant:
                select_variant(package, variant)
            _require_same(robot, package, real, _Case(package.numeric_inverse, targets, starts, params, weights))


class _Case:
    """Targets of all kinds, and the search for a part of them."""

    def __init__(self, search: Any, targets: Any, starts: Any, params: Any, more: dict[str, Any]) -> None:
        self._search, self._targets, self._starts = search, targets, starts
        self._usual = {"restarts": _RESTARTS, "params": params, **more}

    def part(self, first: int, last: int, **options: Any) -> Any:
        """The results of some targets as one batch that begins with the first of them."""
        return self._search(self._targets[first:last], self._starts[first:last], **{**self._usual, **options})

    def one(self, index: int, seed: int) -> Any:
        """The result of a target by itself."""
        return self._search(self._targets[index], self._starts[index], seed=seed, **self._usual)


def _require_same(robot: Robot, package: ModuleType, real: str, case: _Case) -> None:
    name = f"{robot.name}: C {real}, batch {NUMERIC_INVERSE}"
    whole = case.part(0, LONG)
    for way, found, first in _ways(case, _contracts(package)):
        for field, got, wanted in zip(whole._fields, found, whole, strict=True):
            if got.tobytes() != wanted[first : first + len(got)].tobytes():
                raise ProofError(f"{name} gives another {field} {way}; nothing was written")


def _ways(case: _Case, contracts: bool) -> Iterator[tuple[str, Any, int]]:
    """What differs, the results, and where their targets begin."""
    for length in range(LONGEST + 1):
        yield f"in a batch of {length}", case.part(0, length), 0
    yield "with two threads", case.part(0, LONG, threads=2), 0
    for first in (1, 7, LONGEST):
        yield "for a part of the batch", case.part(first, 2 * LONGEST, seed=1 + first * _STEP), first
    for index in range(0 if contracts else LONGEST):
        alone = case.one(index, 1 + index * _STEP)
        yield "than for one target", type(alone)(*(np.asarray(entry)[None] for entry in alone)), index


def _contracts(package: ModuleType) -> bool:
    """Whether a product and a sum may be one operation, so that two copies of a kernel may differ."""
    native: Any = getattr(package, "_native")  # noqa: B009 - what the package calls its own
    return "reproducible" not in native.ffi.string(native.lib.kinegen_variant()).decode()


def _mixed(robot: Robot, count: int, real: str) -> tuple[Any, Any]:
    """Targets and starts (N, dof): most can be reached, and every seventh is of another kind, by its first tip."""
    low, high = np.array(joint_box(robot)).T
    q, starts = np.random.default_rng(SEED).uniform(low, high, (2, count, robot.dof))
    targets = tip_targets(robot, q)
    first = targets.reshape(count, -1, 4, 4)[:, 0]
    kinds = np.where(np.arange(count) % 7 == 3, np.arange(count) // 7 % 4, -1)
    first[kinds == 0, 0, 3] = np.nan
    first[kinds == 1, 1, 1] = np.inf
    first[kinds == 2, :3, 3] *= 5  # out of reach: all restarts are taken
    starts[kinds == 3, -1] = np.nan
    return targets.astype(DTYPES[real]), starts.astype(DTYPES[real])
