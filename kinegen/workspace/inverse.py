"""The closed-form inverse of a robot as a question: is this pose reached?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kinegen.emit.kernels import Kernels
from kinegen.workspace.dexterous import Inverse
from kinegen.workspace.package import make_package
from kinegen.workspace.ranges import Range
from kinegen.workspace.sample import FloatArray

_SLACK = 1e-9
"""By which a joint may pass its bound, as in the inverse itself."""


def find_inverse(kernels: Kernels, ranges: tuple[Range, ...]) -> Inverse:
    """Compile the inverse of a robot.

    Args:
        kernels: The robot and its inverse program, the only one.
        ranges: What its joints may run through; those of its own file.

    Returns:
        What tells of poses whether a branch of the inverse reaches them within the ranges.
    """
    package = make_package(kernels)
    low, high = np.array([each.bounds for each in ranges]).T

    def reached(poses: FloatArray) -> NDArray[np.bool_]:
        solutions, valid = package.inverse(poses, threads=0)
        # A slide without limits has a range all the same, which the inverse knows nothing of.
        within = ((low - _SLACK <= solutions) & (solutions <= high + _SLACK)).all(axis=-1)
        found: NDArray[np.bool_] = ((valid == 1) & within).any(axis=-1)
        return found

    return reached
