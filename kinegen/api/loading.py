"""A robot from a file, a text or a mapping."""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Iterable, Mapping
from pathlib import Path

from kinegen.api.mapping import text_of
from kinegen.api.robot import Robot, from_model
from kinegen.api.words import is_text
from kinegen.errors import KinegenError, RobotFileError, printable, quote
from kinegen.formats.format import Imported, ReadOptions, format_of
from kinegen.formats.load import load_text, load_with_report
from kinegen.robot.model import Robot as Model
from kinegen.robot.redundancy import joined, with_redundancy

Source = str | bytes | os.PathLike[str] | Mapping[str, object] | Model
"""What `load` takes: the path of a file, the text of one, a mapping with its keys, or a robot."""

TEXT = "<text>"
"""What messages call a text."""

MAPPING = "<mapping>"
"""What messages call a mapping."""


def load(
    source: Source,
    *,
    tips: Iterable[str] = (),
    base: str = "",
    packages: Mapping[str, str | os.PathLike[str]] | None = None,
    arguments: Mapping[str, object] | None = None,
    snap: float | None = None,
    table: str = "",
    redundancy: str | Iterable[str] = "",
) -> Robot:
    """Read a robot from a file, a text or a mapping: kinegen YAML, URDF, xacro, MJCF, or a CSV table.

    A string of several lines, or one that begins with `<` or `{`, is the text itself; any other string is a path.
    Numbers are exact as they are written: `0.4318` is 4318/10000. URDF and MJCF print rounded numbers; what is taken as
    the exact value that its digits stand for is in `robot.report`, and a warning says so.

    Args:
        source: Path, text, mapping with the keys of a robot file, or a robot, which is returned.
        tips: Links of a URDF or MJCF file at which the robot ends; all ends of the tree if there are none.
        base: Link of such a file that becomes the base.
        packages: Folder of each package that a xacro file names in `$(find NAME)`.
        arguments: Values of the arguments of a xacro file.
        snap: Angles within so many radians of a multiple of 15 degrees become that multiple; 0 keeps every digit.
        table: Convention, length unit and angle unit of a CSV table, such as `standard,mm,deg`.
        redundancy: What the closed-form inverse takes in addition to the pose: the name of a joint, names of several
            joints in the order of their values, or `arm_angle`; what the file says if left out.

    Returns:
        The robot, validated; lengths in the unit of the file, angles in radians.

    Raises:
        KinegenError: If it cannot be read or does not describe a robot, with `path` and `line` of the mistake.

    Example:
        >>> import kinegen
        >>> kinegen.load("robots/ur5.yaml")
        <kinegen.Robot ur5: 6 joints, standard, lengths in m>
        >>> kinegen.load('''
        ... kinegen: 1
        ... name: slider
        ... convention: standard
        ... units: {length: mm, angle: deg}
        ... joints:
        ...   - {name: turn, theta: q, d: 0, a: 500, alpha: 90}
        ...   - {name: slide, theta: 0, d: q, a: 0, alpha: 0}
        ... ''')
        <kinegen.Robot slider: 2 joints, standard, lengths in mm>
        >>> try:  # doctest: +ELLIPSIS
        ...     kinegen.load({"kinegen": 1, "name": "arm", "conventoin": "standard"})
        ... except kinegen.KinegenError as error:
        ...     print(error.message)
        unknown key 'conventoin' ...
    """
    if isinstance(source, Model):
        model = with_redundancy(source, redundancy) if redundancy else source
        return model if isinstance(model, Robot) and not redundancy else from_model(model)
    options = ReadOptions(
        tips=(tips,) if isinstance(tips, str) else tuple(tips),
        base=base,
        packages=tuple((name, os.fspath(folder)) for name, folder in (packages or {}).items()),
        arguments=tuple((name, str(value)) for name, value in (arguments or {}).items()),
        snap=snap,
        table=table,
        redundancy=redundancy if isinstance(redundancy, str) else joined(redundancy),
    )
    imported = _read(source, options)
    if imported.report.changed:
        where = imported.robot.source
        warnings.warn(f"{where}: {imported.report.summary}; robot.report lists them", stacklevel=2)
    return from_model(imported.robot, imported.report)


def _read(source: object, options: ReadOptions) -> Imported:
    if isinstance(source, Mapping):
        return _read_mapping(source, options)
    if isinstance(source, bytes):
        return _read_text(source, options)
    if isinstance(source, str):
        is_path = not is_text(source)
        return _read_file(source, options) if is_path else _read_text(source.encode("utf-8", "surrogatepass"), options)
    if isinstance(source, os.PathLike):
        return load_with_report(Path(source), options)
    raise KinegenError(f"expected a path, a text or a mapping that describes a robot, not {_article(source)}")


def _read_file(path: str, options: ReadOptions) -> Imported:
    try:
        return load_with_report(path, options)
    except RobotFileError as error:
        if error.line is None and not os.path.exists(path):  # noqa: PTH110 - Path refuses some of these names
            reason = "there is no such file (the text of a robot file has several lines)"
            raise RobotFileError(reason, printable(path)) from None
        raise


def _read_text(text: bytes, options: ReadOptions) -> Imported:
    name = f"{TEXT}.csv" if options.table else TEXT
    if format_of(name, text).name != "xacro":
        return load_text(text, name, options)
    # xacro reads the file by itself, in a process of its own.
    with tempfile.TemporaryDirectory(prefix="kinegen-") as folder:
        file = Path(folder) / "text.xacro"
        file.write_bytes(text)
        try:
            return load_with_report(file, options)
        except RobotFileError as error:
            raise RobotFileError(error.message, TEXT, error.line) from None


def _read_mapping(source: Mapping[str, object], options: ReadOptions) -> Imported:
    text = text_of(source)
    try:
        return load_text(text.encode("utf-8", "surrogatepass"), MAPPING, options)
    except RobotFileError as error:
        # A mapping has no lines; the entry itself shows the place.
        entry = text.splitlines()[error.line - 1].strip() if error.line else ""
        where = f", in {quote(entry)}" if entry else ""
        raise RobotFileError(f"{error.message}{where}", MAPPING) from None


def _article(thing: object) -> str:
    name = type(thing).__name__
    return f"{'an' if name[:1].lower() in 'aeiou' else 'a'} {name}"
