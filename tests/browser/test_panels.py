"""The panels of a page, used as a person would: by mouse, by keyboard, without a message on the console."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kinegen.io.load import load
from kinegen.tools.viewer.document import ViewOptions, page
from kinegen.verify import reference
from tests.browser.conftest import Open
from tests.browser.test_controls import AXE
from tests.viewer.pages import ROBOTS

Q = [0.4, -0.7, 0.5, 0.3, 0.6, 0.2]

Opened = Any
Opener = Callable[..., Opened]


@pytest.fixture
def opened(open_page: Open) -> Opener:
    """Opens the page of a robot with one panel unfolded, at some joints."""

    def opener(name: str | Path, panel: str = "", q: list[float] | None = None, **options: Any) -> Opened:
        tab = open_page(name, **options)
        tab.evaluate("(q) => q && kinegen.setJoints(q, 'test')", q)
        only = "(id) => document.querySelectorAll('.panel').forEach((each) => (each.open = each.id === id))"
        tab.evaluate(only, panel)
        tab.evaluate("kinegen.three.fit()")
        return tab

    return opener


@pytest.fixture
def with_points(tmp_path: Path) -> Path:
    """The page of a PUMA with the points that it reaches."""
    path = tmp_path / "points.html"
    path.write_text(page(load(ROBOTS / "puma560.yaml"), ViewOptions(workspace=20_000)), encoding="utf-8")
    return path


def until(tab: Opened, expression: str, seconds: float = 30) -> None:
    """Waits; the policy of the page forbids what Playwright has for this."""
    for _ in range(int(seconds * 20)):
        if tab.evaluate(expression):
            return
        tab.wait_for_timeout(50)
    raise AssertionError(f"never true: {expression}")


def names(tab: Opened) -> list[str]:
    """The names that the panels draw."""
    return list(tab.locator("#marks .label").all_text_contents())


def joints(tab: Opened) -> np.ndarray[Any, Any]:
    return np.array(tab.evaluate("Array.from(kinegen.state.q)"))


def pose(tab: Opened) -> np.ndarray[Any, Any]:
    return np.array(tab.evaluate("Array.from(kinegen.evaluate('fk', kinegen.state.q))")).reshape(-1, 4, 4)[0]


# The table ------------------------------------------------------------------------------------------------------------


def test_a_row_lights_its_frames_and_dimensions_by_mouse(opened: Opener) -> None:
    tab = opened("puma560", "table", Q)
    tab.locator("#table tbody tr").nth(2).hover()

    assert sorted(names(tab)) == ["a = 0.4318 m", "d = 0.15005 m", "{2}", "{3}", "θ = 28.65°"]
    tab.locator("#player").hover()
    assert names(tab) == []


def test_rows_are_reached_by_keyboard_and_stay_lit(opened: Opener) -> None:
    tab = opened("puma560", "table", Q)
    tab.locator("#table button.row").first.focus()
    tab.keyboard.press("ArrowDown")
    assert "α = -90°" in names(tab)
    tab.keyboard.press("ArrowDown")
    assert "a = 0.4318 m" in names(tab)
    tab.keyboard.press("Enter")
    tab.locator("#play-speed").focus()

    assert "a = 0.4318 m" in names(tab)
    tab.evaluate("kinegen.setJoints([0.4, -0.7, 1, 0, 0, 0], 'test')")
    assert "θ = 57.3°" in names(tab)
    tab.evaluate("kinegen.setUnit('rad')")
    assert "θ = 1 rad" in names(tab)


def test_both_tables_of_an_arm_can_be_pointed_at(opened: Opener) -> None:
    tab = opened("puma560", "table", Q)
    tab.get_by_role("button", name="Show standard DH").press("Enter")
    tab.locator("#table .dh").nth(1).locator("button.row").nth(2).focus()

    assert {"a = 0.0203 m", "d = 0.15005 m", "α = -90°"} <= set(names(tab))
    tab.get_by_role("button", name="Show standard DH").click()
    assert not tab.locator("#table .dh").nth(1).is_visible()


@pytest.mark.parametrize(
    ("name", "kinds"),
    [("ur5", ["Rz", "Tz", "Tx", "Rx"]), ("scara", ["Rx", "Rz", "Tx", "Tz"]), ("panda", ["Rx", "Tx", "Rz", "Tz"])],
)
def test_steps_of_a_row_follow_its_convention(opened: Opener, name: str, kinds: list[str]) -> None:
    tab = opened(name, "table")
    tab.locator("#table button.row").first.click()
    found = []
    for _ in kinds:
        tab.get_by_role("button", name="Step").press("Enter")
        assert tab.locator("#table .step").count() == 1
        found.append(re.match(r"\d of 4: (\w\w)", tab.locator("#play-status").text_content())[1])

    assert found == kinds
    assert tab.locator("#play-status").text_content().endswith("; done")
    tab.get_by_role("button", name="Stop").click()
    assert tab.locator("#play-status").text_content() == ""


def test_a_row_plays_pauses_and_goes_on_with_the_next(opened: Opener) -> None:
    tab = opened("planar_3r", "table", [0.3, 0.4, 0.5])
    tab.locator("#play-speed").select_option("2")
    tab.locator("#play-onward").check()
    tab.locator("#play").click()
    until(tab, "document.querySelector('#play-row').textContent.startsWith('Row 2')")
    tab.locator("#play").press("Enter")
    before = names(tab)
    tab.wait_for_timeout(150)

    assert tab.locator("#play").text_content() == "Play"
    assert names(tab) == before
    tab.locator("#play").click()
    until(tab, "document.querySelector('#play-status').textContent.endsWith('done')")
    assert tab.locator("#play-row").text_content().startswith("Row 3")


def test_reduced_motion_shows_whole_steps(opened: Opener) -> None:
    tab = opened("planar_3r", "table", [0.3, 0.4, 0.5], reduced_motion="reduce")
    tab.locator("#table button.row").nth(1).click()
    tab.locator("#play-speed").select_option("2")
    tab.locator("#play").click()
    seen = set()
    for _ in range(40):
        seen |= {each for each in names(tab) if each.startswith(("a", "θ"))}
        tab.wait_for_timeout(100)

    assert seen == {"a = 0.4 m", "θ = 22.92°"}


# The closed form ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["puma560", "iiwa14"])
def test_the_closed_form_shows_the_pose_of_the_kernel(opened: Opener, name: str) -> None:
    robot = load(ROBOTS / f"{name}.yaml")
    q = np.random.default_rng(1).uniform(-1, 1, robot.dof)
    tab = opened(name, "formula", q.tolist())

    expected = reference.frames(robot, q[None])["tool"][0]
    np.testing.assert_allclose(np.array(tab.evaluate("kinegen.closedForm()")).reshape(4, 4), expected, atol=1e-12)
    shown = tab.locator("#formula .form .live").all_text_contents()
    unit = robot.units.length
    assert shown[9:12] == [f"{value + 0:.4f} {unit}" for value in expected[:3, 3].round(4)]


def test_a_term_lights_its_joints_and_a_joint_its_terms(opened: Opener) -> None:
    tab = opened("puma560", "formula", Q)
    tab.locator("#formula .form [data-term=c23]").first.hover()

    lit = "Array.from(document.querySelectorAll('#joints .slider'), (each) => each.classList.contains('lit'))"
    assert tab.evaluate(lit) == [False, True, True, False, False, False]
    assert sorted(names(tab)) == ["elbow", "shoulder"]
    tab.locator("#formula button[data-term=s4]").focus()
    assert tab.evaluate(lit) == [False, False, False, True, False, False]

    tab.evaluate("document.getElementById('joints').open = true")
    tab.locator("#joints .slider").nth(1).hover()
    terms = "[...document.querySelectorAll('#formula [data-term].lit')].map((each) => each.getAttribute('data-term'))"
    assert sorted(set(tab.evaluate(terms))) == ["c2", "c23", "q2", "s2", "s23"]


# The inverse ----------------------------------------------------------------------------------------------------------

GHOSTS = """kinegen.three.overlay.children
    .flatMap((each) => each.children)
    .filter((each) => "branch" in each.userData && each.isGroup)
    .map((each) => each.visible && each.parent.visible)"""


def test_all_branches_of_a_puma_are_drawn(opened: Opener) -> None:
    tab = opened("puma560", "inverse", Q)

    drawn = tab.evaluate(GHOSTS)
    states = tab.locator("#branches .note").all_text_contents()
    assert len(drawn) == len(states) == 8
    assert sum(drawn) == 7
    assert [state for state, ghost in zip(states, drawn, strict=True) if not ghost] == ["current"]
    tab.get_by_role("button", name="All solutions").press("Space")
    assert not any(tab.evaluate(GHOSTS))


def test_a_branch_is_selected_by_mouse_and_by_keyboard(opened: Opener) -> None:
    tab = opened("ur5", "inverse", [0.4, -1.2, 1.0, 0.3, 0.9, 0.2])
    before = pose(tab)
    for index, way in ((2, "mouse"), (5, "keyboard"), (0, "mouse")):
        button = tab.locator("#branches button").nth(index)
        button.click() if way == "mouse" else button.press("Enter")
        assert button.get_attribute("aria-pressed") == "true"
        np.testing.assert_allclose(pose(tab), before, atol=1e-9)
    np.testing.assert_allclose(joints(tab), [0.4, -1.2, 1.0, 0.3, 0.9, 0.2], atol=1e-9)


def test_a_click_on_a_ghost_takes_its_branch(opened: Opener) -> None:
    tab = opened("planar_3r", "inverse", [0.5, 0.9, 0.3])
    middle = """(() => {
        const groups = kinegen.three.overlay.children.flatMap((each) => each.children);
        const group = groups.find((each) => "branch" in each.userData && each.isGroup && each.visible);
        const ball = group.children[0].children.find((each) => each.visible);
        const at = ball.localToWorld(new kinegen.three.THREE.Vector3(0, 0, 0.5)).project(kinegen.three.camera);
        const box = document.getElementById('canvas').getBoundingClientRect();
        return [box.left + (0.5 + at.x / 2) * box.width, box.top + (0.5 - at.y / 2) * box.height];
    })()"""
    before = pose(tab)
    tab.wait_for_timeout(200)
    tab.mouse.click(*tab.evaluate(middle))

    assert joints(tab)[1] == pytest.approx(-0.9, abs=1e-9)
    np.testing.assert_allclose(pose(tab), before, atol=1e-9)


def test_a_typed_pose_is_taken_exactly(opened: Opener) -> None:
    tab = opened("puma560", "inverse", Q)
    before = pose(tab)
    tab.locator("#target-x").fill("0.4")
    tab.locator("#target-x").press("Enter")

    found = pose(tab)
    assert found[0, 3] == pytest.approx(0.4, abs=1e-9)
    np.testing.assert_allclose(np.delete(found, 3, axis=1), np.delete(before, 3, axis=1), atol=1e-9)
    np.testing.assert_allclose(found[1:, 3], before[1:, 3], atol=1e-9)
    assert tab.locator("#inverse-status").text_content().startswith("Reached: shoulder left")
    tab.locator("#target-yaw").fill("10")
    tab.locator("#target-yaw").press("Tab")
    assert np.degrees(np.arctan2(pose(tab)[1, 0], pose(tab)[0, 0])) == pytest.approx(10, abs=1e-7)


def test_out_of_reach_is_shown(opened: Opener) -> None:
    tab = opened("puma560", "inverse", Q)
    tab.locator("#target-x").fill("2")
    tab.locator("#target-x").press("Enter")

    text = tab.locator("#inverse-status").text_content()
    assert text.startswith("Out of reach: the end effector is ")
    assert "target" in names(tab)
    away = float(re.search(r"([\d.]+) m", text)[1])
    assert away == pytest.approx(np.linalg.norm(pose(tab)[:3, 3] - [2, 0.307968, -0.140987]), abs=2e-3)
    tab.evaluate("kinegen.setJoints([0.4, -0.7, 0.5, 0.3, 0.6, 0.2], 'test')")
    assert names(tab) == []


def test_a_field_without_a_number_changes_nothing(opened: Opener) -> None:
    tab = opened("puma560", "inverse", Q)
    tab.locator("#target-z").fill("")
    tab.locator("#target-z").press("Enter")

    assert tab.locator("#inverse-status").text_content() == "A field is not a number."
    np.testing.assert_allclose(joints(tab), Q)


HANDLE = """(way) => {
    const {camera, THREE} = kinegen.three;
    const m = kinegen.evaluate('fk', kinegen.state.q);
    const box = document.getElementById('canvas').getBoundingClientRect();
    const at = new THREE.Vector3(m[3], m[7], m[11]);
    const size = at.distanceTo(camera.position) * Math.tan((camera.fov * Math.PI) / 360) * 1.9 * 0.85 / 7;
    at.addScaledVector(new THREE.Vector3(...way), size * 0.45 * 2.2).project(camera);
    return [box.left + (0.5 + at.x / 2) * box.width, box.top + (0.5 - at.y / 2) * box.height];
}"""


@pytest.mark.parametrize(
    ("name", "q"), [("ur5", [0.4, -1.2, 1.0, 0.3, 0.9, 0.2]), ("iiwa14", [0.2, 0.6, 0.1, -1.2, 0.3, 0.8, 0.1])]
)
def test_the_arm_follows_a_dragged_tip(opened: Opener, name: str, q: list[float]) -> None:
    tab = opened(name, "inverse", q)
    tab.get_by_role("button", name="Move TCP").press("Enter")
    tab.wait_for_timeout(300)
    before, start = pose(tab), tab.evaluate(HANDLE, [0, 0, 1])
    tab.mouse.move(*start)
    tab.mouse.down()
    for step in range(1, 6):
        tab.mouse.move(start[0], start[1] - 8 * step)
        tab.wait_for_timeout(30)
    tab.mouse.up()

    found = pose(tab)
    assert found[2, 3] > before[2, 3] + 0.01
    np.testing.assert_allclose(found[:2, 3], before[:2, 3], atol=1e-6)
    np.testing.assert_allclose(found[:3, :3], before[:3, :3], atol=1e-5)
    assert tab.locator("#inverse-status").text_content().startswith("Reached")


# Motion ---------------------------------------------------------------------------------------------------------------


def test_the_trace_is_drawn_and_cleared(opened: Opener) -> None:
    tab = opened("puma560", "motion", Q)
    tab.get_by_role("button", name="Trace", exact=True).click()
    tab.evaluate("for (let i = 0; i < 50; i++) kinegen.setJoints([0.4 + i / 50, -0.7, 0.5, 0.3, 0.6, 0.2], 'test')")
    assert tab.evaluate("kinegen.motion.traced()") == 50
    tab.get_by_role("button", name="Clear trace").press("Enter")
    assert tab.evaluate("kinegen.motion.traced()") == 1
    tab.get_by_role("button", name="Trace", exact=True).press("Space")
    tab.evaluate("kinegen.setJoints([0, 0, 0, 0, 0, 0], 'test')")
    assert tab.evaluate("kinegen.motion.traced()") == 1


def test_the_trace_forgets_its_oldest_part(opened: Opener) -> None:
    tab = opened("planar_3r", "motion")
    tab.get_by_role("button", name="Trace", exact=True).click()
    tab.evaluate("for (let i = 0; i < 5000; i++) kinegen.setJoints([i / 500, 1, 1], 'test')")

    assert 2000 <= tab.evaluate("kinegen.motion.traced()") <= 4000


def test_reachable_points_are_inside_the_reach(opened: Opener, with_points: Path) -> None:
    tab = opened(with_points, "motion", Q)
    tab.get_by_role("button", name="Reachable points").click()
    until(tab, "kinegen.motion.clouded() > 0")
    far = """(() => {
        const points = kinegen.three.overlay.children.find((each) => each.isPoints).geometry.attributes.position.array;
        const far = [];
        for (let i = 0; i < points.length; i += 3) far.push(Math.hypot(points[i], points[i + 1], points[i + 2]));
        return [points.length / 3, Math.max(...far)];
    })()"""
    count, reach = tab.evaluate(far)

    assert count == tab.evaluate("kinegen.model.cloud.count") > 500
    # The wrist's centre is at most this far from the shoulder, and d3 is across.
    assert 0.8 < reach <= np.hypot(0.4318 + np.hypot(0.4318, 0.0203), 0.15005) + 1e-4


def test_semi_axes_of_ellipsoids_are_singular_values(opened: Opener) -> None:
    tab = opened("puma560", "motion", Q)
    tab.get_by_role("button", name="Velocity ellipsoid", exact=True).click()
    tab.get_by_role("button", name="Angular-velocity ellipsoid").press("Enter")
    jacobian = np.array(tab.evaluate("Array.from(kinegen.evaluate('jacobian', kinegen.state.q))")).reshape(6, 6)
    shown = tab.locator("#motion dd").all_text_contents()

    for text, rows in zip(shown, (jacobian[:3], jacobian[3:]), strict=True):
        values = [float(word) for word in text.split()[:3]]
        np.testing.assert_allclose(values, np.linalg.svd(rows, compute_uv=False), atol=6e-5)


@pytest.mark.parametrize(
    ("q", "start"),
    [
        ([0.4, -0.7, 0.5, 0.3, 0.0, 0.2], "Singular: the joints move together (forearm +1.00, flange \u22121.00)"),
        ([0.4, -0.7, 0.5, 0.3, 0.01, 0.2], "Nearly singular ("),
        ([0.4, -0.7, 0.5, 0.3, 1.0, 0.2], "Not near a singularity"),
    ],
)
def test_singular_poses_name_their_joints(opened: Opener, q: list[float], start: str) -> None:
    tab = opened("puma560", "motion", q)

    assert tab.locator("#singular").text_content().startswith(start)


# All of it ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["hand", "calibrated_2r", "blocks", "motoman_l3", "hostile"])
def test_every_panel_opens_for_other_robots(opened: Opener, name: str) -> None:
    """Trees, runtime parameters, no joints, actuators, hostile names; random joints go through all panels."""
    tab = opened(name)
    tab.evaluate("document.querySelectorAll('.panel').forEach((each) => (each.open = true))")
    for button in tab.locator("#motion button, #conventions button").all():
        if button.is_enabled():
            button.click()
    for row in tab.locator("#table .dh:not([hidden]) button.row").all()[:6]:
        row.focus()
    tab.evaluate(
        "kinegen.setJoints(kinegen.model.joints.map((each) => 0.3 * each.range[0] + 0.7 * each.range[1]), 'test')"
    )
    if tab.locator("#inverse").count():
        tab.locator("#target-z").fill("0.1")
        tab.locator("#target-z").press("Enter")
        assert tab.locator("#inverse-status").text_content() != ""


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_axe_finds_no_serious_fault_in_the_panels(opened: Opener, theme: str) -> None:
    if not AXE.exists():
        pytest.skip("there is no axe-core; run scripts/install_browser.py build/browser")
    tab = opened("puma560", "table", [0.4, -0.7, 0.5, 0.3, 0.0, 0.2], theme=theme)
    tab.evaluate("document.querySelectorAll('.panel').forEach((each) => (each.open = true))")
    tab.get_by_role("button", name="Show standard DH").click()
    tab.locator("#table button.row").nth(2).click()
    tab.locator("#target-x").fill("2")
    tab.locator("#target-x").press("Enter")
    tab.locator("#formula button[data-term=c23]").focus()
    tab.evaluate(AXE.read_text(encoding="utf-8") + ";null")
    found = tab.evaluate("async () => (await axe.run()).violations.map((each) => [each.impact, each.id])")

    assert [each for each in found if each[0] in ("serious", "critical")] == []
