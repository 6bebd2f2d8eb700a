"""`offset:` of a row: a constant that is added to q where it stands, in every convention."""

from __future__ import annotations

from pathlib import Path

import jsonschema
import pytest
import yaml

from kinegen.errors import RobotFileError
from kinegen.io.load import loads
from kinegen.io.robot_file.keys import schema
from kinegen.model.robot import Robot
from kinegen.model.variants import digest
from kinegen.ui.cli import main
from tests.robot.files import HEAD, robot

ROWS = {
    "standard": "{{name: one, a: 0.1, alpha: 90, d: {d}, theta: {theta}{more}}}",
    "modified": "{{name: one, a: 0.1, alpha: 90, d: {d}, theta: {theta}{more}}}",
    "modified_prev_d": "{{name: one, a: 0.1, alpha: 90, d: {d}, theta: {theta}{more}}}",
    "hayati": "{{name: one, a: 0.1, alpha: 1, beta: 2, theta: {theta}{more}}}",
    "ets": "{{name: one, ets: [Tx(1), Rz({theta}), Ty({d}), Rx(90)]{more}}}",
}


def of(convention: str, row: str, angle: str = "deg", more: str = "") -> Robot:
    """A robot of one row."""
    return robot(row, convention="standard" if convention == "ets" else convention, angle=angle, more=more)


@pytest.mark.parametrize("convention", ROWS)
@pytest.mark.parametrize(("offset", "angle"), [("-90", "deg"), ("-pi/2", "rad"), ("home - 10", "deg")])
def test_an_offset_is_added_to_a_turn(convention: str, offset: str, angle: str) -> None:
    more = "parameters: {home: 33}" if "home" in offset else ""
    one = of(convention, ROWS[convention].format(d=0.5, theta="q", more=f", offset: {offset}"), angle, more)
    other = of(convention, ROWS[convention].format(d=0.5, theta=f"q + {offset}", more=""), angle, more)

    assert one.rows == other.rows
    assert one.digest == other.digest == digest(one)


@pytest.mark.parametrize("convention", [name for name in ROWS if name != "hayati"])
def test_an_offset_is_added_to_a_shift(convention: str) -> None:
    one = of(convention, ROWS[convention].format(d="q", theta=30, more=", offset: 0.25"))
    other = of(convention, ROWS[convention].format(d="q + 0.25", theta=30, more=""))

    assert one.rows == other.rows


@pytest.mark.parametrize("convention", ROWS)
def test_the_schema_knows_it(convention: str) -> None:
    row = yaml.safe_load(ROWS[convention].format(d=0.5, theta="q", more=", offset: -90"))
    head = yaml.safe_load(HEAD.format(convention="standard", angle="deg"))

    jsonschema.validate(head | {"joints": [row]}, schema())


def test_limits_are_of_q_itself() -> None:
    one = robot("{name: one, a: 0, alpha: 0, d: 0, theta: q, offset: 90, limits: [-10, 20]}")
    other = robot("{name: one, a: 0, alpha: 0, d: 0, theta: q, limits: [-10, 20]}")

    assert one.variables == other.variables


def test_a_follower_follows_the_variable_without_its_offset() -> None:
    rows = "{{name: one, a: 1, alpha: 0, d: 0, {}}}", "{name: two, a: 1, alpha: 0, d: 0, theta: 2*one}"

    assert (
        robot(rows[0].format("theta: q, offset: 90"), rows[1]).rows
        == robot(rows[0].format("theta: q + 90"), rows[1]).rows
    )


def test_a_parameter_in_an_offset_has_the_dimension_of_the_joint() -> None:
    found = robot(
        "{name: one, a: 0, alpha: 0, d: 0, theta: q, offset: turn}",
        "{name: two, a: 0, alpha: 0, d: q, theta: 0, offset: lift}",
        more="parameters: {turn: {value: 90, runtime: true}, lift: 0.1}",
    )

    assert [str(parameter.dimension) for parameter in found.parameters] == ["angle", "length"]


def test_the_table_shows_what_it_makes_of_the_row(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "arm.yaml"
    row = "joints:\n  - {name: one, a: 0, alpha: 0, d: 0, theta: q, offset: -90}\n"
    path.write_text(HEAD.format(convention="standard", angle="deg") + row, encoding="utf-8")

    assert main(["show", str(path)]) == 0
    assert "q1 - 90" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        ("d: 0, theta: q - 90, offset: 90", "theta is not q alone, so offset could be read in two ways"),
        ("d: 0, theta: -q, offset: 90", "theta is not q alone"),
        ("d: 2*q, theta: 0, offset: 90", "d is not q alone"),
        ("d: 0, theta: 0, offset: 90", "it is added to q, and the row has no q (it is fixed)"),
        ("d: 0.01*q, theta: q, offset: 90", "q is in d and theta; write the sum there"),
        ("d: 0, theta: q, offset: q", "q is the variable of a row"),
        ("d: 0, theta: q, offset: last", "joint variable 'last' is not allowed here"),
        ("d: 0, theta: q, offset: nothing", "undefined name 'nothing'"),
        ("d: 0, theta: q, offset: sqrt(0-1)", "it holds the square root of a negative number"),
        ("d: 0, theta: q, offset: [90]", "expected a number or an expression, found a list"),
    ],
)
def test_what_an_offset_cannot_be(entries: str, message: str) -> None:
    text = HEAD.format(convention="standard", angle="deg") + f"joints:\n  - {{name: last, a: 0, alpha: 0, {entries}}}\n"
    with pytest.raises(RobotFileError) as caught:
        loads(text, "arm.yaml")

    assert caught.value.line == 6
    assert caught.value.message.startswith("joint 1 (last): offset: ")
    assert message in caught.value.message


@pytest.mark.parametrize("word", ["theta_offset", "offsets", "home", "Offset"])
def test_words_of_other_tools_are_hinted_at(word: str) -> None:
    with pytest.raises(RobotFileError, match=r"did you mean offset\?"):
        robot(f"{{name: one, a: 0, alpha: 0, d: 0, theta: q, {word}: 90}}")
