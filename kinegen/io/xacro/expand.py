"""xacro text -> URDF text -> `Robot`.

xacro evaluates expressions as Python and includes files. Here it runs in a process of its own with bounded time and
memory (`sandbox.py`), its expressions compute with plain data alone (`evaluate.py`), and its files come from packages
around the robot and from named folders (`files.py`).
"""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from kinegen.errors import RobotFileError, printable, quote
from kinegen.io import xml
from kinegen.io.format import Imported, ReadOptions
from kinegen.io.link_tree.assemble import assemble
from kinegen.io.messages import fail
from kinegen.io.urdf import link_tree

SECONDS = 10
"""Seconds of CPU time of an expansion at most."""

_PATIENCE = 120
"""Seconds until a process is ended that does not use its CPU time: a busy machine gives a right file little."""

_SANDBOX = Path(__file__).with_name("sandbox.py")
_ENVIRONMENT = {"PATH": os.defpath, "PYTHONSAFEPATH": "1", "PYTHONHASHSEED": "0"}
"""No module comes from the folder of the script, and a set is written in the same order each time."""


def read(data: bytes, path: Path, options: ReadOptions) -> Imported:
    """Expand a xacro file, whose includes are searched beside it, and read the URDF that it gives.

    Raises:
        RobotFileError: At the first defect, in the file or in what it expands to.
        ModuleNotFoundError: Without the package xacro.
    """
    xml.parse(data)
    if importlib.util.find_spec("xacro") is None:
        raise ModuleNotFoundError("No module named 'xacro'", name="xacro")
    text = expanded(path, options)
    try:
        return assemble(link_tree(xml.parse(text), path.stem, options.snap), path.name, options)
    except RobotFileError as error:
        # A line of the expanded text would lead nowhere in the file.
        raise RobotFileError(f"after expansion: {error.message}") from None


def expanded(path: Path, options: ReadOptions) -> bytes:
    """Return the URDF text that xacro makes of a file, with the arguments and packages of the options."""
    request = {
        "file": str(path.absolute()),
        "packages": {name: str(Path(folder).absolute()) for name, folder in options.packages},
        "arguments": dict(options.arguments),
        "path": _module_folders(),
        "seconds": SECONDS,
        "bytes": xml.MAX_BYTES,
    }
    try:
        # The time is bounded twice: by the process itself, and from outside where the system cannot.
        done = subprocess.run(
            [sys.executable, "-s", str(_SANDBOX)],
            input=json.dumps(request).encode(),
            capture_output=True,
            timeout=_PATIENCE,
            check=False,
            env=_ENVIRONMENT | {name: os.environ[name] for name in ("HOME",) if name in os.environ},
        )
        answer = json.loads(done.stdout)
    except subprocess.TimeoutExpired:
        fail(f"xacro did not end within {_PATIENCE} s")
    except ValueError:
        fail(f"xacro took more than {SECONDS} s of CPU time or too much memory, or ended without an answer")
    if "error" in answer:
        message = f"xacro: {printable(str(answer['error']))}"
        if answer.get("package"):
            message = f"package {quote(answer['package'])} is not found; name its folder with --package-path NAME=DIR"
        raise RobotFileError(message, *_place(path, answer.get("place")))
    return str(answer["urdf"]).encode()


def _module_folders() -> list[str]:
    """List the folders of modules, without the working directory, which may hold a file such as `yaml.py`."""
    here = os.path.realpath(os.curdir)
    return [each for each in sys.path if Path(each).is_absolute() and os.path.realpath(each) != here]


def _place(path: Path, place: list[Any] | None) -> tuple[str | None, int | None]:
    """Return file and line of an error: no file for the robot's own, others relative to its folder."""
    if place is None:
        return None, None
    name, line = os.path.realpath(str(place[0])), int(place[1])
    if name == os.path.realpath(path):
        return None, line
    return os.path.normpath(path.parent / os.path.relpath(name, os.path.realpath(path.parent))), line
