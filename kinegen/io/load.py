"""A robot file -> `Robot`, or one line that says what is wrong with it and where.

In: a path or text, from a stranger, in any of the `FORMATS`. Out: the validated model in kernel units. Every defect is
a `RobotFileError`. The format is chosen by suffix and content; its reader bounds and parses the text.
"""

from __future__ import annotations

import math
import stat
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from kinegen.errors import KinegenError, RobotFileError, printable
from kinegen.io.format import LISTENER, READING, YAML_SUFFIXES, Imported, ReadOptions, format_of
from kinegen.io.messages import fail, within
from kinegen.model.expression_parser import Expression, ExpressionError, evaluate, linear
from kinegen.model.expression_values import FLOAT64
from kinegen.model.joint_bounds import joint_box, parameter_values
from kinegen.model.robot import JointType, Robot, Row, Step
from kinegen.model.variants import digest, with_redundancy, with_strict_limits, with_tips

MAX_ANGLE = 1e5
"""The largest angle in radians of which the kernels in double take the sine and cosine."""


def check_angles(robot: Robot) -> None:
    """Refuse a robot with angles beyond `MAX_ANGLE`, of which no kernel takes the sine, however short the file is.

    Each angle of the table counts by itself, over the limits of the joints; what angles of several joints add up to is
    left to the notes of a build.
    """
    degrees = robot.units.angle == "deg"
    turning = {variable.name for variable in robot.variables if variable.type is not JointType.PRISMATIC}
    box = {variable.name: max(map(abs, ends)) for variable, ends in zip(robot.variables, joint_box(robot), strict=True)}
    values = parameter_values(robot)
    for row in robot.rows:
        with within(f"joint {row.number} ({row.name})", row.line):
            limited = next((each for each in robot.variables if each.name == row.variable and each.limits), None)
            if limited is not None and row.variable in turning:
                _require("limits", box[limited.name], degrees=degrees)
            for key, angle in _angles(row):
                _require(key, _largest(angle, box, values), degrees=degrees)
    for where, steps, line in _steps(robot):
        with within(where, line):
            for step in steps:
                if step.kind.is_rotation:
                    _require(step.kind.value, _largest(step.value, box, values), degrees=degrees)


def _angles(row: Row) -> Iterator[tuple[str, Expression]]:
    for key, entry in (("alpha", row.alpha), ("theta", row.theta), ("beta", row.beta)):
        if entry is not None:
            yield key, entry
    yield from ((step.kind.value, step.value) for step in row.steps if step.kind.is_rotation)


def _steps(robot: Robot) -> Iterator[tuple[str, tuple[Step, ...], int]]:
    yield "base", robot.base, 0
    yield "tool", robot.tool, 0
    yield from ((f"frame '{frame.name}'", frame.steps, frame.line) for frame in robot.frames)


def _largest(angle: Expression, box: Mapping[str, float], values: Mapping[str, float]) -> float:
    """Return the largest magnitude of an angle that is linear in joint variables."""
    factors, rest = linear(angle, frozenset(box))
    moving = (abs(float(evaluate(factor, values, FLOAT64))) * box[name] for name, factor in factors.items())
    return abs(float(evaluate(rest, values, FLOAT64))) + sum(moving)


def _require(key: str, size: float, *, degrees: bool) -> None:
    if not size <= MAX_ANGLE:
        shown, most = (math.degrees(size), math.degrees(MAX_ANGLE)) if degrees else (size, MAX_ANGLE)
        unit = "deg" if degrees else "rad"
        fail(f"{key}: the angle reaches {shown:.3g} {unit}; kernels take angles up to {most:.7g} {unit}")


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
    """Read a robot file as `load` does, and say what reading changed."""
    return _read(read_bytes(path), str(path), options, divides=True)


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
    """Read the text of a robot file as `loads` does, and say what reading changed."""
    return _read(text, source, options, divides=options is not None)


def read_bytes(path: str | Path) -> bytes:
    """Read a robot file, at most one byte more than `MAX_BYTES`."""
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


def _read(data: bytes, source: str, options: ReadOptions | None, *, divides: bool) -> Imported:
    """Read a robot. Unless `divides`, a tree in YAML keeps its tips: text may be what a file with options became."""
    shown = printable(source)
    form, options = format_of(source, data), READING.get() if options is None else options
    if form.read is None:
        raise RobotFileError(f"{form.name} files are only written", shown)
    try:
        imported = form.read(data, Path(source), options)
        check_angles(imported.robot)
        if divides and options.tips and form.suffixes == YAML_SUFFIXES:
            imported = replace(imported, robot=with_tips(imported.robot, options.tips))
        if options.redundancy:
            imported = replace(imported, robot=with_redundancy(imported.robot, options.redundancy))
        if options.strict_limits:
            imported = replace(imported, robot=with_strict_limits(imported.robot))
    except RobotFileError as error:
        raise RobotFileError(printable(error.message), printable(error.path or source), error.line or None) from None
    except ModuleNotFoundError as error:
        # xacro comes with an extra.
        if (error.name or "").partition(".")[0] != "xacro":
            raise
        message = f"{form.name} files need the package {error.name}: pip install 'kinegen[import]'"
        raise KinegenError(message, shown) from None
    except ExpressionError as error:
        raise RobotFileError(printable(str(error)), shown) from None
    if listener := LISTENER.get():
        listener(source, imported.report)
    return replace(imported, robot=replace(imported.robot, digest=digest(imported.robot)))
