"""Which printed numbers stand for exact ones, by their own last digit."""

from __future__ import annotations

from fractions import Fraction

import pytest

from kinegen.io.link_tree.numbers import grid_angle, printed


@pytest.mark.parametrize(
    ("text", "share"),
    [
        ("1.57", "1/2"),
        ("1.5708", "1/2"),
        ("1.5707", "1/2"),
        ("1.5707963", "1/2"),
        ("1.57079632679", "1/2"),
        ("1.5707963267948966", "1/2"),
        ("-1.5707963267948968", None),
        ("3.14", "1"),
        ("3.1416", "1"),
        ("3.1415", "1"),
        ("3.1415926535897931", "1"),
        ("0.785398", "1/4"),
        ("2.0944", "2/3"),
        ("-4.712389", "-3/2"),
        ("6.2832", "2"),
        ("0.26", "1/12"),
        ("0.0175", "1/180"),
        ("0.872665", "5/18"),
        ("15.708e-1", "1/2"),
        ("3.141", None),
        ("1.571", "1/2"),
        ("1.5", None),
        ("1.6", None),
        ("3", None),
        ("0.02", None),
        ("0.52", "1/6"),
        ("0.5", None),
        ("1.5710", None),
        ("1.570", None),
        ("2.7629E-18", None),
        ("0.0001", None),
        ("0", None),
        ("1.5708001", None),
    ],
)
def test_angles(text: str, share: str | None) -> None:
    assert grid_angle(printed(text), None) == (None if share is None else Fraction(share))


def test_zero_keeps_every_digit_and_an_angle_takes_more() -> None:
    assert grid_angle(printed("3.141"), 1e-3) == 1
    assert grid_angle(printed("2.7629E-18"), 1e-9) == 0
    assert grid_angle(printed("1.5"), 1e-3) is None


@pytest.mark.parametrize(
    ("text", "value", "tail"),
    [
        ("0.34000000000000002", "0.34", True),
        ("0.089159", "0.089159", False),
        ("1.3877787807814457e-17", "1.3877787807814457e-17", False),
        ("+.5", "0.5", False),
        ("5.", "5", False),
        ("0.100000000000000000000", "0.1", False),
        ("1e-300", "0", True),
        ("0e-300", "0", False),
    ],
)
def test_the_tail_of_a_float_is_taken_off(text: str, value: str, tail: bool) -> None:
    number = printed(text)

    assert number.value == Fraction(value)
    assert number.tail == tail
    assert tail or printed(text, keep=True).value == Fraction(text)
