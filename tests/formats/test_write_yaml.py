"""The YAML writer: what is written reads back as the same robot."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kinegen.errors import KinegenError, RobotFileError
from kinegen.io.load import load, loads
from kinegen.io.robot_file.entry_text import spell
from kinegen.io.robot_file.write import write
from kinegen.model.expression_parser import number, parse
from kinegen.model.robot import Convention, Robot, Step, StepKind, Units
from kinegen.model.variants import frame_named, root_label
from kinegen.verify import reference
from tests.chains import robots
from tests.formats.plain import URDF_TWO

ROBOTS = sorted((Path(__file__).parents[2] / "robots").glob("*.yaml"))


def unused(robot: Robot) -> bool:
    """Whether some parameter only serves the value of another, which closed values lose."""
    return any(each.name in other.made_of for each in robot.parameters for other in robot.parameters)


@pytest.mark.parametrize("path", ROBOTS, ids=lambda path: path.stem)
def test_the_robots_of_the_project_keep_their_digest(path: Path) -> None:
    robot = load(path)

    again = loads(write(robot), path.name)

    assert again.digest == robot.digest or unused(robot)
    assert again.rows == tuple(replace(row, line=new.line) for row, new in zip(robot.rows, again.rows, strict=True))
    assert write(again).splitlines()[1:] == [line.replace("line", "line") for line in write(again).splitlines()[1:]]


@settings(max_examples=60, deadline=None)
@given(robots(most_rows=8))
def test_random_robots_keep_their_digest(robot: Robot) -> None:
    assert loads(write(robot), "again.yaml").digest == robot.digest


numbers = st.fractions(min_value=-1000, max_value=1000, max_denominator=10**6).map(str)
words = st.sampled_from(["a", "b", "pi", "sqrt(2)", "atan2(a, 3)", "asin(1/3)", "2", "0.125"])
expressions = st.recursive(
    words | numbers,
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from("+-*"), inner).map(lambda parts: f"({parts[0]} {parts[1]} {parts[2]})"),
        inner.map(lambda part: f"(-({part}))"),
        inner.map(lambda part: f"(1 + ({part})**2)"),
        inner.map(lambda part: f"(3/(2 + ({part})**2))"),
    ),
    max_leaves=7,
)


@settings(max_examples=400, deadline=None)
@given(expressions)
def test_expressions_read_back_as_the_same_tree(text: str) -> None:
    tree = parse(text)

    assert parse(spell(tree)) == tree


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("pi/2", "pi/2"),
        ("-pi", "-pi"),
        ("2*pi/3", "2*pi/3"),
        ("0.089159", "0.089159"),
        ("1/3", "1/3"),
        ("-(a + b)*2 - 3", "-2*a - 2*b - 3"),
        ("1/a**2", "1/a**2"),
        ("1e-20", "1e-20"),
        ("12345678901234567890", "12345678901234567890"),
    ],
)
def test_expressions_are_written_as_people_do(text: str, expected: str) -> None:
    tree = parse(text)

    assert parse(spell(tree)) == tree
    if "(" not in text:
        assert spell(tree) == expected


def test_an_angle_in_plain_radians_makes_a_file_in_radians() -> None:
    """In a file in degrees `pi` is half a turn, so half a radian cannot be written there."""
    robot = load(Path(__file__).parents[2] / "robots" / "puma560.yaml")
    tilted = replace(robot, tool=(Step(StepKind.RX, number("0.5")),))

    again = loads(write(tilted), "again.yaml")

    assert again.units == Units(robot.units.length, "rad")
    assert again.tool[0].value == number("0.5")
    q = np.full((1, robot.dof), 0.3)
    assert np.array_equal(reference.pose(tilted, q), reference.pose(again, q))


def test_parameters_that_nothing_uses_are_named_and_left_out() -> None:
    text = "kinegen: 1\nname: r\nconvention: standard\nunits: {length: m, angle: deg}\nparameters: {a: 0.5, b: 2*a}\n"
    robot = loads(f"{text}joints:\n  - {{name: j, a: b, alpha: 0, d: 0, theta: q}}\n", "r.yaml")

    written = write(robot)

    assert "# Left out, since no entry uses it: parameter a." in written
    assert loads(written, "r.yaml").parameters[0].name == "b"


def test_comments_give_the_line_of_each_row() -> None:
    robot = load(ROBOTS[0])

    assert f"# line {robot.rows[1].line}\n" in write(robot)
    assert write(robot).startswith(f"# From {ROBOTS[0].name}.\n")


def test_a_table_of_elementary_rows_alone_needs_no_convention() -> None:
    robot = loads(
        "kinegen: 1\nname: r\nconvention: modified\nunits: {length: mm, angle: deg}\n"
        'joints:\n  - {name: y, ets: ["Rz(q + atan2(1, 2))", Tx(30)], limits: [-90, 90]}\n',
        "r.yaml",
    )

    again = loads(write(replace(robot, convention=Convention.ETS)), "r.yaml")

    assert again.rows[0].steps == robot.rows[0].steps
    assert again.variables[0].limits == robot.variables[0].limits


def test_what_a_file_cannot_hold_is_one_line() -> None:
    robot = load(ROBOTS[0])
    long = Fraction(10**200 + 1, 3)

    with pytest.raises(KinegenError, match="cannot be written as a robot file") as caught:
        write(replace(robot, tool=(Step(StepKind.TX, number(long)),)))

    assert "\n" not in str(caught.value)


LINKED = """\
kinegen: 1
name: arm
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: waist, theta: q, d: 1, a: 0, alpha: 0}
  - {name: elbow, theta: q, d: 0, a: 0.5, alpha: 0}
