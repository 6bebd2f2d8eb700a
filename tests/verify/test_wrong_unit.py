"""Angles that look as if they were written in the other unit are told of, and others are not."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.io.load import load, loads
from kinegen.verify.lint.numbers import wrong_unit
from tests.verify.test_nearly import LINK, robot, row

ROBOTS = sorted((Path(__file__).resolve().parents[2] / "robots").glob("*.yaml"))


@pytest.mark.parametrize(
    ("alpha", "angle", "text"),
    [
        (
            "1.5708",
            "deg",
            "1.5708 deg, close to the number pi/2; if radians were meant, write 90",
        ),
        ("-1.57", "deg", "-1.57 deg, close to the number -pi/2; if radians were meant, write -90"),
        ("3.14159", "deg", "3.14159 deg, close to the number pi; if radians were meant, write 180"),
        ("-3.14", "deg", "-3.14 deg, close to the number -pi; if radians were meant, write -180"),
        ("4.712", "deg", "4.712 deg, close to the number 3*pi/2; if radians were meant, write 270"),
        ("90", "rad", "90 rad, or 14.3 turns; if degrees were meant, write pi/2"),
        ("-180", "rad", "-180 rad, or 28.6 turns; if degrees were meant, write -pi"),
        ("30", "rad", "30 rad, or 4.77 turns; if degrees were meant, write pi/6"),
        ("89.9999", "rad", "89.9999 rad, or 14.3 turns; if degrees were meant, write 89.9999*pi/180"),
    ],
)
def test_an_angle_in_the_other_unit(alpha: str, angle: str, text: str) -> None:
    (note,) = wrong_unit(robot(row(alpha=alpha), LINK, angle=angle))

    assert note.line == 6
    assert note.text.startswith(f"alpha of joint 1 (joint) is {text}")


@pytest.mark.parametrize(
    ("alpha", "angle"),
    [
        *((alpha, "deg") for alpha in ("0", "90", "pi/2", "1.5", "1.6", "3", "-2", "6.4", "45")),
        *((alpha, "rad") for alpha in ("0", "pi/2", "1.5708", "2*pi", "6.2832", "-4*pi", "5", "-6")),
    ],
)
def test_other_angles_are_passed_over(alpha: str, angle: str) -> None:
    assert wrong_unit(robot(row(alpha=alpha), LINK, angle=angle)) == ()


@pytest.mark.parametrize(
    ("entries", "where"),
    [
        ("alpha: 0, a: 0, d: 0, theta: q + 1.5708", "theta of joint 1 (joint)"),
        ("alpha: 0, a: 0, d: 0, theta: q, offset: 1.5708", "theta of joint 1 (joint)"),
        ("alpha: 0, a: 0, d: 0, theta: q, limits: [-1.571, 1.57]", "a limit of joint 1 (joint)"),
        ("alpha: 0, a: 1.5708, d: 1.5708, theta: q", None),
        ("alpha: 0, a: 0, d: q, theta: 0, limits: [0, 1.5708]", None),
        ("ets: [Rz(q), Ry(1.5708), Tx(3.14159)]", "Ry of joint 1 (joint)"),
    ],
)
def test_every_place_of_an_angle_is_looked_at(entries: str, where: str | None) -> None:
    found = [note.text.split(" is ")[0] for note in wrong_unit(robot(f"{{name: joint, {entries}}}", LINK))]

    assert found == ([where] if where else [])


def test_parameters_and_fixed_transforms_are_looked_at() -> None:
    more = "parameters: {twist: 1.5708}\ntool: {rpy: [0, 3.1416, 0]}\n"
    notes = wrong_unit(robot(row(alpha="twist"), LINK, more=more))

    assert [(note.line, note.text.split(" is ")[0]) for note in notes] == [
        (8, "alpha of joint 1 (joint)"),
        (None, "Ry of tool"),
    ]


@pytest.mark.parametrize(("limits", "count"), [("[-170, 170]", 1), ("[-12.6, 12.6]", 0), ("[-2*pi, 2*pi]", 0)])
def test_limits_in_degrees_in_a_file_in_radians(limits: str, count: int) -> None:
    one = f"{{name: joint, alpha: 0, a: 0, d: 0, theta: q, limits: {limits}}}"

    assert len(wrong_unit(robot(one, LINK, angle="rad"))) == count


@pytest.mark.parametrize(
    ("limits", "count"), [("[-2.5, 2.5]", 1), ("[0, 6.28]", 1), ("[-2.5, 10]", 0), ("[-170, 170]", 0)]
)
def test_limits_in_radians_in_a_file_in_degrees(limits: str, count: int) -> None:
    one = f"{{name: joint, alpha: 0, a: 0, d: 0, theta: q, limits: {limits}}}"
    slide = "{name: joint, alpha: 0, a: 0, theta: 0, d: q, limits: [-2.5, 2.5]}"

    assert len(wrong_unit(robot(one, LINK))) == count
    assert wrong_unit(robot(slide, LINK)) == ()


def test_a_small_motion_is_told_in_both_units() -> None:
    (note,) = wrong_unit(robot("{name: joint, alpha: 0, a: 0, d: 0, theta: q, limits: [-1, 2.5]}", LINK))

    assert note.text == ("a limit of joint 1 (joint) is 2.5 deg, a small motion; if radians were meant, write 143.239")


@pytest.mark.parametrize("path", ROBOTS, ids=lambda path: str(path.stem))
def test_the_robots_of_the_house_are_in_their_units(path: Path) -> None:
    assert wrong_unit(load(path)) == ()


@pytest.mark.parametrize(
    ("length", "d", "text"),
    [
        ("m", "400", "the arm reaches 800 m; if the lengths are in millimetres, write length: mm"),
        ("mm", "0.4", "the arm reaches 0.8 mm; if the lengths are in metres, write length: m"),
        ("in", "0.01", "the arm reaches 0.02 in; if the lengths are in metres, write length: m"),
        ("mm", "400", ""),
        ("m", "0.4", ""),
        ("m", "0.0004", ""),
        ("m", "40", ""),
    ],
)
def test_a_reach_that_no_arm_has_is_a_note(length: str, d: str, text: str) -> None:
    table = f"""\
