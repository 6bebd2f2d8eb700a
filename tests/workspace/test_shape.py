"""What kind of set a tip sweeps, and in which axes it is measured."""

from __future__ import annotations

import numpy as np
import pytest

from tests.workspace import arms

KINDS = {
    "solid": arms.SHELL,
    "planar region": arms.TWO_LINKS,
    "surface": arms.SPHERE,
    "curve": arms.CIRCLE,
    "straight line": arms.LINE,
    "point": arms.POINT,
}


@pytest.mark.parametrize("kind", KINDS)
def test_kinds_are_told_apart(kind: str) -> None:
    assert arms.surveyed(KINDS[kind], 1000).shape.kind == kind


@pytest.mark.parametrize("joints", [arms.SPHERE, arms.CIRCLE])
def test_what_does_not_fill_its_space_is_not_measured(joints: str) -> None:
    tally = arms.surveyed(joints, 1000).tally

    assert tally
    assert [count.measure for count in tally.counts] == [None] * 4


def test_a_joint_that_does_not_move_the_tip_is_left_out() -> None:
    assert arms.tip("puma560").movers == (0, 1, 2)
    assert arms.tip(arms.POINT).movers == ()


def test_a_level_plane_keeps_the_axes_of_the_base() -> None:
    assert arms.surveyed(arms.TWO_LINKS).shape.names == ("x", "y")


def test_a_slanting_plane_has_a_level_axis_and_a_rising_one() -> None:
    shape = arms.surveyed(arms.TILTED).shape

    assert shape.names == ("u", "v")
    assert np.allclose(shape.axes @ shape.axes.T, np.eye(2))
    assert shape.axes[0, 2] == pytest.approx(0, abs=1e-12)
    assert shape.axes[1, 2] > 0


def test_almost_flat_is_not_flat() -> None:
    """A link of 89.9999 degrees leaves the plane by a micrometre, which structure sees although voxels do not."""
    joints = arms.TWO_LINKS.replace("a: 0.5, alpha: 0", "a: 0.5, alpha: 0.001")

    assert arms.surveyed(joints, 1000).shape.kind == "surface"
