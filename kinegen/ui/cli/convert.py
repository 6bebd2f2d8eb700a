"""`kinegen convert` and `kinegen compare`: robot files in other formats, and side by side."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kinegen.errors import KinegenError, shown
from kinegen.support.files.manifest import check_output
from kinegen.support.text_layout import columns
from kinegen.ui.cli.robot_command import Record, RobotCommand, document_text, json_option
from kinegen.ui.cli.terminal import complain, faint, good, say, strong

if TYPE_CHECKING:
    from kinegen.io.format import Finding, Format, Imported, Report
    from kinegen.model.dh_conversion.convert import Converted
    from kinegen.model.robot import Robot
    from kinegen.tools.compare import Comparison, Difference

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
@json_option
def convert_command(
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
    from kinegen.io.load import load_with_report
    from kinegen.model.dh_conversion.convert import to_convention
    from kinegen.model.robot import Convention

    if tool and output is None:
        raise click.UsageError("--to needs the file to write: -o OUT")
    target = None if output is None else _target(output, tool)
    if output is not None:
        check_output(output, (file,), force=force)
    # What is read, converted and written is the same robot; its poses are compared before it is returned.
    imported = load_with_report(file)
    converted = None if convention is None else to_convention(imported.robot, Convention(convention))
    if output is not None and target is not None:
        _write(output, target, converted.robot if converted else imported.robot)
    if as_json:
        say(document_text(_document(file, imported, converted, output)))
        return
    say(strong(shown(file)))
    say("\n".join(f"  {line}".rstrip() for line in _lines(imported, most=None if everything else _LISTED)))
    if converted is not None:
        say("\n".join(f"  {line}".rstrip() for line in _conversion_lines(converted, str(convention))))
    say(f"  wrote {shown(output)}" if output else faint("  nothing is written without -o OUT"))


def _target(output: Path, tool: str | None) -> Format:
    """Return the format to write."""
    from kinegen.io.format import CONSTRUCTORS, FORMATS, writable

    found = CONSTRUCTORS[tool] if tool else writable(output)
    if found is None:
        known = ", ".join(suffix for each in FORMATS if each.is_writable for suffix in each.suffixes)
        raise click.UsageError(f"'{output.suffix}' is not a suffix of a format that can be written (expected {known})")
    return found


def _write(output: Path, target: Format, robot: Robot) -> None:
    from kinegen.support.files.write import write_file

    if target.write is not None:
        write_file(output, target.write(robot))


def _document(file: Path, imported: Imported, converted: Converted | None, output: Path | None) -> Record:
    report = imported.report
    return {
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


def _conversion(converted: Converted) -> Record:
    return {
        "free": list(converted.free),
        "rounded": list(converted.rounded),
        "frames": dict(converted.frames),
        "dropped": list(converted.dropped),
        "parameters": list(converted.parameters),
        "far": list(converted.far),
    }


def _conversion_lines(converted: Converted, convention: str) -> list[str]:
    """Return what a conversion could have chosen otherwise, and what it could not keep."""
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
    # Numbers that changed, those that nearly did, and new names.
    if report.changed:
        lines += ["", f"taken as the exact value that the printed digits stand for ({len(report.changed)}):"]
        lines += _table(report.changed, unit, most)
        lines.append(f"all together they move a tip by at most {report.effect:.2g} {unit}")
    if report.kept:
        lines += ["", f"close to a special value, and kept as printed ({len(report.kept)}); --snap ANGLE takes them:"]
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


_TROUBLE = 2
"""Exit status where nothing was compared, as that of `diff`."""

_ROUNDING = 1e-11
"""Metres and radians that are the rounding of the poses compared, and print as 0."""


@click.command("compare", cls=RobotCommand, short_help="Compares two robot files.")
@click.argument("first", metavar="A", type=click.Path())
@click.argument("second", metavar="B", type=click.Path())
@click.option("--fit-offsets", is_flag=True, help="Find signs and zero offsets of the joints of B.")
@click.option(
    "--tolerance",
    type=click.FloatRange(min=0, min_open=False),
    default=1e-9,
    show_default=True,
    help="Metres and radians up to which frames are the same where there is no proof.",
)
@json_option
@click.pass_context
def compare_command(
    context: click.Context, first: str, second: str, fit_offsets: bool, tolerance: float, as_json: bool
) -> int:
    """Compares two robot files, in any convention, format and unit.

    Each frame that both have is compared: with a proof for every joint vector where the joint axes and the pose at
    zero are the same, otherwise by the greatest difference over the limits of A. The frames of rows do not count where
    the conventions differ, because each convention places them elsewhere, nor where signs or zeros were fitted.

    The exit status is 0 if the robots are the same, 1 if they are not, and 2 if they cannot be compared.
    """
    from kinegen.io.load import load
    from kinegen.tools.compare import compare

    about: Record = {"first": first, "second": second}
    try:
        left, right = load(first), load(second)
        found = compare(left, right, fit_offsets=fit_offsets, tolerance=tolerance)
    except KinegenError as error:
        if context.find_root().params["debug"]:
            raise
        complain(f"error: {error}")
        if as_json:
            say(document_text({**about, "error": str(error)}))
        return _TROUBLE
    if as_json:
        say(document_text({**about, **asdict(found)}))
    else:
        _report(found, left, right, (shown(first), shown(second)))
    return 0 if found.same else 1


def _report(found: Comparison, left: Robot, right: Robot, files: tuple[str, str]) -> None:
    verdict = "not the same robot"
    if found.same:
        how = "by proof for every joint vector" if found.proved else f"within {found.tolerance:g} m and rad"
        verdict = f"{good('the same robot')}, {how}"
    say(f"{files[0]} and {files[1]}: {verdict}")
    for note in found.notes:
        say(f"  {note}")
    # Fitted signs and offsets, then each frame, then what only one robot has.
    for (_, name), sign, offset in zip(found.joints, found.signs, found.offsets, strict=True):
        if sign < 0 or offset:
            kind = next(each.type for each in right.variables if each.name == name)
            said = f"{offset:+.9g} m" if kind == "prismatic" else f"{math.degrees(offset):+.9g} deg"
            say(f"  {name} of {files[1]} = {'-' if sign < 0 else ''}q {said}")
    for each in found.differences:
        say(f"  {_line(each)}")
        if not each.proved and max(each.distance, each.angle) > found.tolerance:
            say(f"    at {_vector(left, each.distance_at if each.distance > 0 else each.angle_at)}")
    for names, file in ((found.only_first, files[0]), (found.only_second, files[1])):
        if names:
            say(f"  only in {file}: {', '.join(names)}")


def _line(each: Difference) -> str:
    """Describe one frame in a line."""
    name = each.first if each.first == each.second else f"{each.first} ({each.second})"
    aside = "" if each.decides else f" (does not count: {each.reason})"
    if each.proved:
        return f"{name}: the same pose{aside}"
    return f"{name}: at most {_length(each.distance)} and {_angle(each.angle)} apart{aside}"


def _angle(radians: float) -> str:
    return f"{math.degrees(radians):.4g} deg" if radians >= _ROUNDING else "0 deg"


def _length(metres: float) -> str:
    if metres < _ROUNDING:
        return "0 mm"
    return f"{metres:.4g} m" if metres >= 1 else f"{1000 * metres:.4g} mm"


def _vector(robot: Robot, q: tuple[float, ...]) -> str:
    """Return a joint vector, in degrees and metres."""
    parts = []
    for variable, value in zip(robot.variables, q, strict=True):
        slides = variable.type == "prismatic"
        parts.append(f"{variable.name} {value:.4g} m" if slides else f"{variable.name} {math.degrees(value):.1f} deg")
    return ", ".join(parts) or "the only pose"
