"""What every command that takes a robot file has in common: how files of other formats are read, and JSON documents.

`RobotCommand` adds the options to a command and takes `name:=value` for arguments of a xacro file. The files are read
with these options while the command runs.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from kinegen import __version__
from kinegen.errors import KinegenError, OutputError, listed
from kinegen.io.format import ReadOptions, Report, format_of, reading
from kinegen.io.messages import WORKBOOKS
from kinegen.ui.cli.terminal import complain, say

if TYPE_CHECKING:
    from kinegen.model.robot import Robot

Record = dict[str, object]
Result = TypeVar("Result")

_AS_JSON = "kinegen.json"
"""Where a command keeps, for what is said of its error, that a document is wanted."""


def _remembered(context: click.Context, _option: click.Parameter, wanted: bool) -> bool:
    context.meta[_AS_JSON] = wanted
    return wanted


json_option = click.option(
    "--json",
    "as_json",
    is_flag=True,
    callback=_remembered,
    help="Print one JSON document on stdout and nothing else.",
)


def complain_of(error: Exception | str, context: click.Context) -> None:
    """Print an error as one line on stderr, and on stdout as a document where the command is to print one."""
    complain(f"error: {error}")
    if context.meta.get(_AS_JSON):
        with suppress(OutputError):  # the error counts, not that nobody can read it
            say(document_text({"error": str(error)}))


def document_text(fields: Record, *, ensure_ascii: bool = True) -> str:
    """Return a JSON document with the version of kinegen and that of the document in front."""
    import json

    return json.dumps({"kinegen": __version__, "format": 1, **fields}, indent=2, ensure_ascii=ensure_ascii)


def accepted(read: Callable[..., Result], *words: object) -> Result:
    """Return what words of the command line are read as; a wrong word is a wrong argument."""
    try:
        return read(*words)
    except KinegenError as error:
        raise click.BadParameter(error.message) from error


def sample_count(text: str, least: int, most: int) -> int:
    """Return a number of samples, which may be written as 1e6."""
    try:
        number = float(text)
    except ValueError:
        raise click.BadParameter(f"{text!r} is not a number") from None
    if not least <= number <= most or not number.is_integer():
        bound = f"{most:.0e}".replace("e+0", "e").replace("e+", "e")
        raise click.BadParameter(f"{text} is not an integer from {least} to {bound}")
    return int(number)


def robot_record(robot: Robot) -> Record:
    """Return the robot as JSON documents have it."""
    return {
        "name": robot.name,
        "digest": robot.digest,
        "joints": [{"name": variable.name, "type": variable.type.value} for variable in robot.variables],
        "units": {"length": robot.units.length, "angle": "rad"},
        "tips": list(robot.tips),
    }


_TREES = ("URDF", "xacro", "MJCF")
_TAKEN_BY = {
    "tips": ("--tip", (*_TREES, "kinegen YAML")),
    "base": ("--base", _TREES),
    "packages": ("--package-path", ("xacro",)),
    "snap": ("--snap", _TREES),
    "table": ("--table", ("CSV table",)),
}
"""The options by the names of their values, and the formats whose readers use them."""

_HEAD = 1 << 16


def refuse_idle(options: Mapping[str, Any], arguments: Mapping[str, Any]) -> None:
    """Refuse options for reading that no file among the arguments of a command makes use of.

    Raises:
        click.UsageError: At the first such option.
    """
    given = [name for name in _TAKEN_BY if options.get(name) not in (None, "", ())]
    if not given:
        return
    files = {path: _format(path) for path in _files(arguments)}
    for name in given:
        option, formats = _TAKEN_BY[name]
        if files and not any(found in formats for found in files.values()):
            path, found = next(iter(files.items()))
            raise click.UsageError(
                f"{option} is for {listed(formats)} files; {path} is a {found} file, and what it says is kept"
            )


def takes(name: str, path: Path) -> bool:
    """Return whether the reader of a file uses an option, named as its value."""
    return _format(path) in _TAKEN_BY[name][1]


def _files(arguments: Mapping[str, Any]) -> Iterator[Path]:
    """Yield the existing files among the values of a command."""
    for value in arguments.values():
        for each in value if isinstance(value, tuple) else (value,):
            path = Path(each) if isinstance(each, (str, Path)) and "\0" not in str(each) else None
            try:
                if path and path.is_file():
                    yield path
            except OSError:
                continue  # too long for a name, so it is none


def _format(path: Path) -> str:
    """Return the format by the suffix and the first bytes; a tag of URDF or MJCF may stand behind a long comment."""
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except OSError:
        head = b""
    # A workbook has a table, and its reader says what to do.
    return "CSV table" if head.startswith(WORKBOOKS) else format_of(path, head).name


_ARGUMENT = re.compile(r"([A-Za-z_][A-Za-z0-9_.]*):=(.*)\Z", re.DOTALL)
VALUED = ("--tip", "--base", "--package-path", "--snap", "--table", "--redundancy")
"""The options that `RobotCommand` adds, all of which take a value."""


class _Snap(click.ParamType):  # type: ignore[type-arg]
    """An angle in radians, or in degrees with `deg` behind it."""

    name = "angle"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Read an angle in radians."""
        text = str(value).strip()
        number, degrees = (text[:-3], True) if text.endswith("deg") else (text.removesuffix("rad"), False)
        try:
            found = float(number)
        except ValueError:
            found = math.nan
        if not 0 <= found < math.inf:
            self.fail(f"'{text}' is not an angle, such as 1e-3 (radians) or 0.1deg", param, ctx)
        return math.radians(found) if degrees else found


