"""What `kinegen show` gathers: the table in its own units, link matrices, products and where they are cut."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from kinegen.backends.textbook.notation import TableText
from kinegen.backends.textbook.sheet import make_sheet
from kinegen.backends.textbook.sheet_python import python_sheet
from kinegen.backends.textbook.table import read_table
from kinegen.derive.transforms import frames_between
from kinegen.errors import KinegenError
from kinegen.io.load import load, loads
from kinegen.model.robot import Robot
from kinegen.verify import reference
from tests.chains import robots

ROBOTS = Path(__file__).resolve().parent.parent.parent / "robots"
TEXT = TableText()

MIXED = """\
kinegen: 1
name: mixed
convention: modified
units: {length: mm, angle: ANGLE}
parameters:
  pitch: 5
  tilt: {value: QUARTER/9, dimension: angle}
  reach: {value: 2.5, runtime: true}
joints:
  - {name: turn, alpha: 0, a: reach, d: 0.5, theta: QUARTER - q}
  - {name: screw, alpha: -QUARTER, a: 0, d: pitch*q/(2*pi), theta: q}
  - {name: slide, alpha: tilt, a: 1/3, d: 2*q + 1, theta: QUARTER/2}
  - {name: follow, ets: [Rz(0.5*turn + QUARTER), Tx(-reach)]}
tool: {rpy: [0, 0, QUARTER]}
"""


def mixed(angle: str) -> Robot:
    """One robot, written in degrees or radians."""
    quarter = "90" if angle == "deg" else "pi/2"
    return loads(MIXED.replace("ANGLE", angle).replace("QUARTER", quarter), "mixed.yaml")


def entries(robot: Robot) -> list[list[str]]:
    """The table as text, row by row."""
    found = []
    for row in read_table(robot).rows:
        texts = ["" if entry is None else TEXT.entry(entry) for entry in row.entries]
        found.append(texts + [f"{step.kind}({TEXT.entry(step.value)})" for step in row.steps])
    return found


def test_the_table_is_in_the_units_of_the_file() -> None:
    assert entries(mixed("deg")) == [
        ["0", "reach", "0.5", "-q1 + 90"],
        ["-90", "0", "pitch*q2/(2*pi)", "q2"],
        ["tilt", "1/3", "2*q3 + 1", "45"],
        ["", "", "", "", "Rz(q1/2 + 90)", "Tx(-reach)"],
    ]
    assert entries(mixed("rad")) == [
        ["0", "reach", "0.5", "-q1 + pi/2"],
        ["-pi/2", "0", "pitch*q2/(2*pi)", "q2"],
        ["tilt", "1/3", "2*q3 + 1", "pi/4"],
        ["", "", "", "", "Rz(q1/2 + pi/2)", "Tx(-reach)"],
    ]


@pytest.mark.parametrize(("angle", "tilt"), [("deg", "10"), ("rad", "pi/18")])
def test_parameters_have_values_and_units(angle: str, tilt: str) -> None:
    parameters = read_table(mixed(angle)).parameters
    found = [(each.name, TEXT.entry(each.value), each.unit, each.runtime) for each in parameters]

    assert found == [
        ("pitch", "5", "", False),
        ("tilt", tilt, angle, False),
        ("reach", "2.5", "mm", True),
    ]


def test_fixed_transforms_that_do_nothing_are_left_out() -> None:
    assert [frame.name for frame in read_table(mixed("deg")).frames] == ["tool"]
    assert [frame.name for frame in read_table(load(ROBOTS / "puma560.yaml")).frames] == []


@pytest.mark.parametrize(
    ("start", "end", "expected"),
    [
        ("base", 2, "base-0 0-waist waist-shoulder"),
        (2, 0, "waist-shoulder 0-waist"),
        ("elbow", "tool", "elbow-forearm forearm-wrist_bend wrist_bend-flange flange-tool"),
        (3, 3, ""),
    ],
)
def test_the_way_between_two_frames(start: str | int, end: str | int, expected: str) -> None:
    ways = frames_between(load(ROBOTS / "puma560.yaml"), start, end)

    assert " ".join("-".join(pair) for pair in ways) == expected


def test_the_way_through_a_tree_goes_by_the_common_ancestor() -> None:
    ways = frames_between(load(ROBOTS / "hand.yaml"), "thumb_1", "index_spread")

    assert ways == (
        *(("thumb_root", "thumb_1"), ("0", "thumb_root")),
        *(("0", "index_root"), ("index_root", "index_spread")),
    )


def test_an_unknown_frame_is_refused() -> None:
    with pytest.raises(KinegenError, match="unknown frame 'hand'"):
        make_sheet(load(ROBOTS / "puma560.yaml"), "hand", None)


@pytest.mark.parametrize(
    ("start", "end", "factors"),
    [
        (None, None, ["base_T_7", "7T14", "14_T_tool"]),
        (21, 0, ["21T14", "14T7", "7T0"]),
        (0, 10, ["0T10"]),
        (0, 11, ["0T7", "7T11"]),
    ],
)
def test_long_products_are_cut(start: int | None, end: int | None, factors: list[str]) -> None:
    (product,) = make_sheet(load(ROBOTS / "human_body.yaml"), start, end).products

    assert [form.name for form in product.factors] == factors


def rows_of_turns(*turns: int) -> Robot:
    """A chain of rows, each with a number of turns that do not fold."""
    rows = "".join(
        f"  - {{name: row_{index}, ets: [{', '.join(['Rx(0.1)', 'Ry(0.2)'] * (number // 2))}, Rz(q)]}}\n"
        for index, number in enumerate(turns)
    )
    return loads(
        f"kinegen: 1\nname: turns\nconvention: standard\nunits: {{length: m, angle: rad}}\njoints:\n{rows}", "x"
    )


def test_a_row_that_is_long_by_itself_stays_whole() -> None:
    (product,) = make_sheet(rows_of_turns(10, 2), None, None).products

    assert [form.name for form in product.factors] == ["base_T_1", "1_T_tool"]


def test_a_row_that_would_fill_all_memory_is_refused() -> None:
    with pytest.raises(KinegenError, match="base_T_1 has 41 turns and is too long to be printed; select a part"):
        make_sheet(rows_of_turns(40, 2), None, None)


@settings(max_examples=40, suppress_health_check=[HealthCheck.too_slow])
@given(robots())
def test_the_printed_form_of_any_robot_is_its_pose(robot: Robot) -> None:
    functions: dict[str, Any] = {}
    exec(python_sheet(make_sheet(robot, None, None)), functions)  # noqa: S102 - as users do
    q = np.random.default_rng(7).uniform(-1, 1, robot.dof)
    expected = reference.frames(robot, q)

    for tip in robot.tips:
        assert np.abs(np.array(functions[f"base_T_{tip}"](q)) - expected[tip][0]).max() < 1e-13
