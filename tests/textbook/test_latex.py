"""The LaTeX that is printed fits an A4 page, and a web page takes it; the widths are those that pdflatex measures."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from kinegen.backends.textbook.latex_lines import LINE, lines, width
from kinegen.backends.textbook.notation import NOTATIONS
from kinegen.backends.textbook.sheet import make_sheet
from kinegen.backends.textbook.sheet_latex import latex_sheet
from kinegen.backends.textbook.sheet_text import text_sheet
from kinegen.io.load import load, loads
from tests.textbook.catalog import ROBOTS
from tests.textbook.formulas import FILES, display_width, formulas, latex_sheets

PAGE = 345.0
"""Points of a line in the class article on A4 paper."""

KNOWN = frozenset(
    r"""
    \, \; \_ \alpha \arccos \arcsin \arctan \begin \beta \Bigl \Bigr \colon \cos \delta \Delta \end \frac
    \gamma \hline \lambda \left \mathrm \mu \operatorname \phi \pi \psi \quad \right \sin \sqrt \text \theta
    """.split()
)
"""Commands that LaTeX with amsmath, KaTeX and MathJax have in common, as far as they are needed."""

MEASURED = (
    (r"c_{1} \, (a_{2} \, c_{2} + a_{3} \, c_{23} - d_{4} \, s_{23}) - d_{3} \, s_{1}", 144.5),
    (r"-s_{1} \, c_{234} \, s_{5} - c_{1} \, c_{5}", 77.8),
    (r"\frac{\sqrt{3}}{4} \, (s_{1} \, (c_{2} + 1) + 2 \, c_{1} \, s_{2})", 108.4),
    (r"0.25 + 0.5 \, s_{2} + 0.25 \, s_{23} + 0.2 \, s_{234}", 142.3),
    (r"\frac{\sqrt{2} \, s_{2} \, s_{3}}{2} - c_{2} \, c_{3}", 68.9),
    (r"\sqrt{{\mathrm{forward}}^{2} + {\mathrm{rise}}^{2}} \, c_{u1}", 94.9),
    (r"L_{1} + \Delta_{d} + d_{f} + l_{T1} + l_{2a} + \alpha_{1} + L_{\mathrm{arm}}", 165.0),
    (r"\cos\left(q_{1} + q_{2} + q_{3}\right)", 74.1),
    (r"\sin\left(\frac{3 \, q_{1}}{2} + q_{2}\right)", 67.9),
    (r"-q_{1} + \pi/2", 45.0),
    (r"\arctan(\mathrm{rise}/\mathrm{forward})", 89.1),
    (
        (
            r"r_{32} = \Bigl(\cos\left(\frac{2 \, \pi}{9}\right) \, "
            r"\left(\cos\left(\frac{23 \, \pi}{90}\right) \, c_{4} \, "
            r"\left(\frac{\sqrt{2}}{4} + \frac{\sqrt{6}}{4}\right) - \sin\left(\frac{23 \, \pi}{90}\right) \, "
            r"\left(\frac{\sqrt{2}}{4} - \frac{\sqrt{6}}{4}\right)\right)"
        ),
        345.1,
    ),
    (r"{}^{\text{base}}T_{\text{tool}}", 35.5),
    (r"c_{1-2-4} + s_{1,12} + s_{\alpha_{1}}", 87.5),
    (r"\text{thumb\_tip} \colon \text{same as thumb\_5}", 125.6),
    (r"T_{z}(-q_{2} + 2.5) \, R_{x}(180)", 97.0),
    (r"\alpha_{i-1} \; [\mathrm{deg}]", 43.4),
    (r"\frac{c_{2} + 1}{2}", 28.4),
    (r"(3 \, c_{1} - 2 \, s_{1}) \, \left(\frac{c_{2}}{2} - \frac{s_{2}}{3}\right)", 101.6),
)
"""Formulas with their width by pdflatex 3.14 (TeX Live 2022), class article at 10 pt with amsmath, in points."""


@pytest.mark.parametrize(("formula", "points"), MEASURED)
def test_widths_are_those_of_tex(formula: str, points: float) -> None:
    assert points - 4 < width(formula) < points + 6


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_display_fits_the_page(path: Path) -> None:
    displays = [display for sheet in latex_sheets(path) for display in formulas(sheet)]

    assert [body[:200] for _, body in displays if display_width(body) > PAGE] == []
    assert all(body.count("\n") < 24 for name, body in displays if name == "align*")


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_pages_of_the_web_know_every_command(path: Path) -> None:
    r"""`\multicolumn` would lose the whole table in KaTeX and MathJax."""
    text = latex_sheet(make_sheet(load(path), None, None, steps=True))
    commands = set(re.findall(r"\\[A-Za-z]+", "".join(body for _, body in formulas(text))))

    assert commands <= KNOWN


def test_a_long_entry_is_broken_at_its_outermost_sum_first() -> None:
    texts = latex_sheet(make_sheet(load(ROBOTS / "panda.yaml"), None, None)).splitlines()
    start = next(place for place, text in enumerate(texts) if text.startswith("r_{11} &="))
    first, inside, outside = texts[start : start + 3]

    assert first.startswith(r"r_{11} &= c_{1} \, (c_{2} \, (")
    assert inside.startswith(r"  &\quad\quad {} + s_{2} \, (")
    assert outside.startswith(r"  &\quad {} - s_{1} \, (")


def test_brackets_on_two_lines_do_not_grow() -> None:
    half = r"\frac{c_{1}}{2}"
    found = lines(rf"a \, \left({' + '.join([half] * 30)}\right) + \left({half} + b\right)")

    assert len(found) > 2
    assert [text.count(r"\left") - text.count(r"\right") for text in found] == [0] * len(found)
    assert "".join(found).count(r"\Bigl(") == "".join(found).count(r"\Bigr)") == 1
    assert found[-1].endswith(rf"+ \left({half} + b\right)")
    assert all(width(text) <= LINE for text in found)


def test_what_stands_in_a_fraction_or_an_index_is_not_broken() -> None:
    sums = " + ".join(["c_{1-2}"] * 40)

    assert lines(rf"\frac{{{sums}}}{{2}}") == (rf"\frac{{{sums}}}{{2}}",)
    assert len(lines(sums)) > 2


MIXED = """\
kinegen: 1
name: mixed
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: rail, ets: [Tx(q), Rz(30)]}
  - {name: turn, theta: q + 45, d: 1/3, a: 0.25, alpha: 0}
