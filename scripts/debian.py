"""Installs Debian packages, where we may; shared by the scripts that prepare a machine for tests."""

from __future__ import annotations

import os
import shutil
import subprocess

_APT = ("apt-get", "-y", "-qq", "-o", "Acquire::Retries=3")


def install(packages: list[str]) -> None:
    """Install packages as root on Debian; elsewhere print the command for it.

    Args:
        packages: Their names; nothing happens without any.
    """
    if not packages:
        return
    print(f"missing: {' '.join(packages)}", flush=True)
    command = [*_APT, "install", "--no-install-recommends", *packages]
    if os.geteuid() != 0 or shutil.which("apt-get") is None:
        print(f"not root on Debian, so going on without; there, as root: {' '.join(command)}")
        return
    _ = run([*_APT, "update"]) and run(command)


def run(command: list[str]) -> bool:
    """Run a command without questions, and print the end of what it says if it fails.

    Args:
        command: The command and its arguments.

    Returns:
        Whether it succeeded.
    """
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, errors="replace", check=False)
    if done.returncode:
        print("\n".join((done.stdout + done.stderr).splitlines()[-10:]))
        print(f"{' '.join(command)} failed, so going on without")
    return not done.returncode
