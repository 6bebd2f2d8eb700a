"""`kinegen convert`: a robot file of any format in, another one out, and what reading it changed."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kinegen import __version__
from kinegen.cli.robot_command import RobotCommand
from kinegen.cli.terminal import faint, say, strong
from kinegen.errors import shown
from kinegen.lines import columns
from kinegen.output_file import check_output

if TYPE_CHECKING:
    from kinegen.formats.format import Format, Imported
    from kinegen.formats.report import Finding, Report
    from kinegen.robot.model import Robot
    from kinegen.tables.convert import Converted

CONVENTIONS = ("standard", "modified", "ets")
TOOLS = ("toolbox", "pinocchio", "matlab")
_LISTED = 20


class _Convert(RobotCommand):
    """Prints the report itself."""

    tells = False


@click.command("convert", cls=_Convert, short_help="Reads URDF, xacro, MJCF, CSV; writes robot files and tables.")
@click.argument("file", metavar="IN", type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    metavar="OUT",
    type=click.Path(path_type=Path),
    help="File to write; its suffix names the format. Without it, only the report is printed.",
)
@click.option(
    "--convention",
    type=click.Choice(CONVENTIONS),
    help="Write rows of this convention; every pose of every frame stays the same.",
)
@click.option(
    "--to",
    "tool",
    type=click.Choice(TOOLS),
    help="Write program text that makes the robot in the Robotics Toolbox for Python, Pinocchio or MATLAB.",
)
@click.option("--force", is_flag=True, help="Replace OUT if it exists.")
@click.option("--all", "everything", is_flag=True, help=f"List every number, not only the first {_LISTED} of a kind.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document on stdout and nothing else.")
def command(
    file: Path,
    output: Path | None,
    convention: str | None,
    tool: str | None,
    force: bool,
    everything: bool,
    as_json: bool,
) -> None:
    """Reads a robot file of any format and reports what its numbers became.

    A number is as exact as it was printed: 1.5708 is a quarter turn rounded to its last digit, and 3.141 is kept.
    The report lists each number that changed, and each that is nearly special and was kept, with its line and how far
    the difference moves a tip at most.

    \b
        kinegen convert arm.urdf
        kinegen convert arm.urdf --tip tool0 -o arm.yaml
        kinegen convert arm.urdf.xacro prefix:=left_ --package-path arm_description=. -o arm.yaml
        kinegen convert table.csv --table standard,mm,deg -o arm.yaml
        kinegen convert arm.yaml --to pinocchio -o arm.py
    """  # noqa: D301 - click's mark of a paragraph that stays as it is
    from kinegen.formats.load import load_with_report
    from kinegen.robot.model import Convention
    from kinegen.tables.convert import to_convention

    if tool and output is None:
        raise click.UsageError("--to needs the file to write: -o OUT")
    target = None if output is None else _target(output, tool)
    if output is not None:
        check_output(output, (file,), force=force)
    imported = load_with_report(file)
    converted = None if convention is None else to_convention(imported.robot, Convention(convention))
    if output is not None and target is not None:
        _write(output, target, converted.robot if converted else imported.robot)
    if as_json:
        say(json.dumps(_document(file, imported, converted, output), indent=2))
        return
    say(strong(shown(file)))
    say("\n".join(f"  {line}".rstrip() for line in _lines(imported, most=None if everything else _LISTED)))
    if converted is not None:
        say("\n".join(f"  {line}".rstrip() for line in _conversion_lines(converted, str(convention))))
    say(f"  wrote {shown(output)}" if output else faint("  nothing is written without -o OUT"))


def _target(output: Path, tool: str | None) -> Format:
    """The format to write."""
    from kinegen.formats.format import CONSTRUCTORS, FORMATS, writable

    found = CONSTRUCTORS[tool] if tool else writable(output)
    if found is None:
        known = ", ".join(suffix for each in FORMATS if each.is_writable for suffix in each.suffixes)
        raise click.UsageError(f"'{output.suffix}' is not a suffix of a format that can be written (expected {known})")
    return found


def _write(output: Path, target: Format, robot: Robot) -> None:
    from kinegen.write import write_file

    if target.write is not None:
        write_file(output, target.write(robot))


def _document(file: Path, imported: Imported, converted: Converted | None, output: Path | None) -> dict[str, object]:
    report = imported.report
    return {
        "kinegen": __version__,
        "format": 1,
        "file": str(file),
        "robot": imported.robot.name,
        "digest": imported.robot.digest,
        "length_unit": imported.robot.units.length,
        "changed": [asdict(each) for each in report.changed],
        "kept": [asdict(each) for each in report.kept],
        "effect": report.effect,
        "renamed": dict(report.renamed),
        "links": dict(report.links),
        "notes": list(report.notes),
        "conversion": None if converted is None else _conversion(converted),
        "output": None if output is None else str(output),
    }


def _conversion(converted: Converted) -> dict[str, object]:
    return {
        "free": list(converted.free),
        "rounded": list(converted.rounded),
        "frames": dict(converted.frames),
        "dropped": list(converted.dropped),
        "parameters": list(converted.parameters),
        "far": list(converted.far),
    }


def _conversion_lines(converted: Converted, convention: str) -> list[str]:
    """What a conversion could have chosen otherwise, and what it could not keep."""
    named = [f"{old} is {new} now" for old, new in converted.frames if old != new]
    parts = {
        f"{convention} rows; every pose stays the same. Free choices:": converted.free,
        "nearly parallel axes:": converted.far,
        "rounded to 50 digits, because no expression is exact:": converted.rounded,
        "frames of rows:": tuple(named),
        "frames without a name now:": converted.dropped,
        "parameters that no entry uses now:": converted.parameters,
    }
    shown_parts = [(title, found) for title, found in parts.items() if found or title.endswith("choices:")]
    return [line for title, found in shown_parts for line in ("", title, *(f"  {each}" for each in found or ("none",)))]


def _lines(imported: Imported, most: int | None) -> list[str]:
    robot, report = imported.robot, imported.report
    unit = robot.units.length
    counts = ((robot.dof, "joint variable"), (len(robot.rows), "row"), (len(robot.frames), "named frame"))
    lines = [f"robot {robot.name}: " + ", ".join(f"{n or 'no'} {thing}{'s' * (n != 1)}" for n, thing in counts)]
    lines.append(f"tip{'s' * (len(robot.tips) > 1)}: {', '.join(_tip_names(robot, report))}")
    if report.changed:
        lines += ["", f"taken as the exact value that the printed digits stand for ({len(report.changed)}):"]
        lines += _table(report.changed, unit, most)
        lines.append(f"all together they move a tip by at most {report.effect:.2g} {unit}")
    if report.kept:
        lines += ["", f"nearly special, and kept as printed ({len(report.kept)}); --snap ANGLE takes them:"]
        lines += _table(report.kept, unit, most)
    if report.renamed:
        lines += ["", "renamed, because the name is not an identifier, or is taken:"]
        lines += [f"  {old} -> {new}" for old, new in report.renamed[:most]] + _more(report.renamed, most)
    if report.notes:
        lines += ["", *report.notes]
    return lines


def _tip_names(robot: Robot, report: Report) -> list[str]:
    links = {frame: link for link, frame in reversed(report.links)}
    return [f"{tip} (link {links[tip]})" if links.get(tip, tip) != tip else tip for tip in robot.tips]


def _table(found: tuple[Finding, ...], unit: str, most: int | None) -> list[str]:
    head = ("line", "where", "text", "exact", "digits", f"tip moves, {unit}")
    rows = [
        (str(each.line), each.where, each.text, each.exact, f"{each.digits:.2g}", f"{each.effect:.1e}")
        for each in found[:most]
    ]
    lines = columns([head, *rows], left=frozenset({1, 2, 3}))
    return [f"  {line}" for line in lines] + _more(found, most)


def _more(found: tuple[object, ...], most: int | None) -> list[str]:
    rest = 0 if most is None else len(found) - most
    return [f"  and {rest} more; --all lists them"] if rest > 0 else []
