"""`kinegen check` and `kinegen schema`: what robot files hold or what is wrong with them, and how editors see it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING

import click

from kinegen.errors import KinegenError, shown
from kinegen.ui.cli.robot_command import Record, RobotCommand, document_text, json_option, robot_record
from kinegen.ui.cli.terminal import complain, good, say

if TYPE_CHECKING:
    from kinegen.model.robot import Robot
    from kinegen.verify.lint.numbers import Note


@click.command("check", cls=RobotCommand, short_help="Checks robot files.")
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=click.Path())
@json_option
@click.pass_context
def check_command(context: click.Context, files: tuple[str, ...], as_json: bool) -> int:
    """Checks robot files: prints a summary of each, or the first error with its line.

    Notes point out values that are nearly special, such as 89.9999 degrees, and how far the difference moves the tip.
    They also point out angles that look as if they were written in the other unit, such as 1.5708 in degrees.
    """
    failed = examine(context, files, _check_record if as_json else None, _check_lines)
    if failed and len(files) > 1:
        complain(f"{failed} of {len(files)} files have errors")
    return int(failed > 0)


def examine(
    context: click.Context,
    files: tuple[str, ...],
    record: Callable[[str, Robot], Record] | None,
    lines: Callable[[str, Robot], Iterable[str]],
) -> int:
    """Print what is known of each file, also after one has failed; returns how many failed."""
    from kinegen.io.load import load

    documents: list[Record] = []
    failed = 0
    for file in files:
        try:
            robot = load(file)
            if record is None:
                say("\n".join(lines(file, robot)))
            else:
                documents.append({"file": file, "ok": True, "robot": robot_record(robot), **record(file, robot)})
        except KinegenError as error:
            if (len(files) == 1 and record is None) or context.find_root().params["debug"]:
                raise
            complain(f"error: {error}")
            documents.append({"file": file, "ok": False, "error": str(error), "line": error.line})
            failed += 1
    if record is not None:
        say(document_text({"files": documents}))
    return failed


def _notes(robot: Robot) -> tuple[Note, ...]:
    from kinegen.verify.lint.numbers import nearly_special, wrong_unit

    return (*wrong_unit(robot), *nearly_special(robot))


def _check_lines(file: str, robot: Robot) -> Iterator[str]:
    yield f"{shown(file)}: {good('ok')}, {', '.join(_facts(robot))}"
    for note in _notes(robot):
        place = shown(file) if note.line is None else f"{shown(file)}:{note.line}"
        yield f"{place}: note: {note.text}"


def _check_record(_file: str, robot: Robot) -> Record:
    from kinegen.model.joint_bounds import endless, reach, screw_leads

    unlimited = endless(robot)
    return {
        "rows": len(robot.rows),
        "frames": [frame.name for frame in robot.frames],
        "actuators": [reading.name for reading in robot.actuators.readings],
        "runtime_parameters": [parameter.name for parameter in robot.runtime_parameters],
        "reach": None if unlimited else reach(robot),
        "unlimited": list(unlimited),
        "leads": screw_leads(robot),
        "notes": [{"line": note.line, "text": note.text} for note in _notes(robot)],
    }


def _facts(robot: Robot) -> list[str]:
    from kinegen.model.joint_bounds import endless, reach, screw_leads

    types = Counter(variable.type for variable in robot.variables)
    kinds = ", ".join(f"{count} {kind}" for kind, count in types.items()) or "write q where one is, as in theta: q"
    facts = [_counted(robot.dof, "joint variable") + f" ({kinds})", _counted(len(robot.rows), "row")]
    facts += [f"{len(robot.tips)} tips"] if robot.is_tree else []
    facts += [_counted(len(robot.frames), "named frame")] if robot.frames else []
    facts += [_counted(len(robot.actuators.readings), "actuator")] if robot.actuators.readings else []
    facts += [_counted(len(robot.runtime_parameters), "runtime parameter")] if robot.runtime_parameters else []
    bound, free = f"reach at most {reach(robot):.4g} {robot.units.length}", endless(robot)
    facts.append(f"reach without a bound ({', '.join(free)} without limits)" if free else bound)
    facts += [f"lead of {name} {lead:.6g} {robot.units.length}/rev" for name, lead in screw_leads(robot).items()]
    return facts


def _counted(number: int, thing: str) -> str:
    return f"{number} {thing}" if number == 1 else f"{number or 'no'} {thing}s"


@click.command("schema", short_help="Prints the JSON Schema of robot files.")
def schema_command() -> None:
    """Prints the JSON Schema of robot files, with which an editor completes and checks them.

    \b
        kinegen schema > robot.schema.json
    """  # noqa: D301 - click's mark of a paragraph that stays as it is
    import json

    from kinegen.io.robot_file.keys import schema

    say(json.dumps(schema(), indent=2))
