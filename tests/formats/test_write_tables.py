"""Tables as Markdown, CSV and LaTeX: what they show is what the robot has."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from kinegen.errors import KinegenError
from kinegen.io import table_text
from kinegen.io.load import load, loads
from kinegen.model.robot import Convention, Robot
from kinegen.verify import reference

FOLDER = Path(__file__).parents[2] / "robots"
TABLES = [
    path
    for path in sorted(FOLDER.glob("*.yaml"))
    if {row.convention for row in load(path).rows} in ({Convention.STANDARD}, {Convention.MODIFIED})
]


def again(text: str) -> Robot:
    """A CSV table, its head comment and its cells put into a robot file by hand."""
    head, *rest = text.splitlines()
    convention, length, angle = head.removeprefix("# ").split(",")
    rows = list(csv.DictReader(line for line in rest if not line.startswith("#")))
    lines = [f"kinegen: 1\nname: again\nconvention: {convention}\nunits: {{length: {length}, angle: {angle}}}\njoints:"]
    lines += [
        "  - {" + ", ".join(f'{key}: "{row[key]}"' for key in ("name", "a", "alpha", "d", "theta")) + "}"
        for row in rows
    ]
    return loads("\n".join(lines) + "\n", "again.yaml")


@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.stem)
def test_csv_tables_have_the_rows_of_the_robot(path: Path) -> None:
    robot = load(path)
    if robot.is_tree:
        return
    found = again(table_text.write_csv(robot))

    q = np.random.default_rng(1).uniform(-1, 1, (5, robot.dof))
    left, right = (
        np.linalg.solve(frames[a], frames[b])
        for frames, a, b in (
            (reference.frames(robot, q), robot.rows[0].name, robot.rows[-1].name),
            (reference.frames(found, q), robot.rows[0].name, robot.rows[-1].name),
        )
    )
    assert np.abs(left - right).max() < 1e-12 * (1 + np.abs(left).max())


def test_markdown() -> None:
    text = table_text.write_markdown(load(FOLDER / "xarm6.yaml"))

    assert "| i | joint | a [mm] | α [deg] | d [mm] | θ [deg] | limits |\n" in text
    assert r"| 3 | elbow | sqrt(rise\*\*2 + forward\*\*2) | 0 | 0 | q + atan(rise/forward) | -225 to 11 |" in text
    assert "| rise | 284.5 |" in text


def test_csv() -> None:
    text = table_text.write_csv(load(FOLDER / "puma560.yaml"))

    assert text.startswith("# modified,m,deg\n")
    assert "\nname,a,alpha,d,theta" in text


def test_latex() -> None:
    text = table_text.write_latex(load(FOLDER / "jaco2.yaml"))

    assert r"\theta \; [\mathrm{deg}]" in text
    assert r"-\mathrm{D3} - \frac{\mathrm{D4}}{\sqrt{3}}" in text
    assert text.count(r"\begin") == text.count(r"\end")
    assert text.count("{") == text.count("}")


@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.stem)
def test_latex_and_markdown_of_every_table(path: Path) -> None:
    robot = load(path)

    assert table_text.write_latex(robot).count("{") == table_text.write_latex(robot).count("}")
    assert all(row.name in table_text.write_markdown(robot) for row in robot.rows)


def test_other_rows_are_one_line() -> None:
    for write in (table_text.write_csv, table_text.write_latex, table_text.write_markdown):
        with pytest.raises(KinegenError, match="convert it with --convention standard"):
            write(load(FOLDER / "hand.yaml"))
