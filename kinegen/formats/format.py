"""The formats of robot files: how each is recognised, read and written.

In: a name, a suffix, the first bytes of a file. Out: a `Format`, whose reader gives a `Robot` with a `Report` of what
reading changed. Readers and writers are imported when they are called: lxml and xacro are an extra.
"""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Any

from kinegen.formats.report import EMPTY, Report
from kinegen.robot.model import Robot

YAML_SUFFIXES = (".yaml", ".yml")


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """What reading may need to be told; kinegen's own files need nothing of it.

    Attributes:
        tips: Names of the links at which the robot ends; all ends of the tree if there are none.
        base: Name of the link that becomes the base; the root of the tree if it is empty.
        packages: Folder of each package that `$(find NAME)` of a xacro file names.
        arguments: Values of the arguments of a xacro file, by name.
        snap: Angles within this distance in radians of a multiple of 15 degrees become that multiple. None goes by
            the printed digits alone; zero keeps every digit.
        table: Convention, length unit and angle unit of a CSV table, such as `standard,mm,deg`.
        redundancy: What the inverse is given besides the pose, in any format: joints with commas between them, or
            `arm_angle`; what the file says if it is empty.
    """

    tips: tuple[str, ...] = ()
    base: str = ""
    packages: tuple[tuple[str, str], ...] = ()
    arguments: tuple[tuple[str, str], ...] = ()
    snap: float | None = None
    table: str = ""
    redundancy: str = ""


READING: ContextVar[ReadOptions] = ContextVar("READING", default=ReadOptions())  # noqa: B039 - a frozen record
"""How robot files are read where a caller of `load` says nothing of it; the command line sets it for a command."""


LISTENER: ContextVar[Callable[[str, Report], None] | None] = ContextVar("LISTENER", default=None)
"""Who is told what reading a file changed, by the name of the file."""


@contextmanager
def reading(options: ReadOptions, listener: Callable[[str, Report], None] | None = None) -> Iterator[None]:
    """Read all robot files inside with these options, and tell the listener what reading changed."""
    tokens = READING.set(options), LISTENER.set(listener)
    try:
        yield
    finally:
        READING.reset(tokens[0])
        LISTENER.reset(tokens[1])


@dataclass(frozen=True, slots=True)
class Imported:
    """A robot and what reading it changed; the digest is filled in by `load`."""

    robot: Robot
    report: Report = field(default=EMPTY)


@dataclass(frozen=True, slots=True)
class Late:
    """A function that is imported when it is called."""

    module: str
    name: str

    def __call__(self, *arguments: Any) -> Any:
        """Import the function and call it."""
        return getattr(importlib.import_module(self.module), self.name)(*arguments)

    @property
    def exists(self) -> bool:
        """Whether its module is there."""
        try:
            return importlib.util.find_spec(self.module) is not None
        except ModuleNotFoundError:
            return False


Reader = Callable[[bytes, Path, ReadOptions], Imported]
Writer = Callable[[Robot], str]


@dataclass(frozen=True, slots=True)
class Format:
    """A format of robot files.

    Attributes:
        name: What messages call it.
        suffixes: Endings of file names, in lower case; the first is the usual one.
        read: Text, the path of its file and options -> the robot. None where the format is only written.
        write: The robot -> text. None where the format is only read.
    """

    name: str
    suffixes: tuple[str, ...]
    read: Reader | None
    write: Writer | None = None

    @property
    def is_writable(self) -> bool:
        """Whether there is a writer, and its module is there."""
        return self.write is not None and (not isinstance(self.write, Late) or self.write.exists)


def _late(module: str, name: str) -> Late:
    return Late(f"kinegen.formats.{module}", name)


FORMATS = (
    Format("kinegen YAML", YAML_SUFFIXES, _late("yaml.importer", "read"), _late("yaml.write", "write")),
    Format("URDF", (".urdf",), _late("urdf.read", "read"), _late("urdf.write", "write")),
    Format("xacro", (".xacro",), _late("urdf.expand", "read")),
    Format("MJCF", (".mjcf", ".xml"), _late("mjcf.read", "read")),
    Format("CSV table", (".csv",), _late("csv_table", "read"), _late("tables.csv", "write")),
    Format("Markdown table", (".md",), None, _late("tables.markdown", "write")),
    Format("LaTeX table", (".tex",), None, _late("tables.latex", "write")),
)
"""Every format, in the order in which messages list them."""

CONSTRUCTORS = {
    "toolbox": Format("Robotics Toolbox for Python", (".py",), None, _late("constructors.toolbox", "write")),
    "pinocchio": Format("Pinocchio", (".py",), None, _late("constructors.pinocchio", "write")),
    "matlab": Format("MATLAB", (".m",), None, _late("constructors.matlab", "write")),
}
"""Program text that makes the robot in other tools, by the name that asks for it."""


def format_named(name: str) -> Format:
    """The format of a name in `FORMATS`."""
    return next(each for each in FORMATS if each.name == name)


def format_of(path: str | Path, data: bytes) -> Format:
    """The format of a file, by its suffix and its first bytes.

    The content decides among the formats in XML, because URDF and MJCF share suffixes in practice. A file that is not
    recognised is read as kinegen YAML, whose messages say how such a file begins.
    """
    suffix = PurePath(path).suffix.lower()
    start = data[:4096].lstrip(b"\xef\xbb\xbf \t\r\n")
    by_suffix = next((each for each in FORMATS if suffix in each.suffixes and each.read), None)
    is_xml = start.startswith(b"<") and suffix not in YAML_SUFFIXES
    if by_suffix and by_suffix.name in ("kinegen YAML", "CSV table", "xacro"):
        return by_suffix
    if by_suffix or is_xml:
        return _xml_format(data, by_suffix)
    return FORMATS[0]


def _xml_format(data: bytes, by_suffix: Format | None) -> Format:
    places = {name: data.find(tag) for name, tag in (("URDF", b"<robot"), ("MJCF", b"<mujoco"))}
    found = [name for name, place in places.items() if place >= 0]
    if b"<xacro:" in data and "URDF" in found:
        return format_named("xacro")
    if found:
        return format_named(min(found, key=places.__getitem__))
    return by_suffix or format_named("URDF")


def writable(path: str | Path) -> Format | None:
    """The format that a file of this suffix is written in, if there is one."""
    suffix = PurePath(path).suffix.lower()
    return next((each for each in FORMATS if suffix in each.suffixes and each.is_writable), None)
