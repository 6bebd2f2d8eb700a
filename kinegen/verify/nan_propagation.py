"""NaN, infinities and angles beyond what is promised: every result that depends on one is NaN, and no other changes.

Which results depend on which input is found out from the reference: a number that moves when an entry of the input
does. The reference shares nothing with the kernels, so a kernel that loses a NaN, or spreads it, is seen.

Sines and cosines make NaN of an infinite or far angle. Lengths have no such range: a number that depends on an infinite
joint or rate by sums and products alone is infinite or NaN. A joint may do both, as a screw does; what depends on it by
its sine is found out from the reference with its lengths held where they are.

A kernel may compute one entry of a matrix from others, such as a column of a rotation from the two others. So an entry
that does not depend on the input, or by less than can be said, may stop being a number if another one of the same frame
depends on it; it may not become another number. Frames without such an entry have to keep their bits, and so have the
other configurations of a batch. Of velocities and orientations, what does not depend on the input is only asked for in
these.

So a NaN in the set of one configuration may not reach another. What depends on a parameter is found out from the
reference: a number that moves when the parameter does.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np

from kinegen.errors import ProofError
from kinegen.ir.program import Operator, Program
from kinegen.model.expression_values import Dimension
from kinegen.model.outputs import Array, Quantity
from kinegen.model.robot import Robot, shifting, turning
from kinegen.support.dataclass import dataclass
from kinegen.verify.dependence import (
    MOVED,
    NOT,
    SURELY,
    Usual,
    dependence,
    dependence_by_sine,
    merged,
    returned,
    value_of,
    variants,
    with_moved,
)
from kinegen.verify.invocations import Arrays, KernelCall, results_of
from kinegen.verify.reference_cache import PLACES, Numbers, quantity_frames
from kinegen.verify.samples import input_samples, vector_samples

POINTS = 4
"""Joint vectors at which each entry is tried."""

KEEPS, MAY, INFINITE, NAN, ANY = range(5)
"""What becomes of a number: it stays; it stays or is no number; it is infinite or NaN; it is NaN; anything."""

FAR = 1e30
"""An angle that is beyond everything promised."""

ANGLES = {"a positive infinity": np.inf, "a negative infinity": -np.inf, "a far angle": FAR}
"""What is no angle."""


@dataclass(frozen=True, slots=True)
class Spoilt:
    """Inputs of which one entry is no number that a kernel can serve."""

    names: tuple[str, ...]  # For each row, what was put where
    inputs: Arrays
    plain: Arrays  # The same without it
    becomes: tuple[Numbers, ...]  # For each result, what becomes of its numbers, from `KEEPS` to `ANY`
    is_spoilt: Numbers  # For each row, whether it has such an entry; the rows beside it have none


class SpoiltRows:
    """Spoilt inputs in the making: each configuration stands beside the same one that is as it was.

    Args:
        values: Its inputs as they are, N each.
    """

    def __init__(self, arrays: Sequence[Array], results: Sequence[Array], values: Mapping[str, Numbers]) -> None:
        self._arrays, self._results, self._values = arrays, results, values
        self._names = list[str]()
        self._inputs: list[Mapping[str, Numbers]] = []
        self._becomes: list[list[Numbers]] = [[] for _ in results]

    def add(self, name: str, place: str, changed: Mapping[str, Numbers], becomes: Sequence[Numbers]) -> None:
        """Try something.

        `name`: what is put somewhere, for people; `changed`: the inputs in which it is; `becomes`: for each result,
        what becomes of the numbers of one configuration.
        """
        self._inputs.append({**self._values, **changed})
        for _ in next(iter(self._values.values())):
            self._names += [f"{name} in {place}", f"{name} in {place} of another configuration"]
            for found, each in zip(self._becomes, becomes, strict=True):
                found += [each, np.full_like(each, KEEPS)]

    def spoilt(self) -> Spoilt:
        """Everything that was added."""

        def joined(array: Array, tried: Sequence[Mapping[str, Numbers]]) -> Numbers:
            usual = self._values[array.name]
            rows = [np.stack([each[array.name], usual], axis=1).reshape(2 * len(usual), *array.shape) for each in tried]
            return np.concatenate([np.zeros((0, *array.shape)), *rows])

        return Spoilt(
            tuple(self._names),
            tuple(joined(array, self._inputs) for array in self._arrays),
            tuple(joined(array, [self._values] * len(self._inputs)) for array in self._arrays),
            tuple(
                np.array(found, int).reshape(len(self._names), *array.shape)
                for found, array in zip(self._becomes, self._results, strict=True)
            ),
            np.arange(len(self._names)) % 2 == 0,
        )


def inject_nan(robot: Robot, quantity: Quantity, arrays: Sequence[Array], results: Sequence[Array]) -> Spoilt:
    """Put NaN, infinities and far angles into each entry of each input.

    Returns the inputs, which floats hold exactly; without rows for a kernel that takes none.
    """
    samples = input_samples(robot, arrays, vector_samples(robot)[-POINTS:])
    values = {name: value.astype(np.float32).astype(np.float64) for name, value in samples.items()}
    entries = [(array.name, place) for array in arrays for place in np.ndindex(*_upper(array))]
    rows = SpoiltRows(arrays, results, values)
    for (name, place), depends in zip(entries, dependence(robot, quantity, results, values, entries), strict=True):
        by_sine = (
            dependence_by_sine(robot, quantity, results, values, place[0])
            if name == "q"
            else [np.full_like(each, NOT) for each in depends]
        )
        for word, value in _kinds(robot, name, place).items():
            becomes = becoming(value, depends, by_sine)
            rows.add(word, f"{name}{list(place)}", {name: _with(values[name], place, value)}, becomes)
    return rows.spoilt()


def becoming(value: float, depends: Sequence[Numbers], by_sine: Sequence[Numbers] | None) -> list[Numbers]:
    """Returns what becomes of the numbers of each result, from `KEEPS` to `ANY`, when an entry becomes no number.

    `depends`: whether they depend on it; `by_sine`: whether they do by a sine or cosine of it; None where there is no
    other way.
    """
    if np.isnan(value) or by_sine is None:
        return [np.choose(each, [KEEPS, MAY, NAN]) for each in depends]
    # Sums and products of an infinity are infinite or NaN, and those of a far number are other numbers.
    otherwise = [KEEPS, ANY, ANY] if np.isfinite(value) else [KEEPS, MAY, INFINITE]
    return [
        np.where(one == SURELY, NAN, np.choose(each, otherwise)) for each, one in zip(depends, by_sine, strict=True)
    ]


def require_spoilt(robot: Robot, quantity: Quantity, way: KernelCall, spoilt: Spoilt, real: str) -> None:
    """Refuse a kernel that loses a NaN or spreads it. Raises `ProofError` naming the kernel and what it was given."""
    if not spoilt.names:
        return
    with np.errstate(all="ignore"):
        given, usual = (tuple(array.astype(real) for array in each) for each in (spoilt.inputs, spoilt.plain))
        found, plain = way.call(given), way.call(usual)
    names = quantity_frames(robot, quantity)
    for array, result, before, becomes in zip(way.kernel.results, found, plain, spoilt.becomes, strict=True):
        frames = len(names) if array.shape[:1] == (len(names),) and len(names) > 1 else 1
        wrong = _wrong(result, before, becomes, frames)
        if quantity.kind not in PLACES:
            wrong &= (becomes >= INFINITE) | ~spoilt.is_spoilt.reshape(-1, *[1] * (result.ndim - 1))
        if wrong.any():
            place = tuple(int(entry) for entry in np.argwhere(wrong)[0])
            raise ProofError(
                f"{robot.name}: {way.target} {quantity} with {spoilt.names[place[0]]}: number {list(place[1:])} of "
                f"{array.name} {_FAULTS[int(becomes[place])]}; nothing was written"
            )


_FAULTS = {
    KEEPS: "changes, which does not depend on it",
    MAY: "becomes another number, which hardly depends on it",
    INFINITE: "is neither infinite nor NaN",
    NAN: "is not NaN",
}


def _wrong(result: Numbers, usual: Numbers, becomes: Numbers, frames: int) -> Numbers:
    """Returns which numbers are wrong; `frames` is how many frames the first axis of a configuration counts."""
    shape = (len(becomes), frames, becomes[0].size // frames)
    touched: Numbers = np.zeros(shape, bool)
    touched |= (becomes.reshape(shape) != KEEPS).any(axis=2, keepdims=True)
    nans, lost = np.isnan(result), ~np.isfinite(result)
    stays = (result == usual) | (lost & touched.reshape(result.shape)) | (nans & np.isnan(usual))
    wrong: Numbers = ~np.select([becomes == INFINITE, becomes == NAN, becomes == ANY], [lost, nans, True], stays)
    return wrong


def _upper(array: Array) -> tuple[int, ...]:
    """Returns the shape of an input without the last rows of matrices, which no kernel reads."""
    return (*array.shape[:-2], 3, 4) if array.is_pose else array.shape


def _kinds(robot: Robot, name: str, place: tuple[int, ...]) -> Mapping[str, float]:
    """Returns what is put into an entry of an input, by what it is called."""
    kinds = {"NaN": np.nan}
    if name == "q":
        is_angle = robot.variables[place[0]].name in turning(robot)
        kinds |= {word: value for word, value in ANGLES.items() if is_angle or np.isinf(value)}
    elif name in ("qd", "qdd"):
        kinds |= {"an infinity": np.inf}
    return kinds


def _with(values: Numbers, place: tuple[int, ...], value: float) -> Numbers:
    found = values.copy()
    for row in found:
        row[place] = value
    return found


_SUMS = Operator.ADD, Operator.SUB, Operator.MUL, Operator.NEG, Operator.SINCOS
"""Of these alone an infinity or a far angle is passed on; below a fraction bar it may give zero."""

_PARAMS = "params"


def spoil_params(robot: Robot, program: Program, arrays: Sequence[Array], results: Sequence[Array]) -> Spoilt:
    """Put NaN, infinities and far angles into each runtime parameter.

    Returns the inputs, and after them the values of the parameters (N, parameters).
    """
    points = vector_samples(robot)[-POINTS:]
    samples = input_samples(robot, arrays, points)
    values = {name: value.astype(np.float32).astype(np.float64) for name, value in samples.items()}
    usual = np.array([value_of(parameter) for parameter in robot.runtime_parameters], np.float32)
    before = [(each, Usual(each, program.quantity, results, values)) for each in variants(robot)]
    sets = np.tile(usual, (len(points), 1)).astype(np.float64)
    rows = SpoiltRows((*arrays, Array(_PARAMS, usual.shape)), results, {**values, _PARAMS: sets})
    for place, (name, kinds) in enumerate(_entries(robot, program)):
        depends = merged(
            [
                known.grades(returned(with_moved(each, {name: MOVED}), program.quantity, results, values))
                for each, known in before
            ]
        )
        by_sine = [np.full_like(each, NOT) for each in depends] if name in shifting(robot) else None
        for word, value in kinds.items():
            spoilt = sets.copy()
            spoilt[:, place] = value
            rows.add(word, f"params.{name}", {_PARAMS: spoilt}, becoming(value, depends, by_sine))
    return rows.spoilt()


def with_params(package: ModuleType, way: KernelCall) -> KernelCall:
    """Returns a way to call a kernel that takes the values of the parameters (N, parameters) after the other inputs."""

    def along(inputs: Arrays) -> Arrays:
        way.select()
        return results_of(way.kernel, package.Params(*inputs[-1].T), inputs[:-1])

    def one_by_one(inputs: Arrays) -> Arrays:
        found = [
            results_of(way.kernel, package.Params(*map(float, values)), tuple(point))
            for *point, values in zip(*inputs, strict=True)
        ]
        return tuple(np.stack(results) for results in zip(*found, strict=True))

    call: Any = along if way.is_plain else one_by_one
    return replace(way, call=call)


def _entries(robot: Robot, program: Program) -> Iterator[tuple[str, Mapping[str, float]]]:
    """Yields every parameter with what is put there."""
    is_sum = all(statement.operator in _SUMS for statement in program.statements)
    for parameter in robot.runtime_parameters:
        yield parameter.name, {"NaN": np.nan, **(ANGLES if is_sum and parameter.dimension is Dimension.ANGLE else {})}
