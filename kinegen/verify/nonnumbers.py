"""NaN, infinities and angles beyond what is promised: every result that depends on one is NaN, and no other changes.

In: a kernel. Out: nothing, or the first entry that is wrong. Which results depend on which input is found out from the
reference: a number that moves when an entry of the input does. The reference shares nothing with the kernels, so a
kernel that loses a NaN, or spreads it, is seen.

A kernel may compute one entry of a matrix from others, such as a column of a rotation from the two others. So an entry
that does not depend on the input may become NaN if another one of the same frame does; it may not become another
number. Frames without such an entry have to keep their bits, and so have the other configurations of a batch. Of
velocities and orientations, what does not depend on the input is only asked for in these.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from kinegen.errors import ProofError
from kinegen.outputs import Array, Quantity
from kinegen.robot.model import JointType, Robot
from kinegen.verify.known import PLACES, Known, Numbers, quantity_frames
from kinegen.verify.samples import input_samples, vector_samples
from kinegen.verify.subjects import subjects
from kinegen.verify.ways import Arrays, Way

POINTS = 4
"""Joint vectors at which each entry is tried."""

MOVED = 0.015625
"""What is added to an entry, to see what depends on it."""

_ROUNDED = 1e-13
"""What is added to all entries, to see which results are decided by rounding."""

_STILL = 1e-9
"""Numbers that move less, relative to the largest, do not depend on it."""

_INFINITY = "an infinity"
"""In what is no angle; what depends on it is not finite."""

FAR = 1e30
"""An angle that is beyond everything promised."""


@dataclass(frozen=True, slots=True)
class Spoilt:
    """Inputs of which one entry is no number that a kernel can serve.

    Attributes:
        names: For each row, what was put where.
        inputs: The inputs.
        plain: The same without it.
        depends: For each result, which of its numbers depend on that entry.
        is_nan: For each row, whether these must be NaN; otherwise they must not be finite.
        is_spoilt: For each row, whether it has such an entry; the rows beside it have none.
    """

    names: tuple[str, ...]
    inputs: Arrays
    plain: Arrays
    depends: tuple[Numbers, ...]
    is_nan: Numbers
    is_spoilt: Numbers


def spoil(robot: Robot, quantity: Quantity, arrays: Sequence[Array], results: Sequence[Array]) -> Spoilt:
    """Put NaN, infinities and far angles into each entry of each input.

    Args:
        robot: The robot.
        quantity: What the kernel computes.
        arrays: Its inputs.
        results: Its results.

    Returns:
        The inputs, which floats hold exactly; without rows for a kernel that takes none.
    """
    points = vector_samples(robot)[-POINTS:]
    samples = input_samples(robot, arrays, points)
    values = {name: value.astype(np.float32).astype(np.float64) for name, value in samples.items()}
    entries = list(_entries(robot, arrays))
    moved = _moved(robot, quantity, results, values, [(array.name, place) for array, place, _ in entries])
    plain: dict[str, list[Numbers]] = {array.name: [] for array in arrays}
    inputs: dict[str, list[Numbers]] = {array.name: [] for array in arrays}
    names, is_nan = list[str](), list[bool]()
    depends: list[list[Numbers]] = [[] for _ in results]
    for (array, place, kinds), changes in zip(entries, moved, strict=True):
        for word, value in kinds.items():
            spoilt = {**values, array.name: _with(values[array.name], place, value)}
            # Every configuration stands beside one that is as it was.
            for given in arrays:
                plain[given.name] += [values[given.name], values[given.name]]
                inputs[given.name] += [spoilt[given.name], values[given.name]]
            for found, change in zip(depends, changes, strict=True):
                shape = (len(points), *change.shape)
                found += [np.broadcast_to(change, shape), np.zeros(shape, bool)]
            names += [f"{word} in {array.name}{list(place)}"] * len(points)
            names += [f"{word} in another configuration"] * len(points)
            is_nan += [word != _INFINITY] * (2 * len(points))
    return Spoilt(
        tuple(names),
        tuple(_joined(inputs[array.name], array.shape, np.float64) for array in arrays),
        tuple(_joined(plain[array.name], array.shape, np.float64) for array in arrays),
        tuple(_joined(found, array.shape, np.bool_) for found, array in zip(depends, results, strict=True)),
        np.array(is_nan, bool),
        np.arange(len(names)) // len(points) % 2 == 0,
    )


def _moved(
    robot: Robot,
    quantity: Quantity,
    results: Sequence[Array],
    values: Mapping[str, Numbers],
    entries: Sequence[tuple[str, tuple[int, ...]]],
) -> list[list[Numbers]]:
    """For each entry and each result, which numbers move with the entry, and are not moved by rounding as well."""
    if not entries:
        return []
    stacked = {
        name: np.concatenate(
            [
                value,
                value + _ROUNDED,
                *(_with(value, place, MOVED, add=True) if name == other else value for other, place in entries),
            ]
        )
        for name, value in values.items()
    }
    given = [
        found.reshape(len(entries) + 2, -1, *found.shape[1:]) for found in returned(robot, quantity, results, stacked)
    ]
    # Of an orientation that is singular everywhere, rounding decides how two angles share their sum.
    steady = [~differ(found[0], found[1]) for found in given]
    return [
        [differ(found[0], found[index + 2]) & still for found, still in zip(given, steady, strict=True)]
        for index in range(len(entries))
    ]


def require_spoilt(robot: Robot, quantity: Quantity, way: Way, spoilt: Spoilt, real: str) -> None:
    """Refuse a kernel that loses a NaN or spreads it.

    Args:
        robot: The robot.
        quantity: What the kernel computes.
        way: How it is called.
        spoilt: What it is given.
        real: Its number type, as NumPy calls it.

    Raises:
        ProofError: Naming the kernel and what it was given.
    """
    if not spoilt.names:
        return
    with np.errstate(all="ignore"):
        given, usual = (tuple(array.astype(real) for array in each) for each in (spoilt.inputs, spoilt.plain))
        found, plain = way.call(given), way.call(usual)
    names = quantity_frames(robot, quantity)
    for array, result, before, depends in zip(way.kernel.results, found, plain, spoilt.depends, strict=True):
        frames = len(names) if array.shape[:1] == (len(names),) and len(names) > 1 else 1
        wrong = _wrong(result, before, depends, spoilt.is_nan, frames)
        if quantity.kind not in PLACES:
            wrong &= depends | ~spoilt.is_spoilt.reshape(-1, *[1] * (result.ndim - 1))
        if wrong.any():
            place = tuple(int(entry) for entry in np.argwhere(wrong)[0])
            kept = "is not NaN" if depends[place] else "changes, which does not depend on it"
            raise ProofError(
                f"{robot.name}: {way.target} {quantity} with {spoilt.names[place[0]]}: number {list(place[1:])} of "
                f"{array.name} {kept}; nothing was written"
            )


def _wrong(result: Numbers, usual: Numbers, depends: Numbers, is_nan: Numbers, frames: int) -> Numbers:
    """Which numbers are wrong; `frames` is how many frames the first axis of a configuration counts."""
    shape = (len(depends), frames, depends[0].size // frames)
    touched: Numbers = np.zeros(shape, bool)
    touched |= depends.reshape(shape).any(axis=2, keepdims=True)
    nans, rows = np.isnan(result), is_nan.reshape(-1, *[1] * (result.ndim - 1))
    spoils = np.where(rows, nans, ~np.isfinite(result))
    wrong: Numbers = np.where(
        depends, ~spoils, ~((result == usual) | (nans & touched.reshape(result.shape)) | (nans & np.isnan(usual)))
    )
    return wrong


def _entries(robot: Robot, arrays: Sequence[Array]) -> Iterator[tuple[Array, tuple[int, ...], Mapping[str, float]]]:
    """Every entry of every input with what is put there."""
    for array in arrays:
        upper = (*array.shape[:-2], 3, 4) if array.is_pose else array.shape
        for place in np.ndindex(*upper):
            kinds = {"NaN": np.nan}
            if array.name == "q" and robot.variables[place[0]].type is JointType.REVOLUTE:
                kinds |= {"a positive infinity": np.inf, "a negative infinity": -np.inf, "a far angle": FAR}
            elif array.name in ("qd", "qdd"):
                kinds |= {_INFINITY: np.inf}
            yield array, place, kinds


def _with(values: Numbers, place: tuple[int, ...], value: float, *, add: bool = False) -> Numbers:
    found = values.copy()
    for row in found:
        row[place] = row[place] + value if add else value
    return found


def returned(
    robot: Robot, quantity: Quantity, results: Sequence[Array], values: Mapping[str, Numbers]
) -> list[Numbers]:
    """What the kernel must return for inputs by name, in the shapes in which it does."""
    known, frames = Known(robot, values), quantity_frames(robot, quantity)
    found = []
    for subject, array in zip(subjects(quantity), results, strict=True):
        numbers = [np.asarray(subject.returned(known, frame), dtype=np.float64) for frame in frames]
        found.append(np.stack(numbers, axis=1).reshape(known.count, *array.shape))
    return found


def differ(first: Numbers, second: Numbers) -> Numbers:
    """Which numbers differ for one of the rows; readings that are impossible say nothing."""
    size = max(1.0, float(np.nanmax(np.abs(first), initial=0.0)))
    differ: Numbers = (np.abs(first - second) > _STILL * size).any(axis=0)
    return differ


def _joined(parts: Sequence[Numbers], shape: tuple[int, ...], kind: type[np.generic]) -> Numbers:
    return np.concatenate(parts).astype(kind) if parts else np.zeros((0, *shape), kind)
