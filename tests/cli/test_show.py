"""`kinegen show`: what is printed, in every notation, and that it is right."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections import Counter
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kinegen.backends.textbook.notation import NOTATIONS, entry_texts
from kinegen.backends.textbook.sheet import make_sheet
from kinegen.backends.textbook.sheet_latex import latex_sheet
from kinegen.backends.textbook.sheet_mathml import mathml_sheet
from kinegen.backends.textbook.sheet_python import python_sheet
from kinegen.backends.textbook.sheet_text import text_sheet
from kinegen.io.load import load, loads
from kinegen.model.robot import Robot
from kinegen.ui.cli import main
from kinegen.verify import reference
from tests.cli.commands import ROBOTS, TWO

FILES = sorted(ROBOTS.glob("*.yaml"))
NAMES = [path.stem for path in FILES]
MATHML = "{http://www.w3.org/1998/Math/MathML}"
TOKENS = {"mi", "mn", "mo", "mtext"}

# Every name here means something in a printout or in Python.
CLASHING = """\
kinegen: 1
name: clash
convention: standard
units: {length: m, angle: deg}
parameters: {c1: 0.3, s23: 0.2, q3: 0.1, px: 0.05, r11: 0.07, lambda: 0.4, math: 0.6, s_2: 0.8}
joints:
  - {name: one, alpha: 360/7, a: c1, d: s23, theta: q}
  - {name: two, alpha: 0, a: q3, d: lambda, theta: q}
  - {name: three, alpha: 90, a: px + math, d: r11, theta: q + 10}
  - {name: four, alpha: 0, a: sqrt(s_2*s_2), d: 1/3, theta: 2/3*three}
"""


def parsed(text: str) -> ET.Element:
    """Printed MathML as it stands on a page; it is our own and no stranger's."""
    return ET.fromstring(f"<body>{text}</body>")  # noqa: S314


