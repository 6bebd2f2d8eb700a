"""The worker of the site's search, in a page that was opened from the disk, where browsers start none."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tests.viewer.pages import ROOT

WORKER = ROOT / "docs" / "site" / "search_worker.js"

PAGE = """\
<!DOCTYPE html><meta charset="utf-8"><body>{before}
<script>
window.answers = [];
try {{
  const worker = new Worker("task.js");
  worker.addEventListener("message", (event) => window.answers.push(event.data));
  worker.postMessage(20);
  worker.postMessage(30);
}} catch (error) {{
  window.answers.push(String(error));
}}
</script>
"""

TASK = """\
const ready = importScripts("more.js");
addEventListener("message", async (event) => { await ready; postMessage(more(event.data)); });
"""


def answers(browser: Any, folder: Path, before: str) -> list[Any]:
    """What a page on the disk hears from a worker that adds one."""
    (folder / "page.html").write_text(PAGE.format(before=before), encoding="utf-8")
    (folder / "task.js").write_text(TASK, encoding="utf-8")
    (folder / "more.js").write_text("function more(number) { return number + 1; }\n", encoding="utf-8")
    shown = browser.new_context(offline=True).new_page()
    shown.goto((folder / "page.html").as_uri())
    shown.wait_for_timeout(500)
    found = shown.evaluate("window.answers")
    assert isinstance(found, list)
    return found


def test_a_frame_does_the_work_of_a_worker_on_the_disk(browser: Any, tmp_path: Path) -> None:
    script = WORKER.read_text(encoding="utf-8")

    assert answers(browser, tmp_path, f"<script>{script}</script>") == [21, 31]
    # Without it the browser refuses; else the script would not be needed.
    assert answers(browser, tmp_path, "") != [21, 31]
