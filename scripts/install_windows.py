"""Installs what `make test-windows` takes, where we may: compilers for Windows and macOS, and Wine.

    python scripts/install_windows.py

On Debian, as root, whatever is missing is installed by apt-get. Elsewhere the command for it is printed; the tests then
skip what they cannot run and say why. The compiler for macOS and for the dialect of MSVC is that of Zig, which comes
from PyPI to `build/windows`; Wine keeps its files there too.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parent))

from debian import install

BUILD = Path(__file__).resolve().parents[1] / "build" / "windows"
"""The folder of what is installed without the system's packages."""

GCC, GXX = "x86_64-w64-mingw32-gcc", "x86_64-w64-mingw32-g++"

PACKAGES = {GXX: "g++-mingw-w64-x86-64-win32", "wine64": "wine64", "gcc": "gcc", "g++": "g++", "cmake": "cmake"}
"""The commands, and what provides each on Debian. One of the two models of threads is enough; nothing has threads."""

WINE_PLACES = ("/usr/lib/wine", "/usr/local/lib/wine")
"""Where Debian keeps the command of Wine."""

ZIGLANG = "ziglang==0.17.1"  # a later clang may warn of more
ZIG = BUILD / "zig" / "ziglang" / "zig"

MISSING = {
    **{command: f"Debian: apt-get install {package}" for command, package in PACKAGES.items()},
    GCC: f"Debian: apt-get install {PACKAGES[GXX]}",
    "zig": f"pip install --target build/windows/zig '{ZIGLANG}'",
}
"""How to get each, for the reason of a skipped test."""


def main() -> int:
    """Install what is missing; 0 even where that is not possible, since the tests report it."""
    install(sorted({package for command, package in PACKAGES.items() if not found(command)}))
    if not ZIG.exists():
        _install_zig()
    command = found("wine64")
    if command and not (BUILD / "wine" / "system.reg").exists():
        # Once and beforehand: two tests that begin at the same time would both want to make it.
        BUILD.mkdir(parents=True, exist_ok=True)
        own = {"WINEPREFIX": str(BUILD / "wine"), "WINEDEBUG": "-all", "WINEDLLOVERRIDES": "mscoree,mshtml="}
        environment = {name: value for name, value in os.environ.items() if name != "DISPLAY"} | own
        silent = subprocess.DEVNULL  # a pipe would stay open as long as the services of Wine
        subprocess.run([command, "wineboot", "-i"], env=environment, stdout=silent, stderr=silent, check=False)
    return 0


def found(command: str) -> str | None:
    """The path of a command; None where it is missing."""
    return shutil.which(command, path=os.pathsep.join((os.environ.get("PATH", ""), *WINE_PLACES)))


def _install_zig() -> None:
    """Fetch the compiler of Zig; where that fails, the tests that take it say so."""
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps"]
    done = subprocess.run([*command, "--no-compile", "--target", str(BUILD / "zig"), ZIGLANG], check=False)
    if done.returncode:
        print(f"{ZIGLANG} could not be installed; tests that compile for macOS and MSVC are skipped")


if __name__ == "__main__":
    sys.exit(main())
