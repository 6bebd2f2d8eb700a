"""The tables and the closed form of a page: their trees, evaluated in JavaScript, give the poses of the reference."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kinegen.backends.textbook.closed_form import closed_form
from kinegen.io.load import load, loads
from kinegen.ir.lower import runtime_defaults
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.robot import Robot
from kinegen.tools.viewer.closed_form_json import MARKED, math_list, pieces
from kinegen.tools.viewer.panels import formula_model, rows_model
from kinegen.verify import reference
from tests.viewer.node import evaluate, needs_node

ROBOTS = Path(__file__).resolve().parents[2] / "robots"
NAMES = """
al5d blocks calibrated_2r cylindrical_joint hand human_body iiwa14 motoman_l3 palletiser panda planar_3r puma560
puma560_mm scara screw spherical_joint stanford ur5 xarm6
""".split()

TIMES = "\u2062"

POSES = """given.map(({model, q, parameters, tables}) => q.map((each) => tables.map((table) => {
    const scope = {q: each, parameters};
    const {rows, tool} = story.frames(table, scope);
    return [...rows, tool];
})))"""

FORMS = """given.map(({form, q}) => q.map((each) => {
    const constants = Object.fromEntries(form.parameters.map((one) => [one.printed, one.value]));
    const scope = {q: each, constants, angles: {}};
    for (const {label, value} of form.angles) { scope.angles[label] = algebra.value(value, scope); }
    return form.products.map(({factors}) => factors.map(({entries}) =>
        [...entries.flatMap((row) => row.map((entry) => algebra.value(entry.value, scope))), 0, 0, 0, 1]
    ).reduce(multiply));
}))"""


def joints(robot: Robot, count: int = 3) -> np.ndarray[Any, np.dtype[np.float64]]:
    low, high = np.array(joint_box(robot)).reshape(-1, 2).T
    return np.random.default_rng(7).uniform(low, high, (count, robot.dof))


def defaults(robot: Robot) -> list[float]:
    return [float(value) for value in runtime_defaults(robot)]


@needs_node
def test_tables_of_every_convention_have_the_poses_of_the_reference() -> None:
    robots = [load(ROBOTS / f"{name}.yaml") for name in NAMES]
    models = [rows_model(robot) for robot in robots]
    given = [
        {"tables": model["tables"], "q": joints(robot).tolist(), "parameters": defaults(robot)}
        for robot, model in zip(robots, models, strict=True)
    ]
    found = evaluate(("numbers.js", "algebra.js", "story.js"), POSES, given)

    for robot, model, poses in zip(robots, models, found, strict=True):
        expected = reference.frames(robot, joints(robot))
        near = 1e-12 * max(1.0, reach(robot))
        for place, each in enumerate(poses):
            own = np.array(each[0]).reshape(-1, 4, 4)
            for row, pose in zip(robot.rows, own, strict=False):
                np.testing.assert_allclose(pose, expected[row.name][place], atol=near, err_msg=robot.name)
            if robot.is_arm:
                for table, frames in zip(model["tables"], each, strict=True):
                    tool = np.array(frames[-1]).reshape(4, 4)
                    np.testing.assert_allclose(tool, expected["tool"][place], atol=near, err_msg=table["title"])


@needs_node
def test_closed_forms_have_the_poses_of_the_reference() -> None:
    robots = [load(ROBOTS / f"{name}.yaml") for name in NAMES]
    forms = [formula_model(robot) for robot in robots]
    given = [{"form": form, "q": joints(robot).tolist()} for robot, form in zip(robots, forms, strict=True)]
    found = evaluate(
        (
            "numbers.js",
            "algebra.js",
        ),
        FORMS,
        given,
    )

    for robot, poses in zip(robots, found, strict=True):
        expected = reference.frames(robot, joints(robot))
        for place, tips in enumerate(poses):
            for tip, pose in zip(robot.tips, tips, strict=True):
                near = 1e-12 * max(1.0, reach(robot))
                np.testing.assert_allclose(
                    np.reshape(pose, (4, 4)), expected[tip][place], atol=near, err_msg=robot.name
                )


@pytest.mark.parametrize(
    ("name", "conventions"),
    [
        ("puma560", ["modified", "standard"]),
        ("ur5", ["standard", "modified"]),
        ("scara", ["modified_prev_d", "standard", "modified"]),
        ("blocks", ["ets"]),
    ],
)
def test_the_own_table_is_first_and_the_others_follow(name: str, conventions: list[str]) -> None:
    assert [table["convention"] for table in rows_model(load(ROBOTS / f"{name}.yaml"))["tables"]] == conventions


def test_links_and_joints_of_a_file_are_shown_as_what_they_are() -> None:
    own, *_ = rows_model(load(ROBOTS.parent / "docs" / "examples" / "elbow_arm.urdf"))["tables"]

    assert (own["title"], own["product"]) == ("elementary transforms", "from left to right")


def test_a_row_has_its_steps_in_the_order_of_its_convention() -> None:
    modified, standard = rows_model(load(ROBOTS / "puma560.yaml"))["tables"]

    assert [step["kind"] for step in modified["rows"][2]["steps"]] == ["Rx", "Tx", "Rz", "Tz"]
    assert [step["kind"] for step in standard["rows"][2]["steps"]] == ["Rz", "Tz", "Tx", "Rx"]
    assert [step["value"] for step in modified["rows"][2]["steps"]] == [0.0, 0.4318, ["q", 2], 0.15005]
    assert modified["columns"] == [["alpha", "i\u22121"], ["a", "i\u22121"], ["d", "i"], ["theta", "i"]]


def test_terms_of_the_closed_form_name_the_joints_that_they_hold() -> None:
    form = formula_model(load(ROBOTS / "puma560.yaml"))
    joints = {angle["label"]: angle["joints"] for angle in form["angles"]}

    assert joints["23"] == [1, 2]
    assert joints["1"] == [0]
    assert [each["name"] for each in form["parameters"]] == ["a2", "a3", "d3", "d4"]
    text = json.dumps(form["products"][0]["factors"][0]["entries"][0][3]["terms"])
    assert '["term", "c23", ["msub", ["mi", "c"], ["mn", "23"]]]' in text


@pytest.mark.parametrize("name", ["panda", "calibrated_2r", "anthropomorphic_wrist", "differential_wrist", "screw"])
def test_pieces_of_an_entry_are_the_entry(name: str) -> None:
    """Long products are broken inside their brackets; nothing is lost and nothing is added."""
    robot = load(ROBOTS / f"{name}.yaml")
    form = closed_form(robot, robot.root, robot.tips[0])

    for entry in (entry for row in form.entries for entry in row):
        texts = ["".join(_texts(piece)) for piece in pieces(entry)]
        assert "".join(texts).replace(TIMES, "") == "".join(_texts(math_list(MARKED.entry(entry)))).replace(TIMES, "")
        assert max(len(text.replace(TIMES, "")) for text in texts) <= 40


def _texts(math: list[Any]) -> list[str]:
    inside = math[2:] if math[0] == "term" else math[1:]
    return [text for each in inside for text in ([each] if isinstance(each, str) else _texts(each))]


def test_mathml_is_lists_of_text() -> None:
    assert math_list(MARKED.symbol("23", "cosine")) == ["term", "c23", ["msub", ["mi", "c"], ["mn", "23"]]]
    assert math_list("<mn>2</mn><mo>+</mo>") == ["mrow", ["mn", "2"], ["mo", "+"]]
    assert math_list("<mtext>a &lt;b&gt;</mtext>") == ["mtext", "a <b>"]


def test_a_decimal_that_is_added_is_shown() -> None:
    rows = "  - {name: J1, theta: q, d: 0.177, a: 0.175, alpha: 0}\n  - {name: J2, theta: 0, d: q, a: 0, alpha: 180}\n"
    robot = loads(
        f"kinegen: 1\nname: lift\nconvention: standard\nunits: {{length: m, angle: deg}}\njoints:\n{rows}", "lift.yaml"
    )
    height = closed_form(robot, robot.root, robot.tips[0]).entries[2][3]

    assert pieces(height) == [["mn", "0.177"], ["mrow", ["mo", "+"], math_list(MARKED.symbol("q2", "variable"))]]


def test_text_between_elements_of_mathml_is_an_error() -> None:
    """A browser would not show it."""
    for markup in ("0.177", "0.177<mo>+</mo>", "<mo>+</mo>0.177"):
        with pytest.raises(ValueError, match=r"0\.177"):
            math_list(markup)


def test_a_long_table_is_shown_in_its_own_convention_alone() -> None:
    rows = "\n".join(f"  - {{name: j{number}, theta: q, d: 0.1, a: 0.2, alpha: 90}}" for number in range(70))
    robot = loads(
        f"kinegen: 1\nname: chain\nconvention: standard\nunits: {{length: m, angle: deg}}\njoints:\n{rows}\n",
        "long.yaml",
    )
    model = rows_model(robot)

    assert [table["convention"] for table in model["tables"]] == ["standard"]
    assert model["missing"] == ["the modified table is left out: the robot has more than 64 rows"]
    assert formula_model(robot) == {"missing": "the closed form of 70 rows is too long to be shown beside the arm"}
