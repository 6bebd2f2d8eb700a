"""Installs what `make test-controllers` takes, where we may: LinuxCNC, Eigen and compilers.

    python scripts/install_controllers.py

On Debian, as root, whatever is missing is installed by apt-get. Elsewhere the command for it is printed; the tests then
skip what they cannot run and say why.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

from debian import install

PACKAGES = {
    "gcc": "gcc",
    "g++": "g++",
    "cmake": "cmake",
    "setpriv": "util-linux",
    "halrun": "linuxcnc-uspace",
    "halcompile": "linuxcnc-uspace-dev",
}
"""The commands, and what provides each on Debian."""

HEADERS = {"/usr/include/eigen3": "libeigen3-dev"}
"""The folders of headers, and what provides each on Debian."""


def main() -> int:
    """Install what is missing; 0 even where that is not possible, since the tests report it."""
    packages = sorted({package for command, package in PACKAGES.items() if shutil.which(command) is None})
    packages += [package for folder, package in HEADERS.items() if not Path(folder).exists()]
    install(packages)
    return 0


if __name__ == "__main__":
    sys.exit(main())
