"""The data of test vectors, which the caller computes with 50 digits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from kinegen.emit.reals import Real
from kinegen.outputs import Array, Quantity

Row = tuple[Fraction, ...]

LAST_ROW: Row = (Fraction(0), Fraction(0), Fraction(0), Fraction(1))
"""The constant last row of a pose."""

NOTHING: Row = (Fraction(0),) * 4
"""What is accepted of its entries."""


@dataclass(frozen=True, slots=True)
class Expected:
    """What one result of a kernel must be.

    Attributes:
        rows: For each set of inputs, or for the first of them, the entries of the output array in order, without the
            constant last row of a matrix.
        turns: Whether they are angles, of which whole turns do not matter.
        spreads: For each number type, how far rounding may move each entry at these inputs, in the unit of the entry.
    """

    rows: tuple[Row, ...]
    turns: bool
    spreads: Mapping[Real, Row]


@dataclass(frozen=True, slots=True)
class Vectors:
    """Inputs and what the kernels must return for them.

    Attributes:
        inputs: Rows of each input by name, joint vectors `q` among them; entries that floats hold exactly.
        expected: For each quantity its results in order.
        pairs: Angles that the kernels take, which floats hold exactly, each with its sine and cosine.
        targets: Poses that an inverse has to solve, each with the joint vector that it comes from; none without one.
        given: What it is given besides, a row for each target; none where there is no redundancy.
    """

    inputs: Mapping[str, tuple[Row, ...]]
    expected: Mapping[Quantity, tuple[Expected, ...]]
    pairs: tuple[tuple[Fraction, Fraction, Fraction], ...]
    targets: tuple[tuple[Row, Row], ...]
    given: tuple[Row, ...] = ()


def whole(array: Array, row: Sequence[Fraction], last: Row = LAST_ROW) -> Row:
    """The entries of a result with the last rows of its matrices.

    Args:
        array: The result.
        row: Its computed entries, in order.
        last: The last row of each matrix: that of a pose, or `NOTHING` for what is accepted.
    """
    if not array.is_pose:
        return tuple(row)
    step = array.size // array.blocks
    return tuple(each for block in range(array.blocks) for each in (*row[block * step : (block + 1) * step], *last))