kinegen: 1
name: arm
convention: standard
units: {{length: {length}, angle: deg}}
joints:
  - {{name: waist, a: {d}, alpha: 90, d: 0, theta: q}}
  - {{name: elbow, a: {d}, alpha: 0, d: 0, theta: q}}
"""

    assert [note.text for note in wrong_unit(loads(table, "arm.yaml"))] == [text] * bool(text)


@pytest.mark.parametrize("limits", [", limits: [0, 0.5]", ""])
def test_slides_without_limits_have_no_reach_to_be_doubted(limits: str) -> None:
    table = f"""\
kinegen: 1
name: gantry
convention: standard
units: {{length: mm, angle: deg}}
joints:
  - {{name: slide, a: 0, alpha: 90, d: q, theta: 0{limits}}}
  - {{name: turn, a: 0.5, alpha: 0, d: 0, theta: q}}
"""

    assert len(wrong_unit(loads(table, "arm.yaml"))) == bool(limits)


@pytest.mark.parametrize(
    ("length", "stroke", "text"),
    [
        ("mm", "[0, 0.3]", "0.3 mm, a small stroke; if metres were meant, write 300"),
        ("mm", "[-0.5, 0.25]", "-0.5 mm, a small stroke; if metres were meant, write -500"),
        ("in", "[0, 0.1]", "0.1 in, a small stroke; if metres were meant, write 3.93701"),
        ("mm", "[0, 300]", ""),
        ("mm", "[0, 4]", ""),
        ("m", "[0, 0.002]", ""),
    ],
)
def test_a_stroke_that_is_small_beside_the_arm_is_a_note(length: str, stroke: str, text: str) -> None:
    table = f"""\
kinegen: 1
name: scara
convention: standard
units: {{length: {length}, angle: deg}}
joints:
  - {{name: waist, a: {10 if length == "in" else 0.4 if length == "m" else 400}, alpha: 180, d: 0, theta: q}}
  - {{name: lift, a: 0, alpha: 0, d: q, theta: 0, limits: {stroke}}}
"""

    found = [(note.line, note.text) for note in wrong_unit(loads(table, "arm.yaml"))]
    assert found == ([(7, f"a limit of joint 2 (lift) is {text}")] if text else [])
