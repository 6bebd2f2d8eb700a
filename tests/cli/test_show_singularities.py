"""`kinegen show --output singularities`: the determinant in factors, and what happens where each vanishes, in words."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinegen
from kinegen.ui.cli import main
from kinegen.verify.reference import Kinematics
from tests.cli.commands import ROBOTS

SQUARE = ("anthropomorphic_wrist", "crx10ial", "kr5", "puma560", "stanford", "ur5")
"""Arms whose Jacobian has a determinant."""

WORDS = {
    "ur5": [
        "det base_J_tool = a2*a3*s3*s5*(a2*c2 + a3*c23 + d5*s234)",
        "s3 = 0 elbow stretched or folded: the parallel axes 2, 3 and 4 are in one plane",
        "s5 = 0 wrist aligned: axes 2, 3, 4 and 6 are parallel",
        "a2*c2 + a3*c23 + d5*s234 = 0 shoulder: the point where axes 5 and 6 meet is in the plane through axis 1",
    ],
    "kr5": [
        "s5 = 0 wrist aligned: axes 4 and 6 coincide",
        "elbow stretched or folded: the point where axes 4, 5 and 6 meet is in the plane of axes 2 and 3",
        "shoulder: the point where axes 4, 5 and 6 meet is on axis 1",
    ],
    "planar_3r": ["det base_J_tool of rows vx, vy, wz = L1*L2*s2 base_J_tool is singular where s2 = 0"],
    "cylindrical_arm": [
        "det base_J_tool of rows vx, vy, vz = q3 These rows are singular where q3 = 0",
        "shoulder: the origin of frame tool is on axis 1",
    ],
    "spherical_wrist": ["det base_J_tool of rows wx, wy, wz = -s2", "s2 = 0 axes 1 and 3 coincide"],
    "al5d": [
        "minors of base_J_tool, each a3*a4*s3 times",
        "without vy: c234",
        "a3*c2 + a4*c23 = 0, c234 = 0 wrist aligned: axes 1 and 5 coincide",
    ],
    "iiwa14": [
        "minors of base_J_tool, each d3*d5*s4 times",
        "without q1: -d5*c3*s4*s6",
        "s2 = 0, s6 = 0 axes 1 and 3 coincide; wrist aligned: axes 5 and 7 coincide",
    ],
    "cartesian": ["It is singular nowhere."],
    "nutating_mill": ["det base_J_cutter of rows"],
    "general_6r": ["det base_J_tool", "It has a factor of more than 200 terms, which is not printed."],
}
"""Lines that are printed, with one space for any number of them and of line ends."""


SUMS = {
    # Constant angles, of which two add up to a right one.
    "twists": """
  - {name: j1, theta: 15 - q, d: 0, a: 0, alpha: 22.5}
  - {name: j2, theta: -q, d: 0, a: -0.32407, alpha: 75}
  - {name: j3, theta: q, d: -0.175, a: 0, alpha: 15}
  - {name: j4, theta: 75, d: q, a: -0.14158, alpha: 105}
  - {name: j5, ets: [Tz(0.26795), Rz(-15), Tx(q)]}
  - {name: j6, theta: q, d: -0.297, a: 0, alpha: 90}
""",
    # The same with three joints, where the sine of one angle is the cosine of the other.
    "complements": """
  - {name: j3, theta: q, d: -0.175, a: 0, alpha: 90}
  - {name: j4, theta: 75, d: q, a: -0.14158, alpha: 105}
  - {name: j5, ets: [Tz(0.26795), Rz(-15), Tx(q)]}
