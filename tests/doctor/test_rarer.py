"""Rarer mistakes: one wrong number, exchanged columns and rows, coupled joints, bad poses; and what is not claimed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from decimal import Decimal
from math import degrees

import numpy as np
import pytest

from kinegen.tools.doctor.diagnosis import Diagnosis, Verdict, examine
from kinegen.tools.doctor.findings import Unexplained
from kinegen.tools.doctor.observed_poses import Line
from kinegen.tools.doctor.residual import Tolerance
from tests.doctor.arms import lines, observed, robot_text, same_robot, some_joints

HEAD = "kinegen: 1\nname: arm\nconvention: standard\nunits: {length: mm, angle: deg}\njoints:\n"
ARM = f"""{HEAD}\
  - {{name: base,  theta: q,        d: 395, a: 30,  alpha: -90}}
  - {{name: upper, theta: q - 90,   d: 0,   a: 340, alpha: 0}}
  - {{name: fore,  theta: q,        d: 0,   a: -20, alpha: -90}}
  - {{name: roll,  theta: q,        d: 342, a: 0,   alpha: 90}}
  - {{name: bend,  theta: q,        d: 0,   a: 0,   alpha: -90}}
  - {{name: hand,  theta: q + 180,  d: 83,  a: 0,   alpha: 0}}
