"""How the page is laid out: what is in view, what is grouped, and that nothing is cut, on desks and phones."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kinegen.io.load import load
from kinegen.tools.viewer.document import ViewOptions, page
from tests.browser.conftest import Open, settle
from tests.viewer.test_page import SWING

PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}

IN_VIEW = """() => {
  const { camera, THREE } = window.kinegen.three;
  camera.updateMatrixWorld();
  return Math.max(...window.kinegen.frames().map((m) => {
    const { x, y } = new THREE.Vector3(m[3], m[7], m[11]).project(camera);
    return Math.max(Math.abs(x), Math.abs(y));
  }));
}"""
"""The largest coordinate of a frame in the picture, whose edges are at 1."""


LABELS = """() => {
  const { camera, THREE } = window.kinegen.three;
  const { left, top, width, height } = document.getElementById("stage").getBoundingClientRect();
  return [...document.querySelectorAll("#labels .label:not([hidden])")].map((label) => {
    const m = window.kinegen.frame(label.textContent);
    const { x, y } = new THREE.Vector3(m[3], m[7], m[11]).project(camera);
    const box = label.getBoundingClientRect();
    const across = Math.max(box.left - left - (0.5 + x / 2) * width, (0.5 + x / 2) * width - box.right + left, 0);
    return Math.max(across, Math.abs((box.top + box.bottom) / 2 - top - (0.5 - y / 2) * height));
  });
}"""
"""How far each name is from the origin of its frame, in pixels."""


def set_joints(shown: Any, q: list[float]) -> None:
    shown.evaluate("(q) => window.kinegen.setJoints(q, 'test')", q)
    settle(shown)


def camera(shown: Any) -> list[float]:
    found: list[float] = shown.evaluate("() => window.kinegen.three.camera.position.toArray()")
    return found


# The view -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["puma560", "kr5", "scara", "panda"])
def test_the_arm_stays_in_view_as_it_moves(open_page: Open, name: str) -> None:
    shown = open_page(name)
    joints = shown.evaluate("() => window.kinegen.model.joints.map((each) => each.range)")
    low, high = np.array(joints).T
    for share in np.random.default_rng(4).uniform(0, 1, (12, len(joints))):
        set_joints(shown, (low + share * (high - low)).tolist())
        assert shown.evaluate(IN_VIEW) < 1


def test_a_detail_that_somebody_looks_at_stays_where_it_is(open_page: Open) -> None:
    shown = open_page("puma560")
    shown.locator("#canvas").focus()
    for _ in range(12):
        shown.keyboard.press("+")
    settle(shown)
    before = camera(shown)
    assert shown.evaluate(IN_VIEW) > 1
    set_joints(shown, [1.5, -1.5, 0.5, 0, 0, 0])

    assert camera(shown) == before


def test_a_view_that_has_grown_shrinks_at_fit_alone(open_page: Open) -> None:
    shown = open_page("puma560")
    first = camera(shown)
    set_joints(shown, [0, -1.5, 1.5, 0, 0, 0])
    grown = camera(shown)
    assert np.linalg.norm(grown) > np.linalg.norm(first)
    set_joints(shown, [0] * 6)
    assert camera(shown) == grown
    shown.locator("#tools button", has_text="Fit").click()
    settle(shown)
    assert camera(shown) != grown


def test_a_motoman_opens_within_its_sliders_and_above_the_ground(open_page: Open) -> None:
    shown = open_page("motoman_l3")

    assert shown.locator(".slider.outside").count() == 0
    assert min(shown.evaluate("() => window.kinegen.frames().map((m) => m[11])")) >= 0
    for button in ("Random", "Random", "Random"):
        shown.locator("#joints button", has_text=button).click()
        assert shown.locator(".slider.outside").count() == 0
        assert shown.locator("#actuators .note").inner_text() == ""


# The arm --------------------------------------------------------------------------------------------------------------

DRUMS = """() => Object.fromEntries([...window.kinegen.housings].map(([name, each]) =>
  [name, { radius: each.radius, height: each.height, shift: each.shift }]))"""


def test_drums_of_a_wrist_move_apart_along_their_axes(open_page: Open) -> None:
    """The fourth has the forearm to move onto, the sixth the flange."""
    drums = open_page("tx60").evaluate(DRUMS)
    fourth, fifth, sixth = list(drums.values())[3:]

    assert fifth["shift"] == 0
    assert min(abs(fourth["shift"]), abs(sixth["shift"])) > 0.5 * fifth["radius"]


@pytest.mark.parametrize("name", ["puma560", "kr5", "ur5", "panda", "stanford"])
def test_drums_are_slimmer_than_the_arm_is_long(open_page: Open, name: str) -> None:
    shown = open_page(name)
    size = shown.evaluate("() => window.kinegen.size")

    for drum in shown.evaluate(DRUMS).values():
        assert 2 * drum["radius"] < 0.075 * size
        assert drum["height"] < 0.13 * size


def test_the_gripper_is_clear_of_the_colour_of_the_drums(open_page: Open) -> None:
    shown = open_page("puma560")
    for theme in ("light", "dark"):
        shown.evaluate("(theme) => window.kinegen.setTheme(theme)", theme)
        colours = shown.evaluate("() => window.kinegen.colours()")
        tool, joint = (
            np.mean([int(colours[name][place : place + 2], 16) for place in (1, 3, 5)]) for name in ("tool", "joint")
        )
        assert tool - joint > 40


# Controls -------------------------------------------------------------------------------------------------------------


def test_what_moves_the_camera_is_apart_from_what_is_shown(open_page: Open) -> None:
    groups = open_page("scara", viewport={"width": 1400, "height": 900}).locator("#tools [role=group]")

    assert groups.count() == 2
    assert groups.nth(0).locator("button").all_inner_texts() == ["Fit", "Front", "Top", "Isometric"]
    assert groups.nth(0).locator("[aria-pressed]").count() == 0
    assert groups.nth(1).locator("button[aria-pressed]").all_inner_texts() == ["Frames", "Labels", "X-ray", "Dark"]
    one, other = groups.nth(0).bounding_box(), groups.nth(1).bounding_box()
    assert other["x"] - one["x"] - one["width"] > 8


FILLED = "(each) => ['--from', '--to', '--zero'].map((name) => Number(each.style.getPropertyValue(name)))"


def test_sliders_are_filled_from_zero(open_page: Open) -> None:
    shown = open_page("puma560")
    first = shown.locator(".slider input[type=range]").nth(0)
    assert first.evaluate(FILLED) == [0.5, 0.5, 0.5]
    for degrees, wanted in ((80, [0.5, 0.75, 0.5]), (-80, [0.25, 0.5, 0.5]), (400, [0.5, 1, 0.5])):
        shown.locator("#value-joint-0").fill(str(degrees))
        assert first.evaluate(FILLED) == pytest.approx(wanted)
    # From -225 to 45 degrees zero is at five sixths.
    assert shown.locator(".slider input[type=range]").nth(1).evaluate(FILLED)[2] == pytest.approx(5 / 6)


def test_radio_buttons_are_at_the_height_of_their_words(open_page: Open) -> None:
    shown = open_page("scara")
    middles = """(label) => {
      const words = document.createRange();
      words.selectNodeContents(label.lastChild);
      return [label.firstChild, words].map((each) => {
        const { top, bottom } = each.getBoundingClientRect();
        return (top + bottom) / 2;
      });
    }"""
    for unit in ("deg", "rad"):
        radio, words = shown.locator(f"label[for=unit-{unit}]").evaluate(middles)
        assert radio == pytest.approx(words, abs=1.5)


def test_the_badge_says_what_it_counts(open_page: Open) -> None:
    assert open_page("scara").locator("#badge").inner_text().startswith("✓ verified: 16/16 test poses")


def test_a_hint_says_how_to_move_the_view_until_it_is_moved(open_page: Open) -> None:
    shown = open_page("scara")
    hint = shown.locator("#hint")
    assert hint.inner_text() == "Drag to rotate, right-drag to pan, scroll to zoom."
    box = shown.locator("#canvas").bounding_box()
    shown.mouse.move(box["x"] + 40, box["y"] + 40)
    shown.mouse.down()
    shown.mouse.move(box["x"] + 90, box["y"] + 60)
    shown.mouse.up()

    assert not hint.is_visible()


def test_a_urdf_says_that_its_meshes_are_not_drawn(open_page: Open, tmp_path: Path) -> None:
    robot, target = tmp_path / "swing.urdf", tmp_path / "swing.html"
    robot.write_text(SWING, encoding="utf-8")
    target.write_text(page(load(robot), ViewOptions()), encoding="utf-8")
    shown = open_page(target)

    assert shown.locator("#about").inner_text() == "Drawn from the joints, without the meshes of the file."
    assert "standard" not in shown.locator("#table .dh").first.inner_text()
    assert "meshes" not in open_page("scara").locator("#about").inner_text()


@pytest.mark.parametrize("width", [340, 390, 800, 1400])
def test_names_of_branches_are_broken_behind_commas_alone(open_page: Open, width: int) -> None:
    shown = open_page("puma560", viewport={"width": width, "height": 900})
    shown.evaluate("() => (document.getElementById('inverse').open = true)")
    settle(shown)
    parts = shown.locator("#branches button span")

    assert parts.count() == 24
    assert parts.evaluate_all("(parts) => parts.map((each) => each.getClientRects().length)") == [1] * 24
    assert shown.locator("#branches button").first.inner_text() == "shoulder left, elbow up, wrist no-flip"


# A phone --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["puma560", "hand", "panda"])
def test_names_of_frames_are_near_them_and_not_cut_at_the_edges(open_page: Open, name: str) -> None:
    shown = open_page(name, **PHONE)
    far = shown.evaluate(LABELS)
    assert far
    assert max(far) < 50
    boxes = shown.locator("#labels .label:not([hidden])").evaluate_all(
        "(all) => all.map((each) => { const { left, right } = each.getBoundingClientRect(); return [left, right]; })"
    )

    assert boxes
    assert min(left for left, _ in boxes) >= 0
    assert max(right for _, right in boxes) <= 390


@pytest.mark.parametrize(("width", "theme"), [(360, "dark"), (390, "light"), (430, "dark")])
def test_a_phone_has_one_row_of_buttons_under_a_short_title(open_page: Open, width: int, theme: str) -> None:
    options: dict[str, Any] = {**PHONE, "viewport": {"width": width, "height": 844}}
    shown = open_page("puma560", theme=theme, **options)
    boxes = [each.bounding_box() for each in shown.locator("#tools button").all()]

    assert len({round(box["y"]) for box in boxes}) == 1
    assert max(box["x"] + box["width"] for box in boxes) <= width
    assert shown.locator("#top").bounding_box()["height"] < 100
    assert "finger" in shown.locator("#hint").inner_text()
    assert shown.evaluate("() => document.documentElement.scrollWidth <= window.innerWidth")
