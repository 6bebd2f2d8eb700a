"""`kinegen inspect`: the family of a robot's closed-form inverse, or what is missing for one."""

from __future__ import annotations

from itertools import permutations
from typing import TYPE_CHECKING

import click

from kinegen.cli.robot_command import RobotCommand
from kinegen.cli.terminal import complain, filled, say, strong
from kinegen.errors import KinegenError, shown
from kinegen.lines import columns
from kinegen.robot.redundancy import JOINTS

if TYPE_CHECKING:
    from kinegen.robot.model import Robot
    from kinegen.symbolic.inverse.constants import Constant
    from kinegen.symbolic.inverse.family import Family

_INDENT = "  "


@click.command("inspect", cls=RobotCommand, short_help="Names the closed-form inverse that an arm has.")
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=click.Path())
@click.pass_context
def command(context: click.Context, files: tuple[str, ...]) -> int:
    """Names the family of each robot's closed-form inverse, its branches in their order, and its constants.

    The family depends on the axes of the joints, not on the convention of the table. If an arm has no family, the
    conditions that fail are listed.
    """
    failed = 0
    for file in files:
        try:
            _inspect(file)
        except KinegenError as error:
            if len(files) == 1 or context.find_root().params["debug"]:
                raise
            complain(f"error: {error}")
            failed += 1
    return int(failed > 0)


def _inspect(file: str) -> None:
    from kinegen.formats.load import load
    from kinegen.symbolic.inverse.family import Family
    from kinegen.symbolic.inverse.recognise import recognise

    robot = load(file)
    found = recognise(robot)
    lines = _family_lines(robot, found) if isinstance(found, Family) else _unknown_lines(robot, found.reasons)
    say(
        "\n".join(
            [f"{shown(file)}: {strong(found.name if isinstance(found, Family) else 'no closed-form inverse')}", *lines]
        )
    )


def _unknown_lines(robot: Robot, reasons: tuple[str, ...]) -> list[str]:
    from kinegen.emit.complete.screws import refusal

    lines = [line for reason in reasons for line in filled([reason], _INDENT)]
    lines += [*_machine_lines(robot), *(() if robot.is_arm else _seen_lines(robot))]
    if robot.is_tree and robot.dof:
        several = f"{_INDENT}The numeric inverse takes targets of all tips: kinegen build --outputs numeric_inverse"
        return [*lines, several]
    if not robot.is_arm:
        return lines
    lines = [*lines, f"{_INDENT}The numeric inverse works for every arm: kinegen build --outputs numeric_inverse"]
    if not refusal(robot):
        lines.append(f"{_INDENT}All solutions, up to 16: kinegen build --outputs complete_inverse")
    if robot.dof == JOINTS and not robot.redundancy:
        lines.append(f"{_INDENT}Seven joints: --redundancy NAME gives one joint, or arm_angle, in addition to the pose")
    return lines


def _machine_lines(robot: Robot) -> list[str]:
    """The pairs of tips between which the robot is a machine tool with five axes."""
    from kinegen.robot.model import TOOL
    from kinegen.symbolic.inverse.machine import Machine, machine_of

    lines = []
    for tool, workpiece in permutations(robot.tips, 2) if robot.is_tree else ((TOOL, robot.root),):
        found = machine_of(robot, workpiece, tool)
        if isinstance(found, Machine):
            text = f"{tool} as a tool in the frame of {workpiece}: a machine tool with five axes, {found.words}"
            way = f"@{tool}/{workpiece}" if robot.is_tree else ""
            command = f"{_INDENT * 2}kinegen build --outputs axis_inverse{way}"
            lines += [*filled([text], _INDENT), command]
    return lines


def _seen_lines(robot: Robot) -> list[str]:
    """The pairs of tips between which the chain has a closed-form inverse."""
    from kinegen.symbolic.inverse.recognise import Unknown, recognise
    from kinegen.tables.seen import seen_chain

    lines, reasons = list[str](), list[str]()
    for tool, workpiece in permutations(robot.tips, 2):
        found = recognise(seen_chain(robot, tool, workpiece))
        if isinstance(found, Unknown):
            reasons.append(f"{tool} in the frame of {workpiece}: {found.reasons[0]}")
        else:
            text = f"{tool} in the frame of {workpiece}: {'; '.join([found.name, *found.conditions])}"
            command = f"{_INDENT * 2}kinegen build --outputs inverse@{tool}/{workpiece}"
            lines += [*filled([text], _INDENT), command]
    # Without a redundancy there is hardly a tree of which all joints between two tips are a family.
    return lines or ([line for reason in reasons for line in filled([reason], _INDENT)] if robot.redundancy else [])


def _family_lines(robot: Robot, family: Family) -> list[str]:
    from kinegen.symbolic.inverse.constants import constants

    branches = [f"{_INDENT * 2}{index}  {name}" for index, name in enumerate(family.branches)]
    rows = [_row(robot, constant) for constant in constants(family)]
    table = columns(rows, left=frozenset({0, 2})) if rows else []
    meanings = [line for meaning in family.meanings for line in filled([meaning], _INDENT * 2)]
    conditions = [line for condition in family.conditions for line in filled([condition], _INDENT * 2)]
    return [
        *_defect_lines(robot, family),
        f"{_INDENT}solved for the {family.aim} of the tool",
        f"{_INDENT}branches",
        *branches,
        *meanings,
        *([f"{_INDENT}constants", *table] if table else []),
        f"{_INDENT}targets",
        *conditions,
    ]


def _defect_lines(robot: Robot, family: Family) -> list[str]:
    """Which conditions are met only nearly, and what that means."""
    from kinegen.symbolic.inverse.apart import SAMPLES, tip_apart
    from kinegen.symbolic.inverse.derive import singular_below, size_of
    from kinegen.symbolic.inverse.refine import amounts

    if family.defect is None:
        return []
    unit, tip = robot.units.length, tip_apart(robot, family)
    failing = [
        f"{each.text} but for {each.amount:.2g} {'rad' if each.is_angle else unit}" for each in family.defect.failing
    ]
    many, below = amounts(family.defect, size_of(robot, family)), singular_below(robot, family)
    away = (
        f"the tip of the nearest exact arm is up to {tip.length:.2g} {unit} and {tip.angle:.2g} rad away (the most of "
        f"{SAMPLES:,} joint vectors)"
    )
    led = f"its solutions are led to this arm's by {many.text}"
    vanish = (
        "branches may be missing where the least singular value of the Jacobian, lengths by the reach of "
        f"{size_of(robot, family):.4g} {unit}, is below {below:.1g}"
    )
    lines = [line for text in (*failing, away, led, vanish) for line in filled([text], _INDENT * 2)]
    return [f"{_INDENT}conditions that it nearly meets", *lines]


def _row(robot: Robot, constant: Constant) -> tuple[str, str, str]:
    unit = "deg" if constant.is_angle else robot.units.length
    runtime = f" (from {', '.join(constant.runtime)})" if constant.runtime else ""
    return f"{_INDENT * 2}{constant.text}", f"{constant.value:.6g}", f"{unit}{runtime}"
