"""A robot from a file, a text or a mapping."""

from __future__ import annotations

import math
import os
import tempfile
import warnings
from collections.abc import Iterable, Mapping, Sequence
from decimal import Decimal
from fractions import Fraction
from numbers import Integral, Real
from pathlib import Path
from typing import Any

import yaml

from kinegen.errors import KinegenError, RobotFileError, printable, quote
from kinegen.io.format import Imported, ReadOptions, format_of
from kinegen.io.load import load_text, load_with_report
from kinegen.model.robot import Robot as Model
from kinegen.model.variants import joined, with_redundancy, with_strict_limits
from kinegen.support.naming import only_printed
from kinegen.ui.api.options import is_text
from kinegen.ui.api.robot import Robot, from_model

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
    strict_limits: bool = False,
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
        strict_limits: Whether a solution of an inverse that rounding moved beyond a limit is not valid.

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
    # A robot is returned as it is, unless something is asked of it.
    if isinstance(source, Model):
        model = with_redundancy(source, redundancy) if redundancy else source
        model = with_strict_limits(model) if strict_limits else model
        return model if isinstance(model, Robot) and model is source else from_model(model)
    options = ReadOptions(
        tips=(tips,) if isinstance(tips, str) else tuple(tips),
        base=base,
        packages=tuple((name, os.fspath(folder)) for name, folder in (packages or {}).items()),
        arguments=tuple((name, str(value)) for name, value in (arguments or {}).items()),
        snap=snap,
        table=table,
        redundancy=redundancy if isinstance(redundancy, str) else joined(redundancy),
        strict_limits=strict_limits,
    )
    # Words of C are refused when C is made of the robot: `closed_form` prints any name.
    with only_printed():
        imported = _read(source, options)
    if imported.report.is_noted:
        where = imported.robot.source
        warnings.warn(f"{where}: {imported.report.summary}; snap=0 keeps them, robot.report lists them", stacklevel=2)
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


MOST_DEPTH = 20
"""Robot files nest less; a mapping that holds itself would nest for ever."""


def text_of(source: Mapping[str, object]) -> str:
    """Return the text of a robot file with the content of a mapping, so that it has the same reader and messages.

    Numbers are written with the digits that Python shows: `0.4318` is 4318/10000. Fractions and decimals are exact.
    Rows of the table are on a line each.

    Raises:
        RobotFileError: If it holds anything but mappings, sequences, text and numbers, or nests too deep.
    """
    plain = _plain(source, "", 0)
    return yaml.dump(
        plain, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=math.inf, default_flow_style=None
    )


class _Dumper(yaml.SafeDumper):
    def ignore_aliases(self, data: Any) -> bool:  # noqa: ARG002 - the signature of PyYAML
        """Write everything out; a list may occur twice."""
        return True


def _plain(value: object, where: str, depth: int) -> object:
    if depth > MOST_DEPTH:
        raise RobotFileError(f"{where or 'the mapping'} nests too deep", MAPPING)
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                raise RobotFileError(f"the key {quote(repr(key))}{_of(where)} is not text", MAPPING)
        return {str(key): _plain(each, _under(where, key), depth + 1) for key, each in value.items()}
    if isinstance(value, bool | str):
        return value
    if isinstance(value, Sequence) and not isinstance(value, bytes | bytearray):
        return [_plain(each, f"{where}[{place}]", depth + 1) for place, each in enumerate(value)]
    if isinstance(value, Fraction | Decimal):
        return str(value)
    if isinstance(value, Integral):
        return int(value)
    if isinstance(value, Real):
        return float(value)
    if hasattr(value, "tolist"):  # an array of NumPy
        return _plain(value.tolist(), where, depth + 1)
    raise RobotFileError(f"{where} is {quote(repr(value))}, expected text, a number, a list or a mapping", MAPPING)


def _under(where: str, key: object) -> str:
    return f"{where}.{key}" if where else str(key)


def _of(where: str) -> str:
    return f" of {where}" if where else ""
