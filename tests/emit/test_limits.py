"""Limits as data: rounded outwards, the same in C and in Python, with functions that ask them and keep to them."""

from __future__ import annotations

import ctypes
import subprocess
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from kinegen.backends.bundle import joint_lines
from kinegen.backends.limits import joint_limits
from kinegen.backends.scalar_types import ScalarType
from kinegen.io.load import load, loads
from kinegen.model.outputs import Quantity, parse_quantity
from kinegen.runtime.extension import load_package
from tests.builds.workshop import make, set_machine, write_robot

ARM = """\
kinegen: 1
name: arm
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: turn, theta: q, d: 0.25, a: 0, alpha: 90, limits: [-160, 170]}
  - {name: free, theta: q, d: 0, a: 0.3, alpha: 0}
  - {name: slide, type: prismatic, theta: 90, d: q, a: 0.1, alpha: 90, limits: [-0.1, 0.35]}
"""


@pytest.mark.parametrize("real", ScalarType)
def test_limits_are_the_next_numbers_outside(real: ScalarType) -> None:
    turn, free, slide = joint_limits(loads(ARM, "arm.yaml"), real)

    assert free is None
    assert turn is not None
    assert slide is not None
    kind = np.float64 if real is ScalarType.DOUBLE else np.float32
    for number, exact, side in ((slide[0], Fraction(-1, 10), -1), (slide[1], Fraction(35, 100), 1)):
        inwards = float(np.nextafter(kind(number), kind(-side * np.inf)))
        assert side * (Fraction(number) - exact) >= 0
        assert side * (Fraction(inwards) - exact) < 0
    assert turn[0] <= np.deg2rad(-160)
    assert turn[1] >= np.deg2rad(170)


@pytest.mark.parametrize("real", ScalarType)
@pytest.mark.parametrize(("low", "high", "expected"), [("-sqrt(0.25)", "sqrt(2)*sqrt(8)", (-0.5, 4.0)),
                                                       ("sqrt(2)*sqrt(2) - 2", "sqrt(2)", (0.0, None))])  # fmt: skip
def test_roots_that_are_numbers_of_the_type_are_not_moved(
    real: ScalarType, low: str, high: str, expected: tuple[float, float | None]
) -> None:
    text = ARM.replace("limits: [-0.1, 0.35]", f"limits: [{low}, {high}]")
    _, _, slide = joint_limits(loads(text, "arm.yaml"), real)

    assert slide is not None
    assert slide[0] == expected[0]
    if expected[1] is not None:
        assert slide[1] == expected[1]
    else:
        assert Fraction(slide[1]) ** 2 > 2


def test_printed_limits_hold_all_that_is_between_the_limits() -> None:
    first, _, third = joint_lines(loads(ARM, "arm.yaml"))

    assert first.endswith("-2.79253 to 2.96706")
    assert third.endswith("-0.1 to 0.35")


def test_c_and_python_agree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    set_machine(monkeypatch, tmp_path / "cache")
    make(write_robot(tmp_path, ARM), tmp_path, quantities=(Quantity.POSE,), compile=False)
    package = load_package(tmp_path / "arm")
    low, high = np.deg2rad(-160), np.deg2rad(170)
    vectors = np.array(
        [[low, 1e30, -0.1], [high, -4, 0.35], [0, 0, 0.36], [3, 0, 0], [np.nan, 0, 0], [0, np.inf, 0], [0, np.nan, 9]]
    )
    for kind, stem, real in ((np.float64, "arm", ctypes.c_double), (np.float32, "arm_f32", ctypes.c_float)):
        library = _compiled(tmp_path / "arm", stem)
        q = vectors.astype(kind)
        clamped = np.empty_like(q)
        within = []
        for row, place in zip(q, clamped, strict=True):
            given, result = (array.ctypes.data_as(ctypes.POINTER(real)) for array in (row, place))
            within.append(bool(library[f"{stem}_within_limits"](given)))
            library[f"{stem}_clamp"](given, result)
        names = (f"{stem.upper()}_LIMITS_LOW", f"{stem.upper()}_LIMITS_HIGH")
        data = [(real * 3).in_dll(library, name) for name in names]

        assert within == [True, True, False, False, False, False, False]
        assert package.within_limits(q).tolist() == within
        finite = np.isfinite(q[:, 1])
        np.testing.assert_array_equal(package.clamp(q)[finite], clamped[finite])
        assert np.isnan(clamped[4, 0])
        assert np.isfinite(clamped[5]).all()
        assert package.within_limits(package.clamp(q[:4])).all()
        limits = joint_limits(
            load(tmp_path / "arm.yaml"), ScalarType.DOUBLE if kind is np.float64 else ScalarType.FLOAT
        )
        assert [(data[0][i], data[1][i]) for i in (0, 2)] == [limits[0], limits[2]]
        assert data[1][1] == np.finfo(kind).max
    assert (package.LIMITS[0], package.LIMITS[2]) == joint_limits(load(tmp_path / "arm.yaml"), ScalarType.DOUBLE)[::2]
    with pytest.raises(ValueError, match=r"within_limits: q has shape \(2,\)"):
        package.within_limits([0, 1])


