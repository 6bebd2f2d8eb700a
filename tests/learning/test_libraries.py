"""`xp` of packages on arrays of other libraries, and the C function under Numba and SciPy."""

from __future__ import annotations

import ctypes
import importlib
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from tests.learning.conftest import angles, bridge

pytestmark = [pytest.mark.learning, pytest.mark.filterwarnings("ignore::DeprecationWarning")]

LIBRARIES = ("array_api_strict", "torch", "jax.numpy", "dask.array")


@pytest.mark.parametrize("library", LIBRARIES)
def test_outputs_on_arrays_of_any_library(arm: ModuleType, library: str) -> None:
    module = pytest.importorskip(library)
    for real in ("float64", "float32"):
        if library == "jax.numpy" and real == "float64":
            continue  # rounded by JAX, unless it is told otherwise: test_jax.py
        q = angles(5, real=real)
        given = module.asarray(q)
        for name in dir(bridge(arm, "xp")):
            kernel = getattr(arm, name)
            count = len(kernel.inputs)
            expected, found = kernel(*[q] * count), getattr(bridge(arm, "xp"), name)(*[given] * count)
            pairs = zip(expected, found, strict=True) if isinstance(expected, tuple) else [(expected, found)]
            for one, other in pairs:
                assert type(other) is type(given)
                numbers = np.asarray(other)
                assert numbers.dtype == one.dtype
                np.testing.assert_allclose(numbers, one, rtol=0, atol=20 * np.finfo(real).eps)


def test_the_c_function_in_a_loop_of_numba(arm: ModuleType) -> None:
    numba = pytest.importorskip("numba")
    function = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(arm.fk.address)

    @numba.njit
    def heights(q: Any) -> Any:
        found, pose = np.empty(len(q)), np.empty((4, 4))
        for row in range(len(q)):
            function(q[row].ctypes, pose.ctypes)
            found[row] = pose[2, 3]
        return found

    q = angles(50)

    np.testing.assert_array_equal(heights(q), arm.fk(q)[:, 2, 3])


def test_the_c_function_under_an_integral_of_scipy(arm: ModuleType) -> None:
    """The mean height while one joint turns, where gravity does the averaging: the part that does not turn."""
    numba, integrate, scipy = map(pytest.importorskip, ("numba", "scipy.integrate", "scipy"))
    types, carray = numba.types, numba.carray
    function = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(arm.fk.address)

    @numba.cfunc(types.float64(types.intc, types.CPointer(types.float64)))
    def height(count: int, values: Any) -> float:
        given = carray(values, (count,))
        q, pose = np.array([0.1, -1.0, 0.7, 0.3, 0.2, 0.1]), np.empty((4, 4))
        q[1] = given[0]
        function(q.ctypes, pose.ctypes)
        return float(pose[2, 3])

    found, _ = integrate.quad(importlib.import_module("scipy").LowLevelCallable(height.ctypes), 0, 2 * np.pi)
    q = np.tile([0.1, 0.0, 0.7, 0.3, 0.2, 0.1], (64, 1))
    q[:, 1] = np.arange(64) * 2 * np.pi / 64

    assert found == pytest.approx(arm.fk(q)[:, 2, 3].mean() * 2 * np.pi, abs=1e-12)
    assert scipy.__version__