frames:
  here: {parent: turn}
"""


def test_rows_that_are_sequences_stand_below_the_table() -> None:
    text = latex_sheet(make_sheet(loads(MIXED, "mixed.yaml"), None, None))
    table = text[: text.index(r"\end{array}")]

    assert r"\multicolumn" not in text
    assert r"1 & \text{rail} &  &  &  &  \\" in table
    assert r"\text{row } 1 \; \text{rail} &\colon T_{x}(q_{1}) \, R_{z}(30)" in text


def test_the_table_has_no_fractions_that_touch_other_rows() -> None:
    text = latex_sheet(make_sheet(loads(MIXED, "mixed.yaml"), None, None))
    table = text[: text.index(r"\end{array}")]

    assert r"\frac" not in table
    assert r"2 & \text{turn} & 0 & 0.25 & 1/3 & q_{2} + 45 \\" in table


def test_a_frame_without_a_transform_is_the_same_as_its_parent() -> None:
    sheet = make_sheet(loads(MIXED, "mixed.yaml"), None, None)

    assert r"\text{here} &\colon \text{same as turn}" in latex_sheet(sheet)
    assert any(line.split() == ["here", "turn", "same", "as", "turn"] for line in text_sheet(sheet).splitlines())


@pytest.mark.parametrize(
    ("name", "printed"),
    [
        ("df", "d_{f}"),
        ("l2a", "l_{2a}"),
        ("lT1", "l_{T1}"),
        ("Delta_d", r"\Delta_{d}"),
        ("L_arm", r"L_{\mathrm{arm}}"),
        ("alpha1", r"\alpha_{1}"),
        ("mu", r"\mu"),
        ("xi2", r"\xi_{2}"),
        ("a_max", r"a_{\mathrm{max}}"),
        ("tip", r"\mathrm{tip}"),
        ("link_length_upper", r"\mathrm{link\_length\_upper}"),
    ],
)
def test_names_of_parameters_have_their_indices(name: str, printed: str) -> None:
    assert NOTATIONS["latex"].symbol(name, "parameter") == printed
