"""The LaTeX of every robot goes through pdflatex without a line that is too wide, and through KaTeX and MathJax."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.textbook.formulas import FILES, formulas, latex_sheets

MODULES = Path(__file__).parent.parent.parent / "build" / "browser" / "node_modules"
RENDER = Path(__file__).parent / "render.cjs"


@pytest.fixture(scope="module")
def every_sheet() -> list[str]:
    """What `kinegen show --format latex` prints of all robots: the pose with all steps, and the Jacobians."""
    return [sheet for path in FILES for sheet in latex_sheets(path)]


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="needs pdflatex; apt-get install texlive-latex-base")
def test_no_box_is_overfull_on_an_a4_page(every_sheet: list[str], tmp_path: Path) -> None:
    body = "\n\\clearpage\n".join(every_sheet)
    preamble = "\\documentclass[a4paper]{article}\n\\usepackage{amsmath}\n\\begin{document}\n"
    (tmp_path / "sheets.tex").write_text(f"{preamble}{body}\n\\end{{document}}\n", encoding="utf-8")
    command = ["pdflatex", "-interaction=nonstopmode", "sheets.tex"]
    ran = subprocess.run(command, check=False, cwd=tmp_path, capture_output=True, text=True, errors="replace")
    log = ran.stdout

    assert re.findall(r"^(?:Overfull|!).*", log, re.M) == []
    assert "Output written on sheets.pdf" in log


@pytest.mark.skipif(
    not (MODULES / "katex").exists(), reason="there is no KaTeX; run scripts/install_browser.py build/browser"
)
def test_katex_and_mathjax_render_every_display(every_sheet: list[str], tmp_path: Path) -> None:
    displays = [f"\\begin{{{name}}}{body}\\end{{{name}}}" for sheet in every_sheet for name, body in formulas(sheet)]
    (tmp_path / "displays.json").write_text(json.dumps(displays), encoding="utf-8")
    command = ["node", str(RENDER), str(MODULES), str(tmp_path / "displays.json")]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout

    assert printed == f"{len(displays)} displays\n"
