"""The checked call of a generated module: which actuator is out of range, and where."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest

from kinegen.model.actuator_limits import reading_box, reading_ranges
from kinegen.runtime.vendored._actuators import ReadingCheck
from kinegen.verify.reference import Actuation
from tests.actuators.machines import machine, one

CHECK = ReadingCheck(("m1", "wire", "m3"), ((-1.0, 1.0), (0.2, 0.8), (-math.inf, math.inf)), ("rad", "m", ""))


def test_readings_within_their_ranges_come_back() -> None:
    readings = np.array([[0.5, 0.2, 1e6], [-1.0, 0.8, -3.0]])

    assert CHECK(readings) is readings
    np.testing.assert_array_equal(CHECK([0, 0.5, 7]), [0, 0.5, 7])


@pytest.mark.parametrize(
    ("readings", "message"),
    [
        ([1.5, 0.5, 0], "actuator 'm1' reads 1.5 rad, 0.5 rad beyond; its range is -1 to 1 rad"),
        ([0, 0.1, 0], "actuator 'wire' reads 0.1 m, 0.1 m beyond; its range is 0.2 to 0.8 m"),
        ([0, math.nan, 0], "actuator 'wire' reads nan m; its range is 0.2 to 0.8 m"),
        ([0, 0.5, math.nan], "actuator 'm3' reads nan, which is not a finite number"),
        ([0, 0.5, math.inf], "actuator 'm3' reads inf, which is not a finite number"),
        ([0, 0.5, -math.inf], "actuator 'm3' reads -inf, which is not a finite number"),
        ([0, 0.19999999, 0], "actuator 'wire' reads 0.2 m, 1e-08 m beyond; its range is 0.2 to 0.8 m"),
        ([0, math.inf, 0], "actuator 'wire' reads inf m; its range is 0.2 to 0.8 m"),
        ([[0, 0.5, 0], [0, 0.9, 0]], r"actuator 'wire' reads 0.9 m at \[1\], 0.1 m beyond; its range"),
        (np.full((2, 3, 3), 2.0), r"actuator 'm1' reads 2 rad at \[0, 0\], 1 rad beyond; its range"),
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


def test_a_reading_that_rounding_moved_beyond_a_bound_is_brought_to_it() -> None:
    """The joints of an inverse at a limit are so."""
    given = np.array([[1 + 4.4e-16, 0.2 - 5e-17, 3.0], [-1 - 4.4e-16, 0.8 + 1.1e-16, 3.0]])
    checked = CHECK(given)

    np.testing.assert_array_equal(checked, [[1.0, 0.2, 3.0], [-1.0, 0.8, 3.0]])
    assert given[0, 0] > 1
    with pytest.raises(ValueError, match="m1"):
        CHECK([1 + 1e-14, 0.5, 0])


def test_a_reading_at_a_pole_of_a_formula_is_nan_without_a_warning() -> None:
    """NumPy would print a warning with the lines of our files."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        joints = Actuation(one("value: 2*sin(m/2)/m", angle="rad"), np.array([[0.5], [0.0]])).joints

    assert np.isnan(joints[1, 0])
    np.testing.assert_allclose(joints[0, 0], 2 * np.sin(0.25) / 0.5)


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

    np.testing.assert_allclose(reading_ranges(robot), [(-50 * math.pi, 25 * math.pi), (-math.inf, math.inf)])
    np.testing.assert_allclose(reading_box(robot), [(-50 * math.pi, 50 * math.pi), (-1, 1)])


LIMITED = (
    "{name: turn, a: 0, alpha: 0, d: 0, theta: q, limits: [-170, 170]}",
    "{name: bend, a: 0, alpha: 0, d: 0, theta: q, limits: [-30, 60]}",
)
DEGREE = math.pi / 180


@pytest.mark.parametrize(
    ("readings", "drives", "ranges"),
    [
        (
            "{m1: number, m2: angle}",
            ("{joint: turn, form: gear, actuator: m1, ratio: 100}", "{joint: bend, value: -m2/2 + 10}"),
            [(-17000, 17000), (-100 * DEGREE, 80 * DEGREE)],
        ),
        # Half of the sum and half of the difference of both joints.
        (
            "{m1: angle, m2: angle}",
            ("{joints: [turn, bend], form: coupling, actuators: [m1, m2], matrix: [[1, 1], [1, -1]]}",),
            [(-100 * DEGREE, 115 * DEGREE), (-115 * DEGREE, 100 * DEGREE)],
        ),
        # The second joint is counted from the first.
        (
            "{m1: angle, m2: angle}",
            (
                "{joint: turn, form: gear, actuator: m1, ratio: 2, sign: -1}",
                "{joint: bend, form: gear, actuator: m2, ratio: 1, offset: -turn}",
            ),
            [(-340 * DEGREE, 340 * DEGREE), (-200 * DEGREE, 230 * DEGREE)],
        ),
    ],
)
def test_the_limits_of_joints_bound_readings_that_have_none(
    readings: str, drives: tuple[str, ...], ranges: list[tuple[float, float]]
) -> None:
    robot = machine(readings, *drives, rows=LIMITED)

    np.testing.assert_allclose(reading_ranges(robot), ranges, rtol=1e-9)
    # Joints at their limits, computed to readings, are within.
    assert all(low < exact[0] and exact[1] < high for (low, high), exact in zip(reading_ranges(robot), ranges))


def test_limits_of_the_reading_itself_are_the_ones_that_count() -> None:
    robot = machine(
        "{m1: {dimension: number, limits: [-1, 18000]}, m2: angle}",
        "{joint: turn, form: gear, actuator: m1, ratio: 100}",
        "{joint: bend, value: m2}",
        rows=LIMITED,
    )

    assert reading_ranges(robot)[0] == (-1, 18000)
