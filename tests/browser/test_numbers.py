"""What the page says: poses, orientations, texts to copy, the check of its kernels, links, and hostile files."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from kinegen.io.load import load
from kinegen.verify import reference
from tests.browser.conftest import Open, settle
from tests.viewer.pages import MARKUP, ROBOTS, with_wrong_kernel


def copied(shown: Any, what: str, language: str) -> str:
    """The text that the page offers for copying."""
    if shown.locator("#copy").get_attribute("open") is None:
        shown.locator("#copy summary").click()
    shown.locator("#copy-what").select_option(what)
    shown.locator("#copy-language").select_option(language)
    return str(shown.locator("#copy-text").input_value())


def numbers(text: str) -> np.ndarray:
    """The numbers of a list in Python, C or YAML, without comments and sizes."""
    inside = re.sub(r"#.*|/\*.*?\*/|^[^=:]*[=:]", "", text)
    return np.array([float(word) for word in re.findall(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?", inside)])


@pytest.mark.parametrize("name", ["puma560", "ur5", "scara", "human_body", "puma560_mm", "iiwa14"])
def test_the_pose_text_is_that_of_the_reference(open_page: Open, name: str) -> None:
    robot = load(ROBOTS / f"{name}.yaml")
    shown = open_page(name)
    for q in np.random.default_rng(5).uniform(-1, 1, (3, robot.dof)):
        shown.evaluate("(q) => window.kinegen.setJoints(q, 'test')", list(q))
        (expected,) = reference.pose(robot, q)[0]
        scale = max(1.0, float(np.abs(expected).max()))

        for language in ("python", "c", "yaml"):
            assert np.array_equal(numbers(copied(shown, "joints", language)), q)
            found = numbers(copied(shown, "pose", language)).reshape(4, 4)
            assert np.abs(found - expected).max() < 1e-12 * scale


def test_texts_to_copy_are_what_they_say(open_page: Open) -> None:
    shown = open_page("scara", "#q=0.5,-0.25,0.125")
    names: dict[str, Any] = {}
    exec(copied(shown, "pose", "python") + "\n" + copied(shown, "joints", "python"), names)  # noqa: S102
    assert names["q"] == [0.5, -0.25, 0.125]
    assert np.array(names["base_T_tool"]).shape == (4, 4)
    assert yaml.safe_load(copied(shown, "pose", "yaml"))["base_T_tool"] == names["base_T_tool"]
    assert yaml.safe_load(copied(shown, "joints", "yaml")) == {"q": [0.5, -0.25, 0.125]}
    assert copied(shown, "joints", "c") == "const double q[3] = {0.5, -0.25, 0.125}; /* rad and m */"


ROTATIONS = """(matrices) => matrices.map((m) => {
  const { quaternion, rotationVector, rollPitchYaw, eulerZyz } = window.kinegen.orientation;
  return [quaternion(m), rotationVector(m), rollPitchYaw(m), eulerZyz(m)];
})"""


def test_orientations_give_the_rotation_back(open_page: Open) -> None:
    shown = open_page("spherical_joint")
    generator = np.random.default_rng(8)
    turns = [np.linalg.qr(generator.normal(size=(3, 3)))[0] for _ in range(100)]
    turns = [turn * np.sign(np.linalg.det(turn)) for turn in turns]
    turns += [np.diag(signs) for signs in ([1.0, 1, 1], [1.0, -1, -1], [-1.0, 1, -1], [-1.0, -1, 1])]
    turns += [np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]), np.array([[0.0, 0, -1], [1, 0, 0], [0, -1, 0]])]
    matrices = [np.block([[turn, np.zeros((3, 1))], [0, 0, 0, 1]]) for turn in turns]

    found = shown.evaluate(ROTATIONS, [list(map(float, matrix.ravel())) for matrix in matrices])

    for turn, (quaternion, vector, rpy, zyz) in zip(turns, found, strict=True):
        assert np.abs(from_quaternion(quaternion) - turn).max() < 1e-13
        assert np.abs(from_vector(np.array(vector)) - turn).max() < 1e-13
        assert np.abs(about(2, rpy[2]) @ about(1, rpy[1]) @ about(0, rpy[0]) - turn).max() < 1e-13
        assert np.abs(about(2, zyz[0]) @ about(1, zyz[1]) @ about(2, zyz[2]) - turn).max() < 1e-13
        assert quaternion[0] >= 0
        assert np.linalg.norm(vector) <= np.pi + 1e-15
        assert abs(rpy[1]) <= np.pi / 2 + 1e-15
        assert 0 <= zyz[1] <= np.pi


def about(axis: int, angle: float) -> np.ndarray:
    made = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    made[i, i] = made[j, j] = np.cos(angle)
    made[j, i] = np.sin(angle)
    made[i, j] = -made[j, i]
    return made


def from_quaternion(quaternion: list[float]) -> np.ndarray:
    w, x, y, z = quaternion
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * w * cross + 2 * cross @ cross


def from_vector(vector: np.ndarray) -> np.ndarray:
    angle = float(np.linalg.norm(vector))
    half = np.array([np.cos(angle / 2), *(vector * (np.sin(angle / 2) / angle if angle else 0.5))])
    return from_quaternion(list(half))


def test_every_frame_can_be_read(open_page: Open) -> None:
    robot = load(ROBOTS / "hand.yaml")
    shown = open_page("hand")
    expected = reference.frames(robot, [joint["home"] for joint in shown.evaluate("() => window.kinegen.model.joints")])
    options = shown.locator("#pose-frame option").all_inner_texts()

    assert sorted(options) == sorted(robot.frame_names)
    for name in ("index_3", "little_tip", "thumb_root"):
        shown.locator("#pose-frame").select_option(name)
        found = numbers(copied(shown, "pose", "yaml").partition(":")[2]).reshape(4, 4)
        assert np.abs(found - expected[name][0]).max() < 1e-12 * 200


# The check of the kernels ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["puma560", "calibrated_2r", "motoman_l3", "palletiser", "hand"])
def test_the_kernels_of_a_page_are_right(open_page: Open, name: str) -> None:
    badge = open_page(name).locator("#badge")

    assert badge.get_attribute("class") == "right"
    assert "verified: 16/16" in badge.inner_text()


def test_a_wrong_kernel_is_red(open_page: Open, pages: Callable[[str], Path], tmp_path: Path) -> None:
    path = tmp_path / "wrong.html"
    path.write_text(with_wrong_kernel(pages("puma560").read_text(encoding="utf-8")), encoding="utf-8")
    badge = open_page(path).locator("#badge")

    assert badge.get_attribute("class") == "wrong"
    assert badge.inner_text().startswith("✗ not verified: ")
    assert "16/16" not in badge.inner_text()
    assert "wrong: fk" in str(badge.get_attribute("title"))


def test_a_wrong_number_among_the_vectors_is_red(open_page: Open, pages: Callable[[str], Path], tmp_path: Path) -> None:
    text = pages("puma560").read_text(encoding="utf-8")
    start = text.index('id="model">') + len('id="model">')
    end = text.index("</script>", start)
    model = json.loads(text[start:end])
    model["checks"]["kernels"][0]["results"][0]["rows"][7][5] += 1e-13
    path = tmp_path / "vector.html"
    path.write_text(text[:start] + json.dumps(model) + text[end:], encoding="utf-8")

    badge = open_page(path).locator("#badge")

    assert badge.get_attribute("class") == "wrong"
    assert badge.inner_text().startswith("✗ not verified: 15/16 test poses")


def test_a_page_whose_script_was_changed_does_not_run(
    browser: Any, pages: Callable[[str], Path], tmp_path: Path
) -> None:
    path = tmp_path / "changed.html"
    path.write_text(pages("scara").read_text(encoding="utf-8").replace("const app = {", "const app = { a: 1,", 1))
    context = browser.new_context(offline=True)
    shown = context.new_page()
    shown.goto(path.as_uri())

    assert shown.evaluate("() => window.kinegen === undefined")
    context.close()


# Links ----------------------------------------------------------------------------------------------------------------


def test_a_link_holds_the_joints(open_page: Open) -> None:
    shown = open_page("puma560", "#q=0.1,-0.2,0.3,-0.4,0.5,-0.6")
    assert shown.evaluate("() => Array.from(window.kinegen.state.q)") == [0.1, -0.2, 0.3, -0.4, 0.5, -0.6]

    shown.locator("#value-joint-1").fill("-30")
    shown.wait_for_function("() => window.location.hash.includes('-0.5235987755982988')")
    assert shown.url.endswith("#q=0.1,-0.5235987755982988,0.3,-0.4,0.5,-0.6")

    shown.evaluate("() => { window.location.hash = '#q=1,1,1,1,1,1'; }")
    shown.wait_for_function("() => window.kinegen.state.q[0] === 1")
    assert shown.locator("#value-joint-0").input_value() == "57.2958"


@pytest.mark.parametrize("fragment", ["#q=1,2", "#q=a,b,c", "#q=NaN,0,0", "#q=1e999,0,0", "#q=", "#q=,,", "#%", "#p=1"])
def test_a_bad_link_is_left_alone(open_page: Open, fragment: str) -> None:
    shown = open_page("scara", fragment)

    assert shown.evaluate("() => Array.from(window.kinegen.state.q)") == [0, 0, 0]
    assert "verified: 16/16" in shown.locator("#badge").inner_text()


def test_a_joint_vector_beyond_the_sines_is_not_drawn_and_comes_back(open_page: Open) -> None:
    shown = open_page("puma560", "#q=1e9,0,0,0,0,0")
    assert "NaN" in shown.locator("#pose .matrix").inner_text()
    shown.locator("#tools button", has_text="Fit").click()
    shown.locator("button", has_text="Home").click()
    settle(shown)

    assert "NaN" not in shown.locator("#pose .matrix").inner_text()
    assert shown.evaluate("() => Number.isFinite(window.kinegen.three.camera.position.x)")


# Hostile files --------------------------------------------------------------------------------------------------------


def test_markup_of_a_file_is_text(open_page: Open) -> None:
    shown = open_page("hostile")

    assert shown.locator("#description").inner_text() == MARKUP
    assert shown.locator("img").count() == 0
    assert shown.locator("b").count() == 0
    assert "verified: 16/16" in shown.locator("#badge").inner_text()
    assert shown.locator("label", has_text="hasOwnProperty").count() == 1
