"""The C function of a package in Numba and under an integral of SciPy; run with the package on the path."""

import ctypes

import numba
import numpy as np
import ur5
from numba import types
from scipy import LowLevelCallable, integrate

# double q[6] in, double base_T_tool[16] out, as in ur5.h.
pose_of = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(ur5.fk.address)


@numba.cfunc(types.float64(types.intc, types.CPointer(types.float64)))
def height(count, values):  # noqa: ANN001, ANN201 - Numba has the types
    """The height of the tool while joint 2 turns: the signature that SciPy's `quad` calls."""
    q, pose = np.zeros(6), np.empty((4, 4))
    q[1] = numba.carray(values, (count,))[0]
    pose_of(q.ctypes, pose.ctypes)
    return pose[2, 3]


whole, _ = integrate.quad(LowLevelCallable(height.ctypes), 0.0, np.pi)
print("mean height over half a turn:", round(whole / np.pi, 6), "m")
