"""Runtime parameters along a batch: each configuration and target gets what a call with its own parameters gives.

A batch with one set of parameters for all is compared with the reference elsewhere, for the values of the robot file
and for others; so a batch in which sets alternate has to give the bits of these batches, in every length, layout and
form of the arrays.

Targets are poses of either set, so that both have solutions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np

from kinegen.errors import ProofError
from kinegen.model.dh_conversion.elementary_transforms import chain_of
from kinegen.model.joint_bounds import reach
from kinegen.model.outputs import NUMERIC_INVERSE, Quantity
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass
from kinegen.verify import reference
from kinegen.verify.bit_consistency import BLOCK, LONGEST, SHARED, START, Call, Called, require_calls
from kinegen.verify.invocations import (
    DTYPES,
    Arrays,
    Floats,
    KernelCall,
    in_layout,
    layouts_of,
    results_of,
    ways_to_call,
)
from kinegen.verify.numeric_inverse import in_numpy
from kinegen.verify.numeric_inverse_batches import tip_errors, tip_targets
from kinegen.verify.samples import FloatArray, parameter_sets, random_joints
from kinegen.verify.tolerances import accepted_error

_LENGTHS = 0, 1, 15, 17, LONGEST
_NUMBERS = 256
_GUARD = -7.0


@dataclass(frozen=True, slots=True)
class Alternating:
    """A kernel with inputs and sets of parameters, which configurations take in turn."""

    kernel: Any
    make: Any
    sets: Floats  # Values of the parameters, a row for each of two sets
    inputs: Arrays  # Inputs, N configurations each

    def of(self, count: int) -> tuple[Arrays, Floats, Arrays]:
        """So many configurations, the values of each parameter for them (parameters, N), and the results wanted."""
        places = np.resize(np.arange(len(self.inputs[0])), count)
        inputs = tuple(array[places] for array in self.inputs)
        turns = _turns(count)
        found = [results_of(self.kernel, self.make(*map(float, values)), inputs) for values in self.sets]
        return inputs, self.sets[turns].T, tuple(_in_turn(results, turns) for results in zip(*found, strict=True))

    def call(self, inputs: Arrays, values: Iterable[Any], **options: Any) -> Arrays:
        """Call the kernel with values for each parameter."""
        return Called(self.kernel, self.make(*values), inputs, ()).call(inputs, **options)


def require_varied(robot: Robot, quantity: Quantity, target: str, called: Alternating) -> int:
    """Call a kernel with parameters along the batch, and refuse one that then gives something else.

    Returns the number of calls. Raises `ProofError` naming the first call that gives something else.
    """
    return require_calls(robot, quantity, target, called.kernel, _calls(called))


def _calls(called: Alternating) -> Iterator[Call]:
    yield from _lengths(called)
    yield from _forms(called)
    yield from _one_by_one(called)
    yield from _shapes(called)
    yield from _given_results(called)
    yield from _shared(called)


def _lengths(called: Alternating) -> Iterator[Call]:
    """Batches of every length below two tiles, in every layout."""
    inputs, values, wanted = called.of(START + LONGEST)
    for layout in layouts_of(called.kernel):
        for count in range(LONGEST + 1) if called.kernel.backend == "c" else _LENGTHS:
            part = slice(START, START + count)
            params = called.make(*values[:, part])
            results = partial(in_layout, called.kernel, params, layout, tuple(array[part] for array in inputs))
            name = f"with parameters along a batch of {count} of layout {layout}"
            yield Call(name, results, tuple(array[part] for array in wanted))


def _forms(called: Alternating) -> Iterator[Call]:
    """Values in arrays of other forms."""
    inputs, values, wanted = called.of(LONGEST)
    forms: dict[str, Callable[[Floats], Any]] = {
        "every second entry of arrays": lambda array: np.repeat(array, 2)[::2],
        "arrays in the opposite order": lambda array: array[::-1].copy()[::-1],
        "arrays of the opposite byte order": lambda array: array.astype(array.dtype.newbyteorder()),
        "arrays of float32": lambda array: array.astype(np.float32),
        "lists": lambda array: array.tolist(),
    }
    for name, form in forms.items():
        yield Call(f"with parameters in {name}", partial(called.call, inputs, [form(each) for each in values]), wanted)


def _one_by_one(called: Alternating) -> Iterator[Call]:
    """Yields one parameter along the batch, while the others are numbers."""
    inputs, values, _ = called.of(LONGEST)
    usual = called.sets[0].tolist()
    for place, name in enumerate(called.make._fields):
        given, turns = [*usual[:place], values[place], *usual[place + 1 :]], _turns(LONGEST)
        found = [called.call(inputs, [*usual[:place], float(each[place]), *usual[place + 1 :]]) for each in called.sets]
        wanted = tuple(_in_turn(results, turns) for results in zip(*found, strict=True))
        yield Call(f"with {name} alone along the batch", partial(called.call, inputs, given), wanted)


def _shapes(called: Alternating) -> Iterator[Call]:
    """Parameters whose axes are others than those of the inputs."""
    inputs, _, _ = called.of(LONGEST)
    found = [called.call(inputs, each.tolist()) for each in called.sets]
    wanted = tuple(np.stack(results) for results in zip(*found, strict=True))
    crossed = called.sets.T[..., None]
    yield Call("with every set of parameters for every input", partial(called.call, inputs, crossed), wanted)
    last = tuple(array[:, -1] for array in wanted)
    single = tuple(array[-1] for array in inputs)
    yield Call("with parameters along the batch and one input", partial(called.call, single, called.sets.T), last)


def _given_results(called: Alternating) -> Iterator[Call]:
    """Arrays for the result, and arguments that are bound."""
    inputs, values, wanted = called.of(LONGEST)
    plain = tuple(np.full_like(array, _GUARD) for array in wanted)
    bound = tuple(np.full_like(array, _GUARD) for array in wanted)
    yield Call("with parameters along the batch and out=", partial(_into, called, inputs, values, plain), wanted)
    yield Call("with parameters along the batch, bound", partial(_bound, called, inputs, values, bound), wanted)


def _into(called: Alternating, inputs: Arrays, values: Floats, given: Arrays) -> Arrays:
    called.call(inputs, values, out=given if len(given) > 1 else given[0])
    return given


def _bound(called: Alternating, inputs: Arrays, values: Floats, given: Arrays) -> Arrays:
    called.kernel.bind(*inputs, *given, params=called.make(*values))()
    return given


def _shared(called: Alternating) -> Iterator[Call]:
    """Long batches: shared by threads, and cut into blocks."""
    inputs, values, wanted = called.of(SHARED)
    yield Call("with parameters along the batch and threads=3", partial(called.call, inputs, values, threads=3), wanted)
    is_small = sum(array[0].size for array in wanted) <= _NUMBERS
    if is_small and called.kernel.backend == "c":
        inputs, values, wanted = called.of(BLOCK + LONGEST)
        name = f"with parameters along a batch of {BLOCK + LONGEST}"
        yield Call(name, partial(called.call, inputs, values), wanted)


def _turns(count: int) -> Any:
    """The set of each configuration: two of the first, one of the second, so that no two tiles look the same."""
    return np.arange(count) % 3 // 2


def _in_turn(results: Sequence[Floats], turns: Any) -> Floats:
    """Returns of each configuration the result of its own set."""
    found: Floats = np.stack(results)[turns, np.arange(len(turns))]
    return found


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

    Raises `ProofError` as the two functions below.
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


def require_varied_inverse(robot: Robot, make: Any, quantity: Quantity, way: KernelCall, real: str) -> int:
    """Call an inverse and its choice with parameters along the batch, and refuse one that then gives something else.

    `way`: the plain batch of a backend. Returns the number of calls. Raises `ProofError` naming the first call that
    gives something else, or if one of the sets has no solution at all.
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

    `search`: its numeric inverse, compiled or not. Raises `ProofError` if errors are reported that are not those of the
    own parameters, if too little is solved, or if a compiled search gives other bits than with one set for all.
    """
    name = f"{robot.name}: {target} {NUMERIC_INVERSE} with parameters along the batch"
    count = SEARCHED[search.backend]
    q, poses = _targets(robot, count, real)
    starts = q + DTYPES[real].type(0.05)
    sets, turns = parameter_sets(robot), np.arange(count) % 2
    varied = make(*sets[turns].T)
    found = search(poses, starts, params=varied, restarts=_RESTARTS)
    reported = np.stack([found.position_error, found.rotation_error], axis=1).reshape(count, 2, -1)
    # The errors that a search reports are those of the parameters that it took.
    apart = np.abs(reported - _true_errors(robot, found.q, poses, turns))
    most = accepted_error(robot, real) * _ROUNDINGS
    if (apart > np.array([[most * reach(robot, robot.tips)], [most]])).any():
        raise ProofError(f"{name} reports errors that are not those of its own parameters; nothing was written")
    if found.solved.mean() < LEAST_SHARE:
        solved = f"{int(found.solved.sum())} of {count:,} reachable targets"
        raise ProofError(f"{name} solves only {solved}; nothing was written")
    if search.backend != "c":
        return
    # Compiled searches give the bits of one set for all, for each target those of its own set.
    plain = [search(poses, starts, params=make(*map(float, values)), restarts=_RESTARTS) for values in sets]
    shared = search(poses, starts, params=varied, restarts=_RESTARTS, threads=2)
    for field, got, again, *wanted in zip(found._fields, found, shared, *plain, strict=True):
        own = np.stack(wanted)[turns, np.arange(count)]
        if got.tobytes() != own.tobytes() or again.tobytes() != own.tobytes():
            raise ProofError(f"{name} gives another {field} than with one set for all; nothing was written")


def _targets(robot: Robot, count: int, real: str) -> tuple[Any, Any]:
    """Joint vectors (N, dof) and targets, in turn of the parameters of the file and of the moved ones."""
    q = random_joints(robot, count).astype(DTYPES[real])
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
    """Returns the values of both sets of runtime parameters, by name."""
    names = [parameter.name for parameter in robot.runtime_parameters]
    return [dict(zip(names, values, strict=True)) for values in parameter_sets(robot).tolist()]
