"""Headers state the proven errors, and a build says where they are too large."""

from __future__ import annotations

import re
from fractions import Fraction
from functools import cache
from pathlib import Path

import pytest

from kinegen.backends.accuracy import error_bound, fraction_box, two_digits
from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.limits import joint_limits
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import build, lower_file
from kinegen.driver.results import BuildOptions
from kinegen.io.load import load
from kinegen.model.outputs import USUAL, Quantity
from kinegen.verify.lint.precision import precision_notes

ROOT = Path(__file__).resolve().parents[2]
CALIBRATED = ROOT / "tests" / "bounds" / "ur5_calibrated.yaml"


@cache
def kernels(name: str) -> RobotPrograms:
    return lower_file(ROOT / "robots" / f"{name}.yaml", USUAL)


@cache
def header(name: str, real: ScalarType) -> str:
    """A header as one line of words."""
    files = emit_kernel(kernels(name), real)
    text = next(text for file, text in files.items() if file.endswith(".h"))
    return re.sub(r"\s+(\* )?", " ", text)


def test_every_function_states_its_errors_in_the_unit_of_the_file() -> None:
    assert header("puma560_mm", ScalarType.FLOAT).count("Proven error") == 1 + len(USUAL)
    assert re.search(
        r"Proven error: \|px\| <= \d\.\de-4 mm, \|py\| <= .* rotation", header("puma560_mm", ScalarType.FLOAT)
    )


@pytest.mark.parametrize("real", ScalarType)
def test_a_header_states_the_bound_and_nothing_smaller(real: ScalarType) -> None:
    program = kernels("panda").programs[0]
    stated = re.findall(
        r"Proven error: \|px\| <= (\S+) m, \|py\| <= (\S+) m, \|pz\| <= (\S+) m, rotation entries <= (\S+)\.",
        header("panda", real),
    )[0]
    proven = error_bound(kernels("panda"), program, real)

    assert proven.rotation is not None
    for text, bound in zip(stated, (*proven.position, proven.rotation), strict=True):
        assert bound <= float(text) <= 1.1 * bound


@pytest.mark.parametrize("name", ["puma560", "iiwa14"])
def test_errors_are_stated_for_limits_as_floats_round_them(name: str) -> None:
    known = load(ROOT / "robots" / f"{name}.yaml")
    for box, limits in zip(fraction_box(known), joint_limits(known, ScalarType.FLOAT), strict=True):
        assert limits is None or (box[0] <= Fraction(limits[0]) and Fraction(limits[1]) <= box[1])
    assert any(limits is not None for limits in joint_limits(known, ScalarType.FLOAT))


def test_headers_say_what_is_assumed_of_joints_without_limits() -> None:
    assert "half a turn to either side for q[2] and q[5])" in header("puma560", ScalarType.FLOAT)
    assert "half a turn to either side for q[0] and q[1] and -1 to 1 m for q[2])" in header("scara", ScalarType.FLOAT)
    assert "where there are none" not in header("ur5", ScalarType.FLOAT)


def test_angles_without_limits_have_a_bound_for_the_whole_range_of_the_sine() -> None:
    """A sum of angles of 12000 rad is rounded to multiples of 1/1024; an angle that is in no sum loses nothing."""
    text = header("puma560", ScalarType.FLOAT)

    assert re.search(r"For q\[2\] and q\[5\] anywhere up to 12000 rad, as far as sums of angles are too: .*e-4 m", text)
    assert "The same for q[3], q[4] and q[5] anywhere up to 12000 rad." in header("stanford", ScalarType.FLOAT)


def test_headers_say_whose_parameters_are_meant() -> None:
    assert "for the parameters of the file" in header("calibrated_2r", ScalarType.DOUBLE)
    assert "for the parameters of the file" not in header("panda", ScalarType.DOUBLE)


def test_trees_and_frames_state_the_worst() -> None:
    assert header("hand", ScalarType.FLOAT).count("Proven error of any tip: ") == 2
    assert header("hand", ScalarType.FLOAT).count("Proven error of any frame: ") == 1


@pytest.mark.parametrize(
    ("error", "text"),
    [(0.0, "0"), (3.7001e-7, "3.8e-7"), (9.99e-16, "1.0e-15"), (12.0, "1.2e1"), (float("inf"), "infinity")],
)
def test_two_digits_are_rounded_upwards(error: float, text: str) -> None:
    assert two_digits(error) == text


def test_a_calibrated_table_whose_lengths_cancel_gets_a_note() -> None:
    found = precision_notes(lower_file(CALIBRATED, (Quantity.POSE,)), tuple(ScalarType))

    assert len(found) == 1
    assert re.match(
        r"float results may be off by \d\.\de-4 m where the end effector covers 1\.\d+ m: lengths of 1149 m", found[0]
    )
    assert "double kernels" in found[0]
    assert "Hayati" in found[0]


def test_a_build_says_so(tmp_path: Path) -> None:
    options = BuildOptions(output=tmp_path, quantities=(Quantity.POSITION,), compile=False)
    notes = build(CALIBRATED, options, lambda _: None).notes

    assert [note for note in notes if note.startswith("float results may be off")] == [notes[-1]]


@pytest.mark.parametrize("name", ["puma560", "human_body", "hand", "calibrated_2r", "blocks", "spherical_joint"])
def test_ordinary_robots_get_none(name: str) -> None:
    assert precision_notes(kernels(name), tuple(ScalarType)) == ()
