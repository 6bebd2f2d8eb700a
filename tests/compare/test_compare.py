"""Two robots compared: proofs where they are the same, the greatest difference where they are not."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from kinegen.errors import KinegenError
from kinegen.io.load import load, loads
from kinegen.io.robot_file.write import write
from kinegen.model.dh_conversion import to_convention
from kinegen.model.expression_parser import number
from kinegen.model.robot import Convention, Robot
from kinegen.tools.compare import compare
from kinegen.ui.cli import main
from kinegen.verify import reference
from tests.chains import robots

FOLDER = Path(__file__).parents[2] / "robots"
ROBOTS = sorted(FOLDER.glob("*.yaml"))
MOVING = [path for path in ROBOTS if load(path).dof]


@pytest.mark.parametrize("path", ROBOTS, ids=lambda path: path.stem)
def test_a_robot_is_itself_by_proof(path: Path) -> None:
    robot = load(path)

    found = compare(robot, robot)

    assert found.same
    assert found.proved
    assert all(each.proved for each in found.differences)


@pytest.mark.parametrize("path", MOVING, ids=lambda path: path.stem)
def test_a_converted_robot_is_the_same_by_proof(path: Path) -> None:
    robot = load(path)
    other = Convention.STANDARD if robot.convention is not Convention.STANDARD else Convention.MODIFIED

    converted = to_convention(robot, other).robot

    if converted.tips == robot.tips:
        found = compare(robot, converted)
        assert found.same
        assert found.proved


@settings(max_examples=15, deadline=None, suppress_health_check=list(HealthCheck))
@given(robots(most_rows=6, runtime=False))
def test_random_robots_and_their_elementary_rows_are_the_same(robot: Robot) -> None:
    assert compare(robot, to_convention(robot, Convention.ETS).robot).proved


def text(**changes: str) -> str:
    """An arm of three joints as a robot file, with some lines changed."""
    lines = {
        "units": "units: {length: m, angle: deg}",
        "one": "  - {name: one, theta: q, d: 0.4, a: 0.1, alpha: 90}",
        "two": "  - {name: two, theta: q, d: 0.05, a: 0.5, alpha: 0}",
        "three": "  - {name: three, theta: q, d: 0.1, a: 0.3, alpha: 30}",
        "tool": "tool: {xyz: [0.1, 0.02, 0.3], rpy: [10, 20, 30]}",
    } | changes
    head = f"kinegen: 1\nname: arm\nconvention: standard\n{lines['units']}\njoints:\n"
    return head + "\n".join(lines[key] for key in ("one", "two", "three", "tool")) + "\n"


def arm(**changes: str) -> Robot:
    return loads(text(**changes), "arm.yaml")


def test_a_difference_is_found_where_it_is_greatest() -> None:
    """A link that is 1 mm longer moves the tip by 1 mm, wherever the joints are."""
    found = compare(arm(), arm(two="  - {name: two, theta: q, d: 0.05, a: 0.501, alpha: 0}"))

    assert not found.same
    tip = found.differences[0]
    assert (tip.first, tip.second) == ("tool", "tool")
    assert tip.distance == pytest.approx(0.001, rel=1e-9)
    assert tip.angle < 1e-7


def test_the_greatest_difference_is_not_far_from_that_of_many_samples() -> None:
    first, second = arm(), arm(two="  - {name: two, theta: 1.02*q, d: 0.05, a: 0.5, alpha: 3}")

    tip = compare(first, second).differences[0]

    q = np.random.default_rng(9).uniform(-math.pi, math.pi, (50_000, 3))
    apart = reference.frames(first, q)["tool"] - reference.frames(second, q)["tool"]
    assert tip.distance >= np.linalg.norm(apart[:, :3, 3], axis=1).max() * 0.999
    here = [reference.frames(each, np.array(tip.distance_at))["tool"][0, :3, 3] for each in (first, second)]
    assert np.linalg.norm(here[0] - here[1]) == pytest.approx(tip.distance, rel=1e-12)


def test_units_are_recognised() -> None:
    robot = load(FOLDER / "ur5.yaml")
    lines = write(robot).replace("length: m,", "length: mm,")

    found = compare(robot, loads(lines, "wrong_unit.yaml"))

    assert not found.same
    assert any("are 1000 times those of the other: is it in millimetres?" in note for note in found.notes)


def test_millimetres_and_metres_of_one_robot_are_the_same() -> None:
    metres = arm()
    millimetres = arm(
        units="units: {length: mm, angle: deg}",
        one="  - {name: one, theta: q, d: 400, a: 100, alpha: 90}",
        two="  - {name: two, theta: q, d: 50, a: 500, alpha: 0}",
        three="  - {name: three, theta: q, d: 100, a: 300, alpha: 30}",
        tool="tool: {xyz: [100, 20, 300], rpy: [10, 20, 30]}",
    )

    assert compare(metres, millimetres).proved


def test_joints_are_matched_by_name() -> None:
    first = loads(
        "kinegen: 1\nname: r\nconvention: standard\nunits: {length: m, angle: deg}\njoints:\n"
        "  - {name: x, ets: [Tx(q)]}\n  - {name: y, ets: [Ty(q)]}\n",
        "r.yaml",
    )
    second = loads(
        "kinegen: 1\nname: r\nconvention: standard\nunits: {length: m, angle: deg}\njoints:\n"
        "  - {name: y, ets: [Ty(q)]}\n  - {name: x, ets: [Tx(q)]}\n",
        "r.yaml",
    )

    found = compare(first, second)

    assert found.proved
    assert "the joints are in another order; they are matched by name" in found.notes


@pytest.mark.parametrize(
    ("two", "three", "signs", "offsets"),
    [
        ("q + 90", "q", (1, 1, 1), (0, -90, 0)),
        ("-q", "q - 37", (1, -1, 1), (0, 0, 37)),
        ("30 - q", "-q + 180", (1, -1, -1), (0, 30, 180)),
    ],
)
def test_signs_and_offsets_are_found(two: str, three: str, signs: tuple[int, ...], offsets: tuple[int, ...]) -> None:
    other = arm(
        two=f"  - {{name: b, theta: {two}, d: 0.05, a: 0.5, alpha: 0}}",
        three=f"  - {{name: c, theta: {three}, d: 0.1, a: 0.3, alpha: 30}}",
    )
    assert not compare(arm(), other).same

    found = compare(arm(), other, fit_offsets=True)

    assert found.same
    assert found.signs == signs
    turned = [
        math.remainder(math.degrees(each) - wanted, 360) for each, wanted in zip(found.offsets, offsets, strict=True)
    ]
    assert np.allclose(turned, 0, atol=1e-6)


@pytest.mark.parametrize("name", ["ur5", "panda", "stanford", "scara", "iiwa14", "puma560", "cylindrical_arm"])
def test_signs_and_offsets_of_the_robots_of_the_project(name: str) -> None:
    """Planted: every other joint turned around, and every zero moved."""
    robot = load(FOLDER / f"{name}.yaml")
    rng = np.random.default_rng(11)
    planted = [int(each) for each in rng.integers(-60, 60, robot.dof)]
    rows = []
    for line in write(to_convention(robot, Convention.ETS).robot).splitlines():
        row = line
        place = next((v.index for v in robot.variables if f"name: {v.name}," in line.replace("  ", " ")), None)
        if place is not None:
            revolute = robot.variables[place].type == "revolute"
            degrees = robot.units.angle == "deg"
            offset = f"{planted[place]}" + ("" if degrees else "*pi/180") if revolute else f"{planted[place]}/1000"
            row = row.split(", limits")[0].split("}")[0]
            row = row.replace("(q", f"({'-' if place % 2 else ''}q + {offset}") + "}"
        rows.append(row)
    other = loads("\n".join(rows), "other.yaml")

    found = compare(robot, other, fit_offsets=True)

    assert found.same, found.differences[0]
    assert found.differences[0].distance < 1e-9


def test_axes_in_other_places_are_one_line() -> None:
    other = arm(two="  - {name: two, theta: q, d: 0.05, a: 0.6, alpha: 0}")

    with pytest.raises(KinegenError, match="the axes are in other places"):
        compare(arm(), other, fit_offsets=True)


def test_robots_that_cannot_be_compared_are_one_line() -> None:
    with pytest.raises(KinegenError, match="has 3 joint variables and ur5 has 6"):
        compare(arm(), load(FOLDER / "ur5.yaml"))
    with pytest.raises(KinegenError, match="joint two of arm is revolute, joint two of arm is prismatic"):
        compare(arm(), arm(two="  - {name: two, theta: 0, d: q, a: 0.5, alpha: 0}"))


def test_tips_and_frames_of_trees() -> None:
    hand = load(FOLDER / "hand.yaml")
    longer = replace(
        hand, parameters=tuple(replace(p, value=number(19)) if p.name == "lL3" else p for p in hand.parameters)
    )

    found = compare(hand, longer)

    assert not found.same
    assert [each.first for each in found.differences if not each.proved] == ["little_tip", "little_3"]
    assert found.differences[4].distance == pytest.approx(0.001)


def test_exit_status_and_text(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    first, second = tmp_path / "a.yaml", tmp_path / "b.yaml"
    first.write_text(text(), encoding="utf-8")
    second.write_text(text(two="  - {name: two, theta: q, d: 0.05, a: 0.501, alpha: 0}"), encoding="utf-8")

    assert main(["compare", str(first), str(first)]) == 0
    assert "the same robot, by proof for every joint vector" in capsys.readouterr().out
    assert main(["compare", str(first), str(second)]) == 1
    said = capsys.readouterr().out
    assert "not the same robot" in said
    assert "tool: at most 1 mm and " in said
    assert main(["compare", "--tolerance", "0.01", str(first), str(second)]) == 0
    assert "within 0.01 m and rad" in capsys.readouterr().out


def test_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "a.yaml"
    file.write_text(text(), encoding="utf-8")

    assert main(["compare", "--json", "--fit-offsets", str(file), str(file)]) == 0

    found = json.loads(capsys.readouterr().out)
    assert found["same"] is True
    assert found["proved"] is True
    assert found["signs"] == [1, 1, 1]
    assert (found["format"], found["first"], found["second"]) == (1, str(file), str(file))
    assert found["kinegen"]


def test_what_cannot_be_compared_is_status_2_and_json_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """So that a script can tell trouble from a difference."""
    good, bad, other = tmp_path / "a.yaml", tmp_path / "bad.yaml", tmp_path / "other.yaml"
    good.write_text(text(), encoding="utf-8")
    bad.write_text(text().replace("alpha", "alhpa"), encoding="utf-8")
    other.write_text(text(two=""), encoding="utf-8")
    for file in (bad, other, tmp_path / "none.yaml"):
        assert main(["compare", str(good), str(file)]) == 2
        said = capsys.readouterr()
        assert said.out == ""
        assert said.err.startswith("error: ")
        assert said.err.count("\n") == 1

        assert main(["compare", "--json", str(good), str(file)]) == 2
        said = capsys.readouterr()
        found = json.loads(said.out)
        assert f"error: {found['error']}\n" == said.err
        assert (found["format"], found["second"]) == (1, str(file))


LEFT = """\
kinegen: 1
name: left
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: shoulder, theta: q, d: 0, a: 0, alpha: 75}
  - {name: elbow, theta: q, d: 0, a: 0, alpha: 52}
  - {name: slide, theta: 90, d: q, a: 0, alpha: 0}
