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


def _largest(entries: Numbers) -> Numbers:
    """The largest absolute value of each row, as floats; 0 for rows without entries."""
    found: Numbers = np.abs(entries.astype(np.float64)).max(axis=1, initial=0.0)
    return found
