"""Inverses with runtime parameters along a batch: each target is solved for with its own set of parameters.

In: an inverse, or a search, whose batches with one set for all are proven elsewhere. Out: nothing, or the first call
that gives something else. Targets are poses of either set, so that both have solutions.
"""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen import reference
from kinegen.errors import ProofError
from kinegen.outputs import NUMERIC_INVERSE, Quantity
from kinegen.robot.extent import joint_box, reach
from kinegen.robot.model import Robot
from kinegen.tables.seen import chain_of
from kinegen.verify.moved import parameter_sets
from kinegen.verify.samples import SEED
from kinegen.verify.search import in_numpy
from kinegen.verify.tips import tip_errors, tip_targets
from kinegen.verify.tolerances import accepted_error
from kinegen.verify.varied import Alternating, require_varied
from kinegen.verify.ways import DTYPES, Way, ways_to_call

FloatArray = NDArray[np.float64]

TARGETS = 128
"""Targets of a closed form; they come again in longer batches."""

SEARCHED = {"c": 1072, "numpy": 24}
"""Targets of a search: compiled, more than go to C at once."""

LEAST_SHARE = 0.75
"""A search that solves less is broken; a start may be far away, and restarts are few."""

_RESTARTS = 4

_ROUNDINGS = 2
"""A difference of poses may be off by so many times what a pose may be."""


def require_varied_batches(robot: Robot, package: ModuleType, quantity: Quantity, real: str) -> None:
    """Call an inverse or a search of a package, compiled and in NumPy, with parameters along the batch.

    Args:
        robot: The robot, which has runtime parameters.
        package: Its generated package, imported.
        quantity: The inverse or the search.
        real: A number type that it was built for.

    Raises:
        ProofError: As the two functions below.
    """
    if quantity == NUMERIC_INVERSE:
        search = package.numeric_inverse
        if search.backend == "c":
            require_varied_search(robot, package.Params, search, f"C {real}", real)
        require_varied_search(robot, package.Params, in_numpy(package, search), f"NumPy {real}", real)
        return
    for way in ways_to_call(package, quantity, real):
        if way.is_plain:
            way.select()
            require_varied_inverse(robot, package.Params, quantity, way, real)


def require_varied_inverse(robot: Robot, make: Any, quantity: Quantity, way: Way, real: str) -> int:
    """Call an inverse and its choice with parameters along the batch, and refuse one that then gives something else.

    Args:
        robot: The robot, which has runtime parameters.
        make: The package's `Params`.
        quantity: The inverse.
        way: The plain batch of a backend.
        real: The number type.

    Returns:
        The number of calls.

    Raises:
        ProofError: Naming the first call that gives something else, or if one of the sets has no solution at all.
    """
    robot = chain_of(robot, quantity)
    q, poses = _targets(robot, TARGETS, real)
    sets = parameter_sets(robot)
    given = [reference.redundancy(robot, q.astype(np.float64)).astype(q.dtype)] if robot.redundancy else []
    for values in sets:
        if not way.kernel(poses, *given, params=make(*map(float, values)))[1].any():
            raise ProofError(f"{robot.name}: {way.target} {quantity} solves no target with other parameters")
    count = require_varied(robot, quantity, way.target, Alternating(way.kernel, make, sets, (poses, *given)))
    choice = Alternating(way.kernel.chooses, make, sets, (poses, *given, q))
    return count + require_varied(robot, quantity, f"{way.target} nearest", choice)


def require_varied_search(robot: Robot, make: Any, search: Any, target: str, real: str) -> None:
    """Search with parameters along the batch, and refuse what is not solved with the parameters of its own target.

    Args:
        robot: The robot, which has runtime parameters.
        make: The package's `Params`.
        search: Its numeric inverse, compiled or not.
        target: What is called, for the message.
        real: The number type.

    Raises:
        ProofError: If errors are reported that are not those of the own parameters, if too little is solved, or if a
            compiled search gives other bits than with one set for all.
    """
    name = f"{robot.name}: {target} {NUMERIC_INVERSE} with parameters along the batch"
    count = SEARCHED[search.backend]
    q, poses = _targets(robot, count, real)
    starts = q + DTYPES[real].type(0.05)
    sets, turns = parameter_sets(robot), np.arange(count) % 2
    varied = make(*sets[turns].T)
    found = search(poses, starts, params=varied, restarts=_RESTARTS)
    reported = np.stack([found.position_error, found.rotation_error], axis=1).reshape(count, 2, -1)
    apart = np.abs(reported - _true_errors(robot, found.q, poses, turns))
    most = accepted_error(robot, real) * _ROUNDINGS
    if (apart > np.array([[most * reach(robot, robot.tips)], [most]])).any():
        raise ProofError(f"{name} reports errors that are not those of its own parameters; nothing was written")
    if found.solved.mean() < LEAST_SHARE:
        solved = f"{int(found.solved.sum())} of {count:,} reachable targets"
        raise ProofError(f"{name} solves only {solved}; nothing was written")
    if search.backend != "c":
        return
    plain = [search(poses, starts, params=make(*map(float, values)), restarts=_RESTARTS) for values in sets]
    shared = search(poses, starts, params=varied, restarts=_RESTARTS, threads=2)
    for field, got, again, *wanted in zip(found._fields, found, shared, *plain, strict=True):
        own = np.stack(wanted)[turns, np.arange(count)]
        if got.tobytes() != own.tobytes() or again.tobytes() != own.tobytes():
            raise ProofError(f"{name} gives another {field} than with one set for all; nothing was written")


def _targets(robot: Robot, count: int, real: str) -> tuple[Any, Any]:
    """Joint vectors (N, dof) and targets, in turn of the parameters of the file and of the moved ones."""
    low, high = np.array(joint_box(robot)).T
    q = np.random.default_rng(SEED).uniform(low, high, (count, robot.dof)).astype(DTYPES[real])
    return q, _poses(robot, q, np.arange(count) % 2).astype(DTYPES[real])


def _poses(robot: Robot, q: Any, turns: Any) -> FloatArray:
    """Poses by the reference, each with its own set of parameters."""
    found = [tip_targets(robot, q.astype(np.float64), values) for values in _named_sets(robot)]
    poses: FloatArray = np.stack(found)[turns, np.arange(len(q))]
    return poses


def _true_errors(robot: Robot, q: Any, targets: Any, turns: Any) -> FloatArray:
    """Distances and angles to the targets, shape (N, 2, tips)."""
    goals = targets.astype(np.float64)
    found = [tip_errors(robot, q.astype(np.float64), goals, values) for values in _named_sets(robot)]
    errors: FloatArray = np.stack(found)[turns, np.arange(len(q))]
    return errors


def _named_sets(robot: Robot) -> list[dict[str, float]]:
    """The values of both sets of runtime parameters, by name."""
    names = [parameter.name for parameter in robot.runtime_parameters]
    return [dict(zip(names, values, strict=True)) for values in parameter_sets(robot).tolist()]