def _packages(
    _context: click.Context, _parameter: click.Parameter, texts: tuple[str, ...]
) -> tuple[tuple[str, str], ...]:
    found = tuple(text.partition("=")[::2] for text in texts)
    for name, folder in found:
        if not name or not folder:
            raise click.BadParameter("expected NAME=DIR")
    return found


def _options() -> list[click.Parameter]:
    return [
        click.Option(
            ["--tip", "tips"],
            metavar="LINK",
            multiple=True,
            help="Frame of a tree at which the robot ends: a link of a URDF or MJCF file, or a tip, frame or joint of "
            "a robot file; repeat it for several tips.",
        ),
        click.Option(["--base"], metavar="LINK", default="", help="Link of such a file that becomes the base."),
        click.Option(
            ["--package-path", "packages"],
            metavar="NAME=DIR",
            multiple=True,
            callback=_packages,
            help="Folder of a package that a xacro file names in $(find NAME). NAME:=VALUE sets an argument of it.",
        ),
        click.Option(
            ["--snap"],
            type=_Snap(),
            metavar="ANGLE",
            help="Take angles within ANGLE of a multiple of 15 degrees as that multiple, in radians or as in 0.1deg; "
            "0 keeps every digit. By default only what the printed digits explain is changed.",
        ),
        click.Option(
            ["--table"],
            metavar="CONVENTION,LENGTH,ANGLE",
            default="",
            help="How the columns of a CSV file are meant, such as standard,mm,deg.",
        ),
        click.Option(
            ["--redundancy"],
            metavar="JOINT,...",
            default="",
            help="Joints whose values the inverse is given in addition to the pose, such as track,table; or arm_angle.",
        ),
        click.Option(
            ["--strict-limits"],
            is_flag=True,
            help="Solutions that rounding moved outside the joint limits are not valid; some at limits are lost.",
        ),
    ]


def _joined(words: Iterable[str]) -> list[str]:
    """Return the words of a command line, with lists of an option that have blanks behind their commas as one word."""
    found: list[str] = []
    for word in words:
        is_value = len(found) > 1 and found[-2].startswith("--") and not found[-1].startswith("--")
        is_open = is_value or (found and found[-1].startswith("--") and "=" in found[-1])
        if is_open and found[-1].endswith(",") and (not word.startswith("-") or word[1:2].isdigit()):
            found[-1] += word
        else:
            found.append(word)
    return found


class RobotCommand(click.Command):
    """A command that reads robot files of any format; one line says what reading a file changed.

    An option that the command has itself stays what it is there.
    """

    tells = True

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        used = {word for each in self.params for word in each.opts}
        self._added = [each for each in _options() if used.isdisjoint(each.opts)]
        self.params += self._added

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Take the arguments of xacro out of the words of the command line."""
        found = [_ARGUMENT.match(word) for word in args]
        ctx.meta["kinegen.arguments"] = tuple((match[1], match[2]) for match in found if match)
        return super().parse_args(ctx, _joined(word for word, match in zip(args, found, strict=True) if not match))

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command, with the options for reading in force."""
        taken = {each.name: ctx.params.pop(each.name) for each in self._added if each.name}
        refuse_idle(taken, ctx.params)
        told: set[str] = set()

        def tell(source: str, report: Report) -> None:
            if report.is_noted and self.tells and source not in told:
                told.add(source)
                complain(f"{source}: note: {report.summary}; --snap 0 keeps them, 'kinegen convert' lists them")

        with reading(ReadOptions(arguments=ctx.meta["kinegen.arguments"], **taken), tell):
            return super().invoke(ctx)
