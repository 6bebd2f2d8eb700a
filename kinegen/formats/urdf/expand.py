"""xacro text -> URDF text -> `Robot`.

xacro evaluates expressions as Python and includes files, so it runs in a process of its own, with bounded time and
memory, restricted expressions, and files from the package of the robot and from named folders alone
(`sandbox.py`).
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
from kinegen.formats import xml
from kinegen.formats.format import Imported, ReadOptions
from kinegen.formats.links.assemble import assemble
from kinegen.formats.messages import fail
from kinegen.formats.urdf.read import link_tree

SECONDS = 10
_SANDBOX = Path(__file__).with_name("sandbox.py")


def read(data: bytes, path: Path, options: ReadOptions) -> Imported:
    """Expand a xacro file and read the URDF that it gives.

    Args:
        data: The text; includes are searched beside its file.
        path: Its file.
        options: Arguments and packages of xacro, and those of URDF.

    Raises:
        RobotFileError: At the first defect, in the file or in what it expands to.
        ModuleNotFoundError: Without the package xacro.
    """
    xml.parse(data)
    if importlib.util.find_spec("xacro") is None:
        raise ModuleNotFoundError("No module named 'xacro'", name="xacro")
    expanded = _expand(path, options)
    try:
        return assemble(link_tree(xml.parse(expanded), path.stem, options.snap), path.name, options)
    except RobotFileError as error:
        # A line of the expanded text would lead nowhere in the file.
        raise RobotFileError(f"after expansion: {error.message}") from None


def _expand(path: Path, options: ReadOptions) -> bytes:
    request = {
        "file": str(path.absolute()),
        "packages": dict(options.packages),
        "arguments": dict(options.arguments),
        "path": sys.path,
        "seconds": SECONDS,
        "bytes": xml.MAX_BYTES,
    }
    try:
        done = subprocess.run(
            [sys.executable, "-I", str(_SANDBOX)],
            input=json.dumps(request).encode(),
            capture_output=True,
            timeout=2 * SECONDS,
            check=False,
            env={"PATH": os.defpath},
        )
        answer = json.loads(done.stdout)
    except (subprocess.TimeoutExpired, ValueError):
        fail(f"xacro took more than {SECONDS} s or too much memory, or ended without an answer")
    if "error" in answer:
        message = f"xacro: {printable(str(answer['error']))}"
        if answer.get("package"):
            message = f"package {quote(answer['package'])} is not found; name its folder with --package-path NAME=DIR"
        raise RobotFileError(message, *_place(path, answer.get("place")))
    return str(answer["urdf"]).encode()


def _place(path: Path, place: list[Any] | None) -> tuple[str | None, int | None]:
    """File and line of an error: none for the file itself, and another one relative to the folder of that file."""
    if place is None:
        return None, None
    name, line = os.path.realpath(str(place[0])), int(place[1])
    if name == os.path.realpath(path):
        return None, line
    return os.path.normpath(path.parent / os.path.relpath(name, os.path.realpath(path.parent))), line
