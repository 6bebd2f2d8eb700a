"""The same bits in every way of calling: what a proof compares with the reference once stands for all calls.

In: a kernel, inputs, and what its batch gave for them, which is compared with the reference elsewhere. Out: nothing, or
the first call that gives something else. The header of the batch kernels promises that a result does not depend on its
place in the batch; so lengths, strides, layouts, threads, blocks, types of input and arrays for the result may not
change a bit. NumPy's own functions make no such promise: there, the last digits may differ.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from kinegen.errors import ProofError
from kinegen.model.outputs import Quantity
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass
from kinegen.verify.invocations import Arrays, Floats, in_layout, in_rows, layouts_of, results_of
from kinegen.verify.isolation import calling, require_guards

LONGEST = 66
"""Batches of all lengths up to this are tried: two tiles of the widest kind, and two more."""

START = 3
"""Where they begin, so that no configuration keeps its place in a tile."""

BLOCK = 32_768
"""A longer batch is cut up."""

SHARED = 2 * 4096 + 5
"""Long enough that three threads have something to do."""

_FEW = 0, 1, 2, 17
"""Lengths for NumPy, where a tail is nothing special."""

_LARGEST = 1000.0
"""Numbers up to this become other types, of which some hold no more than 65,504."""

_NUMBERS = 256
"""Kernels with more numbers for a configuration are not asked for a batch over a block, which would take 100 MB."""

_GUARD = -7.0
_LAST_DIGITS = 64


@dataclass(frozen=True, slots=True)
class Call:
    """One call."""

    name: str
    results: Callable[[], Arrays]  # Calls the kernel
    wanted: Arrays


@dataclass(frozen=True, slots=True)
class Called:
    """A kernel with inputs and its results."""

    kernel: Any
    params: Any  # Values of its runtime parameters; None for those of the robot file
    inputs: Arrays  # Its inputs, N configurations each
    results: Arrays  # What a batch of all of them gave

    def resized(self, count: int) -> tuple[Arrays, Arrays]:
        """Returns the same configurations over and over."""
        places = np.resize(np.arange(len(self.inputs[0])), count)
        return tuple(array[places] for array in self.inputs), tuple(array[places] for array in self.results)

    def call(self, inputs: Arrays, **options: Any) -> Arrays:
        """Call the kernel; several results as a tuple, and one as well."""
        found = self.kernel(*inputs, params=self.params, **options)
        return found if isinstance(found, tuple) else (found,)


def require_same_bits(robot: Robot, quantity: Quantity, target: str, called: Called) -> int:
    """Call a kernel in every way, and refuse one that then gives something else.

    Returns the number of calls. Raises `ProofError` naming the first call that gives something else.
    """
    return require_calls(robot, quantity, target, called.kernel, _calls(called))


def require_calls(robot: Robot, quantity: Quantity, target: str, kernel: Any, calls: Iterator[Call]) -> int:
    """Make calls, and refuse a kernel that gives something else than what is wanted.

    Returns the number of calls. Raises `ProofError` naming the first call that gives something else.
    """
    count = 0
    for call in calls:
        count += 1
        calling(f"{target} {quantity} {call.name}")
        found = call.results()
        require_guards()
        if not all(_same(kernel, one, other) for one, other in zip(found, call.wanted, strict=True)):
            raise ProofError(
                f"{robot.name}: {target} {quantity} gives another result {call.name} than in a plain batch; "
                "nothing was written"
            )
    return count


def _same(kernel: Any, found: Floats, wanted: Floats) -> bool:
    if found.shape != wanted.shape or found.dtype != wanted.dtype:
        return False
    if kernel.backend == "c":
        return np.ascontiguousarray(found).tobytes() == np.ascontiguousarray(wanted).tobytes()
    if np.array_equal(found, wanted):
        return True
    size = np.nanmax(np.abs(wanted), initial=1.0)
    close = np.isclose(found, wanted, rtol=0, atol=_LAST_DIGITS * np.finfo(wanted.dtype).eps * size, equal_nan=True)
    return bool(close.all())


def _calls(called: Called) -> Iterator[Call]:
    yield from _lengths(called)
    yield from _strides(called)
    yield from _foreign_types(called)
    yield from _given_results(called)
    yield from _shared(called)
    yield from _single(called)


def _lengths(called: Called) -> Iterator[Call]:
    """Batches of every length below two tiles, in every layout."""
    for layout in layouts_of(called.kernel):
        for count in range(LONGEST + 1) if called.kernel.backend == "c" else _FEW:
            inputs, wanted = (tuple(array[START:] for array in arrays) for arrays in called.resized(START + count))
            results = partial(in_layout, called.kernel, called.params, layout, inputs)
            yield Call(f"in a batch of {count} of layout {layout}", results, wanted)


def _strides(called: Called) -> Iterator[Call]:
    """Arrays that do not lie next to each other in memory."""
    inputs, wanted = called.resized(LONGEST)
    forms: dict[str, Callable[[Floats], Floats]] = {
        "with every second row of an array": lambda array: np.repeat(array, 2, axis=0)[::2],
        "with rows in the opposite order": lambda array: array[::-1].copy()[::-1],
        "with every third number of a row": _spread_columns,
        "with columns in the opposite order": lambda array: array[..., ::-1].copy()[..., ::-1],
        "with arrays in Fortran order": np.asfortranarray,
        "with arrays at odd addresses": _misaligned,
        "with arrays of the opposite byte order": lambda array: array.astype(array.dtype.newbyteorder()),
        "with lists": lambda array: array,
    }
    for name, form in forms.items():
        yield Call(name, partial(called.call, tuple(map(form, inputs))), wanted)
    # The shape of a batch: leading axes, their order, and the layout of its numbers.
    several, deep = (tuple(a.reshape(6, LONGEST // 6, *a.shape[1:]) for a in arrays) for arrays in (inputs, wanted))
    yield Call("with two leading axes", partial(called.call, several), deep)
    turned = tuple(array.swapaxes(0, 1) for array in several)
    yield Call("with exchanged axes", partial(called.call, turned), tuple(array.swapaxes(0, 1) for array in deep))
    rows = partial(called.call, in_rows(called.kernel, inputs), layout="joint_major")
    whole = called.call(tuple(map(np.ascontiguousarray, in_rows(called.kernel, inputs))), layout="joint_major")
    yield Call("with transposed arrays of layout joint_major", rows, whole)
    if len(inputs) > 1:
        first = tuple(np.repeat(array[-1:], LONGEST, axis=0) for array in inputs[:1])
        yield Call(
            "with one configuration of the first input for all",
            partial(called.call, (inputs[0][-1], *inputs[1:])),
            called.call((*first, *inputs[1:])),
        )
    # A broadcast row has strides of zero.
    same = tuple(np.broadcast_to(array[-1:], array.shape) for array in inputs)
    yield Call(
        "with one row for all", partial(called.call, same), tuple(np.repeat(a[-1:], LONGEST, axis=0) for a in wanted)
    )


def _spread_columns(array: Floats) -> Floats:
    if not array.ndim:
        return array
    wide = np.full((*array.shape[:-1], 3 * array.shape[-1]), np.nan, array.dtype)
    wide[..., 1::3] = array
    return wide[..., 1::3]


def _misaligned(array: Floats) -> Floats:
    room = np.empty(array.nbytes + 1, np.uint8)
    found = room[1:].view(array.dtype).reshape(array.shape)
    found[...] = array
    return found


def _foreign_types(called: Called) -> Iterator[Call]:
    """Other number types, which are converted first."""
    inputs, _ = called.resized(LONGEST)
    real = inputs[0].dtype
    for other in (np.dtype(np.float16), np.dtype(np.int32), np.dtype(np.longdouble)):
        becomes = np.dtype(np.float32) if other == np.float16 else np.dtype(np.float64)
        if becomes == real and other != real:
            foreign: tuple[Any, ...] = tuple(np.clip(array, -_LARGEST, _LARGEST).astype(other) for array in inputs)
            plain = called.call(tuple(array.astype(real) for array in foreign))
            yield Call(f"with arrays of {other}", partial(called.call, foreign), plain)


def _given_results(called: Called) -> Iterator[Call]:
    """Arrays for the result, and arguments that are bound."""
    inputs, wanted = called.resized(LONGEST)
    plain = tuple(np.full_like(array, _GUARD) for array in wanted)
    yield Call("with out=", partial(_into, called, inputs, plain, plain), wanted)
    rooms = tuple(np.full((2 * len(array), *array.shape[1:]), _GUARD, array.dtype) for array in wanted)
    views = tuple(array[::2] for array in rooms)
    between = tuple(_between(array) for array in wanted)
    yield Call("with every second row of out=", partial(_into, called, inputs, views, rooms), between)
    bound = tuple(np.full_like(array, _GUARD) for array in wanted)
    yield Call("bound to arrays", partial(_bound, called, inputs, bound), wanted)


def _between(array: Floats) -> Floats:
    """Returns every second row, and what stood between them before."""
    room = np.full((2 * len(array), *array.shape[1:]), _GUARD, array.dtype)
    room[::2] = array
    return room


def _into(called: Called, inputs: Arrays, given: Arrays, seen: Arrays) -> Arrays:
    called.call(inputs, out=given if len(given) > 1 else given[0])
    return seen


def _bound(called: Called, inputs: Arrays, given: Arrays) -> Arrays:
    called.kernel.bind(*inputs, *given, params=called.params)()
    return given


def _shared(called: Called) -> Iterator[Call]:
    """Long batches: shared by threads, and cut into blocks."""
    inputs, wanted = called.resized(SHARED)
    yield Call("with threads=3", partial(called.call, inputs, threads=3), wanted)
    is_small = sum(array[0].size for array in wanted) <= _NUMBERS
    if is_small and called.kernel.backend == "c":  # NumPy has had several blocks already
        longer, also = called.resized(BLOCK + LONGEST)
        yield Call(f"in a batch of {BLOCK + LONGEST}", partial(called.call, longer), also)


def _single(called: Called) -> Iterator[Call]:
    """Yields one configuration, which the scalar kernel serves: however it is given, with the same bits."""
    for place in {0, len(called.inputs[0]) // 2, len(called.inputs[0]) - 1}:
        inputs = tuple(array[place, ...] for array in called.inputs)
        wanted = results_of(called.kernel, called.params, inputs)
        given = tuple(np.full_like(array, _GUARD) for array in wanted)
        yield Call("of one configuration with out=", partial(_into, called, inputs, given, given), wanted)
        bound = tuple(np.full_like(array, _GUARD) for array in wanted)
        yield Call("of one configuration, bound", partial(_bound, called, inputs, bound), wanted)
        spread = tuple(map(_spread_columns, inputs))
        yield Call("of one configuration with strides", partial(called.call, spread), wanted)
