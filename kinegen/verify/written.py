"""That what lies in a folder is what was proven: the C of a firmware package, and every file once it is written.

In: files as they were proven, and as they are handed out. Out: nothing, or the first one that differs.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path, PurePosixPath

from kinegen.errors import ProofError, WriteError
from kinegen.robot.model import Robot


def require_proven(robot: Robot, project: Mapping[str, str], proven: Mapping[str, str]) -> None:
    """Compare the C files of a firmware package with those that were proven.

    Args:
        robot: The robot.
        project: Text of the package by path.
        proven: Text that was proven, by file name.

    Raises:
        ProofError: If one differs, or a kernel is missing.
    """
    found = {PurePosixPath(path).name: text for path, text in project.items() if path.endswith((".c", ".h"))}
    for name, text in proven.items():
        if name.endswith((".c", ".h")) and not name.endswith(("_batch.c", "_batch.h")) and found.get(name) != text:
            state = "differs from the one that was proven" if name in found else "is missing"
            raise ProofError(f"{robot.name}: {name} of the package {state}; nothing was written")


def require_written(folder: Path, contents: Mapping[str, str | bytes]) -> None:
    """Read back what was written.

    Args:
        folder: The output folder.
        contents: What was to be written, by path below it.

    Raises:
        WriteError: If a file holds something else.
    """
    for name, content in contents.items():
        path = folder / name
        if path.read_bytes() != (content.encode() if isinstance(content, str) else content):
            raise WriteError(f"{path} does not hold what was written to it; build again")