DRIVEN = """\
kinegen: 1
name: arm
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: turn, theta: q, d: 0.25, a: 0.1, alpha: 90, limits: [-90, 30]}
  - {name: free, theta: q, d: 0, a: 0.3, alpha: 0}
actuators:
  readings:
    motor: {dimension: angle, limits: [-60, 180]}
    wheel: {dimension: angle}
  joints:
    - {joint: turn, value: -motor/2}
    - {joint: free, value: wheel/3}
"""


def test_readings_of_actuators_have_limits_in_c_as_joints_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    set_machine(monkeypatch, tmp_path / "cache")
    quantities = (Quantity.POSE, parse_quantity("joints_to_actuators"))
    make(write_robot(tmp_path, DRIVEN), tmp_path, quantities=quantities, compile=False)
    for kind, stem, real in ((np.float64, "arm", ctypes.c_double), (np.float32, "arm_f32", ctypes.c_float)):
        library = _compiled(tmp_path / "arm", stem)
        names = (f"{stem.upper()}_ACTUATORS_LOW", f"{stem.upper()}_ACTUATORS_HIGH")
        low, high = (list((real * 2).in_dll(library, name)) for name in names)
        largest = np.finfo(kind).max
        assert (low[1], high[1]) == (-largest, largest)
        # Rounded outwards, by no more than the next number.
        assert low[0] <= -np.pi / 3 < np.nextafter(kind(low[0]), kind(1))
        assert high[0] >= np.pi > np.nextafter(kind(high[0]), kind(1))
        beyond = np.nextafter(kind(high[0]), kind(4))
        for readings, within, clamped in (
            ([high[0], 1e30], True, [high[0], 1e30]),
            ([beyond, 0], False, [high[0], 0]),
            ([-9, -np.inf], False, [low[0], -largest]),
            ([np.nan, 0], False, [np.nan, 0]),
        ):
            row, result = np.array(readings, kind), np.empty(2, kind)
            given, place = (array.ctypes.data_as(ctypes.POINTER(real)) for array in (row, result))
            assert bool(library[f"{stem}_actuators_within_limits"](given)) is within
            library[f"{stem}_clamp_actuators"](given, place)
            np.testing.assert_array_equal(result, np.array(clamped, kind))


def test_without_outputs_of_actuators_there_is_nothing_of_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    set_machine(monkeypatch, tmp_path / "cache")
    make(write_robot(tmp_path, DRIVEN), tmp_path, quantities=(Quantity.POSE,), compile=False)
    assert "actuators" not in (tmp_path / "arm" / "arm.h").read_text(encoding="utf-8").lower()


def _compiled(folder: Path, stem: str) -> ctypes.CDLL:
    library = folder / f"{stem}.so"
    subprocess.run(
        ["cc", "-std=c99", "-O1", "-shared", "-fPIC", str(folder / f"{stem}.c"), "-o", str(library)],
        check=True,
    )
    return ctypes.CDLL(str(library))
