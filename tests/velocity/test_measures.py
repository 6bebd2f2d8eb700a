"""Manipulability and condition number of batches of Jacobians."""

from __future__ import annotations

import math

import numpy as np
import pytest

from kinegen.runtime.vendored._measures import condition_number, manipulability


def planar_2r(q1: float, q2: float, a1: float = 1.0, a2: float = 1.0) -> list[list[float]]:
    s1, c1, s12, c12 = math.sin(q1), math.cos(q1), math.sin(q1 + q2), math.cos(q1 + q2)
    return [[-a1 * s1 - a2 * s12, -a2 * s12], [a1 * c1 + a2 * c12, a2 * c12]]


@pytest.mark.parametrize("q2", [0.3, 1.2, -2.0, math.pi / 2])
def test_the_manipulability_of_two_links_is_the_area_that_they_span(q2: float) -> None:
    """a1 a2 |sin(q2)|, Yoshikawa 1985, eq. 20."""
    assert manipulability(planar_2r(0.4, q2, 0.5, 0.3)) == pytest.approx(0.15 * abs(math.sin(q2)), rel=1e-12)


def test_the_condition_number_of_two_links_is_one_at_the_isotropic_pose() -> None:
    """Salisbury and Craig 1982: a1 = sqrt(2) a2 and the elbow at 135 degrees."""
    assert condition_number(planar_2r(0.7, math.radians(135), math.sqrt(2), 1.0)) == pytest.approx(1, rel=1e-12)


def test_more_and_fewer_joints_than_rows() -> None:
    jacobians = np.random.default_rng(3).normal(size=(2, 5, 6, 7))
    expected = np.sqrt(np.linalg.det(jacobians @ jacobians.swapaxes(-1, -2)))

    np.testing.assert_allclose(manipulability(jacobians), expected, rtol=1e-9)
    np.testing.assert_allclose(manipulability(jacobians.swapaxes(-1, -2)), expected, rtol=1e-9)
    np.testing.assert_allclose(condition_number(jacobians), np.linalg.cond(jacobians), rtol=1e-9)


def test_singular_and_spoilt_poses_leave_the_others_alone() -> None:
    batch = np.array([np.eye(3), np.zeros((3, 3)), np.full((3, 3), np.nan)])

    np.testing.assert_array_equal(manipulability(batch), [1, 0, np.nan])
    assert condition_number(batch)[0] == 1
    assert np.isinf(condition_number(np.diag([1.0, 1.0, 0.0])))
    assert np.isnan(condition_number(batch)[2])


@pytest.mark.parametrize("wrong", [1.0, [1.0, 2.0], np.zeros((6, 0)), [["a", "b"]]])
def test_what_is_no_jacobian_is_refused(wrong: object) -> None:
    with pytest.raises(ValueError, match="shape"):
        manipulability(wrong)  # type: ignore[arg-type]
