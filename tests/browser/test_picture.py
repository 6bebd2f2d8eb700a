"""What is drawn: the arm, in light and dark, and how long that takes."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.browser.conftest import Open, settle

FOLDER = Path(__file__).parent
BUILD = FOLDER.parent.parent / "build" / "browser"
SIZE = (96, 72)

TOLERANCE = 6.0
"""Mean difference of the small pictures, of 255: antialiasing and versions of Chromium make less than 3, and an arm in
another posture makes more than 10."""

PICTURE = (
    "() => { const a = window.kinegen; a.three.draw(); return a.three.renderer.domElement.toDataURL('image/png'); }"
)


def picture(shown: Any) -> np.ndarray:
    """The canvas as colours of 0 to 255, shape (height, width, 3)."""
    import base64

    image = pytest.importorskip("PIL.Image", reason="pip install -e '.[browser]'")
    data = base64.b64decode(shown.evaluate(PICTURE).partition(",")[2])
    return np.asarray(image.open(io.BytesIO(data)).convert("RGB").resize(SIZE, image.Resampling.BOX), dtype=float)


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_the_arm_looks_as_it_did(open_page: Open, theme: str) -> None:
    from PIL import Image

    shown = open_page("puma560", "#q=0.5,-0.6,0.3,0.2,0.4,0", theme=theme)
    shown.locator("#tools button", has_text="Fit").click()
    found = picture(shown)
    BUILD.mkdir(parents=True, exist_ok=True)
    Image.fromarray(found.astype(np.uint8)).save(BUILD / f"puma560_{theme}.png")
    expected = np.asarray(Image.open(FOLDER / f"puma560_{theme}.png").convert("RGB"), dtype=float)

    assert np.abs(found - expected).mean() < TOLERANCE, f"see {BUILD}; if it is meant, copy the picture to {FOLDER}"

    # What the tolerance is worth: another posture is another picture.
    shown.evaluate("() => { const a = window.kinegen; a.setJoints([-1, 0, 0.3, 0, 0, 0], 'test'); }")
    settle(shown)
    assert np.abs(picture(shown) - expected).mean() > TOLERANCE


ROBOTS = ("scara", "hand", "motoman_l3", "human_body", "planar_3r", "spherical_joint", "blocks", "puma560_mm")


@pytest.mark.parametrize("name", ROBOTS)
def test_robots_of_every_kind_are_drawn(open_page: Open, name: str) -> None:
    shown = open_page(name)
    with_arm = picture(shown)
    shown.evaluate(
        "() => { const { scene } = window.kinegen.three; scene.children.forEach((each) => (each.visible = false)); }"
    )
    empty = picture(shown)

    different = np.abs(with_arm - empty).max(axis=2) > 24
    assert different.mean() > 0.02, "the arm is too small, or not there"
    assert not different[:, [0, -1]].any() or not different[[0, -1], :].all(), "the arm fills the picture"
    assert shown.evaluate("() => window.kinegen.checked.isRight")


def test_an_evaluation_with_drawing_calls_takes_less_than_four_milliseconds(
    open_page: Open, capsys: pytest.CaptureFixture[str]
) -> None:
    shown = open_page("iiwa14")
    milliseconds = shown.evaluate(
        """async () => {
          const app = window.kinegen;
          const q = app.home();
          const times = [];
          for (let index = 0; index < 60; index++) {
            q[0] = index / 100;
            q[3] = -index / 80;
            const start = performance.now();
            app.setJoints(q, "test");
            app.three.draw();
            times.push(performance.now() - start);
            await new Promise(requestAnimationFrame);
          }
          return times.sort((a, b) => a - b)[30];
        }"""
    )
    with capsys.disabled():
        print(f"\n  seven joints: {milliseconds:.2f} ms for an evaluation with its drawing calls (median of 60)")

    assert milliseconds < 4.0


def test_without_webgl_joints_and_poses_work(browser: Any, open_page: Open, tmp_path: Path, pages: Any) -> None:
    text = pages("scara").read_text(encoding="utf-8")
    path = tmp_path / "blind.html"
    # A browser that knows no WebGL gives no context.
    start = "<script>HTMLCanvasElement.prototype.getContext = () => null;</script>"
    policy = text.index('<meta http-equiv="Content-Security-Policy"')
    end = text.index(">", policy) + 1
    path.write_text(text[:policy] + start + text[end:], encoding="utf-8")

    context = browser.new_context(offline=True)
    shown = context.new_page()
    shown.goto(path.as_uri())
    shown.wait_for_function("window.kinegen !== undefined")
    assert shown.locator("#notice").inner_text().startswith("This browser has no WebGL")
    shown.locator("#value-joint-0").fill("90")
    assert shown.locator("#pose .matrix td").nth(0).inner_text() == "0.000000"
    context.close()
