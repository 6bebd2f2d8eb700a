"""Constants that are nearly special are told of, with what the difference does, and nothing else is."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from kinegen.io.load import load, loads
from kinegen.model.joint_bounds import screw_leads
from kinegen.model.robot import Robot
from kinegen.verify import reference
from kinegen.verify.lint.numbers import nearly_special

HEAD = "kinegen: 1\nname: arm\nconvention: standard\n"


def robot(*rows: str, angle: str = "deg", more: str = "") -> Robot:
    """A robot of some rows; its first joint stands on line 6, or further below `more`."""
    table = "".join(f"  - {row}\n" for row in rows)
    return loads(f"{HEAD}units: {{length: m, angle: {angle}}}\n{more}joints:\n{table}", "arm.yaml")


def row(alpha: str = "0", a: str = "0", d: str = "0", theta: str = "q", name: str = "joint") -> str:
    """One row of the table."""
    return f"{{name: {name}, alpha: {alpha}, a: {a}, d: {d}, theta: {theta}}}"


LINK = row(a="1", d="0.5", name="link")


def only_note(arm: Robot) -> str:
    """The text of the one note about a robot."""
    (note,) = nearly_special(arm)
    return note.text


@pytest.mark.parametrize(
    ("alpha", "angle", "found"),
    [
        ("89.9999", "deg", "89.9999 deg, close to 90,"),
        ("-90.00001", "deg", "-90.00001 deg, close to -90,"),
        ("0.05", "deg", "0.05 deg, close to 0,"),
        ("90 + 1e-16", "deg", "90.0000000000000001 deg, close to 90,"),
        ("1.5708", "rad", "1.5708 rad, close to pi/2,"),
        ("-1.5707963267948966", "rad", "-1.5707963267948966 rad, close to -pi/2,"),
        ("3.14159", "rad", "3.14159 rad, close to pi,"),
        ("-4.712", "rad", "-4.712 rad, close to -3*pi/2,"),
    ],
)
def test_angles_close_to_quarter_turns(alpha: str, angle: str, found: str) -> None:
    text = only_note(robot(row(alpha=alpha), LINK, angle=angle))

    assert text.startswith(f"alpha of joint 1 (joint) is {found} and kept as it is; the difference moves the tip by")


@pytest.mark.parametrize("alpha", ["0", "90", "-180", "pi/2", "45", "89.8", "30.0001", "3*turn"])
def test_special_and_other_angles_are_passed_over(alpha: str) -> None:
    more = "parameters: {turn: 30}\n" if "turn" in alpha else ""

    assert nearly_special(robot(row(alpha=alpha), LINK, more=more)) == ()


def test_an_offset_is_looked_at_without_its_variable() -> None:
    assert only_note(robot(row(theta="q - 89.9999"), LINK)).startswith("theta of joint 1 (joint) is -89.9999 deg")
    assert nearly_special(robot(row(theta="90 - q"), LINK)) == ()


def test_tiny_lengths_are_close_to_zero() -> None:
    text = only_note(robot(row(a="1e-8"), LINK))

    assert text == (
        "a of joint 1 (joint) is 1e-8 m, close to 0, and kept as it is; the difference moves the tip by up to 1e-08 m"
    )


def test_the_effect_is_that_of_the_exact_value() -> None:
    bent, straight = robot(row(alpha="89.95"), LINK), robot(row(alpha="90"), LINK)
    q = np.random.default_rng(1).uniform(-np.pi, np.pi, (5_000, 2))
    distances = np.linalg.norm((reference.pose(bent, q) - reference.pose(straight, q))[:, 0, :3, 3], axis=1)
    told = float(re.search("moves the tip by up to (.*) m and", only_note(bent))[1])  # type: ignore[index]

    assert told == pytest.approx(distances.max(), rel=0.1)


def test_differences_below_all_rounding_are_measured_too() -> None:
    text = only_note(robot(row(alpha="90 + 1e-30"), LINK))

    assert "moves the tip by up to 2e-32 m and turns it by 1.7e-32 rad" in text


def test_parameters_count_with_their_values_unless_they_are_given_at_run_time() -> None:
    fixed = "parameters: {tilt: {value: 0.03, dimension: angle}}\n"

    assert only_note(robot(row(alpha="tilt"), LINK, more=fixed)).startswith("alpha of joint 1 (joint) is 0.03 deg")
    assert nearly_special(robot(row(alpha="tilt"), LINK, more=fixed.replace("}}", ", runtime: true}}"))) == ()


def test_sequences_and_fixed_transforms_are_looked_at() -> None:
    fixed = "base: {rpy: [90.001, 0, 0]}\ntool: {ets: [Tx(1e-9)]}\n"
    fixed += "frames:\n  camera: {parent: base, rpy: [0, 0.002, 0]}\n"
    notes = nearly_special(robot("{name: joint, ets: [Rz(q), Ry(-90.003)]}", LINK, more=fixed))

    assert [(note.line, " ".join(note.text.split()[:5])) for note in notes] == [
        (10, "Ry of joint 1 (joint)"),
        (None, "Rx of base is 90.001"),
        (None, "Tx of tool is 1e-9"),
        (8, "Ry of frame camera is"),
    ]
    assert "turns camera by" in notes[-1].text
    assert [str(note).split(" of ")[0] for note in notes] == ["line 10: Ry", "Rx", "Tx", "line 8: Ry"]


def test_leads_of_screws() -> None:
    arm = robot(
        "{name: fine, alpha: 0, a: 0, theta: q, d: p*q/(2*pi)}",
        "{name: coarse, ets: [Rx(-q + 10), Tx(0.3*q + 1)]}",
        row(name="plain"),
        more="parameters: {p: 0.002}\n",
    )

    assert screw_leads(arm) == pytest.approx({"fine": 0.002, "coarse": -0.6 * np.pi})


@pytest.mark.parametrize(
    ("suffix", "shift", "found"), [("urdf", "5e-10", 0), ("urdf", "0.00002", 1), ("yaml", "5e-10", 1)]
)
def test_what_nobody_can_measure_is_no_note_about_a_file_with_links(
    suffix: str, shift: str, found: int, tmp_path: Path
) -> None:
    """Programs write such digits into a URDF; in a table somebody typed them."""
    urdf = f"""<robot name="arm"><link name="a"/><link name="b"/><link name="c"/>
      <joint name="turn" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint>
      <joint name="bend" type="continuous"><parent link="b"/><child link="c"/><axis xyz="0 1 0"/>
      <origin xyz="30 {shift} 0"/></joint></robot>"""
    arm = robot(f"{{name: turn, ets: [Rz(q), Tx(30), Ty({shift})]}}", "{name: bend, ets: [Ry(q)]}")
    (tmp_path / "arm.urdf").write_text(urdf, "utf-8")
    arm = load(tmp_path / "arm.urdf") if suffix == "urdf" else arm

    assert len(nearly_special(arm)) == found
