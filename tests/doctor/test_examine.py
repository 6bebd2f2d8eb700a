"""Known mistakes in known tables, found from a few rounded poses, and what is said where the poses do not suffice."""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal

import numpy as np
import pytest

from kinegen.tools.doctor.diagnosis import Diagnosis, Verdict, examine
from kinegen.tools.doctor.observed_poses import Said
from kinegen.tools.doctor.residual import Tolerance
from tests.doctor.arms import lines, observed, robot_text, same_robot, some_joints

PUMA, UR5 = robot_text("puma560"), robot_text("ur5")
TOOLED = PUMA + "tool: {xyz: [0.1, 0, 0.05], rpy: [0, 45, 10]}\n"
BASED = PUMA + "base:\n  xyz: [0.5, 0, 0.3]   # on a table\n  rpy: [0, 0, 30]\n"


def diagnose(wrong: str, right: str, form: str = "rpy", count: int = 6, said: Said | None = None) -> Diagnosis:
    """What the doctor says of a wrong text and poses of the right one."""
    found = lines(right, some_joints(right, count), form)
    return examine(wrong, "arm.yaml", observed(wrong, found, said, form), "tool")


def replaced(text: str, *pairs: tuple[str, str]) -> str:
    for old, new in pairs:
        assert text.count(old) == 1, (old, text.count(old))
        text = text.replace(old, new)
    return text


