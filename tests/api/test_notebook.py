"""Cells of a notebook: the magic, the viewer as a widget and as a frame, and notebooks without outputs."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import kinegen
from kinegen.ui.api.page import Page
from scripts import notebooks

ROOT = Path(__file__).resolve().parents[2]
CELL = """\
kinegen: 1
name: arm
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: turn, theta: q, d: 0, a: 0.5, alpha: 0}
"""


@pytest.fixture
def shell() -> Iterator[Any]:
    """IPython with the extension."""
    from IPython.core.interactiveshell import InteractiveShell

    # A module of its own: reset() would empty the `__main__` of this process, which starts others.
    found = InteractiveShell.instance(user_module=ModuleType("cells"))
    found.extension_manager.load_extension("kinegen")
    yield found
    found.extension_manager.unload_extension("kinegen")
    found.reset(new_session=False)
    InteractiveShell.clear_instance()


def test_a_cell_gives_the_module_the_robot_and_the_closed_form(shell: Any) -> None:
    form = shell.run_cell_magic("robot", "--outputs pose --real double", CELL)

    assert isinstance(form, kinegen.ClosedForm)
    assert shell.user_ns["arm"].fk(np.zeros(1))[0, 3] == 0.5
    assert shell.user_ns["arm_robot"].joints == ("turn",)


def test_a_cell_may_name_the_module_and_be_quiet(shell: Any) -> None:
    assert shell.run_cell_magic("robot", "mine --outputs=pose --real=double --quiet", CELL) is None

    assert shell.user_ns["mine"] is kinegen.compile(CELL, "pose", real="double")
    assert "arm" not in shell.user_ns


@pytest.mark.parametrize(
    ("line", "cell", "message"),
    [
        ("", CELL.replace("alpha", "alfa"), "error: line 7 of the cell: "),
        ("", "nonsense", "error: line 2 of the cell: a robot file is made of"),
        ("", "\n", "error: the file is empty"),
        ("--outputs", CELL, "error: %%robot: --outputs needs a value; usage: %%robot"),
        ("--outputs flight", CELL, "error: unknown output 'flight'"),
        ("one two", CELL, "error: %%robot: unexpected 'two'; usage:"),
        ("'", CELL, "error: %%robot: no closing quotation; usage:"),
        ("1x", CELL, "error: %%robot: unexpected '1x'"),
    ],
)
def test_a_mistake_is_one_line(
    line: str, cell: str, message: str, shell: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    assert shell.run_cell_magic("robot", line, cell) is None

    printed = capsys.readouterr()
    assert printed.err.startswith(message)
    assert printed.err.count("\n") == 1
    assert printed.out == ""


def test_nearly_special_numbers_are_noted(shell: Any, capsys: pytest.CaptureFixture[str]) -> None:
    shell.run_cell_magic("robot", "--outputs pose --real double", CELL.replace("alpha: 0", "alpha: 89.9999"))

    assert capsys.readouterr().out.startswith("note: alpha of joint 1 (turn) is 89.9999 deg")


@pytest.fixture(scope="module")
def view() -> Any:
    """A widget."""
    return kinegen.view(ROOT / "robots" / "scara.yaml", [0.5, 0.6, 0.1])


def test_a_widget_has_the_joints(view: Any) -> None:
    assert view.q == [0.5, 0.6, 0.1]
    view.q = np.array([0.1, 0.2, 0.05])
    assert view.q == [0.1, 0.2, 0.05]
    # What the page says arrives as the state of the widget.
    view.set_state({"q": [0.3, 0.2, 0.1]})
    assert view.q == [0.3, 0.2, 0.1]
    assert view.get_state(["q", "height"]) == {"q": [0.3, 0.2, 0.1], "height": 600}


@pytest.mark.parametrize("wrong", [[0.0], [0.0, 0.0, float("nan")], "abc", None, [[0.0] * 3], [0.0, 0.0, float("inf")]])
def test_a_wrong_joint_vector_changes_nothing(wrong: Any, view: Any) -> None:
    before = view.q
    with pytest.raises(kinegen.KinegenError, match="scara"):
        view.q = wrong

    assert view.q == before


def test_a_widget_begins_at_home() -> None:
    view: Any = kinegen.view(ROOT / "robots" / "puma560.yaml")

    assert len(view.q) == 6
    assert view.html.startswith("<!DOCTYPE html>")


def test_without_widgets_the_page_is_in_a_frame(tmp_path: Path) -> None:
    page: Any = kinegen.view(ROOT / "robots" / "scara.yaml", widget=False)
    frame = page._repr_html_()
    start = frame.index('srcdoc="') + len('srcdoc="')

    assert frame.startswith('<iframe title="scara" sandbox="allow-scripts"')
    assert html.unescape(frame[start : frame.index('"', start)]) == page.html
    assert page.save(tmp_path / "page.html").read_text(encoding="utf-8") == page.html


def test_without_anywidget_it_is_a_frame_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kinegen.ui.api.notebook.importlib.util.find_spec", lambda _name: None)

    assert isinstance(kinegen.view(CELL), Page)
    with pytest.raises(kinegen.KinegenError, match="needs the package anywidget: pip install"):
        kinegen.view(CELL, widget=True)


def test_page_and_widget_speak_the_same_messages() -> None:
    page = (ROOT / "templates" / "viewer" / "embed.js").read_text(encoding="utf-8")
    widget = (ROOT / "kinegen" / "ui" / "api" / "widget.js").read_text(encoding="utf-8")

    for word in ("kinegen: 1", "ready", "postMessage", "source"):
        assert word in page
        assert word in widget


@pytest.mark.parametrize("path", notebooks.NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_have_no_outputs(path: Path) -> None:
    assert path.read_text(encoding="utf-8") == notebooks.cleared(path)


@pytest.mark.notebooks
@pytest.mark.parametrize("path", notebooks.NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_run(path: Path) -> None:
    """Each from top to bottom; nothing but wanted mistakes, and what is compiled, is printed to stderr."""
    notebook: Any = notebooks.executed(path)
    outputs = [each for cell in notebook.cells if cell.cell_type == "code" for each in cell.outputs]
    printed = [each["text"] for each in outputs if each.get("name") == "stderr"]
    errors = [text for text in printed if not re.fullmatch(r"(compiling \w+ \(first time; kept\)\n)+", text)]

    assert not any(each["output_type"] == "error" for each in outputs)
    assert len(errors) == ("drawing" in path.stem)
    assert all("line 7 of the cell" in each for each in errors)


def test_all_four_notebooks_are_there() -> None:
    names = {path.stem for path in notebooks.NOTEBOOKS}

    assert names >= {"first_steps", "from_a_drawing", "velocity_control", "calibration"}


@pytest.mark.parametrize("path", notebooks.NOTEBOOKS, ids=lambda path: path.stem)
def test_commands_of_notebooks_are_those_of_their_interpreter(path: Path) -> None:
    """A notebook may run where `kinegen` is not on the PATH, and its next cell reads what the command wrote."""
    cells = [cell["source"] for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]]
    commands = [line for source in cells for line in source if line.startswith("!")]

    assert all(line.startswith("!{python} -m kinegen ") for line in commands)
    assert not commands or any("python = sys.executable\n" in source for source in cells)
