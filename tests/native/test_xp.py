"""`xp` of packages on NumPy: the same numbers as the NumPy form, and what is refused."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from kinegen.model.outputs import parse_quantity
from kinegen.runtime.vendored import xp as runtime
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


@pytest.mark.parametrize("kind", ["f8", "f4", "f2"])
@pytest.mark.parametrize("order", ["<", ">"])
def test_the_order_of_bytes_changes_no_result(kind: str, order: str, xp: Any) -> None:
    """Nor the range of angles, which is that of the number type."""
    q = np.full((2, 6), 0.3).astype(np.dtype(order + kind))
    q[1, 2] = 5e4 if kind == "f2" else 15000.0
    plain = xp.fk(q.astype(q.dtype.newbyteorder("=")))
    np.testing.assert_array_equal(xp.fk(q), plain)
    assert np.isnan(plain[1]).any() == (kind != "f8")


@pytest.mark.parametrize("real", [np.float64, np.float32])
def test_runtime_parameters_are_numbers_or_arrays(real: type, tmp_path: Any) -> None:
    """Lengths and angles; an angle that is a parameter has a sine of its own."""
    two = assemble("calibrated_2r", tmp_path, compiled=False)
    module, q = import_module(f"{two.__name__}.xp"), np.full((3, 2), 0.4, real)
    for params in (
        None,
        two.Params(tilt=0.3),
        two.Params(L1=np.array([0.1, 0.2, 0.3], real), skew=np.array(0.2, real)),
    ):
        np.testing.assert_array_equal(module.fk(q, params=params), two.fk(q, params=params), strict=True)
    with pytest.raises(TypeError, match="fk: params is of type dict, expected Params"):
        module.fk(q, params={"tilt": 0.3})


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


def test_arrays_of_the_other_byte_order_are_taken(xp: Any) -> None:
    q = np.linspace(-1, 1, 6)

    assert np.array_equal(xp.fk(q.astype(">f8")), xp.fk(q))


def test_what_is_no_output_is_no_attribute(xp: Any) -> None:
    with pytest.raises(AttributeError, match="has no attribute 'elbow'"):
        _ = xp.elbow


def test_sines_end_where_those_of_the_c_kernels_do() -> None:
    for real, limit in ((np.float32, 12000.0), (np.float64, 100000.0)):
        sine, cosine = runtime._sincos(runtime.Entry(np, np.array([limit, -limit, limit * 1.001, np.inf], real)))

        for each in (sine.value, cosine.value):
            assert np.isfinite(each).tolist() == [True, True, False, False]


def test_an_infinity_has_no_arc_tangent() -> None:
    one, infinite = (runtime.Entry(np, np.array([value])) for value in (1.0, np.inf))
    with np.errstate(invalid="ignore"):
        for up, along in ((one, infinite), (infinite, one), (infinite, infinite)):
            assert np.isnan(runtime._atan2(up, along).value)
    assert runtime._atan2(one, one).value == np.pi / 4
