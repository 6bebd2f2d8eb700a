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
from kinegen.verify.expectation import Expectation, expect
from kinegen.verify.known import Known, Numbers, quantity_frames
from kinegen.verify.splits import adjoint
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
    known: Known, results: Mapping[Quantity, Arrays]
) -> Iterator[tuple[Quantity, Expectation, tuple[Numbers, ...]]]:
    """Jacobians of the same frame, each brought to the origin and the axes of the base.

    Args:
        known: The reference at the joint vectors.
        results: The results of kernels of `JACOBIANS` at them.

    Yields:
        Each quantity but the first of a frame, what it must be after that one, and what it is.
    """
    first: dict[str, Quantity] = {}
    for quantity, found in results.items():
        other = first.setdefault(quantity.frame, quantity)
        if other is not quantity:
            in_base = Quantity(Kind.JACOBIAN, Reference.WORLD, quantity.frame)
            wanted = _in_base(known, other, results[other][-1])
            (subject,) = subjects(in_base)
            split = tuple(subject.split(wanted[:, column]) for column in range(wanted.shape[1]))
            yield quantity, replace(expect(known, in_base), wanted=(split,)), (_in_base(known, quantity, found[-1]),)


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