def show(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> str:
    """What `kinegen show` prints."""
    assert main(["show", *map(str, arguments)]) == 0

    out, err = capsys.readouterr()
    assert err == ""
    return out


def printed_pose(robot: Robot, text: str, name: str, q: np.ndarray) -> np.ndarray:
    """Runs the printed Python and evaluates one of its functions."""
    functions: dict[str, Any] = {}
    exec(text, functions)  # noqa: S102 - it is what the user does with it
    return np.array(functions[name](q))


def text_entries(text: str) -> dict[str, str]:
    """The entries that stand one a line, broken lines joined."""
    joined = re.sub(r"\n +(?=[+-] )", " ", text)
    return dict(re.findall(r"^  ([rp][123xyz]{1,2}) = (.*)$", joined, re.M))


def test_the_table_comes_first(capsys: pytest.CaptureFixture[str]) -> None:
    head = show(capsys, ROBOTS / "puma560.yaml").split("\n\n")

    assert head[0].splitlines()[0].startswith("puma560: Unimation PUMA 560")
    assert head[0].splitlines()[1:] == [
        "modified convention (proximal, Craig): one row is Rx(alpha) Tx(a) Rz(theta) Tz(d)",
        "units: m and deg in the table, m and rad in the closed form",
    ]
    assert head[1].splitlines()[::3] == [
        "  i  joint       alpha_{i-1}  a_{i-1}  d_i  theta_i",
        "  3  elbow                 0       a2   d3       q3",
        "  6  flange              -90        0    0       q6",
    ]


def test_the_closed_form_is_factored_and_explained(capsys: pytest.CaptureFixture[str]) -> None:
    text = show(capsys, ROBOTS / "puma560.yaml")

    assert "  px = c1*(a2*c2 + a3*c23 - d4*s23) - d3*s1\n" in text
    assert "c23 = cos(q2 + q3), s23 = sin(q2 + q3)\n" in text
    assert "  q1 waist, q2 shoulder, q3 elbow, q4 forearm, q5 wrist_bend, q6 flange\n" in text
    assert text.endswith("  a2 = 0.4318 m, a3 = 0.0203 m, d3 = 0.15005 m, d4 = 0.4318 m\n")


def test_a_narrow_form_is_a_matrix(capsys: pytest.CaptureFixture[str]) -> None:
    text = show(capsys, ROBOTS / "puma560.yaml", "--from", "3", "--to", "6")

    assert (
        "      [  c4*c5*c6 - s4*s6  -c4*c5*s6 - s4*c6  -c4*s5  a3 ]\n"
        "3T6 = [             s5*c6             -s5*s6      c5  d4 ]\n"
        "      [ -s4*c5*c6 - c4*s6   s4*c5*s6 - c4*c6   s4*s5   0 ]\n"
        "      [                 0                  0       0   1 ]\n"
    ) in text


def test_a_narrow_terminal_gets_entries(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    text = show(capsys, ROBOTS / "puma560.yaml", "--from", "1", "--to", "3")
    assert "1T3 = [" in text

    text = show(capsys, ROBOTS / "puma560.yaml", "--from", "2", "--to", "6")

    assert text_entries(text)["r31"] == "-s4*c5*c6 - c4*s6"
    assert max(len(line) for line in text.split("\n\n", 2)[2].splitlines()) <= 60


def test_steps_are_the_link_matrices_and_their_products(capsys: pytest.CaptureFixture[str]) -> None:
    text = show(capsys, ROBOTS / "puma560.yaml", "--to", "3", "--steps")

    assert re.findall(r"^(\w+) = \[", text, re.M) == ["0T1", "1T2", "2T3", "0T2", "0T3"]


def test_a_link_is_not_printed_twice(capsys: pytest.CaptureFixture[str]) -> None:
    text = show(capsys, ROBOTS / "puma560.yaml", "--from", "1", "--to", "2", "--steps")

    assert text.count("1T2 = ") == 1


def test_base_and_tool_are_steps_too(capsys: pytest.CaptureFixture[str]) -> None:
    text = show(capsys, ROBOTS / "standard_frames.yaml", "--steps")

    assert re.findall(r"^(\w+) = \[", text, re.M) == [*("0T1", "1T2", "2T3", "3_T_tool", "0T2", "0T3", "base_T_tool")]


def test_the_way_back_is_the_inverse(capsys: pytest.CaptureFixture[str]) -> None:
    text = show(capsys, ROBOTS / "puma560.yaml", "--from", "2", "--to", "1")

    assert "      [  c2  0  -s2  0 ]\n2T1 = [ -s2  0  -c2  0 ]\n" in text


def test_a_tree_shows_every_tip(capsys: pytest.CaptureFixture[str]) -> None:
    text = show(capsys, ROBOTS / "hand.yaml")
    tips = load(ROBOTS / "hand.yaml").tips

    assert re.findall(r"^base_T_(\w+)", text, re.M) == list(tips)
    # Labels without a name of their own mean one angle on the whole page.
    labels = re.findall(r"cu(\d) = ", text)
    assert labels == sorted(set(labels))


def test_rows_of_a_tree_say_where_they_start(capsys: pytest.CaptureFixture[str]) -> None:
    table = show(capsys, ROBOTS / "hand.yaml").split("\n\n")[1]

    assert table.splitlines()[7].split()[:5] == ["7", "0", "index_root", "Tx(90)", "Ty(25)"]
    assert table.splitlines()[11].split()[:3] == ["11", "10", "index_3"]


def test_a_chain_that_no_page_could_hold_is_cut(capsys: pytest.CaptureFixture[str]) -> None:
    text = show(capsys, ROBOTS / "human_body.yaml")

    assert "base_T_tool = base_T_7 * 7T14 * 14_T_tool\n" in text
    assert len(text) < 20_000


def test_mixed_conventions_have_a_column(capsys: pytest.CaptureFixture[str]) -> None:
    table = show(capsys, ROBOTS / "calibrated_2r.yaml").split("\n\n")[1]

    assert [line.split() for line in table.splitlines()] == [
        ["i", "joint", "convention", "alpha", "a", "d", "theta", "beta"],
        ["1", "joint_1", "hayati", "tilt", "L1", "q1", "skew"],
        ["2", "joint_2", "standard", "0", "L2", "0", "q2", "+", "zero_2"],
    ]


def test_a_chain_without_joints_is_a_number(capsys: pytest.CaptureFixture[str]) -> None:
    text = show(capsys, ROBOTS / "blocks.yaml")

    assert text.endswith(
        "              [  0  1  0   7 ]\n"
        "base_T_tool = [ -1  0  0  -8 ]\n"
        "              [  0  0  1   6 ]\n"
        "              [  0  0  0   1 ]\n"
    )


def test_an_unknown_frame_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", str(ROBOTS / "puma560.yaml"), "--to", "hand"]) == 1
    assert capsys.readouterr().err == (
        "error: unknown frame 'hand' (expected base, waist, shoulder, elbow, forearm, wrist_bend, flange, tool, "
        "or a number from 0 to 6)\n"
    )


def test_an_unknown_notation_is_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", str(ROBOTS / "puma560.yaml"), "--format", "word"]) == 2
    assert "'word' is not one of 'text', 'latex', 'mathml', 'python'" in capsys.readouterr().err


@pytest.mark.parametrize("path", FILES, ids=NAMES)
def test_printed_python_computes_the_pose(path: Path) -> None:
    robot = load(path)
    text = python_sheet(make_sheet(robot, None, None, steps=True))
    q = np.random.default_rng(4).uniform(-1, 1, robot.dof)
    expected = reference.frames(robot, q)

    for tip in robot.tips:
        size = max(1.0, np.abs(expected[tip]).max())
        assert np.abs(printed_pose(robot, text, f"base_T_{tip}", q) - expected[tip][0]).max() < 1e-13 * size


def test_printed_python_takes_other_parameters() -> None:
    robot = load(ROBOTS / "puma560.yaml")
    text = python_sheet(make_sheet(robot, None, None))
    functions: dict[str, Any] = {}
    exec(text, functions)  # noqa: S102 - it is what the user does with it
    q = np.linspace(0.1, 0.6, 6)
    expected = reference.pose(robot, q, {"a2": 0.5, "d3": -0.1})[0, 0]

    assert np.abs(functions["base_T_tool"](q, a2=0.5, d3=-0.1) - expected).max() < 1e-15


def test_partial_products_are_functions_with_names(capsys: pytest.CaptureFixture[str]) -> None:
    text = show(capsys, ROBOTS / "puma560.yaml", "--from", "1", "--to", "3", "--format", "python")
    robot = load(ROBOTS / "puma560.yaml")
    q = np.linspace(0.1, 0.6, 6)
    frames = reference.frames(robot, q)
    expected = np.linalg.inv(frames["waist"][0]) @ frames["elbow"][0]

    assert np.abs(printed_pose(robot, text, "frame1_T_frame3", q) - expected).max() < 1e-15


def test_names_that_mean_something_else_stay_apart() -> None:
    robot = loads(CLASHING, "clash.yaml")
    sheet = make_sheet(robot, None, None)
    q = np.array([0.3, -0.7, 1.1])
    printed = printed_pose(robot, python_sheet(sheet), "base_T_tool", q)
    text = text_sheet(sheet)

    assert np.abs(printed - reference.pose(robot, q)[0, 0]).max() < 1e-15
    assert "c1_ = 0.3 m, s23_ = 0.2 m, q3_ = 0.1 m, px_ = 0.05 m, r11_ = 0.07 m, lambda = 0.4 m" in text
    assert text.splitlines()[5].split() == ["1", "one", "360/7", "c1_", "s23_", "q1"]


@pytest.mark.parametrize("path", [*FILES, "clash"], ids=[*NAMES, "clash"])
def test_latex_is_balanced(path: Path | str) -> None:
    robot = load(path) if isinstance(path, Path) else loads(CLASHING, "clash.yaml")
    text = latex_sheet(make_sheet(robot, None, None, steps=True))
    opened: list[str] = []
    for kind, name in re.findall(r"\\(begin|end)\{([a-z*]+)\}", text):
        if kind == "begin":
            opened.append(name)
        else:
            assert opened.pop() == name

    assert opened == []
    for line in re.sub(r"\\[{}]", "", text).splitlines():
        assert line.count("{") == line.count("}")
        assert line.count(r"\left") == line.count(r"\right")
    # TeX ends a formula at an empty line, and does so with an error.
    for formula in re.findall(r"\\begin\{(?:align|equation)\*\}.*?\\end\{(?:align|equation)\*\}", text, re.S):
        assert "\n\n" not in formula


def test_latex_says_what_a_textbook_says(capsys: pytest.CaptureFixture[str]) -> None:
    text = show(capsys, ROBOTS / "puma560.yaml", "--format", "latex")

    assert r"p_{x} &= c_{1} \, (a_{2} \, c_{2} + a_{3} \, c_{23} - d_{4} \, s_{23}) - d_{3} \, s_{1}" in text
    assert r"{}^{\text{base}}T_{\text{tool}} = \begin{bmatrix}" in text
    assert r"c_{23} &= \cos\left(q_{2} + q_{3}\right), & s_{23} &= \sin\left(q_{2} + q_{3}\right)" in text
    assert r"q_{5} &\colon \text{wrist\_bend}" in text


@pytest.mark.parametrize("path", FILES, ids=NAMES)
def test_mathml_is_one_element_for_each_transform(path: Path) -> None:
    robot = load(path)
    sheet = make_sheet(robot, None, None, steps=True)
    page = parsed(mathml_sheet(sheet))
    forms = [*sheet.links, *(form for product in sheet.products for form in product.factors)]
    products = sum(len(product.factors) > 1 for product in sheet.products)

    assert [element.tag for element in page] == [f"{MATHML}math"] * (len(forms) + products)


@pytest.mark.parametrize("path", FILES, ids=NAMES)
def test_mathml_shows_every_number_of_the_text(path: Path) -> None:
    """Browsers show the text of token elements alone, and numbers outside of them are lost."""
    for form in make_sheet(load(path), None, None).products[0].factors:
        texts, markups = (entry_texts(form, NOTATIONS[name]) for name in ("text", "mathml"))
        for text, markup in zip(chain(*texts), chain(*markups), strict=True):
            elements = list(parsed(markup).iter())

            assert all(each.tag in TOKENS or not each.text for each in elements)
            assert not any(each.tail for each in elements)
            shown = [each.text for each in elements if each.tag == "mn"]
            assert Counter(shown) >= Counter(re.findall(r"(?<![\w.])[0-9]+\.[0-9]+", text)), text


def test_mathml_comments_cannot_be_closed_by_a_description() -> None:
    robot = loads(TWO.replace("Two joints", "--> <b>two</b> --"), "two.yaml")
    page = parsed(mathml_sheet(make_sheet(robot, None, None)))

    assert [element.tag for element in page] == [f"{MATHML}math"]


def test_a_description_cannot_leave_its_docstring() -> None:
    robot = loads(TWO.replace("Two joints", '\'"""; raise SystemExit; """\''), "two.yaml")
    text = python_sheet(make_sheet(robot, None, None))

    assert printed_pose(robot, text, "base_T_tool", np.zeros(2)).shape == (4, 4)


def test_words_of_c_are_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A name is refused only by what cannot have it."""
    path = tmp_path / "double.yaml"
    path.write_text(TWO.replace("name: two", "name: double", 1), encoding="utf-8")

    assert show(capsys, path).startswith("double")
    assert main(["check", str(path)]) == 1
    assert "robot name 'double' is a C keyword" in capsys.readouterr().err


def test_words_of_the_robot_file_are_not_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "base.yaml"
    path.write_text(TWO.replace("name: two", "name: pi", 1), encoding="utf-8")

    assert main(["show", str(path)]) == 1
    assert "robot name 'pi' is a word of the robot file itself" in capsys.readouterr().err
