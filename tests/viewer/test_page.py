"""Pages of `kinegen view` as text: what they contain, what they let run, and how large they are."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kinegen.errors import KinegenError
from kinegen.io.load import load
from kinegen.model.outputs import parse_quantity
from kinegen.model.robot import Robot
from kinegen.tools.viewer.document import SCRIPTS, ViewOptions, closed_script, embedded, page
from kinegen.verify import reference
from tests.viewer.pages import HOSTILE, MARKUP, ROBOTS, ROOT, VENDOR, model_of, read

LARGEST = 1_500_000


@pytest.fixture(scope="module")
def seven() -> str:
    """The page of an arm with seven joints."""
    return page(load(ROBOTS / "iiwa14.yaml"), ViewOptions())


@pytest.fixture(scope="module")
def hostile(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("hostile") / "<b>&.yaml"
    path.write_text(HOSTILE, encoding="utf-8")
    return page(load(path), ViewOptions())


def test_a_page_of_seven_joints_is_small(seven: str) -> None:
    assert len(seven.encode()) <= LARGEST


def test_the_same_robot_gives_the_same_page(seven: str) -> None:
    assert page(load(ROBOTS / "iiwa14.yaml"), ViewOptions()) == seven


def test_nothing_is_loaded(seven: str) -> None:
    for tag, attributes in read(seven).elements:
        addresses = [attributes[name] for name in ("src", "href", "action", "data") if name in attributes]
        assert all(address == "data:," for address in addresses), tag
    assert not re.search(r"@import|url\(", read(seven).texts["style"])


def digest(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


@pytest.mark.parametrize("name", ["seven", "hostile"])
def test_the_policy_allows_this_script_and_style_alone(name: str, request: pytest.FixtureRequest) -> None:
    found = read(request.getfixturevalue(name))
    (policy,) = [each["content"] for tag, each in found.elements if tag == "meta" and "http-equiv" in each]
    rules = dict(rule.split(" ", 1) for rule in str(policy).split("; "))

    assert rules["default-src"] == "'none'"
    assert rules["script-src"] == digest(found.texts["script"])
    assert rules["style-src"] == digest(found.texts["style"])
    assert rules["base-uri"] == rules["form-action"] == "'none'"
    assert "unsafe" not in str(policy)


def test_markup_of_a_file_adds_no_element(hostile: str, seven: str) -> None:
    def names(text: str) -> list[str]:
        return [tag for tag, _ in read(text).elements]

    assert names(hostile) == names(seven)
    assert model_of(hostile)["description"] == MARKUP
    assert MARKUP not in hostile


def test_data_have_no_bracket_and_no_number_that_json_lacks() -> None:
    text = embedded({"a": MARKUP, "b": [1.5]})

    assert not set("<>&") & set(text)
    assert json.loads(text) == {"a": MARKUP, "b": [1.5]}
    with pytest.raises(ValueError, match="not JSON compliant"):
        embedded({"a": float("nan")})


def test_a_script_has_nothing_that_ends_it() -> None:
    text = closed_script('const a = "</ScRiPt x><!-- <script>";')

    assert not re.search(r"<(/script|script|!--)", text, re.IGNORECASE)
    assert text.replace("\\", "") == 'const a = "</ScRiPt x><!-- <script>";'


def test_every_script_of_the_folder_is_used_and_the_start_is_last() -> None:
    files = {path.name for path in (ROOT / "templates" / "viewer").glob("*.js")}

    assert files == set(SCRIPTS)
    assert SCRIPTS[-1] == "start.js"


def test_scripts_make_no_markup_and_evaluate_no_text() -> None:
    forbidden = re.compile(
        r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\b|new Function|fetch\(|https?:"
    )
    for name in SCRIPTS:
        text = (ROOT / "templates" / "viewer" / name).read_text(encoding="utf-8")
        # The name of MathML looks like an address, and nothing is fetched from there.
        assert not forbidden.search(text.replace("http://www.w3.org/1998/Math/MathML", "")), name


def test_three_js_is_the_recorded_one() -> None:
    record = json.loads((VENDOR / "three.json").read_text(encoding="utf-8"))
    content = (VENDOR / "three.js").read_bytes()

    assert hashlib.sha256(content).hexdigest() == record["sha256"], "make it anew: python scripts/get_three.py"
    assert f'"{record["version"].split(".")[1]}"'.encode() in content  # its REVISION
    assert record["licence"] == "MIT"
    assert "MIT" in (VENDOR / "three.LICENSE").read_text(encoding="utf-8")


# The data -------------------------------------------------------------------------------------------------------------


def value_of(tree: Any, q: list[float], parameters: list[float]) -> float:
    """An expression of a page, as its script evaluates it."""
    if not isinstance(tree, list):
        return float(tree)
    operation, *rest = tree
    if operation in ("q", "p"):
        return (q if operation == "q" else parameters)[rest[0]]
    if operation == "^":
        return float(value_of(rest[0], q, parameters) ** rest[1])
    values = [value_of(each, q, parameters) for each in rest]
    functions = {"+": sum, "*": np.prod, "atan2": lambda pair: np.arctan2(*pair)}
    if operation in functions:
        return float(functions[operation](values))
    return float({"sqrt": np.sqrt, "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan}[operation](*values))


def elementary(kind: str, value: float) -> np.ndarray:
    """One elementary transform."""
    made, axis = np.eye(4), "xyz".index(kind[1])
    if kind[0] == "T":
        made[axis, 3] = value
        return made
    i, j = (axis + 1) % 3, (axis + 2) % 3
    made[i, i] = made[j, j] = np.cos(value)
    made[j, i] = np.sin(value)
    made[i, j] = -made[j, i]
    return made


def frames_of(model: dict[str, Any], q: list[float]) -> dict[str, np.ndarray]:
    """Every frame of a page, from the elementary transforms in its data."""
    parameters = [each["value"] for each in model["parameters"]]

    def product(steps: list[Any], start: np.ndarray) -> np.ndarray:
        for step in steps:
            start = start @ elementary(step["kind"], value_of(step["value"], q, parameters))
        return start

    found: dict[str, np.ndarray] = {}
    first = product(model["base"], np.eye(4))
    for row in model["rows"]:
        found[row["name"]] = product(row["steps"], found.get(row["parent"], first))
    for frame in model["frames"]:
        if "steps" in frame:
            found[frame["name"]] = product(frame["steps"], found.get(frame["parent"], np.eye(4)))
    return found


def reach(robot: Robot) -> float:
    return max(1.0, *(float(np.abs(m).max()) for m in reference.frames(robot, np.ones(robot.dof)).values()))


@pytest.mark.parametrize(
    "name",
    [
        "puma560",
        "ur5",
        "scara",
        "hand",
        "motoman_l3",
        "calibrated_2r",
        "palletiser",
        "rrr_nonplanar_5",
        "standard_frames",
    ],
)
def test_the_steps_of_the_rows_lead_to_the_frames(name: str) -> None:
    from kinegen.tools.viewer.data import robot_data
    from kinegen.tools.viewer.document import page_kernels

    robot = load(ROBOTS / f"{name}.yaml")
    model = json.loads(embedded(robot_data(page_kernels(robot))))
    q = np.random.default_rng(3).uniform(-1, 1, robot.dof)

    found, expected = frames_of(model, list(q)), reference.frames(robot, q)

    assert [frame["name"] for frame in model["frames"]] == list(robot.frame_names)
    for frame in robot.frame_names:
        assert np.abs(found[frame] - expected[frame][0]).max() < 1e-12 * reach(robot), frame


def test_joints_have_units_limits_home_and_followers() -> None:
    from kinegen.tools.viewer.data import robot_data
    from kinegen.tools.viewer.document import page_kernels

    data = robot_data(page_kernels(load(ROBOTS / "hand.yaml")))
    by_name = {joint["name"]: joint for joint in data["joints"]}

    assert by_name["index_2"]["followers"] == ["index_3"]
    assert by_name["thumb_1"]["limits"] == pytest.approx([0, np.pi / 3])
    assert by_name["thumb_1"]["home"] == 0
    assert len(data["tips"]) == 5


def test_a_page_opens_with_every_joint_on_its_slider_and_actuators_to_match() -> None:
    from kinegen.tools.viewer.data import robot_data
    from kinegen.tools.viewer.document import page_kernels

    data = robot_data(page_kernels(load(ROBOTS / "motoman_l3.yaml")))

    for each in (*data["joints"], *data["actuators"]):
        assert each["range"][0] <= each["home"] <= each["range"][1], each["name"]


SWING = """\
<robot name="swing">
  <link name="ground"/>
  <link name="bar"><visual><geometry><mesh filename="package://swing/bar.stl"/></geometry></visual></link>
  <joint name="hinge" type="continuous">
    <parent link="ground"/><child link="bar"/><origin xyz="0 0 0.5"/><axis xyz="0 1 0"/>
  </joint>
