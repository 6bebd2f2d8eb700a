"""What is said of a singular place holds at all of it: where links are folded as well as where they are stretched."""

from __future__ import annotations

import pytest

import kinegen

ELBOW = "elbow stretched or folded: the origin of frame tool is in the plane of axes "
WRIST = [("q", 0, 0, 90), ("q", 0, 0, -90), ("q", 0, 0, 0)]


def words(*rows: tuple[str | float, ...], convention: str = "standard") -> dict[str, str]:
    """What is said of each place of a table: theta, d, a, alpha in degrees, without parameters."""
    keys = ("name", "theta", "d", "a", "alpha")
    robot = kinegen.load(
        {
            "kinegen": 1,
            "name": "arm",
            "convention": convention,
            "units": {"length": "m", "angle": "deg"},
            "joints": [dict(zip(keys, (f"j{place}", *row), strict=True)) for place, row in enumerate(rows)],
        }
    )
    places = robot.closed_form(output="singularities").singularities
    return {", ".join(map(str, zeros)): said for zeros, said in places}


@pytest.mark.parametrize("theta", ["q", "q + 180", "180 - q", "q + 90"])
def test_two_links_of_one_length_are_in_one_plane_and_not_always_on_the_axis(theta: str) -> None:
    (said,) = words(("q", 0, 1, 0), (theta, 0, 1, 0)).values()

    assert said == f"{ELBOW}1 and 2"


@pytest.mark.parametrize("theta", ["q", "q + 180"])
def test_so_are_those_of_an_arm_with_a_waist(theta: str) -> None:
    said = words(("q", 0, 0, 90), ("q", 0, 0.5, 0), (theta, 0, 0.5, 0))

    assert said["sin(q3)"] == f"{ELBOW}2 and 3"


def test_three_axes_whose_directions_alone_are_dependent_are_parallel_to_one_plane() -> None:
    said = words(("q", 0.1, 0.3, 45), ("q", 0.1, 0.5, -90), ("q", 0.1, 0, 0))

    assert said == {"sin(q2)": "axes 1, 2 and 3 are parallel to one plane"}


def test_parallel_axes_that_meet_where_folded_are_in_one_plane_where_stretched() -> None:
    said = words(("q", 0.1, 0.5, 0), ("q", 0, 0.5, 0), ("q", 0.4, 0.5, 0), *WRIST)

    assert said["sin(q2), sin(q3)"] == (
        "elbow stretched or folded: the parallel axes 1, 2 and 3 are in one plane; "
        "elbow stretched or folded: the parallel axes 2, 3 and 4 are in one plane"
    )


def test_axes_that_coincide_are_not_said_to_be_in_a_plane() -> None:
    said = words(("q", 0.2, 0.5, 90), ("q - 90", 0, 0.5, -90), ("q + 90", 0, 0.5, 0))

    assert said["sin(q2) + 1"] == "axes 1 and 3 coincide"
    assert said["cos(q3)"] == "shoulder: the origin of frame tool is in the plane of axes 1 and 3"


def test_sets_that_contradict_themselves_are_not_reached() -> None:
    said = words(
        ("q - 90", 0.5, 0.5, 0),
        ("q", 0.5, 0.5, 90),
        ("q", 0.5, 0.5, 90),
        ("q - 90", 0, 0, 0),
        ("q + 180", 0, 0, 90),
        convention="modified",
    )

    assert {place for place, each in said.items() if each.startswith("not reached")} == {
        place for place in said if "sin(q2) + cos(q2)" in place and "sin(q2) + cos(q2) + 1" in place
    }
