"""Laws that Jacobians obey, whoever computes them: they are differences of poses, and change axes by the adjoint.

In: the Jacobians of a package. Out: what they must be after each of these laws, for the proof to compare.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property

import numpy as np

from kinegen.outputs import Kind, Quantity, Reference
from kinegen.reference.differences import Differences
from kinegen.verify.expectation import Expectation, Limits, expect
from kinegen.verify.known import Known, Numbers, quantity_frames
from kinegen.verify.splits import Split, adjoint
from kinegen.verify.subjects import subjects
from kinegen.verify.ways import Arrays

JACOBIANS = (Kind.JACOBIAN, Kind.FK_JACOBIAN)
"""Kinds whose last result is a geometric Jacobian."""


class ByDifferences(Known):
    """What follows from differences of poses in 50 digits."""

    @cached_property
    def motion(self) -> Differences:
        """Jacobians at the joint vectors."""
        return Differences(self.robot, self.inputs["q"])


def by_adjoint(
    known: Known, results: Mapping[Quantity, Arrays], limits: Mapping[Quantity, Limits]
) -> Iterator[tuple[Quantity, Expectation, tuple[Numbers, ...], Limits]]:
    """Jacobians of the same frame, each brought to the origin and the axes of the base.

    Args:
        known: The reference at the joint vectors.
        results: The results of kernels of `JACOBIANS` at them.
        limits: What is accepted of these results.

    Yields:
        Each quantity but the first of a frame, what it must be after that one, what it is, and what is accepted.
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


def _in_base(known: Known, quantity: Quantity, jacobian: Numbers) -> Numbers:
    """A Jacobian at the origin and in the axes of the base, shape (N, frames, 6, dof)."""
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
