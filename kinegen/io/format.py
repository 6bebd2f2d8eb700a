"""The formats of robot files: how each is recognised, read and written, and the report of what reading changed.

In: a name, a suffix, the first bytes of a file. Out: a `Format`, whose reader gives a `Robot` with a `Report`. Readers
and writers are imported when they are called: xacro is an extra. Effects in a report are upper bounds in the length
unit of the robot, by lengths along the chain; no pose is computed here.
"""

from __future__ import annotations

import importlib
import importlib.util
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import field
from pathlib import Path, PurePath
from typing import Any

from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass

NOTED = 1e-6
"""Where a tip moves less than this, in metres, `kinegen convert` alone reports the changes."""


NOTED_TURN = 1e-4
"""The same of an angle, in the unit of the file, where no length turns with it."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One number of the file that is nearly something else.

    Attributes:
        where: Its place, such as `joint 'elbow', rpy[2]`.
        text: As it is printed in the file.
        exact: What it became, or what it is near to.
        digits: How far the two are apart, in units of the last printed digit.
        effect: How far the difference moves a tip at most, in the length unit of the robot.
        changed: Whether the exact value was taken; otherwise every printed digit was kept.
    """

    line: int
    where: str
    text: str
    exact: str
    digits: float
    effect: float
    changed: bool


@dataclass(frozen=True, slots=True)
class Report:
    """Everything that a reader has to say.

    Attributes:
        findings: In the order of the file, those that were changed and those that were kept.
        renamed: Names of the file that are not identifiers or are taken, each with the name used instead.
        notes: What could not be carried, or was chosen, one sentence each.
        links: The frame of each link of the file, by name.
    """

    findings: tuple[Finding, ...] = ()
    renamed: tuple[tuple[str, str], ...] = ()
    notes: tuple[str, ...] = ()
    links: tuple[tuple[str, str], ...] = ()

    @property
    def changed(self) -> tuple[Finding, ...]:
        """The numbers that were changed."""
        return tuple(each for each in self.findings if each.changed)

    @property
    def kept(self) -> tuple[Finding, ...]:
        """The numbers that are nearly special and were kept."""
        return tuple(each for each in self.findings if not each.changed)

    @property
    def effect(self) -> float:
        """Return how far all changes together move a tip at most."""
        return sum(each.effect for each in self.changed)

    @property
    def is_noted(self) -> bool:
        """Tell whether the changes move or turn a tip so far that a person wants to know of them."""
        return self.effect >= NOTED or any(_change(each) >= NOTED_TURN for each in self.changed)

    @property
    def summary(self) -> str:
        """Return what was changed, in one line with the change of the largest effect; only where `is_noted`."""
        count, first = len(self.changed), max(self.changed, key=lambda each: each.effect)
        replaced = (
            f"{count} rounded numbers replaced by exact ones"
            if count > 1
            else "1 rounded number replaced by the exact one"
        )
        length = f"{1000 * self.effect:.2g} mm" if self.effect < 0.1 else f"{self.effect:.2g} m"
        if self.effect < NOTED:
            return f"{replaced} ({first.text} -> {first.exact}); rotates the end effector"
        return f"{replaced} ({first.text} -> {first.exact}); moves the end effector by up to {length}"


def _change(finding: Finding) -> float:
    """Return how far a number and its exact value are apart, by the digits of the number."""
    mantissa, _, exponent = finding.text.lower().partition("e")
    decimals = len(mantissa.partition(".")[2]) - int(exponent or 0)
    return finding.digits * 10.0**-decimals


EMPTY = Report()


