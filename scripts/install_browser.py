"""Installs what `make test-browser` takes besides Python packages, where we may: Chromium, Node.js, TeX and modules.

    python scripts/install_browser.py FOLDER

On Debian, as root, missing commands are installed by apt-get; elsewhere the command for it is printed. axe-core, which
looks for faults of accessibility, and KaTeX and MathJax, which render formulas, are installed by npm into FOLDER. The
tests skip what they cannot run and say why.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

from debian import install, run

COMMANDS = {
    "chromium": ("chromium", "fonts-dejavu-core"),
    "npm": ("nodejs", "npm"),
    "pdflatex": ("texlive-latex-base",),
}
"""Debian packages behind the commands that are needed."""

MODULES = ("axe-core@4.14.1", "katex@0.16.47", "mathjax-full@3.2.2")


def main(arguments: list[str]) -> int:
    """Installs what is missing; returns 0 even where that is not possible, since the tests report it."""
    packages = sorted({name for command, names in COMMANDS.items() if not shutil.which(command) for name in names})
    install(packages)
    folder = Path(arguments[0])
    names = [module.partition("@")[0] for module in MODULES]
    if shutil.which("npm") and not all((folder / "node_modules" / name).exists() for name in names):
        folder.mkdir(parents=True, exist_ok=True)
        run(["npm", "install", "--no-fund", "--no-audit", "--silent", "--prefix", str(folder), *MODULES])
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
