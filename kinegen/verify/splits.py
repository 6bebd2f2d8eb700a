"""Which entries of a result are lengths, for each unit of what is differentiated by, and which are pure numbers.

In: an array of N configurations. Out: both kinds of entries, shape (N, entries) each.
"""

from __future__ import annotations

import numpy as np

from kinegen.verify.known import Numbers

Split = tuple[Numbers, Numbers]


def split_matrix(matrices: Numbers) -> Split:
    """Positions; rotations with the last rows."""
    others = np.concatenate([matrices[:, :3, :3].reshape(-1, 9), matrices[:, 3]], axis=1)
    return matrices[:, :3, 3], others


def split_point(points: Numbers) -> Split:
    """Lengths alone."""
    return points, points[:, :0]


def split_rows(arrays: Numbers) -> Split:
    """Linear rows, angular rows: of (N, 6, columns) and (N, n, 6, columns)."""
    return arrays[..., :3, :].reshape(len(arrays), -1), arrays[..., 3:, :].reshape(len(arrays), -1)


def split_numbers(arrays: Numbers) -> Split:
    """No lengths."""
    flat = arrays.reshape(len(arrays), -1)
    return flat[:, :0], flat


def split_adjoint(matrices: Numbers) -> Split:
    """The block that holds lengths, the three others."""
    others = (matrices[:, :3, :3], matrices[:, 3:, :3], matrices[:, 3:, 3:])
    return matrices[:, :3, 3:].reshape(-1, 9), np.concatenate([block.reshape(-1, 9) for block in others], axis=1)


def adjoint(a_T_b: Numbers) -> Numbers:
    """The matrices [[R, [p]x R], [0, R]], shape (N, 6, 6), which take twists from b to a (linear, then angular)."""
    rotation, position = a_T_b[:, :3, :3], a_T_b[:, :3, 3]
    found = np.zeros((len(a_T_b), 6, 6), dtype=a_T_b.dtype)
    found[:, :3, :3] = found[:, 3:, 3:] = rotation
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        found[:, i, 3:] = position[:, j, None] * rotation[:, k] - position[:, k, None] * rotation[:, j]
    return found
