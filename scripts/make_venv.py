"""Makes the virtual environment that `make` works in; needs nothing but the standard library.

    python3 scripts/make_venv.py .venv

A usable environment is left as it is. Debian keeps `ensurepip` in a package of its own (python3-venv), so on a bare
machine `python3 -m venv` fails half way; then pip comes from the system's pip, from virtualenv, or as one wheel whose
hash is checked.
"""

from __future__ import annotations

import hashlib
import importlib.util
import shutil
import subprocess
import sys
import tempfile
import urllib.request
from pathlib import Path

# The wheel that installs itself where nothing else brings pip. The hash makes the download safe to run.
PIP_URL = (
    "https://files.pythonhosted.org/packages/ef/7d/500c9ad20238fcfcb4cb9243eede163594d7020ce87bd9610c9e02771876/"
    "pip-24.3.1-py3-none-any.whl"
)
PIP_SHA256 = "3790624780082365f47549d032f3770eeb2b1e8bd1f7b2e02dace1afa361b4ed"

NO_PIP = """\
error: this Python cannot make a virtual environment by itself, and pip could not be fetched ({reason}).
  On Debian and Ubuntu:  apt-get install python3-venv
  Or name another one:   make PYTHON=/path/to/python3.10"""


def main(folder: Path) -> int:
    """Makes the environment in a folder, or says in a few lines why it cannot."""
    if is_usable(folder):
        return 0

    # What stands there is half made or belongs to a Python that has gone.
    shutil.rmtree(folder, ignore_errors=True)
    try:
        make(folder)
    except (OSError, ValueError, subprocess.CalledProcessError) as error:
        shutil.rmtree(folder, ignore_errors=True)
        print(NO_PIP.format(reason=error), file=sys.stderr)
        return 1
    return 0


def is_usable(folder: Path) -> bool:
    """Tells whether a folder holds an environment with pip and with a new enough Python."""
    probe = "import sys, pip; sys.exit(sys.version_info < (3, 10))"
    python = folder / "bin" / "python"
    return python.exists() and subprocess.run([python, "-c", probe], capture_output=True, check=False).returncode == 0


def make(folder: Path) -> None:
    """Makes the environment by the first way that this machine offers."""
    if has("venv") and has("ensurepip"):
        run(sys.executable, "-m", "venv", folder)
    elif has("venv") and has("pip"):
        run(sys.executable, "-m", "venv", "--without-pip", folder)
        run(sys.executable, "-m", "pip", "--python", folder / "bin" / "python", "install", "--quiet", "pip")
    elif shutil.which("virtualenv"):
        run("virtualenv", "--quiet", "--python", sys.executable, folder)
    else:
        run(sys.executable, "-m", "venv", "--without-pip", folder)
        install_pip(folder / "bin" / "python", PIP_URL, PIP_SHA256)


def has(module: str) -> bool:
    """Tells whether this Python has a module, without importing it."""
    return importlib.util.find_spec(module) is not None


def install_pip(python: Path, url: str, sha256: str) -> None:
    """Fetches pip's wheel, checks it, and lets it install itself.

    Args:
        python: Interpreter of the environment.
        url: Where the wheel is.
        sha256: What its bytes must hash to.

    Raises:
        ValueError: Something else came back.
    """
    with urllib.request.urlopen(url, timeout=60) as answer:  # noqa: S310 - an https address from this file
        wheel = answer.read()
    if hashlib.sha256(wheel).hexdigest() != sha256:
        raise ValueError(f"{url} is not the file it should be")
    with tempfile.TemporaryDirectory() as temporary:
        path = Path(temporary) / url.rsplit("/", 1)[-1]
        path.write_bytes(wheel)
        run(python, path / "pip", "install", "--quiet", "--no-index", path)


def run(*command: str | Path) -> None:
    """Runs a command and raises if it fails; its own words go to the screen."""
    subprocess.run(command, check=True)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
