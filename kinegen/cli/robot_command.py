"""What every command that takes a robot file has in common: how files of other formats are read.

`RobotCommand` adds the options to a command and takes `name:=value` for arguments of a xacro file. The files are read
with these options while the command runs.
"""

from __future__ import annotations

import math
import re
from typing import Any

import click

from kinegen.cli.terminal import complain
from kinegen.formats.format import ReadOptions, reading
from kinegen.formats.report import Report

_ARGUMENT = re.compile(r"([A-Za-z_][A-Za-z0-9_.]*):=(.*)\Z", re.DOTALL)
VALUED = ("--tip", "--base", "--package-path", "--snap", "--table", "--redundancy")
"""The options that `RobotCommand` adds, all of which take a value."""


class _Snap(click.ParamType):  # type: ignore[type-arg]
    """An angle in radians, or in degrees with `deg` behind it."""

    name = "angle"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Radians."""
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
            help="Link of a URDF or MJCF file at which the robot ends; repeat it for several tips.",
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
    ]


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
        return super().parse_args(ctx, [word for word, match in zip(args, found, strict=True) if not match])

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command, with the options for reading in force."""
        taken = {each.name: ctx.params.pop(each.name) for each in self._added if each.name}
        told: set[str] = set()

        def tell(source: str, report: Report) -> None:
            if report.changed and self.tells and source not in told:
                told.add(source)
                complain(f"{source}: note: {report.summary}; 'kinegen convert {source}' lists them")

        with reading(ReadOptions(arguments=ctx.meta["kinegen.arguments"], **taken), tell):
            return super().invoke(ctx)