tool: {{xyz: [12, 0, 60], rpy: [0, 30, 0]}}
"""


def changed(text: str, *pairs: tuple[str, str]) -> str:
    for old, new in pairs:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


def diagnose(
    wrong: str,
    right: str = ARM,
    move: Callable[[np.ndarray], np.ndarray] = lambda q: q,
    form: str = "rpy",
    count: int = 6,
    tolerance: Tolerance | None = None,
) -> Diagnosis:
    """What is said of a wrong text and poses of the right one; the robot is at `move` of the written joint values."""
    q = some_joints(right, count)
    found = [replace(line, joints=numbers(said)) for line, said in zip(lines(right, move(q), form, 2), q, strict=True)]
    return examine(wrong, "arm.yaml", observed(wrong, found, form=form), "tool", tolerance=tolerance or Tolerance())


def unexplained(found: Diagnosis) -> Unexplained:
    assert found.verdict is Verdict.NOTHING
    assert found.unexplained is not None
    return found.unexplained


def numbers(values: np.ndarray) -> tuple[Decimal, ...]:
    return tuple(Decimal(f"{value:g}") for value in values)


ONE_NUMBER = {
    "a mistyped length": (("a: 340", "a: 304"), "joint 2 (upper): a is 340 instead of 304"),
    "a length of zero": (("d: 342", "d: 0"), "joint 4 (roll): d is 342 instead of 0"),
    "a zero with a digit too few": (("q - 90", "q - 9"), "joint 2 (upper): the constant in theta is -90 instead of -9"),
    "a twist of 90": (("a: 340, alpha: 0", "a: 340, alpha: 90"), "joint 2 (upper): alpha is 0 instead of 90"),
    "a number of the tool": (("[12, 0, 60]", "[12, 0, 66]"), "the transform 'tool': Tz is 60 instead of 66"),
    "an angle of the tool": (("[0, 30, 0]", "[0, 3, 0]"), "the transform 'tool': Ry is 30 instead of 3"),
}


@pytest.mark.parametrize("name", ONE_NUMBER)
@pytest.mark.parametrize("form", ["rpy", ""])
def test_one_wrong_number_is_solved_from_the_poses(name: str, form: str) -> None:
    change, words = ONE_NUMBER[name]
    found = diagnose(changed(ARM, change), form=form)

    if name == "an angle of the tool" and not form:
        assert found.verdict is Verdict.AGREES  # the point of the tool is where it was
        return
    assert found.verdict is Verdict.FOUND
    assert (words,) in (found.findings[0].words, *found.findings[0].same)
    assert same_robot(found.findings[0].text or "", ARM)


def test_a_wrong_number_in_radians_is_written_as_a_part_of_pi() -> None:
    right = changed(ARM, ("angle: deg", "angle: rad"), ("180", "pi"), ("30, 0]", "0.5, 0]"), ("d: 395", "d: 305"))
    right = right.replace("90", "pi/2")
    wrong = changed(right, ("theta: q - pi/2,   d: 0,   a: 340", "theta: q + 0.3,  d: 0,   a: 340"))
    taken = lines(right, some_joints(right), "rpy", 2)
    turned = [replace(line, joints=numbers(np.radians(np.array(line.joints, dtype=float)))) for line in taken]
    orient = [replace(line, orientation=()) for line in turned]
    found = examine(wrong, "arm.yaml", observed(wrong, orient), "tool")

    assert found.verdict is Verdict.FOUND
    assert "theta: q - pi/2" in (found.findings[0].text or "")


def swapped(first: int, second: int) -> Callable[[np.ndarray], np.ndarray]:
    order = list(range(6))
    order[first], order[second] = second, first
    return lambda q: q[:, order]


def coupled(sign: int) -> Callable[[np.ndarray], np.ndarray]:
    return lambda q: q + np.outer(sign * q[:, 1], [0, 0, 1, 0, 0, 0])


ORDER = sorted(range(6), key=["base", "upper", "fore", "roll", "bend", "hand"].__getitem__)
READ = {
    "two columns": (swapped(3, 4), "the columns of joints roll and bend are exchanged in the poses"),
    "the reverse": (lambda q: q[:, ::-1], "the columns of the joints are in reverse order in the poses"),
    "the alphabet": (lambda q: q[:, np.argsort(ORDER)], "the columns of the joints are in the order of the alphabet"),
    "from the ground": (coupled(-1), "joint fore is at its value in the poses minus that of upper"),
    "the other way": (coupled(1), "joint fore is at its value in the poses plus that of upper"),
}


@pytest.mark.parametrize("name", READ)
def test_columns_of_joints_in_another_order_and_coupled_joints(name: str) -> None:
    move, words = READ[name]
    found = diagnose(ARM, move=move)

    assert found.verdict is Verdict.FOUND
    assert found.findings[0].words[0].startswith(words)
    assert found.findings[0].text is None


def test_exchanged_columns_beside_another_mistake() -> None:
    found = diagnose(changed(ARM, ("a: -20", "a: 20")), move=swapped(0, 1))

    assert found.verdict is Verdict.FOUND
    assert "the columns of joints base and upper are exchanged in the poses" in found.findings[0].words
    assert found.findings[0].text == ARM


EXCHANGED = {
    "a and d of a row": (("d: 395, a: 30, ", "d: 30,  a: 395,"),),
    "columns a and d": (
        ("d: 395, a: 30, ", "d: 30,  a: 395,"),
        ("d: 0,   a: 340", "d: 340, a: 0"),
        ("d: 0,   a: -20", "d: -20, a: 0"),
        ("d: 342, a: 0, ", "d: 0,   a: 342,"),
        ("d: 83,  a: 0, ", "d: 0,  a: 83, "),
    ),
    "column d": (("d: 395", "d: 83"), ("d: 0,   a: 340", "d: 395, a: 340"), ("d: 342", "d: 0"),
                 ("d: 0,   a: 0,   alpha: -90", "d: 342, a: 0,   alpha: -90"), ("d: 83,  a: 0", "d: 0,  a: 0")),
    "two rows": (("d: 0,   a: -20, alpha: -90", "d: 342, a: 0, alpha: 90"),
                 ("d: 342, a: 0,   alpha: 90", "d: 0, a: -20, alpha: -90")),
}  # fmt: skip


@pytest.mark.parametrize("name", EXCHANGED)
def test_exchanged_entries_columns_and_rows(name: str) -> None:
    found = diagnose(changed(ARM, *EXCHANGED[name]))

    assert found.verdict is Verdict.FOUND
    assert same_robot(found.findings[0].text or "", ARM)


def spoilt(text: str, count: int, bad: dict[int, float], form: str = "rpy") -> list[Line]:
    """Poses, of which some are shifted along x."""
    taken = lines(text, some_joints(text, count), form, 2)
    for place, shift in bad.items():
        position = taken[place].position
        taken[place] = replace(taken[place], position=(position[0] + Decimal(shift), *position[1:]))
    return taken


def test_one_bad_pose_among_ten_is_named() -> None:
    found = examine(ARM, "arm.yaml", observed(ARM, spoilt(ARM, 10, {5: 36.0})), "tool")

    assert found.verdict is Verdict.NOTHING
    assert unexplained(found).most_agree is not None
    assert unexplained(found).most_agree.finding.words == ()
    assert [(each.line, each.position) for each in unexplained(found).most_agree.errors if not each.fits] == [
        (6, pytest.approx(36, abs=0.02))
    ]
    assert max(unexplained(found).errors, key=lambda error: error.position).line == 6


def test_one_bad_pose_beside_a_mistake() -> None:
    wrong = changed(ARM, ("a: -20", "a: 20"))
    found = examine(wrong, "arm.yaml", observed(wrong, spoilt(ARM, 10, {2: -25.0})), "tool")

    assert found.verdict is Verdict.NOTHING
    assert unexplained(found).most_agree is not None
    assert unexplained(found).most_agree.finding.text == ARM
    assert [each.line for each in unexplained(found).most_agree.errors if not each.fits] == [3]


def test_three_bad_poses_of_ten_are_no_exception() -> None:
    found = examine(ARM, "arm.yaml", observed(ARM, spoilt(ARM, 10, {1: 30.0, 5: 36.0, 7: -20.0})), "tool")

    assert found.verdict is Verdict.NOTHING
    assert unexplained(found).most_agree is None
    assert len(unexplained(found).errors) == 10


def test_nothing_nearer_makes_positions_or_orientations_worse() -> None:
    """Orientations that mean nothing: positions are right, and no reading of the orientations helps."""
    rng = np.random.default_rng(3)
    taken = [
        replace(line, orientation=numbers(np.round(rng.uniform(-180, 180, 3), 2)))
        for line in lines(ARM, some_joints(ARM), "rpy", 2)
    ]
    found = examine(ARM, "arm.yaml", observed(ARM, taken), "tool")

    assert found.verdict is Verdict.NOTHING
    assert unexplained(found).positions_agree
    for finding in found.findings:
        assert finding.candidate.position <= 0.02
        assert finding.candidate.rotation <= found.start.rotation


def test_half_a_turn_is_180_degrees() -> None:
    found = diagnose(changed(ARM, ("rpy: [0, 30, 0]", "rpy: [180, 30, 0]")))

    assert degrees(found.start.rotation) == pytest.approx(180, abs=0.02)


def test_small_errors_of_all_zeros_are_left_to_calibration() -> None:
    """Two degrees in two joints, which are no usual slips."""
    wrong = changed(ARM, ("theta: q - 90", "theta: q - 88"), ("theta: q,        d: 342", "theta: q - 2,    d: 342"))
    found = diagnose(wrong)

    assert found.verdict is Verdict.NOTHING
    assert unexplained(found).kinds == ("theta",)


def test_orientations_have_a_tolerance_of_their_own() -> None:
    rng = np.random.default_rng(3)
    noisy = [
        replace(line, orientation=numbers(np.round(np.array(line.orientation, dtype=float) + rng.normal(0, 0.1, 3), 2)))
        for line in lines(ARM, some_joints(ARM), "rpy", 2)
    ]
    given = observed(ARM, noisy)

    assert examine(ARM, "arm.yaml", given, "tool").verdict is Verdict.NOTHING
    found = examine(ARM, "arm.yaml", given, "tool", tolerance=Tolerance(0.05, np.radians(0.3)))
    assert found.verdict is Verdict.AGREES
    wrong = examine(changed(ARM, ("a: -20", "a: -21")), "arm.yaml", given, "tool", tolerance=Tolerance(angle=0.005))
    assert wrong.findings[0].words == ("joint 3 (fore): a is -20 instead of -21",)


def test_so_few_and_coarse_poses_say_nothing_of_rare_mistakes() -> None:
    """Among thousands of combinations some would agree with one position by chance."""
    (taken,) = lines(ARM, some_joints(ARM, 1), "", 2)
    other = replace(taken, position=numbers(np.array([-310, 480, 290])))
    coarse, exact = (
        examine(ARM, "arm.yaml", observed(ARM, [other]), "tool", tolerance=Tolerance(limit), most=1)
        for limit in (40, 0.05)
    )

    assert any(words.startswith("rarer mistakes") for words in coarse.left_out)
    assert not any(words.startswith("rarer mistakes") for words in exact.left_out)
    assert coarse.verdict is exact.verdict is Verdict.NOTHING


@pytest.mark.parametrize("seed", range(4))
def test_a_right_table_of_a_real_arm_gets_no_explanation(seed: int) -> None:
    """Every number is off by a little, as of any arm that is made; the digits of the poses are finer than that."""
    rng = np.random.default_rng(seed)
    real = robot_text("puma560")
    for value in ("0.4318", "0.0203", "0.15005"):
        real = real.replace(value, f"{float(value) + rng.normal(0, 1e-3):.6f}")
    real = real.replace("theta: q,", f"theta: q + {rng.uniform(0.05, 0.3):.3f},")
    real = real.replace("alpha: 90,", f"alpha: {90 + rng.uniform(0.05, 0.2):.3f},")
    table = robot_text("puma560")
    found = examine(table, "arm.yaml", observed(table, lines(real, some_joints(real, 8))), "tool")

    assert found.verdict is Verdict.NOTHING
    assert found.findings == ()


def test_a_reading_in_which_the_digits_say_nothing_is_no_explanation() -> None:
    """Whole millimetres and degrees, read as metres and radians, agree with almost any robot."""
    pose = Line(numbers(np.array([10, 20, 30, 40, 50, 60])), numbers(np.zeros(3)), numbers(np.zeros(3)), 1)
    found = examine(ARM, "arm.yaml", observed(ARM, [pose, replace(pose, line=2)]), "tool")

    assert found.verdict is Verdict.NOTHING
    assert not any(finding.candidate.fits for finding in found.findings)
