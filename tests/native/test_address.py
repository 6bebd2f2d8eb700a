"""The address of a kernel's C function: what Numba, ctypes and others call without Python in between."""

from __future__ import annotations

import ctypes
from types import ModuleType

import numpy as np
import pytest

import kinegen
from tests.cli.commands import ROBOTS

pytestmark = pytest.mark.usefixtures("machine")


def called(module: ModuleType, name: str, real: type[ctypes._SimpleCData[float]], *arrays: np.ndarray) -> None:
    """Call a kernel by its address; the arrays are its inputs, its parameters and its results."""
    pointers = [ctypes.c_void_p(array.ctypes.data) for array in arrays]
    assert {array.dtype.itemsize for array in arrays if array.dtype != np.uint8} == {ctypes.sizeof(real)}
    function = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * len(arrays))(getattr(module, name).address)
    function(*pointers)


@pytest.mark.parametrize(("real", "kind"), [("double", ctypes.c_double), ("float", ctypes.c_float)])
def test_it_takes_inputs_and_results(real: str, kind: type[ctypes._SimpleCData[float]]) -> None:
    arm = kinegen.compile(ROBOTS / "planar_3r.yaml", "pose,jacobian,inverse", real=real)
    dtype = np.dtype(kind)
    q, pose = np.array([0.3, -0.7, 1.1], dtype), np.empty((4, 4), dtype)
    called(arm, "fk", kind, q, pose)
    solutions, valid = np.empty((2, 3), dtype), np.empty(2, np.uint8)
    called(arm, "inverse", kind, pose, solutions, valid)

    np.testing.assert_array_equal(pose, arm.fk(q))
    wanted = arm.inverse(pose)
    np.testing.assert_array_equal(valid, wanted[1])
    np.testing.assert_array_equal(solutions[valid == 1], wanted[0][wanted[1]])


def test_parameters_come_before_results() -> None:
    arm = kinegen.compile(ROBOTS / "calibrated_2r.yaml", "position", real="double")
    params = arm.Params(L1=0.5)
    q, position = np.array([0.3, -0.7]), np.empty(3)
    called(arm, "position", ctypes.c_double, q, np.array(params, float), position)

    np.testing.assert_array_equal(position, arm.position(q, params=params))


def test_the_numpy_form_has_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    with pytest.warns(RuntimeWarning, match="NumPy"):
        arm = kinegen.compile(ROBOTS / "planar_joint.yaml", "position", real="double")

    assert arm.position.address is None
