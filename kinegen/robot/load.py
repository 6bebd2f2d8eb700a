"""A robot file -> `Robot`, or one line that says what is wrong with it and where.

In: a path or text, from a stranger. Out: the validated model in kernel units. Every defect is a `RobotFileError`.
The way there: `yaml_tree` bounds and parses the text, `read` takes the parts apart as they are written, `resolve` finds
out what the names mean and makes everything exact radians.
"""

from __future__ import annotations

import stat
from dataclasses import replace
from pathlib import Path, PurePath

from kinegen.errors import RobotFileError
from kinegen.robot.angle_range import check_angles
from kinegen.robot.digest import digest
from kinegen.robot.fields import printable
from kinegen.robot.model import Robot
from kinegen.robot.read import read_robot
from kinegen.robot.resolve import resolve
from kinegen.robot.yaml_tree import MAX_BYTES, decode, parse_tree


def load(path: str | Path) -> Robot:
    """Read a robot file.

    Args:
        path: The file; its base name becomes `Robot.source`.

    Raises:
        RobotFileError: If it cannot be read, or is not a robot.
    """
    shown = printable(str(path))
    try:
        if not stat.S_ISREG(Path(path).stat().st_mode):
            kind = "a folder" if Path(path).is_dir() else "not a regular file"
            raise RobotFileError(f"this is {kind}; expected a robot file", shown)
        with Path(path).open("rb") as file:
            # One byte too many is enough to see that a file is too large.
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise RobotFileError(f"cannot be read: {reason.lower()}", shown) from None
    except ValueError:
        raise RobotFileError("this is not a file name", shown) from None
    return loads(data, str(path))


def loads(text: str | bytes, source: str) -> Robot:
    """Read the text of a robot file.

    Args:
        text: The content.
        source: What messages call the file; its base name becomes `Robot.source`.

    Raises:
        RobotFileError: If it is not a robot.
    """
    try:
        data = text if isinstance(text, bytes) else text.encode("utf-8", "surrogatepass")
        robot = resolve(read_robot(parse_tree(decode(data))), printable(PurePath(source).name))
        check_angles(robot)
    except RobotFileError as error:
        raise RobotFileError(printable(error.message), printable(source), error.line) from None
    return replace(robot, digest=digest(robot))
