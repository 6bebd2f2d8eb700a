"""`xp` of packages on NumPy: the same numbers as the NumPy form, and what is refused."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from kinegen.outputs import parse_quantity
from tests.builds.workshop import assemble

OUTPUTS = ("pose", "frames", "position", "twist", "quaternion_wxyz", "axis_angle", "rpy_zyx")


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """A UR5 without compiled kernels."""
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("KINEGEN_NUMPY_FUNCTIONS", raising=False)
        return assemble(
            "ur5", tmp_path_factory.mktemp("xp"), compiled=False, quantities=tuple(map(parse_quantity, OUTPUTS))
        )


@pytest.fixture(scope="module")
def xp(arm: ModuleType) -> Any:
    return import_module(f"{arm.__name__}.xp")


@pytest.mark.parametrize("real", [np.float64, np.float32])
def test_the_numbers_are_those_of_the_numpy_form(arm: ModuleType, xp: Any, real: type) -> None:
    q = np.random.default_rng(2).uniform(-3, 3, (2, 5, 6)).astype(real)
    q[0, 0], q[1, 0, 1], q[1, 1, 2], q[1, 2, 3] = 0.0, np.nan, np.inf, 1.01e5
    with np.errstate(all="ignore"):
        for name in dir(xp):
            inputs = [q, q[0] * real(0.3)][: len(getattr(arm, name).inputs)]
            np.testing.assert_array_equal(getattr(xp, name)(*inputs), getattr(arm, name)(*inputs), strict=True)


def test_empty_batches_and_runtime_parameters(xp: Any, tmp_path: Any) -> None:
    assert xp.fk(np.zeros((0, 6))).shape == (0, 4, 4)

    other = assemble("motoman_l3", tmp_path, compiled=False)
    q = np.full((3, other.DOF), 0.4)
    np.testing.assert_array_equal(import_module(f"{other.__name__}.xp").fk(q), other.fk(q))


@pytest.mark.parametrize(
    ("inputs", "kind", "message"),
    [
        (([0.0] * 6,), TypeError, "fk: q is of type list, expected an array"),
        ((np.zeros(5),), ValueError, r"fk: q has shape \(5,\), expected \(..., 6\)"),
        ((np.zeros(6), np.zeros(6)), TypeError, r"fk takes 1 arrays \(q\), 2 given"),
        ((np.zeros(6, int),), TypeError, "fk: q is of int64, expected a floating-point type"),
    ],
)
def test_other_arguments_are_refused_in_one_line(xp: Any, inputs: Any, kind: type, message: str) -> None:
    with pytest.raises(kind, match=message):
        xp.fk(*inputs)


def test_what_is_no_output_is_no_attribute(xp: Any) -> None:
    with pytest.raises(AttributeError, match="has no attribute 'elbow'"):
        _ = xp.elbow
