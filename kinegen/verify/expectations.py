"""What a kernel must return at some inputs, how far it is from that, and the laws that Jacobians obey."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import mpmath
import numpy as np

from kinegen.model.joint_bounds import reach
from kinegen.model.outputs import Kind, Quantity, Reference
from kinegen.support.dataclass import dataclass
from kinegen.verify.expected_results import subjects
from kinegen.verify.invocations import Arrays
from kinegen.verify.reference import DIGITS
from kinegen.verify.reference.velocity import Differences
from kinegen.verify.reference_cache import Numbers, ReferenceResults, Split, adjoint, quantity_frames, quantity_reach

Limits = tuple[tuple[Split, ...], ...]
"""What is accepted of each entry, for each result and frame; arrays of shape (N or 1, entries)."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """The largest errors of a result, and the worst entry: the one with the largest share of what is accepted of it."""

    position_error: float  # Largest error of an entry that is a length
    position_limit: float
    rotation_error: float  # Largest error of any other entry
    rotation_limit: float
    share: float  # Error of the worst entry, as a share of what is accepted of it
    row: int  # Number of the input at which the worst entry is
    frame: str
    compared: int
    uncompared: int  # Number of entries of which any value is accepted
    is_zero: bool  # Whether the result is 0 at all inputs


@dataclass(frozen=True, slots=True)
class Expectation:
    """The results of one quantity at some inputs."""

    quantity: Quantity
    known: ReferenceResults
    frames: tuple[str, ...]
    wanted: tuple[tuple[Split, ...], ...]  # For each result and frame, the entries that are lengths and all others
    length_scale: float  # What errors of lengths are relative to
    number_scale: float  # What errors of all other entries are relative to

    @property
    def is_read(self) -> bool:
        """Whether something else is compared than what the kernel returns."""
        return any(subject.numbers is not None for subject in subjects(self.quantity))

    def parts(self, place: int, column: int, result: Numbers) -> Split:
        """Returns one result for one frame, apart into lengths and all other entries."""
        subject = subjects(self.quantity)[place]
        inner = result.shape[result.ndim - subject.rank :]
        numbers = result.reshape(len(result), len(self.frames), *inner)[:, column]
        return subject.split(subject.read(self.known, self.frames[column], numbers))

    def judge(self, results: Sequence[Numbers], limits: Limits) -> Verdict:
        """Find the largest errors and the entry that is worst by what is accepted of it; a NaN is worse than any error.

        `results`: the results of a kernel, each of shape (N, ...) with an axis for frames where there are several.
        """
        worst, largest = (-1.0, 0, 0), [(0.0, 0.0), (0.0, 0.0)]
        counts, is_zero = np.zeros(2, int), True
        for place, result in enumerate(results):
            for column in range(len(self.frames)):
                found, wanted = self.parts(place, column, result), self.wanted[place][column]
                for part, (one, other, limit) in enumerate(zip(found, wanted, limits[place][column], strict=True)):
                    if one.size:
                        with np.errstate(invalid="ignore"):  # what a wrong kernel leaves may be any bits
                            off = one - other
                        (share, row), most, count = _worst(off, limit)
                        worst = max(worst, (share, row, column), key=lambda each: each[0])
                        largest[part] = _larger(largest[part], most)
                        counts += count
                        is_zero &= not other.any()
        share, row, column = worst
        compared, uncompared = map(int, counts)
        return Verdict(
            *largest[0], *largest[1], max(share, 0.0), row, self.frames[column], compared, uncompared, is_zero
        )

    def errors(self, results: Sequence[Numbers]) -> tuple[Numbers, Numbers]:
        """Returns the largest errors of each configuration and frame.

        `results`: the results of a kernel, each of shape (N, ...) with an axis for frames where there are several.
        Errors of lengths, and of all other entries, floats of shape (N, frames) each.
        """
        lengths, numbers = np.zeros((2, self.known.count, len(self.frames)))
        for subject, wanted, result in zip(subjects(self.quantity), self.wanted, results, strict=True):
            inner = result.shape[result.ndim - subject.rank :]
            by_frame = result.reshape(self.known.count, len(self.frames), *inner)
            for column, frame in enumerate(self.frames):
                found = subject.split(subject.read(self.known, frame, by_frame[:, column]))
                for total, one, other in zip((lengths, numbers), found, wanted[column], strict=True):
                    total[:, column] = np.maximum(total[:, column], _largest(one - other))
        return lengths, numbers


def expect(known: ReferenceResults, quantity: Quantity) -> Expectation:
    """Ask the reference what a kernel must return.

    Lengths are measured by the reach of the frames, times the largest angular velocity or acceleration that occurs, as
    far as it is more than 1: a point moves that fast at this distance from an axis. All other entries are measured by
    their own largest, or by 1 if that is less.
    """
    frames = quantity_frames(known.robot, quantity)
    with mpmath.workdps(DIGITS):
        wanted = tuple(
            tuple(subject.split(subject.expected(known, frame)) for frame in frames) for subject in subjects(quantity)
        )
    lengths, numbers = (
        max((float(_largest(split[part]).max(initial=0)) for result in wanted for split in result), default=0.0)
        for part in (0, 1)
    )
    number_scale = max(1.0, numbers)
    extent = reach(known.robot, quantity_reach(known.robot, quantity))
    return Expectation(quantity, known, frames, wanted, max(extent * number_scale, lengths), number_scale)


Largest = tuple[float, float]
"""An error, and what is accepted of it."""


def _larger(one: Largest, other: Largest) -> Largest:
    """The larger of two errors; of equal ones that of which less is accepted, as what nobody looked at has no limit."""
    if math.isnan(one[0]) or math.isnan(other[0]):
        return one if math.isnan(one[0]) else other
    return max(one, other, key=lambda each: (each[0], -each[1] if each[1] else -math.inf))


def _worst(differences: Numbers, limits: Numbers) -> tuple[tuple[float, int], Largest, tuple[int, int]]:
    """The largest share of its limit and its row; the largest error and its limit; entries with a limit and without."""
    # What a kernel does not write may be as large as any number.
    with np.errstate(invalid="ignore", over="ignore"):
        errors = np.abs(differences.astype(np.float64))
        limits = np.broadcast_to(limits, errors.shape)
        free = np.isinf(limits)
        shares = np.where(free, 0.0, np.nan_to_num(errors / limits, nan=np.inf))
    row, entry = np.unravel_index(np.argmax(shares), shares.shape)
    most = np.argmax(np.where(free, -1.0, errors))  # NaN is the largest for argmax
    largest = 0.0, 0.0
    if not free.flat[most]:
        largest = float(errors.flat[most]), float(limits.flat[most])
    loose = int(free.sum())
    return (float(shares[row, entry]), int(row)), largest, (errors.size - loose, loose)


def _largest(entries: Numbers) -> Numbers:
    """Returns the largest absolute value of each row, as floats; 0 for rows without entries."""
    found: Numbers = np.abs(entries.astype(np.float64)).max(axis=1, initial=0.0)
    return found


JACOBIANS = (Kind.JACOBIAN, Kind.FK_JACOBIAN)
"""Kinds whose last result is a geometric Jacobian."""


class ByDifferences(ReferenceResults):
    """What follows from differences of poses in 50 digits."""

    @cached_property
    def motion(self) -> Differences:
        """Jacobians at the joint vectors."""
        return Differences(self.robot, self.inputs["q"])


def by_adjoint(
    known: ReferenceResults, results: Mapping[Quantity, Arrays], limits: Mapping[Quantity, Limits]
) -> Iterator[tuple[Quantity, Expectation, tuple[Numbers, ...], Limits]]:
    """Jacobians of the same frame, each brought to the origin and the axes of the base.

    `results`: the results of kernels of `JACOBIANS` at them; `limits`: what is accepted of these results. Yields each
    quantity but the first of a frame, what it must be after that one, what it is, and what is accepted.
    """
    first: dict[str, Quantity] = {}
    for quantity, found in results.items():
        other = first.setdefault(quantity.way, quantity)
        if other is not quantity:
            in_base = Quantity(Kind.JACOBIAN, Reference.WORLD, quantity.frame, quantity.seen_from)
            wanted = _in_base(known, other, results[other][-1])
            (subject,) = subjects(in_base)
            split = tuple(subject.split(wanted[:, column]) for column in range(wanted.shape[1]))
            expectation = replace(expect(known, in_base), wanted=(split,))
            allowed = _allowed(expectation, (limits[other][-1], limits[quantity][-1]))
            yield quantity, expectation, (_in_base(known, quantity, found[-1]),), allowed


def _allowed(expectation: Expectation, both: tuple[tuple[Split, ...], tuple[Split, ...]]) -> Limits:
    """The limits of two Jacobians together, after both are brought to the base with lever arms up to the reach."""
    extent = expectation.length_scale / expectation.number_scale
    found = []
    for splits in zip(*both, strict=True):
        number = sum(float(numbers.max(initial=0)) for _, numbers in splits)
        length = sum(float(lengths.max(initial=0)) for lengths, _ in splits)
        # A row of a rotation adds three entries, with a norm of one.
        found.append((np.array([[2 * (length + extent * number)]]), np.array([[2 * number]])))
    return (tuple(found),)


def _in_base(known: ReferenceResults, quantity: Quantity, jacobian: Numbers) -> Numbers:
    """Returns a Jacobian at the origin and in the axes of the base, shape (N, frames, 6, dof)."""
    frames = quantity_frames(known.robot, quantity)
    by_frame = jacobian.reshape(known.count, len(frames), *jacobian.shape[-2:])
    columns = []
    for column, frame in enumerate(frames):
        place = known.motion.pose(frame)
        if quantity.reference is Reference.LOCAL_WORLD_ALIGNED:
            place = np.concatenate([np.broadcast_to(np.eye(4)[:, :3], (known.count, 4, 3)), place[:, :, 3:]], axis=2)
        elif quantity.reference is Reference.WORLD:
            place = np.broadcast_to(np.eye(4), (known.count, 4, 4))
        columns.append(adjoint(place) @ by_frame[:, column])
    return np.stack(columns, axis=1)
