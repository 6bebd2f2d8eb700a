"""The page in a cell of a notebook: the widget moves the arm, sliders are heard, and the frame keeps to itself."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import kinegen
from tests.browser.conftest import VIEW
from tests.viewer.pages import ROBOTS, ROOT

START = [0.5, 0.6, 0.1]
WIDGET = ROOT / "kinegen" / "ui" / "api" / "widget.js"

NOTEBOOK = """\
<!DOCTYPE html><meta charset="utf-8"><div id="cell"></div>
<script type="module">
{widget}
// What anywidget hands to a widget: a model with the traits, and the element of the cell.
const traits = {traits}, handlers = new Set();
window.saved = [];
window.model = {{
  get: (name) => traits[name],
  set(name, value) {{ traits[name] = value; for (const handler of [...handlers]) handler(); }},
  save_changes: () => window.saved.push(traits.q),
  on: (_event, handler) => handlers.add(handler),
  off: (_event, handler) => handlers.delete(handler),
}};
window.close_cell = render({{ model: window.model, el: document.getElementById("cell") }});
</script>
"""


@pytest.fixture
def cell(browser: Any, tmp_path: Path) -> Iterator[tuple[Any, Any]]:
    """A page with the widget of a SCARA in it, and the frame of the arm."""
    view = kinegen.view(ROBOTS / "scara.yaml", START)
    traits = {"q": view.q, "page": view.html, "title": "scara", "height": 500}
    widget = WIDGET.read_text(encoding="utf-8").replace("export default { render };", "")
    data = json.dumps(traits).replace("<", "\\u003c")
    file = tmp_path / "cell.html"
    file.write_text(NOTEBOOK.format(widget=widget, traits=data), encoding="utf-8")
    context = browser.new_context(viewport=VIEW, offline=True)
    page, heard = context.new_page(), []
    page.on("pageerror", lambda error: heard.append(str(error)))
    page.on("console", lambda message: heard.append(message.text) if message.type == "error" else None)
    page.goto(file.as_uri())
    frame = page.frames[1]
    frame.wait_for_function("window.kinegen !== undefined")
    yield page, frame
    context.close()
    assert heard == []


def joints(frame: Any) -> list[float]:
    """The joints that the page shows."""
    found: list[float] = frame.evaluate("Array.from(window.kinegen.state.q)")
    return found


def test_it_begins_with_the_joints_of_the_widget(cell: tuple[Any, Any]) -> None:
    page, frame = cell

    assert joints(frame) == START
    assert page.evaluate("window.saved") == []


def test_setting_q_moves_the_arm(cell: tuple[Any, Any]) -> None:
    page, frame = cell
    page.evaluate("window.model.set('q', [0.1, 0.2, 0.05])")
    frame.wait_for_function("window.kinegen.state.q[0] === 0.1")

    assert joints(frame) == [0.1, 0.2, 0.05]
    assert page.evaluate("window.saved") == []


def test_a_slider_writes_q_back_and_is_not_answered(cell: tuple[Any, Any]) -> None:
    page, frame = cell
    frame.locator("input[type=range]").first.press("ArrowRight")
    page.wait_for_function("window.saved.length > 0")
    moved = joints(frame)

    assert moved[0] > START[0]
    assert page.evaluate("window.saved.at(-1)") == moved
    page.evaluate("window.model.set('q', [0.1, 0.2, 0.05])")
    frame.wait_for_function("window.kinegen.state.q[0] === 0.1")


@pytest.mark.parametrize(
    "said", ["{}", "{kinegen: 1, q: ['<b>', 0, 0]}", "{kinegen: 1, q: [1]}", "{kinegen: 2, q: [1, 1, 1]}"]
)
def test_other_messages_change_nothing(said: str, cell: tuple[Any, Any]) -> None:
    page, frame = cell
    page.evaluate(f"document.querySelector('iframe').contentWindow.postMessage({said}, '*')")
    page.wait_for_timeout(100)

    assert joints(frame) == START


def test_the_frame_cannot_reach_the_notebook(cell: tuple[Any, Any]) -> None:
    _, frame = cell

    reach = "(() => { try { return String(window.parent.document); } catch (error) { return error.name; } })()"
    assert frame.evaluate(reach) == "SecurityError"


def test_a_cell_that_is_closed_listens_no_longer(cell: tuple[Any, Any]) -> None:
    page, frame = cell
    page.evaluate("window.close_cell()")
    frame.locator("input[type=range]").first.press("ArrowRight")
    page.wait_for_timeout(200)

    assert page.evaluate("window.saved") == []
