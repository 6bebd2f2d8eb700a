"""Frama-C finds no run-time error in the emitted kernels. `scripts/prove_eva.py` does the same for all of them."""

from __future__ import annotations

import shutil

import pytest

from kinegen.backends.scalar_types import ScalarType
from kinegen.verify.frama_c.driver import guard_driver, kernel_driver, pair_driver
from kinegen.verify.frama_c.eva import PACKAGE, PROGRAM, analyse
from tests.emit.emitted import kernels

pytestmark = pytest.mark.skipif(
    shutil.which(PROGRAM) is None,
    reason=f"{PROGRAM} is not installed (Debian: apt-get install --no-install-recommends {PACKAGE})",
)


@pytest.mark.parametrize("real", ScalarType)
@pytest.mark.parametrize("name", ["thumb", "cartesian", "blocks", "calibrated_2r"])
def test_kernels_of_every_shape_have_no_run_time_error(name: str, real: ScalarType) -> None:
    """An arm, one without angles, one without joints, one with runtime parameters, all at the values of the file."""
    driver = kernel_driver(kernels(name), real)

    assert analyse(driver).proves(driver)


@pytest.mark.parametrize("real", ScalarType)
def test_bounds_are_tight_enough_to_mean_something(real: ScalarType) -> None:
    """A planar chain of three joints reaches 0.6 m and 0.8 m up; Frama-C sees it within a tenth."""
    shown = analyse(kernel_driver(kernels("scara"), real)).shown

    assert max(map(abs, shown["fk_rotation"])) < 1.1
    assert -0.66 < shown["fk_position"][0] < -0.6
    assert 1.4 <= round(shown["fk_position"][1], 6) < 1.54


@pytest.mark.parametrize("real", ScalarType)
def test_the_pair_is_finite_within_its_range_and_nan_elsewhere(real: ScalarType) -> None:
    inside, outside = pair_driver(real), guard_driver(real)

    assert analyse(inside).proves(inside)
    assert analyse(outside).proves(outside)