""",
}
"""Joints of arms whose determinants have angles with a constant sum."""


def show(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> str:
    assert main(["show", *map(str, arguments), "--output", "singularities"]) == 0

    out, err = capsys.readouterr()
    assert err == ""
    return out


@pytest.mark.parametrize("name", WORDS)
def test_it_is_printed_as_books_do_with_words(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    printed = " ".join(show(capsys, ROBOTS / f"{name}.yaml").split())

    for line in WORDS[name]:
        assert line in printed


@pytest.mark.parametrize("name", SQUARE)
def test_the_printed_python_gives_the_determinant_of_the_reference(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = kinegen.load(ROBOTS / f"{name}.yaml")
    printed: dict[str, Any] = {}
    exec(show(capsys, ROBOTS / f"{name}.yaml", "--format", "python"), printed)  # noqa: S102
    q = np.random.default_rng(4).uniform(-1, 1, robot.dof)
    expected = np.linalg.det(Kinematics(robot, q[None]).jacobian("tool")[0])

    np.testing.assert_allclose(printed["base_D_tool"](q), [[expected]], rtol=1e-9)


@pytest.mark.parametrize("name", ["ur5", "al5d", "iiwa14", "general_6r", "thumb"])
def test_every_notation_prints_it(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    path = ROBOTS / f"{name}.yaml"
    latex = show(capsys, path, "--format", "latex")
    page = ET.fromstring(f"<body>{show(capsys, path, '--format', 'mathml')}</body>")  # noqa: S314 - our own
    words = " ".join(filter(None, page.itertext()))

    assert latex.count(r"\begin{align*}") == latex.count(r"\end{align*}") > 1
    assert "det" in latex or "minors of" in latex
    assert "det" in words or "minors of" in words


def test_python_has_the_places_as_expressions() -> None:
    form = kinegen.load(ROBOTS / "stanford.yaml").closed_form(output="singularities")

    assert str(form.sympy()) == "Matrix([[q3**2*sin(q2)*sin(q5)]])"
    assert [tuple(map(str, zeros)) for zeros, _ in form.singularities] == [("sin(q2)",), ("q3",), ("sin(q5)",)]


def test_a_long_determinant_is_refused_where_an_expression_is_asked_for() -> None:
    form = kinegen.load(ROBOTS / "general_6r.yaml").closed_form(output="singularities")

    with pytest.raises(kinegen.KinegenError, match="too long to be printed"):
        form.sympy()


def test_more_minors_than_can_be_factored_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", str(ROBOTS / "human_body.yaml"), "--output", "singularities"]) == 1

    assert capsys.readouterr().err == (
        "error: the Jacobian from base to tool, of rank 6 in general, has 54264 minors, of which at most 150 are "
        "factored: choose a part of the chain with fewer joints (--from and --to)\n"
    )


def table(folder: Path, convention: str, *rows: str) -> str:
    lines = ["kinegen: 1", "name: arm", f"convention: {convention}", "units: {length: m, angle: deg}", "joints:"]
    for number, row in enumerate(rows, 1):
        theta, d, a, alpha = row.split(",")
        lines.append(f"- {{name: j{number}, theta: {theta}, d: {d}, a: {a}, alpha: {alpha}}}")
    (folder / "arm.yaml").write_text("\n".join(lines), encoding="utf-8")
    return str(folder / "arm.yaml")


def test_minors_that_vanish_everywhere_are_not_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = ("q-90,0,0.4,90", "q,0.4,0.4,90", "q,0,0,90", "180,q,0,180", "q+90,0,0,180", "q-90,0,0,0")

    assert main(["show", table(tmp_path, "modified", *rows), "--output", "singularities"]) == 0

    lines = capsys.readouterr().out.splitlines()
    assert sum(line.startswith("  without ") for line in lines) == 9
    assert "Its rank is at most 4 everywhere, and nowhere less." in lines


@pytest.mark.parametrize("rows", [("0,q,0,90", "0,q,0,-90", "0,q,0,0"), ("q,0,0,0", "q,0.1,0,0", "0,q,0,0")])
def test_a_rank_that_is_low_everywhere_is_told(
    rows: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Three slides in a plane, and joints that share an axis, move the tool in two directions at most."""
    printed = show(capsys, table(tmp_path, "standard", *rows))
    robot = kinegen.load(tmp_path / "arm.yaml")
    jacobians = Kinematics(robot, np.random.default_rng(2).uniform(-3, 3, (50, 3))).jacobian("tool")

    assert set(np.linalg.matrix_rank(jacobians, tol=1e-9)) == {2}
    assert "Its rank is at most 2 everywhere, and nowhere less." in printed
    assert "singular" not in printed


@pytest.mark.parametrize("notation", ["text", "latex", "mathml"])
def test_minors_that_are_too_long_are_not_called_a_determinant(
    notation: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = ("q,0.11,0.3,37", "q,0.4,0.23,71", "q,0.2,0.31,43", "q,0.4,0.17,-61", "q,0.3,0.27,29", "q,0.2,0.13,17")
    printed = show(capsys, table(tmp_path, "standard", *rows, "q,0.15,0.2,23"), "--format", notation)

    assert "One of its 7 minors has a factor of more than 200 terms" in printed
    assert "minors of" in printed
    assert "det" not in printed


@pytest.mark.parametrize("notation", ["text", "latex", "mathml"])
def test_of_many_minors_what_they_share_is_printed(
    notation: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arm = ("q,0.1,0,-90", "q,0,0.4,0", "q,0,0,90", "q,0.4,0,-90", "q,0,0,90", "q,0,0,0")
    gantry = ("90,q,0,90", "90,q,0,90", "0,q,0,0")

    shown = main(
        ["show", table(tmp_path, "standard", *gantry, *arm), "--output", "singularities", "--format", notation]
    )

    printed = capsys.readouterr().out
    assert shown == 0
    assert "minors of" in printed
    assert "are not printed" in printed
    assert "F1" not in printed


@pytest.mark.parametrize("name", SUMS)
def test_angles_with_a_constant_sum_are_not_merged(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / f"{name}.yaml"
    path.write_text(
        f"kinegen: 1\nname: {name}\nconvention: modified\nunits: {{length: m, angle: deg}}\njoints:{SUMS[name]}"
    )

    assert "det base_J_tool" in show(capsys, path)


def test_lengths_with_many_decimals_leave_no_integers_of_twenty_digits(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As in a URDF that a program computed: the common denominator of all lengths is not what people read."""
    table = (ROBOTS / "ur5.yaml").read_text("utf-8")
    for name, length in (("a: a2", "a: -0.425"), ("a: a3", "a: -0.39225"), ("d: d5", "d: 0.094650000000000012345")):
        parameter = name.partition(" ")[2]
        table = re.sub(rf"(?m)^  {parameter}: .*\n", "", table).replace(name, length)
    (tmp_path / "arm.yaml").write_text(table, "utf-8")

    assert main(["show", str(tmp_path / "arm.yaml"), "--output", "singularities"]) == 0
    printed = capsys.readouterr().out
    assert "0.094650000000000012345*s234" in printed.replace("0.94650000000000012345", "0.094650000000000012345")
    assert not re.search(r"\d{6}", re.sub(r"\.\d+", "", printed))
