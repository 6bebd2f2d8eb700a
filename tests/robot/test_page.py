"""docs/robot-file.md and its figures: current, complete, and drawn from the transforms that the kernels have."""

from __future__ import annotations

import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from kinegen.derive.transforms import Turn, row_transforms, symbols
from kinegen.io.robot_file import keys
from kinegen.model.expression_parser import FUNCTIONS
from kinegen.model.robot import ROW_ENTRIES, Convention
from tests.robot.files import robot

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "robot-file.md").read_text(encoding="utf-8")
FIGURES = sorted((ROOT / "docs" / "figures").glob("*.svg"))


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> object:
    """The script that makes the page."""
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    import make_robot_file

    return make_robot_file


def test_it_is_current() -> None:
    done = subprocess.run(
        [sys.executable, "docs/make_robot_file.py", "--check"], cwd=ROOT, capture_output=True, text=True, check=False
    )

    assert done.returncode == 0, done.stdout + done.stderr


def test_it_names_every_key_and_word() -> None:
    tables = (keys.TOP, keys.UNITS, keys.ROW, keys.TRANSFORM, keys.FRAME, keys.PARAMETER, keys.ACTUATORS, keys.DRIVE)
    words = (*keys.LENGTH_UNITS, *keys.ANGLE_UNITS, *keys.JOINT_TYPES, *keys.DIMENSIONS, *keys.STEPS, *FUNCTIONS)

    for word in {*(key for table in tables for key in table), *words, *keys.TABLE_CONVENTIONS}:
        assert f"`{word}`" in PAGE, word


@pytest.mark.parametrize("convention", [each for each in Convention if each is not Convention.ETS])
def test_a_figure_shows_the_transforms_of_its_convention(convention: Convention, script: object) -> None:
    entries = {"theta": "q", "d": "0.1", "a": "0.2", "alpha": "0.3", "beta": "0.4"}
    given = ", ".join(f"{key}: {entries[key]}" for key in ROW_ENTRIES[convention])
    arm = robot(f"{{name: one, {given}}}", convention=str(convention))

    steps = row_transforms(arm.rows[0], symbols(arm, keep_parameters=True))
    kinds = [("R" if isinstance(step, Turn) else "T") + "xyz"[step.axis] for step in steps]
    assert [move.kind for move in script.MOVES[convention]] == kinds  # type: ignore[attr-defined]
    assert f"`{' '.join(f'{kind}({label})' for kind, label in formula(convention))}`" in PAGE


def formula(convention: Convention) -> list[tuple[str, str]]:
    """The formula of a convention, as the page prints it below the heading."""
    found = re.search(rf"### {convention}\n\n`(.*)`", PAGE)
    assert found is not None
    return re.findall(r"(\w\w)\((\w+)\)", found[1])


def test_a_figure_shows_xyz_and_rpy_as_the_loader_reads_them(script: object) -> None:
    arm = robot("{name: one, a: 0, alpha: 0, d: 0, theta: q}", more="tool: {xyz: [1, 2, 3], rpy: [4, 5, 6]}")

    kinds = [step.kind.value for step in arm.tool]
    assert [move.kind for move in script.MOVES["rpy"]] == kinds  # type: ignore[attr-defined]


@pytest.mark.parametrize("path", FIGURES, ids=lambda path: str(path.stem))
def test_figures_are_small_pictures_with_a_title(path: Path) -> None:
    picture = ET.fromstring(path.read_text(encoding="utf-8"))  # noqa: S314 - our own file

    assert picture[0].tag.endswith("title")
    assert path.stat().st_size < 16_000
    assert f"(figures/{path.name})" in PAGE


def test_the_first_example_is_a_robot() -> None:
    from kinegen.io.load import loads

    block = re.search(r"```yaml\n(.*?)```", PAGE, re.S)
    assert block is not None
    assert loads(block[1], "page").dof == 3
