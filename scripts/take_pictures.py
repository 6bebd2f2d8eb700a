"""Takes the pictures of the moving arm that the pages show, in Chromium.

    pip install -e '.[browser]'
    python scripts/take_pictures.py

A renderer in software draws them, so that they differ little from one machine to the next; nothing compares them.
"""

from __future__ import annotations

import io
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal

from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

from kinegen.io.load import load
from kinegen.tools.viewer.document import ViewOptions, page

ROOT = Path(__file__).resolve().parent.parent
PICTURES = ROOT / "docs" / "pictures"
FLAGS = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--force-color-profile=srgb")
SIZE = (1120, 665)
Theme = Literal["light", "dark"]


def take(browser: Browser, folder: Path, robot: str, theme: Theme, joints: str) -> Page:
    """Open the page of a robot at a posture, in degrees."""
    file = folder / f"{robot}.html"
    file.write_text(page(load(ROOT / "robots" / f"{robot}.yaml"), ViewOptions()), encoding="utf-8")
    width, height = SIZE
    context = browser.new_context(viewport={"width": width, "height": height}, color_scheme=theme, offline=True)
    shown = context.new_page()
    shown.goto(file.as_uri())
    shown.wait_for_function("window.kinegen !== undefined")
    for field, value in zip(shown.locator("#joints input[type=number]").all(), joints.split(), strict=False):
        field.fill(value)
        field.press("Enter")
    shown.get_by_role("button", name="Fit").click()
    return shown


def panels(shown: Page, *titles: str) -> None:
    """Open these panels and close the others."""
    for panel in shown.locator("details:has(> summary)").all():
        title = panel.locator("> summary").inner_text().strip().lower()
        wanted = any(title.startswith(name) for name in titles)
        if (panel.get_attribute("open") is not None) != wanted and panel.is_visible():
            panel.locator("> summary").click()


def save(shown: Page, name: str) -> None:
    """Write a picture in full colour: a palette loses the red and blue of thin axes, which cover few pixels."""
    shown.wait_for_timeout(800)
    picture = Image.open(io.BytesIO(shown.screenshot())).convert("RGB")
    picture.save(PICTURES / name, optimize=True)


def main() -> None:
    """Take both."""
    path = shutil.which("chromium") or shutil.which("google-chrome")
    if path is None:
        raise SystemExit("there is no Chromium; on Debian, as root: apt-get install chromium")
    with sync_playwright() as running, TemporaryDirectory() as folder:
        browser = running.chromium.launch(executable_path=path, args=list(FLAGS))
        puma = take(browser, Path(folder), "puma560", "light", "20 -50 60 0 40 0")
        panels(puma, "closed form")
        save(puma, "viewer.png")
        ur5 = take(browser, Path(folder), "ur5", "dark", "30 -60 80 -40 -90 10")
        panels(ur5, "inverse")
        save(ur5, "viewer_dark.png")
        browser.close()


if __name__ == "__main__":
    main()
