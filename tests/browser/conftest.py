"""A Chromium without a network, and pages of robots in it."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from kinegen.io.load import load
from kinegen.tools.viewer.document import ViewOptions, page
from tests.viewer.pages import HOSTILE, ROBOTS

pytestmark = pytest.mark.browser

Open = Callable[..., Any]

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--force-color-profile=srgb")
VIEW = {"width": 800, "height": 520}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what is in this folder."""
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.browser)


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Chromium of the system, drawing in software."""
    playwright = pytest.importorskip("playwright.sync_api", reason="pip install -e '.[browser]'")
    path = next((found for name in NAMES if (found := shutil.which(name))), None)
    if path is None:
        pytest.skip("there is no Chromium; on Debian, as root: apt-get install chromium")
    with playwright.sync_playwright() as running:
        made = running.chromium.launch(executable_path=path, args=list(FLAGS))
        yield made
        made.close()


@pytest.fixture(scope="session")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The page of a robot as a file, made once; `hostile` has markup in every string."""
    folder = tmp_path_factory.mktemp("pages")

    def made(name: str) -> Path:
        target = folder / f"{name}.html"
        if not target.exists():
            source = ROBOTS / f"{name}.yaml"
            if name == "hostile":
                source = folder / "<b>&.yaml"
                source.write_text(HOSTILE, encoding="utf-8")
            target.write_text(page(load(source), ViewOptions()), encoding="utf-8")
        return target

    return made


@pytest.fixture
def open_page(browser: Any, pages: Callable[[str], Path]) -> Iterator[Open]:
    """Opens the page of a robot without a network; no message may appear on its console, and no request leave it."""
    contexts: list[Any] = []
    heard: list[str] = []

    def opened(name: str | Path, fragment: str = "", *, theme: str = "light", **options: Any) -> Any:
        options = {"viewport": VIEW, "color_scheme": theme, "offline": True, **options}
        context = browser.new_context(**options)
        contexts.append(context)
        shown = context.new_page()
        shown.on("console", lambda message: heard.append(f"{message.type}: {message.text}"))
        shown.on("pageerror", lambda error: heard.append(f"error: {error}"))
        shown.on("dialog", lambda dialog: heard.append(f"dialog: {dialog.message}"))
        path = pages(name) if isinstance(name, str) else name
        shown.on("request", lambda request: None if is_own(request.url) else heard.append(f"request: {request.url}"))
        shown.goto(path.as_uri() + fragment)
        shown.wait_for_function("window.kinegen !== undefined")
        settle(shown)
        return shown

    yield opened
    for context in contexts:
        context.close()
    assert not heard


def is_own(address: str) -> bool:
    """Whether a request is for the page, or for data inside it."""
    return address.startswith(("file:", "data:"))


def settle(shown: Any) -> None:
    """Wait until what was asked for is drawn."""
    shown.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
