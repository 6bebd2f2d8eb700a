"""Runtime parameters along a batch: each configuration gets what a call with its own set of parameters gives.

In: a kernel and inputs. Out: nothing, or the first call that gives something else. A batch with one set of parameters
for all is compared with the reference elsewhere, for the values of the robot file and for others; so a batch in which
sets alternate has to give the bits of these batches, in every length, layout and form of the arrays.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from kinegen.outputs import Quantity
from kinegen.robot.model import Robot
from kinegen.verify.calls import BLOCK, LONGEST, SHARED, START, Call, Called, require_calls
from kinegen.verify.ways import Arrays, Floats, in_layout, layouts_of, results_of

_LENGTHS = 0, 1, 15, 17, LONGEST
_NUMBERS = 256
_GUARD = -7.0


@dataclass(frozen=True, slots=True)
class Alternating:
    """A kernel with inputs and sets of parameters, which configurations take in turn.

    Attributes:
        kernel: The kernel of an imported package.
        make: The package's `Params`.
        sets: Values of the parameters, a row for each of two sets.
        inputs: Inputs, N configurations each.
    """

    kernel: Any
    make: Any
    sets: Floats
    inputs: Arrays

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

    Args:
        robot: The robot.
        quantity: What the kernel computes.
        target: The kernel's language and number type, for the message.
        called: The kernel with inputs and parameters.

    Returns:
        The number of calls.

    Raises:
        ProofError: Naming the first call that gives something else.
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
    """One parameter along the batch, while the others are numbers."""
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
    """Of each configuration the result of its own set."""
    found: Floats = np.stack(results)[turns, np.arange(len(turns))]
    return found
