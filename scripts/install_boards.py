"""Installs the cross compilers and emulators that `make test-boards` uses, where we may.

    python scripts/install_boards.py

On Debian, as root, whatever commands are missing are installed by apt-get. Elsewhere the command for it is printed; the
tests then skip what they cannot run and say why.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from kinegen.boards.targets import TARGETS  # noqa: E402
from kinegen.boards.toolchain import missing  # noqa: E402

HOST = {"gcc": ("gcc", "libc6-dev"), "clang": ("clang",)}
"""The compilers whose results the boards are compared with."""


def main() -> int:
    """Installs what is missing; returns 0 even where that is not possible, since the tests tell."""
    packages = wanted()
    if not packages:
        return 0
    install = ["apt-get", "-y", "-qq", "-o", "Acquire::Retries=3", "install", "--no-install-recommends", *packages]
    print(f"missing: {' '.join(packages)}", flush=True)
    if os.geteuid() != 0 or shutil.which("apt-get") is None:
        print(f"not root on Debian, so going on without; there, as root: {' '.join(install)}")
        return 0
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    for command in (["apt-get", "-qq", "-o", "Acquire::Retries=3", "update"], install):
        done = subprocess.run(command, env=environment, capture_output=True, text=True, errors="replace", check=False)
        if done.returncode:
            print("\n".join((done.stdout + done.stderr).splitlines()[-10:]))
            print(f"{' '.join(command)} failed, so going on without")
            return 0
    return 0


def wanted() -> list[str]:
    """The packages behind the commands that this machine lacks."""
    lacking = {command: packages for command, packages in HOST.items() if shutil.which(command) is None}
    for target in TARGETS.values():
        lacking |= missing(target)
    return sorted({package for packages in lacking.values() for package in packages})


if __name__ == "__main__":
    sys.exit(main())
