"""The checked call of a generated module: which actuator is out of range, and where."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kinegen.native.runtime._actuators import ReadingCheck
from kinegen.robot.actuators_extent import reading_box, reading_ranges
from tests.actuators.machines import machine, one

CHECK = ReadingCheck(("m1", "wire", "m3"), ((-1.0, 1.0), (0.2, 0.8), (-math.inf, math.inf)), ("rad", "m", ""))


def test_readings_within_their_ranges_come_back() -> None:
    readings = np.array([[0.5, 0.2, 1e6], [-1.0, 0.8, -3.0]])

    assert CHECK(readings) is readings
    np.testing.assert_array_equal(CHECK([0, 0.5, 7]), [0, 0.5, 7])


@pytest.mark.parametrize(
    ("readings", "message"),
    [
        ([1.5, 0.5, 0], "actuator 'm1' reads 1.5 rad; it goes from -1 to 1 rad"),
        ([0, 0.1, 0], "actuator 'wire' reads 0.1 m; it goes from 0.2 to 0.8 m"),
        ([0, math.nan, 0], "actuator 'wire' reads nan m; it goes from 0.2 to 0.8 m"),
        ([0, 0.5, math.nan], "actuator 'm3' reads nan, which is no finite number"),
        ([[0, 0.5, 0], [0, 0.9, 0]], r"actuator 'wire' reads 0.9 m at \[1\]; it goes"),
        (np.full((2, 3, 3), 2.0), r"actuator 'm1' reads 2 rad at \[0, 0\]; it goes"),
        ([0, 0.5], r"actuators has shape \(2,\), expected \(\.\.\., 3\)"),
    ],
)
def test_others_are_refused_by_name(readings: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        CHECK(readings)  # type: ignore[arg-type]


def test_what_is_no_number_is_refused() -> None:
    with pytest.raises(TypeError, match="plain real numbers"):
        CHECK(["a", "b", "c"])  # type: ignore[list-item]


def test_a_bound_rounded_to_single_precision_is_within() -> None:
    high = np.float32(0.1)
    check = ReadingCheck(("m",), ((0.0, 0.1),), ("m",))

    assert float(high) > 0.1
    assert check(np.array([high])).dtype == np.float32


def test_the_range_of_a_wire_is_what_closes_its_triangle() -> None:
    wire = "form: linear_actuator, actuator: m, sides: [0.5, 0.3], length: 0.1 - 2*m"

    np.testing.assert_allclose(reading_ranges(one(wire, "length")), [(-0.35, -0.05)])
    np.testing.assert_allclose(reading_ranges(one(wire, "{dimension: length, limits: [-0.3, -0.1]}")), [(-0.3, -0.1)])


def test_readings_without_bounds_take_their_joints_from_end_to_end() -> None:
    rows = (
        "{name: turn, a: 0, alpha: 0, d: 0, theta: q, limits: [-90, 45]}",
        "{name: bend, a: 0, alpha: 0, d: 0, theta: q}",
    )
    robot = machine(
        "{m1: angle, m2: number}",
        "{joint: turn, form: gear, actuator: m1, ratio: 100}",
        "{joint: bend, value: m2**3}",
        rows=rows,
    )

    assert reading_ranges(robot) == ((-math.inf, math.inf), (-math.inf, math.inf))
    np.testing.assert_allclose(reading_box(robot), [(-50 * math.pi, 50 * math.pi), (-1, 1)])
