"""A robot file -> `Robot`, or one line that says what is wrong with it and where.

In: a path or text, from a stranger, in any of the `FORMATS`. Out: the validated model in kernel units. Every defect is
a `RobotFileError`. The format is chosen by suffix and content; its reader bounds and parses the text.
"""

from __future__ import annotations

import stat
from dataclasses import replace
from pathlib import Path

from kinegen.errors import KinegenError, RobotFileError, printable
from kinegen.formats.angle_range import check_angles
from kinegen.formats.format import LISTENER, READING, Imported, ReadOptions, format_of
from kinegen.robot.digest import digest
from kinegen.robot.expressions import ExpressionError
from kinegen.robot.model import Robot
from kinegen.robot.redundancy import with_redundancy

MAX_BYTES = 16 * 1024 * 1024
"""No format takes more; a reader may take less."""


def load(path: str | Path, options: ReadOptions | None = None) -> Robot:
    """Read a robot file.

    Args:
        path: The file; its base name becomes `Robot.source`.
        options: How to read files of other formats than kinegen's own; those of `READING` if left out.

    Raises:
        RobotFileError: If it cannot be read, or is not a robot.
    """
    return load_with_report(path, options).robot


def load_with_report(path: str | Path, options: ReadOptions | None = None) -> Imported:
    """Read a robot file, and say what reading changed.

    Args:
        path: The file; its base name becomes `Robot.source`.
        options: How to read files of other formats than kinegen's own; those of `READING` if left out.

    Raises:
        RobotFileError: If it cannot be read, or is not a robot.
    """
    return _read(read_bytes(path), str(path), options)


def loads(text: str | bytes, source: str, options: ReadOptions | None = None) -> Robot:
    """Read the text of a robot file.

    Args:
        text: The content.
        source: What messages call the file; its base name becomes `Robot.source`, its suffix is that of the format.
        options: How to read files of other formats than kinegen's own; those of `READING` if left out.

    Raises:
        RobotFileError: If it is not a robot.
    """
    return load_text(text if isinstance(text, bytes) else text.encode("utf-8", "surrogatepass"), source, options).robot


def load_text(text: bytes, source: str, options: ReadOptions | None = None) -> Imported:
    """Read the text of a robot file, and say what reading changed; arguments as for `loads`.

    Raises:
        RobotFileError: If it is not a robot.
    """
    return _read(text, source, options)


def read_bytes(path: str | Path) -> bytes:
    """The content of a robot file, at most one byte more than `MAX_BYTES`.

    Raises:
        RobotFileError: If it cannot be read.
    """
    shown = printable(str(path))
    try:
        if not stat.S_ISREG(Path(path).stat().st_mode):
            kind = "a folder" if Path(path).is_dir() else "not a regular file"
            raise RobotFileError(f"this is {kind}; expected a robot file", shown)
        with Path(path).open("rb") as file:
            # One byte too many is enough to see that a file is too large.
            return file.read(MAX_BYTES + 1)
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise RobotFileError(f"cannot be read: {reason.lower()}", shown) from None
    except ValueError:
        raise RobotFileError("this is not a file name", shown) from None


def _read(data: bytes, source: str, options: ReadOptions | None) -> Imported:
    shown = printable(source)
    form, options = format_of(source, data), READING.get() if options is None else options
    if form.read is None:
        raise RobotFileError(f"{form.name} files are only written", shown)
    try:
        imported = form.read(data, Path(source), options)
        check_angles(imported.robot)
        if options.redundancy:
            imported = replace(imported, robot=with_redundancy(imported.robot, options.redundancy))
    except RobotFileError as error:
        raise RobotFileError(printable(error.message), printable(error.path or source), error.line or None) from None
    except ModuleNotFoundError as error:
        # lxml and xacro come with an extra.
        if (error.name or "").partition(".")[0] not in ("lxml", "xacro"):
            raise
        message = f"{form.name} files need the package {error.name}: pip install 'kinegen[import]'"
        raise KinegenError(message, shown) from None
    except ExpressionError as error:
        raise RobotFileError(printable(str(error)), shown) from None
    if listener := LISTENER.get():
        listener(source, imported.report)
    return replace(imported, robot=replace(imported.robot, digest=digest(imported.robot)))
