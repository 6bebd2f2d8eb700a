"""Limits, runtime parameters and readings: what is within, what is brought back and what is refused."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import pytest

from kinegen.runtime.vendored._actuators import ReadingCheck
from kinegen.runtime.vendored._limits import Clamp, WithinLimits
from kinegen.runtime.vendored._parameters import checked_params, settled_params

PAIRS = ((-1.0, 2.0), None, (0.5, 0.75))
SINGLE = ((-1.0, 2.0), None, (0.5, 0.75))
within = WithinLimits("within_limits", PAIRS, SINGLE, module="arm", doc="")
clamp = Clamp("clamp", PAIRS, SINGLE, module="arm", doc="")


class Params(NamedTuple):
    """Two parameters."""

    a: Any = 1.0
    b: Any = 2.0


class Others(NamedTuple):
    """Those of another package."""

    a: Any = 1.0
    b: Any = 2.0


@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_limits_belong_to_what_they_bound(kind: Any) -> None:
    least, most = kind(-1.0), kind(2.0)
    first = [least, most, np.nextafter(least, kind(-9)), np.nextafter(most, kind(9)), np.nan, np.inf, -np.inf]
    q = np.array([[value, 1e30, 0.625] for value in first], kind)

    assert within(q).tolist() == [True, True, False, False, False, False, False]
    assert clamp(q)[:, 0].tolist()[:4] == [-1.0, 2.0, -1.0, 2.0]
    assert np.isnan(clamp(q)[4, 0])
    assert clamp(q)[5:, 0].tolist() == [2.0, -1.0]
    assert clamp(q).dtype == kind


def test_each_number_type_has_limits_of_its_own() -> None:
    """Those of float are the next floats outside; the nearest to a limit may be inside."""
    low, high = -0.1, 0.7
    least, most = np.nextafter(np.float32(low), np.float32(-9)), np.nextafter(np.float32(high), np.float32(9))
    own = ((low, high),), ((float(least), float(most)),)
    inside, kept = WithinLimits("w", *own, module="arm", doc=""), Clamp("c", *own, module="arm", doc="")
    floats, doubles = np.array([[least], [most]]), np.array([[low], [high]])

    assert inside(floats).tolist() == inside(doubles).tolist() == [True, True]
    assert inside(floats.astype(float)).tolist() == [False, False]
    assert np.array_equal(kept(floats), floats)
    assert np.array_equal(kept(floats.astype(float)), doubles)


def test_a_joint_without_limits_has_none_but_is_a_number() -> None:
    assert within([0.0, -1e300, 0.5])
    assert not within([0.0, math.inf, 0.5])
    assert not within([0.0, math.nan, 0.5])
    assert clamp([0.0, math.inf, 9.0]).tolist() == [0.0, math.inf, 0.75]


@pytest.mark.parametrize("wrong", [np.ma.zeros(3), np.zeros(3, object), np.zeros(3, complex), ["a"] * 3])
def test_other_things_than_numbers_have_no_limits(wrong: Any) -> None:
    for each in (within, clamp):
        with pytest.raises(TypeError, match="expected plain real numbers"):
            each(wrong)
        with pytest.raises(ValueError, match=r"q has shape \(2,\), expected \(..., 3\)"):
            each(np.zeros(2))


def test_parameters_are_those_of_the_package() -> None:
    assert checked_params("fk", None, Params()) == Params()
    assert checked_params("fk", Params(3.0), Params()) == Params(3.0)
    for wrong in (Others(), (1.0, 2.0), {"a": 1.0}, 3.0):
        with pytest.raises(TypeError, match=r"fk: params is of type .*, expected Params"):
            checked_params("fk", wrong, Params())
    with pytest.raises(TypeError, match="the robot has no runtime parameters"):
        checked_params("fk", Params(), None)


def test_parameters_are_numbers_or_arrays_of_them() -> None:
    assert settled_params("fk", Params(1, 2.5)) == (Params(1, 2.5), {})
    assert settled_params("fk", Params(np.float32(1.5), np.array(2))) == (Params(1.5, 2.0), {})
    _, varied = settled_params("fk", Params(np.arange(3.0), 2.0))
    assert {name: array.shape for name, array in varied.items()} == {"params.a": (3,), "params.b": ()}
    for wrong in ("1", None, 1j, np.zeros(2, object)):
        with pytest.raises(TypeError, match=r"fk: params\.b"):
            settled_params("fk", Params(1.0, wrong))


def test_readings_are_held_to_their_ranges() -> None:
    check = ReadingCheck(("crank", "spindle"), ((-1.0, 1.0), (-math.inf, math.inf)), ("mm", ""))
    good = np.array([[1.0, 1e9], [-1.0, -3.0]])

    assert check(good) is good
    for reading in (1.0000001, -2.0):
        with pytest.raises(ValueError, match=r"actuator 'crank' reads .* mm at \[1\].*its range is -1 to 1 mm"):
            check([[0.0, 0.0], [reading, 0.0]])
    for reading in (math.nan, math.inf):
        with pytest.raises(ValueError, match=r"actuator 'spindle' reads .*, which is not a finite number"):
            check([0.0, reading])
        with pytest.raises(ValueError, match="actuator 'crank' reads"):
            check([reading, 0.0])
