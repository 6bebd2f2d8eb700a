"""Installs the cross compilers and emulators that `make test-boards` uses, where we may.

    python scripts/install_boards.py

On Debian, as root, whatever commands are missing are installed by apt-get. Elsewhere the command for it is printed; the
tests then skip what they cannot run and say why.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "scripts")]

from debian import install  # noqa: E402

from kinegen.verify.boards.targets import TARGETS, missing  # noqa: E402

HOST = {"gcc": ("gcc", "libc6-dev"), "clang": ("clang",)}
"""The compilers whose results the boards are compared with."""


def main() -> int:
    """Installs what is missing; returns 0 even where that is not possible, since the tests tell."""
    install(wanted())
    return 0


def wanted() -> list[str]:
    """The packages behind the commands that this machine lacks."""
    lacking = {command: packages for command, packages in HOST.items() if shutil.which(command) is None}
    for target in TARGETS.values():
        lacking |= missing(target)
    return sorted({package for packages in lacking.values() for package in packages})


if __name__ == "__main__":
    sys.exit(main())
