"""Kernels and calls that are wrong on purpose: the proof has to fail for each, and say where."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace

import pytest

from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.routines import SINCOS
from kinegen.backends.scalar_types import ScalarType
from kinegen.verify.frama_c.driver import Driver, guard_driver, kernel_driver, pair_driver
from kinegen.verify.frama_c.eva import PACKAGE, PROGRAM, Outcome, analyse
from kinegen.verify.frama_c.ranges import joint_range
from tests.emit.emitted import kernels

pytestmark = pytest.mark.skipif(
    shutil.which(PROGRAM) is None,
    reason=f"{PROGRAM} is not installed (Debian: apt-get install --no-install-recommends {PACKAGE})",
)

ARM = "thumb"


def with_kernel(pattern: str, replacement: str, real: ScalarType = ScalarType.FLOAT) -> Driver:
    """The usual program, around kernels that differ in one place."""
    files = dict(emit_kernel(kernels(ARM), real))
    source = next(name for name in files if name.endswith(".c"))
    files[source], count = re.subn(pattern, replacement, files[source], count=1)
    assert count == 1, pattern
    return kernel_driver(kernels(ARM), real, files=files)


def with_call(old: str, new: str, real: ScalarType = ScalarType.FLOAT) -> Driver:
    """A program that differs in one place around the usual kernels."""
    driver = kernel_driver(kernels(ARM), real)
    assert driver.files["main.c"].count(old) == 1, old
    return replace(driver, files=driver.files | {"main.c": driver.files["main.c"].replace(old, new)})


def refused(driver: Driver) -> Outcome:
    """What Eva says of a program that is not proved."""
    outcome = analyse(driver)
    assert not outcome.proves(driver)
    return outcome


def test_the_kernels_themselves_pass() -> None:
    driver = with_kernel("const float", "const float")

    assert analyse(driver).proves(driver)


def test_an_output_that_is_too_short_is_noticed() -> None:
    outcome = refused(with_call("float base_T_tool[16];", "float base_T_tool[15];"))

    assert "out of bounds write" in outcome.text


def test_a_joint_vector_that_is_too_short_is_noticed() -> None:
    """Its last entry is not set, then."""
    outcome = refused(with_call("    q[4] = ", "    q[3] = "))

    assert "accessing uninitialized left-value" in outcome.text


def test_an_entry_beyond_the_output_is_noticed() -> None:
    outcome = refused(with_kernel(r"base_T_tool\[15\] =", "base_T_tool[16] ="))

    assert "out of bounds write" in outcome.text


def test_an_output_that_is_left_out_is_noticed() -> None:
    """Nothing proves that it is finite."""
    outcome = refused(with_kernel(r"    base_T_tool\[7\] = [^;]*;\n", ""))

    assert outcome.open == 1


def test_a_temporary_that_is_never_set_is_noticed() -> None:
    outcome = refused(with_kernel(r"const float (t\d+) = \w+ \* \w+;", r"float \1;"))

    assert "accessing uninitialized left-value" in outcome.text


def test_a_division_by_what_may_be_zero_is_noticed() -> None:
    outcome = refused(with_kernel(r"(const float t\d+ = \w+) \* (s3;)", r"\1 / \2"))

    assert "non-finite float value" in outcome.text


def test_an_overflow_is_noticed() -> None:
    outcome = refused(with_kernel(r"(const float t\d+) = ([sc]\d+) \* -?[A-Z]\w+;", r"\1 = 3.0e38F * \2 * 4.0F;"))

    assert "non-finite float value" in outcome.text


@pytest.mark.parametrize("real", ScalarType)
def test_a_joint_value_that_may_be_anything_is_noticed(real: ScalarType) -> None:
    arm = replace(kernels(ARM), programs=kernels(ARM).programs[:1])
    box = ((-1e30, 1e30), *joint_range(arm.robot)[1:])

    assert refused(kernel_driver(arm, real, box)).alarms > 0


@pytest.mark.parametrize("real", ScalarType)
def test_one_angle_just_beyond_the_range_of_the_pair_is_noticed(real: ScalarType) -> None:
    arm = kernels(ARM)
    box = (*joint_range(arm.robot)[:-1], (SINCOS[real].limit, SINCOS[real].limit * 1.001))

    assert "non-finite" in refused(kernel_driver(arm, real, box)).text


def test_a_joint_value_that_is_not_a_number_is_noticed() -> None:
    driver = with_call("    q[0] = ", "    q[0] = 0.0f / 0.0f; if (Frama_C_interval(0, 1)) q[0] = ")

    assert "non-finite float value" in refused(driver).text


@pytest.mark.parametrize("real", ScalarType)
def test_an_assertion_that_does_not_hold_is_noticed(real: ScalarType) -> None:
    driver = pair_driver(real)
    claim = driver.files["main.c"].replace("\\is_finite(s)", "s <= 0.5")
    outcome = analyse(replace(driver, files={"main.c": claim}))

    assert outcome.open == 1
    assert not outcome.proves(driver)


@pytest.mark.parametrize("real", ScalarType)
def test_a_pair_without_its_guard_is_noticed(real: ScalarType) -> None:
    """The first product no longer overflows, so that a large angle gives a number."""
    driver = guard_driver(real)
    text, count = re.subn(r"scaled = x \* [\d.e+F]+;", "scaled = x;", driver.files["main.c"])
    unguarded = replace(driver, files={"main.c": text})

    assert count == 1
    assert not analyse(unguarded).proves(unguarded)


def test_code_that_is_not_reached_is_noticed() -> None:
    driver = with_call("    return 0;\n}\n", "    if (q[0] > 100.0f) {\n        return 1;\n    }\n    return 0;\n}\n")
    outcome = refused(driver)

    assert outcome.alarms == 0
    assert outcome.unreached > 0
