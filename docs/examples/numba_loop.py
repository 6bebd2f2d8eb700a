"""A loop in Numba that calls the C kernel of a package; run with the package on the path."""

import numba
import numpy as np
import ur5._native as native
from numba.core.typing import cffi_utils

cffi_utils.register_module(native)
ffi, ur5_fk = native.ffi, native.lib.ur5_fk  # of ur5.h: double q[6] in, double base_T_tool[16] out


@numba.njit
def highest(steps: int) -> float:
    """The greatest height of the tool while joint 2 turns once."""
    q, pose = np.zeros(6), np.empty((4, 4))
    best = -np.inf
    for step in range(steps):
        q[1] = 2 * np.pi * step / steps
        ur5_fk(ffi.from_buffer(q), ffi.from_buffer(pose))
        best = max(best, pose[2, 3])
    return best


print("highest point:", round(highest(100_000), 6), "m")
