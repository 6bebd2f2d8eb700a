"""The compilers for other systems and Wine, found or named with what provides them."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest

from scripts.install_windows import BUILD, GCC, GXX, MISSING, WINE_PLACES, ZIG

FLAGS = ("-std=c99", "-O1", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror")
"""How C is compiled on both systems; on x86-64 both compute with SSE2."""

SERVICES = ("explorer.exe", "plugplay.exe", "rpcss.exe", "services.exe", "svchost.exe", "winedevice.exe")
"""Programs of Wine that would start with the first one of ours, and keep its output open for seconds."""

LINGER = 15
"""Seconds that Wine waits for the next program."""


def need(*commands: str) -> None:
    """Skip the test where a compiler is missing, and say how to get it."""
    for command in commands:
        if shutil.which(command) is None:
            pytest.skip(f"needs {command} ({MISSING[command]})")


def wine() -> str:
    """The loader of 64-bit programs, which Debian keeps out of the PATH."""
    found = shutil.which("wine64", path=os.pathsep.join((os.environ.get("PATH", ""), *WINE_PLACES)))
    if found is None:
        pytest.skip(f"needs wine64 ({MISSING['wine64']})")
    return found


def zig() -> str:
    """The compiler of C and C++ for all systems."""
    if not ZIG.exists():
        pytest.skip(f"needs ziglang ({MISSING['zig']})")
    return str(ZIG)


def wine_environment() -> dict[str, str]:
    """What Wine needs to run a program of the console: a folder of its own, no services, no words about these."""
    left_out = ",".join(("mscoree", "mshtml", *SERVICES))
    own = {"WINEPREFIX": str(BUILD / "wine"), "WINEDEBUG": "-all", "WINEDLLOVERRIDES": f"{left_out}="}
    return {name: value for name, value in os.environ.items() if name != "DISPLAY"} | own


def serve() -> None:
    """Start what all programs in Wine share. It ends some seconds after the last one, so nobody has to end it."""
    loader = wine()
    server = next(Path(loader).parent.glob("wineserver*"), None) or shutil.which("wineserver")
    if server is not None:
        command = [str(server), f"--persistent={LINGER}"]
        subprocess.run(
            command, env=wine_environment(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False
        )


def run(command: Sequence[str | Path], folder: Path, **variables: str) -> str:
    """Run a program that must succeed; what it prints, with the line ends of this system."""
    environment = wine_environment() | {"ZIG_GLOBAL_CACHE_DIR": str(BUILD / "zig-cache")} | variables
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False, timeout=300
    )
    assert done.returncode == 0, f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}"
    return done.stdout


__all__ = ["BUILD", "FLAGS", "GCC", "GXX", "need", "run", "serve", "wine", "wine_environment", "zig"]
