"""Vectors of named numbers on a tape: every product and every sum is a step of its own."""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from kinegen.symbolic.fold import Vector
from kinegen.symbolic.inverse.exact import Rotation
from kinegen.symbolic.inverse.steps import Steps


@dataclass(frozen=True, slots=True)
class Vectors:
    """Sums and products of vectors.

    Attributes:
        steps: The tape.
    """

    steps: Steps

    def combined(self, *terms: tuple[sp.Expr, Vector]) -> Vector:
        """A sum of multiples of vectors."""
        name = self.steps.name
        x, y, z = (name(sp.Add(*(name(factor * vector[place]) for factor, vector in terms))) for place in range(3))
        return x, y, z

    def dot(self, left: Vector, right: Vector) -> sp.Expr:
        """The inner product."""
        name = self.steps.name
        return name(sp.Add(*(name(a * b) for a, b in zip(left, right, strict=True))))

    def cross(self, left: Vector, right: Vector) -> Vector:
        """The cross product."""
        name = self.steps.name
        x, y, z = (name(name(left[i] * right[j]) - name(left[j] * right[i])) for i, j in ((1, 2), (2, 0), (0, 1)))
        return x, y, z

    def minus(self, left: Vector, right: Vector) -> Vector:
        """The difference."""
        x, y, z = (self.steps.name(a - b) for a, b in zip(left, right, strict=True))
        return x, y, z

    def scaled(self, vector: Vector, factor: sp.Expr) -> Vector:
        """A multiple."""
        x, y, z = (self.steps.name(entry * factor) for entry in vector)
        return x, y, z

    def seen(self, rows: Rotation, vector: Vector) -> Vector:
        """A vector in the axes of a frame."""
        return self.dot(rows[0], vector), self.dot(rows[1], vector), self.dot(rows[2], vector)