MISTAKES = {
    "standard formula on Craig's table": (replaced(PUMA, ("convention: modified", "convention: standard")), PUMA),
    "direction of a joint": (replaced(PUMA, ("d: d3, theta: q", "d: d3, theta: -q")), PUMA),
    "zero of a joint": (replaced(PUMA, ("d: d3, theta: q", "d: d3, theta: q - 90")), PUMA),
    "sign of alpha": (replaced(PUMA, ("forearm,    alpha: -90", "forearm,    alpha: 90")), PUMA),
    "sign of a": (replaced(PUMA, ("a: a3", "a: -a3")), PUMA),
    "sign of d": (replaced(PUMA, ("d: d4", "d: -d4")), PUMA),
    "two signs": (replaced(PUMA, ("d: d4", "d: -d4"), ("wrist_bend, alpha: 90", "wrist_bend, alpha: -90")), PUMA),
    "tool reversed": (
        replaced(TOOLED, ("{xyz: [0.1, 0, 0.05], rpy: [0, 45, 10]}", "{ets: [Ry(-45), Rz(-10), Tz(-0.05), Tx(-0.1)]}")),
        PUMA + "tool: {ets: [Tx(0.1), Tz(0.05), Rz(10), Ry(45)]}\n",
    ),
    "tool too much": (TOOLED, PUMA),
    "tool missing": (PUMA, TOOLED),
    "base too much": (BASED, PUMA),
    "base missing": (PUMA, BASED),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_the_mistake_is_found_and_mended(name: str) -> None:
    wrong, right = MISTAKES[name]
    found = diagnose(wrong, right)

    assert found.verdict is Verdict.FOUND
    assert found.findings[0].text is not None
    assert same_robot(found.findings[0].text, right)
    assert not found.start.fits


def test_only_the_wrong_entries_of_the_text_change() -> None:
    right = PUMA
    wrong = replaced(PUMA, ("a: a3", "a: -a3"), ("d: d3, theta: q", "d: d3, theta: q - 90"))
    text = diagnose(wrong, right).findings[0].text or ""
    changed = [(a, b) for a, b in zip(wrong.splitlines(), text.splitlines(), strict=True) if a != b]
    expected = [(a, b) for a, b in zip(wrong.splitlines(), right.splitlines(), strict=True) if a != b]

    assert [(a, b.split()) for a, b in changed] == [(a, b.split()) for a, b in expected]


def test_the_lines_of_a_base_are_taken_out_whole() -> None:
    found = diagnose(BASED + "# the end\n", PUMA)

    assert found.findings[0].text == PUMA + "# the end\n"


def test_lengths_in_another_unit() -> None:
    wrong = PUMA.replace("0.4318", "431.8").replace("0.0203", "20.3").replace("0.15005", "150.05")
    found = diagnose(wrong, PUMA)

    assert found.findings[0].text == wrong.replace("length: m", "length: mm")


def test_angles_of_the_file_in_another_unit() -> None:
    wrong = PUMA.replace(": -90,", ": -1.5707963267948966,").replace(": 90,", ": 1.5707963267948966,")
    found = diagnose(wrong, PUMA)

    assert found.findings[0].text == wrong.replace("angle: deg", "angle: rad")


def test_joint_values_in_radians_leave_the_file_as_it_is() -> None:
    taken = lines(PUMA, some_joints(PUMA))
    turned = [replace(line, joints=decimals(np.radians(np.array(line.joints, dtype=float)), 5)) for line in taken]
    found = examine(PUMA, "arm.yaml", observed(PUMA, turned), "tool")

    assert found.verdict is Verdict.FOUND
    assert found.findings[0].words == ("the joint values of the poses are in rad",)
    assert found.findings[0].text is None


def decimals(values: np.ndarray, places: int) -> tuple[Decimal, ...]:
    return tuple(Decimal(f"{value:.{places}f}") for value in values)


def test_what_is_stated_is_not_questioned() -> None:
    taken = lines(PUMA, some_joints(PUMA))
    said = Said(angle="rad")
    found = examine(PUMA, "arm.yaml", observed(PUMA, taken, said), "tool")

    assert found.verdict is Verdict.NOTHING
    for finding in found.findings:
        assert finding.candidate.setting.joint_angle == finding.candidate.setting.pose_angle == "rad"


@pytest.mark.parametrize(("written", "read"), [("ypr", "rpy"), ("rpy_xyz", "rpy"), ("xyzw", "wxyz")])
def test_the_order_of_the_orientations(written: str, read: str) -> None:
    taken = lines(PUMA, some_joints(PUMA), written)
    found = examine(PUMA, "arm.yaml", observed(PUMA, taken, form=read), "tool")

    assert found.verdict is Verdict.FOUND
    assert dict(found.findings[0].candidate.changes[0].fields) == {"form": written}


def test_positions_alone_suffice() -> None:
    wrong, right = MISTAKES["sign of a"]
    found = diagnose(wrong, right, form="")

    assert found.findings[0].candidate.fits
    assert found.findings[0].text == right


def test_a_right_file_agrees() -> None:
    found = diagnose(PUMA, PUMA)

    assert found.verdict is Verdict.AGREES
    assert found.findings[0].words == ()


def test_columns_shifted_by_a_row() -> None:
    rows = [line for line in PUMA.splitlines() if "- {name:" in line]
    alphas = [line.split("alpha: ")[1].split(",")[0] for line in rows]
    wrong = PUMA
    for index, line in enumerate(rows):
        wrong = wrong.replace(line, line.replace(f"alpha: {alphas[index]},", f"alpha: {alphas[index - 1]},"))
    found = diagnose(wrong, PUMA)

    assert found.findings[0].text is not None
    assert same_robot(found.findings[0].text, PUMA)


def test_poses_that_cannot_tell_get_the_pose_that_can() -> None:
    """With joints 4 to 6 at zero, the direction of joint 3 and a turn of all that follows look alike."""
    wrong = replaced(PUMA, ("d: d3, theta: q", "d: d3, theta: -q"))
    joints = np.zeros((1, 6))
    joints[0, :3] = 30, -45, 90
    found = examine(wrong, "arm.yaml", observed(wrong, lines(PUMA, joints, "")), "tool")

    assert found.verdict is Verdict.AMBIGUOUS
    assert any(finding.text == PUMA for finding in found.findings)
    assert found.separation is not None
    positions = found.separation.positions
    apart = [np.linalg.norm(a - b) for i, a in enumerate(positions) for b in positions[:i]]
    assert len(positions) == len(found.findings)
    assert min(apart) > 0.001

    # The pose that was asked for decides.
    more = np.vstack([joints, found.separation.joints])
    again = examine(wrong, "arm.yaml", observed(wrong, lines(PUMA, more, "")), "tool")
    assert again.findings[0].text == PUMA
    assert len(again.findings) < len(found.findings)


def test_what_the_poses_do_not_test_is_said() -> None:
    wrong, right = MISTAKES["sign of d"]
    joints = some_joints(PUMA)
    joints[:, 5] = 0
    found = examine(wrong, "arm.yaml", observed(wrong, lines(right, joints)), "tool")

    assert found.verdict is Verdict.FOUND
    assert found.untested == ("joint 6 (flange): the other direction",)
    assert found.separation is not None
    assert abs(found.separation.joints[5]) > 1


def test_nothing_is_claimed_where_nothing_fits() -> None:
    taken = lines(UR5, some_joints(UR5))
    found = examine(PUMA, "arm.yaml", observed(PUMA, taken), "tool")

    assert found.verdict is Verdict.NOTHING
    assert all(not finding.candidate.fits for finding in found.findings)


def test_noise_of_measurements_takes_a_tolerance() -> None:
    wrong, right = MISTAKES["sign of a"]
    rng = np.random.default_rng(8)
    taken = lines(right, some_joints(PUMA))
    noisy = [
        replace(line, position=decimals(np.array(line.position, dtype=float) + rng.normal(0, 3e-4, 3), 4))
        for line in taken
    ]
    given = observed(wrong, noisy)

    assert examine(wrong, "arm.yaml", given, "tool").verdict is Verdict.NOTHING
    found = examine(wrong, "arm.yaml", given, "tool", tolerance=Tolerance(1e-3))
    assert found.verdict is Verdict.FOUND
    assert found.findings[0].text == right


def test_three_changes_at_once() -> None:
    wrong = PUMA
    for old, new in (("d: d4", "d: -d4"), ("a: a3", "a: -a3"), ("d: d3, theta: q", "d: d3, theta: q + 90")):
        wrong = replaced(wrong, (old, new))
    found = diagnose(wrong, PUMA)

    assert found.verdict is Verdict.FOUND
    assert same_robot(found.findings[0].text or "", PUMA)


def test_base_and_tool_unknown_at_once() -> None:
    right = TOOLED + "base: {xyz: [0.5, -0.2, 0.3], rpy: [0, 0, 30]}\n"
    wrong = replaced(PUMA, ("wrist_bend, alpha: 90", "wrist_bend, alpha: -90"))
    found = diagnose(wrong, right)

    assert found.findings[0].candidate.fits
    assert found.findings[0].candidate.base is not None
    assert found.findings[0].candidate.tail is not None
    assert found.findings[0].candidate.position < 3e-4


def test_many_poses_are_screened_and_then_judged_all() -> None:
    """A single pose that does not agree is among those that the search leaves out."""
    wrong, right = MISTAKES["sign of a"]
    taken = lines(right, some_joints(PUMA, 400))
    fine = examine(wrong, "arm.yaml", observed(wrong, taken), "tool")
    taken[5] = replace(taken[5], position=decimals(np.array(taken[5].position, dtype=float) + 0.3, 4))
    spoilt = examine(wrong, "arm.yaml", observed(wrong, taken), "tool")

    assert fine.findings[0].text == right
    assert spoilt.verdict is Verdict.NOTHING
    assert not any(finding.candidate.fits for finding in spoilt.findings)


def test_an_entry_that_an_alias_shares_is_not_changed_alone() -> None:
    """The text of one row is used for two; a change of it would change both."""
    row = "- {name: one, theta: q, d: &length 0.3, a: 0.2, alpha: 90}"
    other = "- {name: two, theta: q, d: *length, a: 0.1, alpha: -90}"
    last = "- {name: three, theta: q, d: 0.1, a: 0.3, alpha: 0}"
    head = "kinegen: 1\nname: arm\nconvention: standard\nunits: {length: m, angle: deg}\njoints:\n"
    wrong = f"{head}  {row}\n  {other}\n  {last}\n"
    right = wrong.replace("*length", "-0.3")
    found = diagnose(wrong, right)

    assert found.verdict is Verdict.FOUND
    assert found.findings[0].words == ("joint 2 (two): the other sign of d",)
    assert found.findings[0].text is None
    assert found.findings[0].reason == "the entry d is shared by a YAML alias"


def test_aliases_elsewhere_do_not_matter() -> None:
    wrong = PUMA.replace("a: a3", "a: -a3").replace(
        "alpha: -90, a: 0,  d: 0,  theta: q, limits", "alpha: &down -90, a: 0,  d: 0,  theta: q, limits"
    )
    wrong = wrong.replace("forearm,    alpha: -90", "forearm,    alpha: *down")
    found = diagnose(wrong, PUMA)

    assert wrong.count("down") == 2
    assert found.findings[0].text == wrong.replace("a: -a3", "a: a3")