frames:
  plate: {parent: base, xyz: [0, 0, 0.1]}
links: {base_link: base, base: plate, "fore arm/link": waist, tool0: tool}
"""


def test_names_of_links_are_kept_and_change_nothing_else(tmp_path: Path) -> None:
    robot = loads(LINKED, "arm.yaml")
    names = (("base_link", "base"), ("base", "plate"), ("fore arm/link", "waist"), ("tool0", "tool"))

    assert robot.links == names
    assert robot.digest == loads(LINKED[: LINKED.index("links:")], "arm.yaml").digest
    assert loads(write(robot), "arm.yaml").links == names
    # From a URDF to a robot file and back, the words of the first file stay.
    (tmp_path / "arm.urdf").write_text(URDF_TWO)
    imported = load(tmp_path / "arm.urdf")
    assert loads(write(imported), "arm.yaml").links == imported.links
    assert frame_named(loads(write(imported), "arm.yaml"), "lower") == frame_named(imported, "lower")


@pytest.mark.parametrize(
    ("links", "message"),
    [
        (
            "{forearm: elbw}",
            (
                "arm.yaml:10: links: link 'forearm': there is no frame 'elbw' "
                "(expected base, waist, elbow, tool, plate; did you mean elbow?)"
            ),
        ),
        ("[forearm]", "arm.yaml:10: links: expected entries such as forearm_link: elbow, found a list"),
        ('{" ": elbow}', "arm.yaml:10: links: ' ' is not the name of a link"),
        ("{forearm: [elbow]}", "arm.yaml:10: links: expected the name of a frame, found a list"),
    ],
)
def test_links_that_mean_no_frame_are_refused(links: str, message: str) -> None:
    with pytest.raises(RobotFileError) as caught:
        loads(LINKED[: LINKED.index("links:")] + f"links: {links}\n", "arm.yaml")
    assert str(caught.value) == message


def test_a_root_without_a_link_is_not_called_as_another_link_is() -> None:
    robot = loads(LINKED.replace("base_link: base, ", ""), "arm.yaml")

    assert root_label(robot) == "root"
    assert root_label(loads(LINKED, "arm.yaml")) == "base_link"
    assert frame_named(robot, "base") == "plate"