"""


def test_frames_of_rows_do_not_count_where_signs_were_fitted() -> None:
    """The z of a row that turns the other way may point the other way, and the arm is the same."""
    left = loads(LEFT, "left.yaml")
    # The same axes, written with the opposite z of the second row.
    text = LEFT.replace("alpha: 75}", "alpha: -105}").replace("alpha: 52}", "alpha: -52}")
    right = loads(text, "right.yaml")
    found = compare(left, right, fit_offsets=True)

    assert -1 in found.signs
    assert {each.first for each in found.differences if each.decides} == {"tool"}
    assert {each.reason for each in found.differences if not each.decides} == {"signs and zeros were fitted"}


def test_rows_without_a_convention_are_not_said_to_have_another(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    body = "- {name: j, ets: [Tz(1), Rz(q)]}"
    head = "kinegen: 1\nname: a\nconvention: standard\nunits: {length: m, angle: deg}\njoints:\n"
    text = f"{head}  {body}\ntool: {{ets: [Tx(1)]}}\n"
    (tmp_path / "a.yaml").write_text(text, encoding="utf-8")
    (tmp_path / "b.yaml").write_text(
        text.replace("Tz(1), Rz(q)", "Rz(q)").replace("ets: [Tx(1)]", "ets: [Tz(1), Tx(1)]"), encoding="utf-8"
    )

    assert main(["compare", str(tmp_path / "a.yaml"), str(tmp_path / "b.yaml")]) == 0
    out = capsys.readouterr().out
    assert "j: at most 1 m and 0 deg apart (does not count: rows without a convention put their frames anywhere)" in out
    assert "another convention" not in out
