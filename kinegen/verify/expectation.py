"""What a kernel must return at some inputs, and how far it is from that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mpmath
import numpy as np

from kinegen.outputs import Quantity
from kinegen.reference import DIGITS
from kinegen.robot.extent import reach
from kinegen.verify.known import Known, Numbers, quantity_frames, quantity_reach
from kinegen.verify.splits import Split
from kinegen.verify.subjects import subjects

Limits = tuple[tuple[Split, ...], ...]
"""What is accepted of each entry, for each result and frame; arrays of shape (N or 1, entries)."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """The worst entries of a result: those with the largest share of what is accepted of them.

    Attributes:
        position_error: Error of the worst entry that is a length.
        position_limit: What is accepted of it.
        rotation_error: Error of the worst other entry.
        rotation_limit: What is accepted of it.
        row: Number of the input at which the worst of both is.
        frame: Its frame.
    """

    position_error: float
    position_limit: float
    rotation_error: float
    rotation_limit: float
    row: int
    frame: str


@dataclass(frozen=True, slots=True)
class Expectation:
    """The results of one quantity at some inputs.

    Attributes:
        quantity: What is computed.
        known: The reference at these inputs.
        frames: The frames for which it is computed.
        wanted: For each result and frame, the entries that are lengths and all others.
        length_scale: What errors of lengths are relative to.
        number_scale: What errors of all other entries are relative to.
    """

    quantity: Quantity
    known: Known
    frames: tuple[str, ...]
    wanted: tuple[tuple[Split, ...], ...]
    length_scale: float
    number_scale: float

    @property
    def is_read(self) -> bool:
        """Whether something else is compared than what the kernel returns."""
        return any(subject.numbers is not None for subject in subjects(self.quantity))

    def parts(self, place: int, column: int, result: Numbers) -> Split:
        """One result for one frame, apart into lengths and all other entries.

        Args:
            place: Number of the result.
            column: Number of the frame.
            result: What the kernel gave, shape (N, ...).
        """
        subject = subjects(self.quantity)[place]
        inner = result.shape[result.ndim - subject.rank :]
        numbers = result.reshape(len(result), len(self.frames), *inner)[:, column]
        return subject.split(subject.read(self.known, self.frames[column], numbers))

    def judge(self, results: Sequence[Numbers], limits: Limits) -> Verdict:
        """Find the entries that are worst by what is accepted of them; a NaN is worse than any error.

        Args:
            results: The results of a kernel, each of shape (N, ...) with an axis for frames where there are several.
            limits: What is accepted.
        """
        worst: list[tuple[float, float, float, int, int]] = [(-1.0, 0.0, 0.0, 0, 0)] * 2
        for place, result in enumerate(results):
            for column in range(len(self.frames)):
                found, wanted = self.parts(place, column, result), self.wanted[place][column]
                for part, (one, other, limit) in enumerate(zip(found, wanted, limits[place][column], strict=True)):
                    if one.size:
                        with np.errstate(invalid="ignore"):  # what a wrong kernel leaves may be any bits
                            off = one - other
                        worst[part] = max(worst[part], (*_worst(off, limit), column), key=lambda each: each[0])
        _, _, _, row, column = max(worst, key=lambda each: each[0])
        (_, length, length_limit, *_), (_, number, number_limit, *_) = worst
        return Verdict(length, length_limit, number, number_limit, row, self.frames[column])

    def errors(self, results: Sequence[Numbers]) -> tuple[Numbers, Numbers]:
        """The largest errors of each configuration and frame.

        Args:
            results: The results of a kernel, each of shape (N, ...) with an axis for frames where there are several.

        Returns:
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


def expect(known: Known, quantity: Quantity) -> Expectation:
    """Ask the reference what a kernel must return.

    Lengths are measured by the reach of the frames, times the largest angular velocity or acceleration that occurs, as
    far as it is more than 1: a point moves that fast at this distance from an axis. All other entries are measured by
    their own largest, or by 1 if that is less.

    Args:
        known: The reference at the inputs.
        quantity: What the kernel computes.
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


def _worst(differences: Numbers, limits: Numbers) -> tuple[float, float, float, int]:
    """The largest share of its limit, with this error, the limit and its row."""
    # What a kernel does not write may be as large as any number.
    with np.errstate(invalid="ignore", over="ignore"):
        errors = np.abs(differences.astype(np.float64))
        limits = np.broadcast_to(limits, errors.shape)
        shares = np.where(np.isinf(limits), 0.0, np.nan_to_num(errors / limits, nan=np.inf))
    row, entry = np.unravel_index(np.argmax(shares), shares.shape)
    return float(shares[row, entry]), float(errors[row, entry]), float(limits[row, entry]), int(row)


def _largest(entries: Numbers) -> Numbers:
    """The largest absolute value of each row, as floats; 0 for rows without entries."""
    found: Numbers = np.abs(entries.astype(np.float64)).max(axis=1, initial=0.0)
    return found