YAML_SUFFIXES = (".yaml", ".yml")


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """Options of reading; kinegen's own files need none of them.

    Attributes:
        tips: Names of the links at which the robot ends, or of frames of a tree in YAML; all ends if there are none.
        base: Name of the link that becomes the base; the root of the tree if it is empty.
        packages: Folder of each package that `$(find NAME)` of a xacro file names.
        arguments: Values of the arguments of a xacro file, by name.
        snap: Angles within this distance in radians of a multiple of 15 degrees become that multiple. None goes by
            the printed digits alone; zero keeps every digit.
        table: Convention, length unit and angle unit of a CSV table, such as `standard,mm,deg`.
        redundancy: What the inverse is given besides the pose, in any format: joints with commas between them, or
            `arm_angle`; what the file says if it is empty.
        strict_limits: Whether solutions of an inverse may not be beyond a limit by rounding, in any format.
    """

    tips: tuple[str, ...] = ()
    base: str = ""
    packages: tuple[tuple[str, str], ...] = ()
    arguments: tuple[tuple[str, str], ...] = ()
    snap: float | None = None
    table: str = ""
    redundancy: str = ""
    strict_limits: bool = False


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
        """Tell whether its module is there."""
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
        """Tell whether there is a writer, and its module is there."""
        return self.write is not None and (not isinstance(self.write, Late) or self.write.exists)


def _late(module: str, name: str) -> Late:
    return Late(f"kinegen.io.{module}", name)


FORMATS = (
    Format("kinegen YAML", YAML_SUFFIXES, _late("robot_file.read", "read"), _late("robot_file.write", "write")),
    Format("URDF", (".urdf",), _late("urdf", "read"), _late("link_writers", "write_urdf")),
    Format("xacro", (".xacro",), _late("xacro.expand", "read")),
    Format("MJCF", (".mjcf", ".xml"), _late("mjcf", "read")),
    Format("CSV table", (".csv",), _late("csv_table", "read"), _late("table_text", "write_csv")),
    Format("Markdown table", (".md",), None, _late("table_text", "write_markdown")),
    Format("LaTeX table", (".tex",), None, _late("table_text", "write_latex")),
)
"""Every format, in the order in which messages list them."""

CONSTRUCTORS = {
    "toolbox": Format("Robotics Toolbox for Python", (".py",), None, _late("link_writers", "write_toolbox")),
    "pinocchio": Format("Pinocchio", (".py",), None, _late("link_writers", "write_pinocchio")),
    "matlab": Format("MATLAB", (".m",), None, _late("link_writers", "write_matlab")),
}
"""Program text that makes the robot in other tools, by the name that asks for it."""


def format_named(name: str) -> Format:
    """Return the format of a name in `FORMATS`."""
    return next(each for each in FORMATS if each.name == name)


def format_of(path: str | Path, data: bytes) -> Format:
    """Return the format of a file, by its suffix and its first bytes.

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


def _without_comments(text: bytes) -> bytes:
    pieces, place = [], 0
    while (begin := text.find(b"<!--", place)) >= 0:
        pieces.append(text[place:begin])
        end = text.find(b"-->", begin + 4)
        # One that does not end is a defect, which the reader finds.
        place = end + 3 if end >= 0 else len(text)
    return b"".join([*pieces, text[place:]])


def _is_expanded(text: bytes) -> bool:
    """Tell whether a URDF file only keeps elements that xacro had no macro for, or only includes of other files.

    Readers of URDF do not look at these, and xacro would refuse them.
    """
    tags = set(_XACRO.findall(text))
    included = b"include" in tags
    called = bool(tags - _DEFINING - {b"include"})
    rest = _XACRO_TAG.sub(b"", text)
    return b"<joint" in rest and not (tags & _DEFINING or (included and called) or b"${" in rest or b"$(" in rest)


_XACRO = re.compile(rb"<xacro:([\w.-]+)")
_XACRO_TAG = re.compile(rb"<xacro:[^<>]*>")
_DEFINING = frozenset(b"arg attribute call element if insert_block macro property unless".split())


def _xml_format(data: bytes, by_suffix: Format | None) -> Format:
    places = {name: data.find(tag) for name, tag in (("URDF", b"<robot"), ("MJCF", b"<mujoco"))}
    found = [name for name, place in places.items() if place >= 0]
    text = _without_comments(data) if b"<xacro:" in data else b""
    if b"<xacro:" in text and "URDF" in found and not (by_suffix == format_named("URDF") and _is_expanded(text)):
        return format_named("xacro")
    if found:
        return format_named(min(found, key=places.__getitem__))
    return by_suffix or format_named("URDF")


def writable(path: str | Path) -> Format | None:
    """Return the format that a file of this suffix is written in, if there is one."""
    suffix = PurePath(path).suffix.lower()
    return next((each for each in FORMATS if suffix in each.suffixes and each.is_writable), None)
