"""Orientations of the reference: both ways, ranges, what holds at singularities, and their rates."""

from __future__ import annotations

import itertools
from typing import Any

import mpmath
import numpy as np
import pytest

from kinegen.model.outputs import Kind
from kinegen.verify import reference
from kinegen.verify.expected_results import ANGLES, FORMS
from kinegen.verify.reference import Orientation, rotations

Numbers = np.ndarray[Any, Any]
ROUNDING = 1e-14


def turns(quaternions: Numbers) -> Numbers:
    return rotations(Kind.QUATERNION_WXYZ, quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True))


RANDOM = turns(np.random.default_rng(3).normal(size=(200, 4)))
SPECIAL = turns(np.array([row for row in itertools.product((-1.0, 0.0, 1.0), repeat=4) if any(row)]))
"""All turns that bring axes to axes, or to diagonals between them, or to the diagonal of a cube."""


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("r", [RANDOM, SPECIAL], ids=["random", "special"])
def test_numbers_give_the_rotation_back(form: Kind, r: Numbers) -> None:
    np.testing.assert_allclose(rotations(form, Orientation(r).numbers(form)), r, atol=ROUNDING)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("r", [RANDOM, SPECIAL], ids=["random", "special"])
def test_numbers_lie_in_their_ranges(form: Kind, r: Numbers) -> None:
    numbers = Orientation(r).numbers(form)
    if form is Kind.AXIS_ANGLE:
        assert np.linalg.norm(numbers, axis=1).max() <= np.pi + ROUNDING
    elif form in ANGLES:
        low, high = (0, np.pi) if form is Kind.EULER_ZYZ else (-np.pi / 2, np.pi / 2)
        assert np.abs(numbers).max() <= np.pi
        assert low <= numbers[:, 1].min() <= numbers[:, 1].max() <= high
    else:
        np.testing.assert_allclose(np.linalg.norm(numbers, axis=1), 1, atol=ROUNDING)
        assert numbers[:, 0 if form is Kind.QUATERNION_WXYZ else 3].min() >= 0


A, B = 0.7, -0.4
QUARTER, HALF = np.pi / 2, np.pi

# What is asked for, the factors of the rotation (axis, angle), and the numbers that stand for all others.
SINGULAR: dict[str, tuple[Kind, list[tuple[str, float]], list[float]]] = {
    "nose up": (Kind.RPY_ZYX, [("z", A), ("y", QUARTER), ("x", B)], [0, QUARTER, A - B]),
    "nose down": (Kind.RPY_ZYX, [("z", A), ("y", -QUARTER), ("x", B)], [0, -QUARTER, A + B]),
    "xyz up": (Kind.RPY_XYZ, [("x", A), ("y", QUARTER), ("z", B)], [A + B, QUARTER, 0]),
    "xyz down": (Kind.RPY_XYZ, [("x", A), ("y", -QUARTER), ("z", B)], [A - B, -QUARTER, 0]),
    "wrist stretched": (Kind.EULER_ZYZ, [("z", A), ("y", 0), ("z", B)], [A + B, 0, 0]),
    "wrist folded": (Kind.EULER_ZYZ, [("z", A), ("y", HALF), ("z", B)], [A - B, HALF, 0]),
    "no turn": (Kind.AXIS_ANGLE, [], [0, 0, 0]),
    "half a turn about x": (Kind.AXIS_ANGLE, [("x", -HALF)], [HALF, 0, 0]),
    "half a turn about -z": (Kind.QUATERNION_WXYZ, [("z", -HALF)], [0, 0, 0, 1]),
    "half a turn, last w": (Kind.QUATERNION_XYZW, [("y", -HALF)], [0, 1, 0, 0]),
    "half a turn about a diagonal": (
        Kind.QUATERNION_WXYZ,
        [("z", QUARTER), ("x", HALF)],
        [0, 0.5**0.5, 0.5**0.5, 0],
    ),
}


