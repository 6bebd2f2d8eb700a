"""Angle sums and their labels."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinegen.model.angle_sums import Angle, AngleLabels


def angle(*terms: tuple[int, object], rest: str = "") -> Angle:
    """An angle from joint numbers and coefficients."""
    return Angle(tuple((joint, Fraction(str(coefficient))) for joint, coefficient in terms), rest)


@pytest.mark.parametrize(
    ("found", "dof", "label"),
    [
        (angle((2, 1)), 6, "2"),
        (angle((2, 1), (3, 1)), 6, "23"),
        (angle((2, 1), (3, -1)), 6, "2m3"),
        (angle((2, -1), (3, 1)), 6, "m23"),
        (angle((2, 1), (3, 1), (4, 1)), 6, "234"),
        (angle((1, 1), (2, 1)), 9, "12"),
        (angle((1, 1), (12, 1)), 12, "1_12"),
        (angle((2, 1), (3, -1)), 10, "2_m3"),
        (angle((2, 2)), 6, "u1"),
        (angle((1, "1/2"), (2, 1)), 6, "u1"),
        (angle((1, 1), rest="0.3"), 6, "u1"),
        (angle(rest="beta"), 6, "u1"),
    ],
)
def test_labels_of_angle_sums(found: Angle, dof: int, label: str) -> None:
    assert AngleLabels(dof).label(found, "it") == label


@given(st.data(), st.integers(1, 21))
def test_no_two_angles_share_a_label(data: st.DataObject, dof: int) -> None:
    sums = st.dictionaries(st.integers(1, dof), st.sampled_from([1, -1, 2]), min_size=1, max_size=4)
    labels = AngleLabels(dof)
    one, two = (angle(*sorted(data.draw(sums).items())) for _ in range(2))

    assert (labels.label(one, one) == labels.label(two, two)) == (one == two)


def test_angles_whose_text_is_the_same_keep_labels_of_their_own() -> None:
    labels = AngleLabels(6)
    same = angle((1, 1), rest="0.785398")

    assert labels.label(same, "one") != labels.label(same, "another")
    assert labels.label(same, "one") == "u1"


def test_sums_and_multiples_print_as_people_write_them() -> None:
    second = angle((2, 1)).plus(angle((3, 1)), -1)

    assert str(second) == "q2 - q3"
    assert str(angle((2, "2/3")).plus(angle(rest="0.5"), -1)) == "2/3*q2 - 0.5"
    assert str(second.times(Fraction(-1, 2))) == "-0.5*q2 + 0.5*q3"
    assert str(second.plus(second, -1)) == "0"
