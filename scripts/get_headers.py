"""Puts Python's C headers into a virtual environment where the system has none.

    python3 scripts/get_headers.py .venv

Compiled modules need `Python.h`, which Debian keeps in a package that a machine with python3 and gcc alone lacks. This
fetches that package through apt and unpacks its headers into the environment; nothing is installed on the system and
root is not needed. Where that fails, a line says so: kinegen then works on its NumPy kernels.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

VERSION = f"{sys.version_info.major}.{sys.version_info.minor}"
PACKAGE = f"libpython{VERSION}-dev"
NO_HEADERS = f"""\
note: Python.h is missing and could not be fetched ({{reason}}); kinegen will evaluate with NumPy.
  On Debian and Ubuntu:  apt-get install {PACKAGE}"""


def main(environment: Path) -> int:
    """Fetches the headers if they are needed and can be had; never fails."""
    target = environment / "include"
    present = (Path(sysconfig.get_path("include")) / "Python.h", target / f"python{VERSION}" / "Python.h")
    if any(header.is_file() for header in present) or shutil.which("cc") is None:
        return 0
    try:
        with tempfile.TemporaryDirectory() as temporary:
            shutil.copytree(fetch(Path(temporary)), target, dirs_exist_ok=True)
    except (OSError, subprocess.CalledProcessError) as error:
        print(NO_HEADERS.format(reason=error), file=sys.stderr)
    return 0


def fetch(folder: Path) -> Path:
    """Downloads and unpacks the package in a folder; returns where its headers are.

    Raises:
        OSError: There is no apt or no such file in the package.
        CalledProcessError: apt refused.
    """
    lists, cache = folder / "lists", folder / "cache"
    (lists / "partial").mkdir(parents=True)
    (cache / "archives" / "partial").mkdir(parents=True)
    # Lists of our own: those of the system may be missing, and only root may renew them.
    options = ("-qq", "-o", f"Dir::State::Lists={lists}", "-o", f"Dir::Cache={cache}", "-o", "APT::Sandbox::User=")
    subprocess.run(("apt-get", *options, "update"), check=True, capture_output=True)
    subprocess.run(("apt-get", *options, "download", PACKAGE), check=True, capture_output=True, cwd=folder)
    package = next(folder.glob("*.deb"), None)
    if package is None:
        raise OSError(f"apt brought no {PACKAGE}")
    subprocess.run(("dpkg-deb", "-x", package, folder / "unpacked"), check=True, capture_output=True)
    return folder / "unpacked" / "usr" / "include"


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
