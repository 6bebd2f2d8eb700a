"""Which arms are recognised, whatever their tables look like, and what is said of the others."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from kinegen.derive.dispatch import derive
from kinegen.derive.inverse.classification import NotClosedForm, recognise
from kinegen.derive.inverse.family import Family
from kinegen.derive.inverse.family_words import constants
from kinegen.errors import KinegenError
from kinegen.io.load import load, loads
from kinegen.model.outputs import Kind, Quantity

ROBOTS = Path(__file__).parents[2] / "robots"

WRIST = "arm with parallel axes 2, 3 and spherical wrist"
UR = "UR type: parallel axes 2, 3, 4"
FIVE = "AL5D type: waist, parallel axes 2, 3, 4, roll"

FAMILIES = {
    "al5d": FIVE,
    "anthropomorphic_arm": "anthropomorphic arm",
    "anthropomorphic_wrist": WRIST,
    "cartesian": "Cartesian arm",
    "cylindrical_arm": "cylindrical arm",
    "fanuc_10l": WRIST,
    "kr5": WRIST,
    "motoman_l3": FIVE,
    "planar_3r": "planar 3R",
    "planar_3r_standard": "planar 3R",
    "puma560": WRIST,
    "puma560_mm": WRIST,
    "scara": "SCARA, joints RRP",
    "scara_class": "SCARA, joints RRP",
    "scara_hd": "SCARA, joints RRP",
    "spherical_arm": "spherical arm",
    "stanford": "Stanford type: spherical arm with spherical wrist",
    "tx60": WRIST,
    "ur16e": UR,
    "ur3": UR,
    "ur5": UR,
}

REASONS = {
    "blocks": "it has no joint variable",
    "hand": "it has 5 tips, not one: thumb_tip, index_tip, middle_tip, ring_tip, little_tip",
    "screw": "joint 1 (spindle) moves more than one row: it is a screw, or another row follows it; if motors "
    "are coupled, keep the rows independent and describe the motors in actuators:",
    "panda": "no closed form has the joints RRRRRRR",
    "calibrated_2r": "joint 2 (joint_2): its direction depends on the runtime parameter skew, tilt",
    "jaco2": "not an arm with a spherical wrist: axes 4 and 5 are not at right angles: they are at 60 deg",
    "rrr_nonplanar_1": "not an arm for the position of a point: the point that joint 3 is to carry lies on its axis",
    "rpr_polar": "not an arm for the position of a point: no closed form begins with the joints RPR",
}


@pytest.mark.parametrize("name", FAMILIES)
def test_textbook_and_factory_arms_are_recognised(name: str) -> None:
    family = recognise(load(ROBOTS / f"{name}.yaml"))

    assert isinstance(family, Family)
    assert family.name == FAMILIES[name]
    assert len(set(family.branches)) == len(family.branches)


@pytest.mark.parametrize("name", REASONS)
def test_where_there_is_no_family_the_failing_condition_is_named(name: str) -> None:
    unknown = recognise(load(ROBOTS / f"{name}.yaml"))

    assert isinstance(unknown, NotClosedForm)
    assert REASONS[name] in unknown.reasons


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("forearm,    alpha: -90", "forearm,    alpha: -89.9999", None),
        ("wrist_bend, alpha: 90,  a: 0", "wrist_bend, alpha: 90,  a: 0.05", "joints 4, 5, 6 do not meet in one point"),
        (
            "wrist_bend, alpha: 90",
            "wrist_bend, alpha: 89",
            "axes 4 and 5 are not at right angles: they are at 89 deg",
        ),
        ("shoulder,   alpha: -90", "shoulder,   alpha: 0", "axes 1 and 2 are parallel"),
    ],
)
def test_conditions_are_exact(old: str, new: str, reason: str | None) -> None:
    text = (ROBOTS / "puma560.yaml").read_text(encoding="utf-8")
    assert old in text
    found = recognise(loads(text.replace(old, new), "puma560.yaml"))

    if reason is None:
        assert isinstance(found, Family)
    else:
        assert isinstance(found, NotClosedForm)
        assert any(reason in line for line in found.reasons)


@pytest.mark.parametrize("angle", ["0.0000001", "0.1"])
def test_what_misses_a_condition_by_a_little_is_nearly_of_the_family(angle: str) -> None:
    text = (ROBOTS / "puma560.yaml").read_text(encoding="utf-8")
    bent = recognise(loads(text.replace("wrist_bend, alpha: 90", f"wrist_bend, alpha: 90 - {angle}"), "puma560.yaml"))

    assert isinstance(bent, Family)
    assert bent.name == f"nearly {WRIST}"
    assert bent.defect is not None
    (failing,) = bent.defect.failing
    assert failing.text == "axes 4 and 5 are at right angles"
    assert failing.amount == pytest.approx(float(angle) * math.pi / 180, rel=1e-6)


@pytest.mark.parametrize("angle", ["1", "-2"])
def test_axes_2_and_3_are_parallel_or_axes_1_and_2_meet(angle: str) -> None:
    reason = f"axes 2 and 3 are not parallel: they are at {angle.removeprefix('-')} deg"
    text = (ROBOTS / "kr5.yaml").read_text(encoding="utf-8")
    bent = text.replace("a: a2, alpha: 0", f"a: a2, alpha: {angle}")

    offset, meeting = (recognise(loads(each, "kr5.yaml")) for each in (bent, bent.replace("a1: 0.18", "a1: 0")))

    assert isinstance(offset, NotClosedForm)
    assert any("axes 1 and 2 do not meet: they pass at 0.18" in line for line in offset.reasons)
    assert any(reason in line for line in offset.reasons)
    assert isinstance(meeting, Family)
    assert meeting.name == "arm whose axes 1, 2 meet, with spherical wrist"


def test_both_tables_of_the_puma_have_the_same_constants() -> None:
    """Fu, Gonzalez and Lee's distal table in mm against Craig's proximal one: other lengths, the same geometry."""
    ours, theirs = (recognise(load(ROBOTS / f"{name}.yaml")) for name in ("puma560", "puma560_mm"))

    assert isinstance(ours, Family)
    assert isinstance(theirs, Family)
    assert [constant.text for constant in constants(ours)] == [constant.text for constant in constants(theirs)]
    assert constants(theirs)[2].value == pytest.approx(431.8)
    assert constants(theirs)[3].value == pytest.approx((20.32**2 + 433.07**2) ** 0.5)
    assert abs(constants(theirs)[4].value) == pytest.approx(149.09)


def test_runtime_lengths_stay_in_the_formulas() -> None:
    text = (
        (ROBOTS / "puma560.yaml")
        .read_text(encoding="utf-8")
        .replace("a3: 0.0203", "a3: {value: 0.0203, runtime: true}")
    )
    robot = loads(text, "puma560.yaml")
    family = recognise(robot)

    assert isinstance(family, Family)
    assert [each.runtime for each in constants(family)].count(("a3",)) == 1
    assert [str(symbol) for symbol in derive(robot, Quantity(Kind.INVERSE)).parameters] == ["a3"]


def test_a_build_names_the_conditions_and_offers_the_numeric_inverse() -> None:
    with pytest.raises(KinegenError, match=r"jaco2 has no closed-form inverse: .*60 deg.*numeric_inverse works"):
        derive(load(ROBOTS / "jaco2.yaml"), Quantity(Kind.INVERSE))


BELTS = """kinegen: 1
name: belts
convention: standard
units: {length: mm, angle: deg}
joints:
  - {name: upper, theta: q, d: 0, a: 150, alpha: 0}
"""
SECOND_ANGLE_FROM_THE_BASE = """  - {name: undo, theta: -upper, d: 0, a: 0, alpha: 0}
  - {name: forearm, theta: q, d: 0, a: 150, alpha: 0}
"""
MOTORS = """  - {name: elbow, theta: q, d: 0, a: 150, alpha: 0}
actuators:
  readings: {a: angle, b: angle}
  joints:
    - {joint: upper, form: gear, actuator: a, ratio: 1}
    - {joint: elbow, value: b - upper}
"""


def test_an_arm_whose_row_follows_a_joint_is_solved_as_the_message_says() -> None:
    refused = recognise(loads(BELTS + SECOND_ANGLE_FROM_THE_BASE, "belts.yaml"))

    assert isinstance(refused, NotClosedForm)
    assert any(reason.endswith("describe the motors in actuators:") for reason in refused.reasons)
    assert not isinstance(recognise(loads(BELTS + MOTORS, "belts.yaml")), NotClosedForm)
