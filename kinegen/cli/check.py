"""`kinegen check`: reads robot files and says what they hold, or what is wrong with them."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import click

from kinegen.cli.robot_command import RobotCommand
from kinegen.cli.terminal import complain, good, say
from kinegen.errors import KinegenError, shown

if TYPE_CHECKING:
    from kinegen.robot.model import Robot


@click.command("check", cls=RobotCommand, short_help="Checks robot files.")
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=click.Path())
@click.pass_context
def command(context: click.Context, files: tuple[str, ...]) -> int:
    """Checks robot files: prints a summary of each, or the first error with its line.

    Notes point out values that are nearly special, such as 89.9999 degrees, and how far the difference moves the tip.
    They also point out angles that look as if they were written in the other unit, such as 1.5708 in degrees.
    """
    failed = 0
    for file in files:
        try:
            _check(file)
        except KinegenError as error:
            if len(files) == 1 or context.find_root().params["debug"]:
                raise
            complain(f"error: {error}")
            failed += 1
    if failed:
        complain(f"{failed} of {len(files)} files have errors")
    return int(failed > 0)


def _check(file: str) -> None:
    from kinegen.formats.load import load
    from kinegen.verify.nearly import nearly_special
    from kinegen.verify.wrong_unit import wrong_unit

    robot = load(file)
    say(f"{shown(file)}: {good('ok')}, {', '.join(_facts(robot))}")
    for note in (*wrong_unit(robot), *nearly_special(robot)):
        place = shown(file) if note.line is None else f"{shown(file)}:{note.line}"
        say(f"{place}: note: {note.text}")


def _facts(robot: Robot) -> list[str]:
    from kinegen.robot.extent import reach
    from kinegen.robot.screw import screw_leads

    types = Counter(variable.type for variable in robot.variables)
    kinds = ", ".join(f"{count} {kind}" for kind, count in types.items())
    facts = [_counted(robot.dof, "joint variable") + (f" ({kinds})" if kinds else ""), _counted(len(robot.rows), "row")]
    facts += [f"{len(robot.tips)} tips"] if robot.is_tree else []
    facts += [_counted(len(robot.frames), "named frame")] if robot.frames else []
    facts += [_counted(len(robot.actuators.readings), "actuator")] if robot.actuators.readings else []
    facts += [_counted(len(robot.runtime_parameters), "runtime parameter")] if robot.runtime_parameters else []
    facts.append(f"reach at most {reach(robot):.4g} {robot.units.length}")
    facts += [f"lead of {name} {lead:.6g} {robot.units.length} a turn" for name, lead in screw_leads(robot).items()]
    return facts


def _counted(number: int, thing: str) -> str:
    return f"{number} {thing}" if number == 1 else f"{number or 'no'} {thing}s"
