"""Installs what runs the languages beside C and Python in `make test-languages`, where we may.

    python scripts/install_languages.py

On Debian, as root, whatever commands are missing are installed by apt-get. Elsewhere the command for it is printed; the
tests then skip what they cannot run and say why. NVRTC, which compiles CUDA without a GPU, comes from PyPI to
build/nvrtc.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

from debian import install

PACKAGES = {
    "node": "nodejs",
    "rustc": "rustc",
    "cargo": "cargo",
    "clang": "clang",
    "wasm-ld": "lld",
    "g++": "g++",
    "cmake": "cmake",
    "octave-cli": "octave",
    "mkoctfile": "octave-dev",
}
"""The commands, and what provides each on Debian."""

HEADERS = {"/usr/include/eigen3": "libeigen3-dev"}
"""The folders of headers, and what provides each on Debian."""


NVRTC = "nvidia-cuda-nvrtc-cu12"
"""The package with the compiler of CUDA; it has no dependencies and needs no driver."""

FOLDER = Path(__file__).resolve().parents[1] / "build" / "nvrtc"


def main() -> int:
    """Install what is missing; 0 even where that is not possible, since the tests report it."""
    packages = sorted({package for command, package in PACKAGES.items() if not is_installed(command)})
    packages += [package for folder, package in HEADERS.items() if not Path(folder).exists()]
    install(packages)
    if sys.platform == "linux" and not list(FOLDER.rglob("libnvrtc.so.*")):
        install_nvrtc()
    return 0


def install_nvrtc() -> None:
    """Fetch NVRTC; where that fails, the tests that take it say so."""
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps"]
    done = subprocess.run([*command, "--target", str(FOLDER), NVRTC], check=False)
    if done.returncode:
        print(f"{NVRTC} could not be installed; tests that compile CUDA are skipped")


def is_installed(command: str) -> bool:
    """Whether a command can be run; Debian's linker has the release in its name."""
    names = [command, *(f"{command}-{release}" for release in range(14, 25))]
    return any(map(shutil.which, names))


if __name__ == "__main__":
    sys.exit(main())