</robot>
"""


def test_a_page_names_the_conventions_of_its_rows_and_says_what_has_links(tmp_path: Path) -> None:
    from kinegen.tools.viewer.data import robot_data
    from kinegen.tools.viewer.document import page_kernels
    from kinegen.tools.viewer.panels import rows_model

    path = tmp_path / "swing.urdf"
    path.write_text(SWING, encoding="utf-8")
    urdf = load(path)
    data, (own, *others) = robot_data(page_kernels(urdf)), rows_model(urdf)["tables"]

    assert (data["conventions"], data["links"]) == (["ets"], True)
    assert (own["own"], own["title"], own["product"]) == (True, "elementary transforms", "from left to right")
    assert [table["title"] for table in others] == ["standard DH", "modified DH"]
    table = robot_data(page_kernels(load(ROBOTS / "planar_3r.yaml")))
    assert (table["conventions"], table["links"]) == (["modified"], False)


OLD_WORDS = re.compile(
    r"Oblique|See through|Drag the tip|Also |\bwish|[Hh]alf axes|Rotation ellipsoid|the tip\b|the way of"
)


def test_scripts_use_the_words_of_the_field() -> None:
    for name in SCRIPTS:
        text = (ROOT / "templates" / "viewer" / name).read_text(encoding="utf-8")
        shown = re.findall(r"\"[^\"\n]*\"|`[^`\n]*`", re.sub(r"(?m)^\s*(//|\*|/\*).*$", "", text))
        assert [each for each in shown if OLD_WORDS.search(each)] == [], name


def test_vectors_are_those_of_the_reference(seven: str) -> None:
    model, robot = model_of(seven), load(ROBOTS / "iiwa14.yaml")
    checks = model["checks"]
    (fk,) = [each for each in checks["kernels"] if each["name"] == "fk"]

    assert len(checks["inputs"]["q"]) == 16
    for q, row in zip(checks["inputs"]["q"], fk["results"][0]["rows"], strict=True):
        (exact,) = reference.pose_mp(robot, q)
        assert [float(exact[i, j]) for i in range(3) for j in range(4)] == pytest.approx(row, abs=1e-16)


# Options --------------------------------------------------------------------------------------------------------------


def test_outputs_are_added_and_a_search_is_refused() -> None:
    robot = load(ROBOTS / "scara.yaml")
    more = page(robot, ViewOptions(outputs=(parse_quantity("quaternion_wxyz"),)))

    assert "quaternion_wxyz" in model_of(more)["kernels"]
    with pytest.raises(KinegenError, match="not an output of a page"):
        page(robot, ViewOptions(outputs=(parse_quantity("numeric_inverse"),)))


def test_an_inverse_is_added_where_there_is_one() -> None:
    def kernels(name: str) -> list[str]:
        found: list[str] = model_of(page(load(ROBOTS / f"{name}.yaml"), ViewOptions()))["kernels"]
        return found

    assert "inverse" in kernels("scara")
    assert "inverse" not in kernels("iiwa14")
    assert {"actuators_to_joints", "joints_to_actuators"} <= set(kernels("palletiser"))


def test_a_robot_without_joints_has_a_page(tmp_path: Path) -> None:
    model = model_of(page(load(ROBOTS / "blocks.yaml"), ViewOptions()))

    assert model["joints"] == []
    assert model["size"] > 0
