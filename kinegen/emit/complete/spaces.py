"""Null spaces and complements of small matrices, with mpmath: the same digits on every machine."""

from __future__ import annotations

from typing import Any

import mpmath

Vector = list[Any]

_TINY = mpmath.mpf(10) ** -15


def null_space(rows: list[Vector]) -> list[Vector]:
    """An orthonormal basis of the vectors that all rows map to zero, by elimination with complete pivoting.

    Args:
        rows: A matrix of real or complex numbers, of order 1.
    """
    work, size = [list(row) for row in rows], len(rows[0])
    pivots: list[int] = []
    for step in range(min(len(work), size)):
        left = [column for column in range(size) if column not in pivots]
        best = max((abs(work[row][column]), -row, -column) for row in range(step, len(work)) for column in left)
        if best[0] < _TINY:
            break
        row, column = -best[1], -best[2]
        work[step], work[row] = work[row], work[step]
        work[step] = [entry / work[step][column] for entry in work[step]]
        pivots.append(column)
        for other in range(len(work)):
            if other != step:
                factor = work[other][column]
                work[other] = [a - factor * b for a, b in zip(work[other], work[step], strict=True)]
    found = []
    for free in (column for column in range(size) if column not in pivots):
        vector: Vector = [mpmath.mpf(int(column == free)) for column in range(size)]
        for place, column in enumerate(pivots):
            vector[column] = -work[place][free]
        found.append(vector)
    return orthonormal(found)


def orthonormal(vectors: list[Vector]) -> list[Vector]:
    """The vectors made orthonormal, in their order."""
    found: list[Vector] = []
    for vector in vectors:
        found.append(unit(_rest(vector, found)))
    return found


def complement(vectors: list[Vector], size: int) -> list[Vector]:
    """An orthonormal basis of what is orthogonal to the vectors, which need not be orthogonal themselves."""
    basis = orthonormal(vectors)
    found: list[Vector] = []
    while len(basis) < size:
        units = ([mpmath.mpf(int(row == column)) for row in range(size)] for column in range(size))
        rests = [_rest(each, basis) for each in units]
        longest = max(range(size), key=lambda index: (round(float(_length(rests[index])), 6), -index))
        basis.append(unit(rests[longest]))
        found.append(basis[-1])
    return found


def unit(vector: Vector) -> Vector:
    """The vector with length 1."""
    length = _length(vector)
    return [entry / length for entry in vector]


def _rest(vector: Vector, basis: list[Vector]) -> Vector:
    for other in (*basis, *basis):
        share = sum(mpmath.conj(a) * b for a, b in zip(other, vector, strict=True))
        vector = [b - share * a for a, b in zip(other, vector, strict=True)]
    return vector


def _length(vector: Vector) -> Any:
    return mpmath.sqrt(sum(abs(entry) ** 2 for entry in vector))
