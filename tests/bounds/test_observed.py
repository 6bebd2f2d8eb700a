"""The C kernels of real arms, a million random poses each: errors stay below the proven bounds, and not far below."""

from __future__ import annotations

import subprocess
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from benchmarks.bounds import CONTRACTED, EXACT, Arm, compile_arm, coordinates, proven, worst_random, worst_searched
from kinegen.backends.scalar_types import ScalarType
from kinegen.model.outputs import Quantity
from tests.sincos.library import COMPILERS

ROBOTS = Path(__file__).resolve().parents[2] / "robots"
HERE = Path(__file__).resolve().parent
ARMS = ("puma560", "ur5", "panda", "iiwa14")
"""Six and seven joints."""

FIGURE = 5.0
"""A bound of a coordinate is at most so many times the worst error that can be found."""

LOOSE = 20.0
"""The same for rotations, whose third column is a cross product: its bound takes all errors as independent."""

pytestmark = pytest.mark.skipif(not COMPILERS, reason="needs gcc or clang")


@cache
def arm(name: str, flags: tuple[str, ...] = EXACT) -> Arm:
    return compile_arm(ROBOTS / f"{name}.yaml", Quantity.POSE, flags)


def assert_within(found: Arm, worst: np.ndarray) -> None:
    """Errors are measured against the double kernel, which has a bound of its own."""
    assert (worst <= proven(found) + proven(found, ScalarType.DOUBLE)).all()


@pytest.mark.parametrize("name", ARMS)
def test_a_million_poses_stay_within_the_bound_and_come_near_it(name: str) -> None:
    worst = worst_random(arm(name))
    bounds, observed = (coordinates(each, Quantity.POSE) for each in (proven(arm(name)), worst))

    assert_within(arm(name), worst)
    assert observed["rotation"] > bounds["rotation"] / LOOSE
    assert all(observed[each] > bounds[each] / FIGURE for each in ("px", "py", "pz"))


@pytest.mark.parametrize("name", ARMS)
def test_a_search_for_the_worst_pose_stays_within_the_bound_and_comes_nearer(name: str) -> None:
    worst = worst_searched(arm(name), tries=10_000)
    bounds, observed = (coordinates(each, Quantity.POSE) for each in (proven(arm(name)), worst))

    assert_within(arm(name), worst)
    assert all(observed[each] > bounds[each] / FIGURE for each in ("px", "py", "pz"))
    assert observed["rotation"] > bounds["rotation"] / LOOSE


@pytest.mark.parametrize("name", ["ur5", "panda"])
def test_contraction_is_covered(name: str) -> None:
    try:
        contracted = arm(name, CONTRACTED)
    except subprocess.CalledProcessError:
        pytest.skip("the compiler knows no fused operations here")
    assert_within(contracted, worst_random(contracted, poses=200_000))


def test_lengths_that_cancel_are_within_the_bound_too() -> None:
    calibrated = compile_arm(HERE / "ur5_calibrated.yaml", Quantity.POSE)

    assert_within(calibrated, worst_random(calibrated, poses=100_000))
    assert max(coordinates(proven(calibrated), Quantity.POSE).values()) > 1e-4
