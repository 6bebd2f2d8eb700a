"""Every control, by mouse and by keyboard."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.browser.conftest import Open, settle

AXE = Path(__file__).parent.parent.parent / "build" / "browser" / "node_modules" / "axe-core" / "axe.min.js"

WAYS = ("mouse", "keyboard")


def joints(shown: Any) -> list[float]:
    found: list[float] = shown.evaluate("() => Array.from(window.kinegen.state.q)")
    return found


def press(shown: Any, way: str, selector: str, text: str = "") -> None:
    """Uses a button."""
    button = shown.locator(selector, has_text=text) if text else shown.locator(selector)
    if way == "mouse":
        button.click()
    else:
        button.focus()
        shown.keyboard.press("Enter")
    settle(shown)


def camera(shown: Any) -> np.ndarray:
    """Where the camera is, and what it looks at."""
    return np.array(
        shown.evaluate("() => [...window.kinegen.three.camera.position, ...window.kinegen.three.controls.target]")
    )


@pytest.mark.parametrize("way", WAYS)
def test_sliders_and_number_fields(open_page: Open, way: str) -> None:
    shown = open_page("puma560")
    slider, field = shown.locator(".slider input[type=range]").nth(0), shown.locator("#value-joint-1")
    if way == "mouse":
        box = slider.bounding_box()
        shown.mouse.click(box["x"] + 0.75 * box["width"], box["y"] + box["height"] / 2)
        assert joints(shown)[0] == pytest.approx(np.radians(80), abs=0.2)
        field.click(click_count=3)
        shown.keyboard.type("-30")
    else:
        slider.focus()
        shown.keyboard.press("ArrowRight")
        assert 0 < joints(shown)[0] < np.radians(1)
        shown.keyboard.press("Home")
        assert joints(shown)[0] == pytest.approx(np.radians(-160))
        field.focus()
        for _ in range(3):
            shown.keyboard.press("Shift+ArrowDown")
    assert joints(shown)[1] == pytest.approx(np.radians(-30))
    assert slider.get_attribute("aria-valuetext").endswith(" deg")


def test_a_value_outside_the_limits_is_marked_and_nonsense_is_left_alone(open_page: Open) -> None:
    shown = open_page("puma560")
    field = shown.locator("#value-joint-0")
    field.fill("170")
    assert field.get_attribute("aria-invalid") == "true"
    assert joints(shown)[0] == pytest.approx(np.radians(170))
    field.fill("")
    assert joints(shown)[0] == pytest.approx(np.radians(170))
    field.fill("160")
    assert field.get_attribute("aria-invalid") == "false"


@pytest.mark.parametrize("way", WAYS)
def test_home_and_random(open_page: Open, way: str) -> None:
    shown = open_page("puma560")
    limits = shown.evaluate("() => window.kinegen.model.joints.map((each) => each.range)")
    press(shown, way, "#joints button", "Random")
    found = joints(shown)
    assert all(low <= value <= high and value != 0 for value, (low, high) in zip(found, limits, strict=True))
    press(shown, way, "#joints button", "Home")
    assert joints(shown) == [0] * 6


@pytest.mark.parametrize("way", WAYS)
def test_degrees_and_radians(open_page: Open, way: str) -> None:
    shown = open_page("scara", "#q=0.5,0,0.125")
    assert shown.locator("#value-joint-0").input_value() == "28.6479"
    if way == "mouse":
        shown.locator("label[for=unit-rad]").click()
    else:
        shown.locator("#unit-deg").focus()
        shown.keyboard.press("ArrowRight")
    assert shown.locator("#value-joint-0").input_value() == "0.5"
    assert shown.locator("#value-joint-2").input_value() == "0.125"
    assert "rad" in shown.locator("#pose .forms").inner_text()
    assert joints(shown) == [0.5, 0, 0.125]


@pytest.mark.parametrize("way", WAYS)
def test_buttons_of_the_picture(open_page: Open, way: str) -> None:
    shown = open_page("puma560")
    for text in ("Front", "Top", "Isometric"):
        before = camera(shown)
        press(shown, way, "#tools button", text)
        assert not np.allclose(camera(shown), before), text
    for text, dark in (("Frames", False), ("Labels", False), ("X-ray", False), ("Dark", True)):
        before = shown.locator("#stage").screenshot()
        button = shown.locator("#tools button", has_text=text)
        pressed = button.get_attribute("aria-pressed")
        press(shown, way, "#tools button", text)
        assert button.get_attribute("aria-pressed") != pressed
        assert shown.locator("#stage").screenshot() != before, text
        assert (shown.evaluate("() => document.documentElement.dataset.theme") == "dark") is dark
    fitted = camera(shown)
    shown.evaluate("() => { window.kinegen.three.camera.position.multiplyScalar(2); }")
    if way == "keyboard":
        shown.locator("#canvas").focus()
        shown.keyboard.press("f")
    else:
        press(shown, way, "#tools button", "Fit")
    settle(shown)
    assert np.linalg.norm(camera(shown)[:3]) == pytest.approx(np.linalg.norm(fitted[:3]), rel=0.25)


def test_orbit_pan_and_zoom_by_mouse(open_page: Open) -> None:
    shown = open_page("puma560")
    box = shown.locator("#canvas").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def drag(button: str) -> None:
        shown.mouse.move(x, y)
        shown.mouse.down(button=button)
        shown.mouse.move(x + 60, y + 20, steps=4)
        shown.mouse.up(button=button)
        settle(shown)

    def distance() -> float:
        position, target = np.split(camera(shown), 2)
        return float(np.linalg.norm(position - target))

    start, far = camera(shown), distance()
    drag("left")
    turned = camera(shown)
    assert np.allclose(turned[3:], start[3:])
    assert not np.allclose(turned[:3], start[:3])
    assert distance() == pytest.approx(far)
    drag("right")
    assert not np.allclose(camera(shown)[3:], turned[3:])
    shown.mouse.wheel(0, -300)
    settle(shown)
    assert distance() < far


def test_the_picture_by_keyboard(open_page: Open) -> None:
    shown = open_page("puma560")
    shown.locator("#canvas").focus()
    start = camera(shown)
    shown.keyboard.press("ArrowLeft")
    panned = camera(shown)
    assert not np.allclose(panned[3:], start[3:])
    shown.keyboard.press("Shift+ArrowLeft")
    turned = camera(shown)
    assert np.allclose(turned[3:], panned[3:])
    assert not np.allclose(turned[:3], panned[:3])
    for key, nearer in (("+", True), ("-", False)):
        before = camera(shown)
        shown.keyboard.press(key)
        after = camera(shown)
        size = np.linalg.norm(after[:3] - after[3:]) / np.linalg.norm(before[:3] - before[3:])
        assert bool(size < 1) is nearer
    shown.evaluate("() => window.kinegen.setJoint(0, 1, 'test')")
    shown.keyboard.press("h")
    assert joints(shown) == [0] * 6


@pytest.mark.parametrize("way", WAYS)
def test_parameters_change_the_arm(open_page: Open, way: str) -> None:
    shown = open_page("calibrated_2r")
    before = shown.evaluate("() => Array.from(window.kinegen.frames().at(-1))")
    field = shown.locator("#parameter-0")
    if way == "mouse":
        field.fill("0.8")
    else:
        field.focus()
        shown.keyboard.press("Control+A")
        shown.keyboard.type("0.8")
    after = shown.evaluate("() => Array.from(window.kinegen.frames().at(-1))")
    assert after[3] - before[3] == pytest.approx(0.8 - 0.4002, abs=1e-3)
    press(shown, way, "#parameters button")
    assert shown.evaluate("() => Array.from(window.kinegen.frames().at(-1))") == before
    assert field.input_value() == "0.4002"


def test_actuators_move_joints_and_follow_them(open_page: Open) -> None:
    shown = open_page("palletiser")
    before = joints(shown)
    slider = shown.locator("#actuators input[type=range]").nth(1)
    slider.focus()
    for _ in range(5):
        shown.keyboard.press("ArrowRight")
    moved = joints(shown)
    assert moved != before
    reading = float(shown.locator("#value-actuator-1").input_value())
    shown.locator("#value-joint-1").fill(str(float(shown.locator("#value-joint-1").input_value()) + 2))
    assert float(shown.locator("#value-actuator-1").input_value()) != reading
    assert shown.locator("#actuators .note").inner_text() == ""


def test_a_linkage_that_does_not_close_is_reported(open_page: Open) -> None:
    shown = open_page("motoman_l3")
    before = joints(shown)
    shown.locator("#value-actuator-1").fill("100000")

    assert "does not close" in shown.locator("#actuators .note").inner_text()
    assert joints(shown) == before


def test_followers_move_along(open_page: Open) -> None:
    shown = open_page("hand")
    place = "() => Array.from(window.kinegen.frame('index_3')).slice(0, 3)"
    before = shown.evaluate(place)
    shown.locator("label", has_text="index_2 (moves index_3 too)").click()
    shown.keyboard.type("60")
    assert shown.evaluate(place) != before


@pytest.mark.parametrize("way", WAYS)
def test_copy(open_page: Open, way: str) -> None:
    shown = open_page("scara", "#q=0.5,0,0")
    shown.context.grant_permissions(["clipboard-read", "clipboard-write"])
    press(shown, way, "#copy summary")
    for text, wanted in (("Copy link", "#q=0.5,0,0"), ("Copy", "")):
        button = shown.locator("#copy button").get_by_text(text, exact=True)
        button.click() if way == "mouse" else button.press("Enter")
        shown.wait_for_function("() => document.querySelector('#copy .note').textContent === 'Copied.'")
        found = shown.evaluate("() => navigator.clipboard.readText()")
        assert found == shown.locator("#copy-text").input_value()
        assert wanted in found


def test_sections_fold_by_keyboard(open_page: Open) -> None:
    shown = open_page("scara")
    for name in ("joints", "pose", "copy"):
        section = shown.locator(f"#{name}")
        was = section.get_attribute("open")
        shown.locator(f"#{name} summary").focus()
        shown.keyboard.press("Space")
        assert section.get_attribute("open") != was


def test_every_control_has_a_name_and_is_reached_by_tab(open_page: Open) -> None:
    shown = open_page("palletiser")
    shown.evaluate("() => document.querySelectorAll('details').forEach((each) => (each.open = true))")
    # What is shown and can be used; of a list with arrow keys, the one entry that Tab goes to.
    controls = """() => [...document.querySelectorAll(
      "button, select, textarea, summary, input[type=range], input[type=number], input:checked, canvas",
    )].filter((each) => each.checkVisibility() && !each.disabled && each.tabIndex >= 0)"""
    count = shown.evaluate(f"() => ({controls})().length")
    reached = set()
    for _ in range(count + 25):
        shown.keyboard.press("Tab")
        reached.add(shown.evaluate(f"() => ({controls})().indexOf(document.activeElement)"))
    assert count > 40
    assert reached >= set(range(count))


@pytest.mark.parametrize(("name", "theme"), [("puma560", "light"), ("palletiser", "dark"), ("calibrated_2r", "dark")])
def test_axe_finds_no_serious_fault(open_page: Open, name: str, theme: str) -> None:
    if not AXE.exists():
        pytest.skip("there is no axe-core; run scripts/install_browser.py build/browser")
    shown = open_page(name, theme=theme)
    shown.locator("#copy summary").click()
    shown.evaluate(AXE.read_text(encoding="utf-8") + ";null")
    found = shown.evaluate(
        "async () => (await axe.run()).violations.map((each) => [each.impact, each.id, each.nodes[0].html])"
    )

    assert [each for each in found if each[0] in ("serious", "critical")] == []


def test_a_narrow_window_shows_everything_below_each_other(open_page: Open) -> None:
    shown = open_page("puma560", viewport={"width": 400, "height": 700})

    assert shown.evaluate("() => document.documentElement.scrollWidth <= window.innerWidth")
    assert shown.locator("#canvas").bounding_box()["height"] > 250
    shown.locator("#value-joint-5").fill("10")
    assert joints(shown)[5] == pytest.approx(np.radians(10))
