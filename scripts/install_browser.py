"""Installs what `make test-browser` takes besides Python packages, where we may: Chromium, Node.js and axe-core.

    python scripts/install_browser.py FOLDER

On Debian, as root, missing commands are installed by apt-get; elsewhere the command for it is printed. axe-core, which
looks for faults of accessibility, is installed by npm into FOLDER. The tests skip what they cannot run and say why.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

from debian import install, run

COMMANDS = {"chromium": ("chromium", "fonts-dejavu-core"), "npm": ("nodejs", "npm")}
"""Debian packages behind the commands that are needed."""

AXE = "axe-core@4.14.1"


def main(arguments: list[str]) -> int:
    """Installs what is missing; returns 0 even where that is not possible, since the tests report it."""
    packages = sorted({name for command, names in COMMANDS.items() if not shutil.which(command) for name in names})
    install(packages)
    folder = Path(arguments[0])
    if shutil.which("npm") and not (folder / "node_modules" / "axe-core" / "axe.min.js").exists():
        folder.mkdir(parents=True, exist_ok=True)
        run(["npm", "install", "--no-fund", "--no-audit", "--silent", "--prefix", str(folder), AXE])
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