def exact_rotation(factors: list[tuple[str, float]]) -> Numbers:
    """The product of the factors in 50 digits, shape (1, 3, 3); the entries of quarter turns are exact."""
    product = np.frompyfunc(mpmath.mpf, 1, 1)(np.eye(3))
    with mpmath.workdps(reference.DIGITS):
        for name, angle in factors:
            halves = mpmath.mpf(angle / HALF) if angle % QUARTER == 0 else mpmath.mpf(angle) / mpmath.pi
            c, s = mpmath.cospi(halves), mpmath.sinpi(halves)
            i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[name]
            factor = np.frompyfunc(mpmath.mpf, 1, 1)(np.eye(3))
            factor[i, i] = factor[j, j] = c
            factor[i, j], factor[j, i] = -s, s
            product = product @ factor
    return product[None]


@pytest.mark.parametrize("case", SINGULAR)
def test_the_singularity_has_the_numbers_that_are_stated(case: str) -> None:
    form, factors, expected = SINGULAR[case]
    exact = exact_rotation(factors)

    np.testing.assert_allclose(Orientation(exact).numbers(form)[0].astype(float), expected, atol=ROUNDING)
    if form in ANGLES:
        assert Orientation(exact).margin(form)[0] == 0


@pytest.mark.parametrize("case", [name for name in SINGULAR if SINGULAR[name][0] in ANGLES])
def test_at_the_singularity_rates_leave_out_what_angles_cannot_show(case: str) -> None:
    """The first and the second angle take what they can of an angular velocity; the third one stands."""
    form, factors, _ = SINGULAR[case]
    exact = exact_rotation(factors)
    omega = np.array([mpmath.mpf(entry) for entry in (0.3, -0.2, 0.5)], dtype=object)[None, :, None]
    found = Orientation(exact).jacobian(form, omega)[0, :, 0].astype(float)
    numbers = Orientation(exact).numbers(form)[0].astype(float)
    first = 2 if form is Kind.RPY_ZYX else 0
    axis = 0 if form is Kind.RPY_XYZ else 2
    c, s = np.cos(numbers[first]), np.sin(numbers[first])
    second = np.array([0, c, s]) if axis == 0 else np.array([-s, c, 0])

    assert found[2 - first] == 0
    assert found[first] == pytest.approx((0.3, -0.2, 0.5)[axis])
    assert found[1] == pytest.approx(second @ (0.3, -0.2, 0.5))


@pytest.mark.parametrize("form", FORMS)
def test_rates_are_differences_of_numbers(form: Kind) -> None:
    """Along a turn about an axis of the base, away from the jumps."""
    omega, step = np.array([0.3, -0.7, 0.5]), 1e-6
    far = RANDOM[Orientation(RANDOM).margin(form) > 0.05]
    ahead, behind = (
        Orientation(rotations(Kind.AXIS_ANGLE, sign * step * omega[None]) @ far).numbers(form) for sign in (1, -1)
    )
    difference = ahead - behind
    difference = np.where(np.abs(difference) > HALF, difference - np.sign(difference) * 2 * HALF, difference)
    found = Orientation(far).jacobian(form, np.broadcast_to(omega[:, None], (len(far), 3, 1)))[..., 0]

    assert len(far) > 150
    np.testing.assert_allclose(found, difference / (2 * step), atol=1e-6)


@pytest.mark.parametrize("form", FORMS)
def test_rates_are_finite_everywhere(form: Kind) -> None:
    found = Orientation(SPECIAL).jacobian(form, np.broadcast_to(np.eye(3), (len(SPECIAL), 3, 3)))

    assert np.isfinite(found).all()


def test_a_small_turn_is_its_own_rotation_vector() -> None:
    """And its rate is the angular velocity."""
    small = np.array([[1e-9, -2e-9, 3e-9]])
    turned = Orientation(rotations(Kind.AXIS_ANGLE, small))

    np.testing.assert_allclose(turned.numbers(Kind.AXIS_ANGLE), small, rtol=1e-12)
    np.testing.assert_allclose(turned.jacobian(Kind.AXIS_ANGLE, np.eye(3)[None])[0], np.eye(3), atol=1e-8)
