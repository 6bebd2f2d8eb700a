"""`kinegen fk`: the pose for one joint vector, from the reference and to the last digit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from kinegen.cli.robot_command import VALUED, RobotCommand
from kinegen.cli.terminal import complain, say, strong
from kinegen.lines import columns

if TYPE_CHECKING:
    from decimal import Decimal

    from kinegen.robot.model import JointVariable, Robot

DIGITS = 12
"""Decimals that are printed; the reference computes with 50 digits."""


class _Signed(RobotCommand):
    """Takes negative numbers for what they are: `-0.5` and `-pi/2` are values, not options."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Put the values behind a `--`, after which click looks for options no more."""
        options: list[str] = []
        values: list[str] = []
        rest = list(args)
        while rest:
            word = rest.pop(0)
            if word == "--":
                values += rest
                break
            if not word.startswith("--") and word != "-h":
                values.append(word)
                continue
            options.append(word)
            if word in ("--frame", *VALUED) and rest:
                options.append(rest.pop(0))
        return super().parse_args(ctx, [*options, "--", *values])


@click.command("fk", cls=_Signed, short_help="Prints the pose for joint values.")
@click.argument("file", type=click.Path())
@click.argument("values", metavar="Q...", nargs=-1)
@click.option(
    "--degrees", "--deg", "asked", flag_value="deg", help="Angles are in degrees, also where the file has radians."
)
@click.option(
    "--radians", "--rad", "asked", flag_value="rad", help="Angles are in radians, also where the file has degrees."
)
@click.option("--frame", metavar="NAME", help="The frame instead of the tool: a joint, a row number or a named frame.")
def command(file: str, values: tuple[str, ...], asked: str | None, frame: str | None) -> None:
    """Prints the pose of the tool in the base frame for joint values.

    One value for each joint variable: a number, or an expression such as pi/2. Angles and lengths are in the units of
    the file; in degrees, pi is half a turn. The last line reports the unit of the angles.

    \b
        kinegen fk robots/puma560.yaml 0 -90 30 0 0 0
        kinegen fk robots/puma560.yaml --radians 0 -pi/2 0.5 0 0 0
    """  # noqa: D301 - click's mark of a paragraph that stays as it is
    from kinegen import reference
    from kinegen.formats.load import load

    robot = load(file)
    angle = asked or robot.units.angle
    q = read_values(robot, values, deg=angle == "deg")
    _warn_of_limits(robot, q, deg=angle == "deg")
    poses = reference.frames_mp(robot, [str(value) for value in q])
    names = robot.tips if frame is None else (_frame_name(robot, frame, tuple(poses)),)
    say("\n\n".join(_pose(robot, name, poses[name]) for name in names))
    if any(map(_is_angle, robot.variables)):
        say(f"angles taken in {angle}, {'as asked' if asked else 'the unit of the file'}")


def read_values(robot: Robot, texts: tuple[str, ...], *, deg: bool) -> list[Decimal]:
    """One exact value for each joint variable, in radians and the file's length unit."""
    wanted = ", ".join(f"{variable.name} [{_unit(robot, variable, deg=deg)}]" for variable in robot.variables)
    if len(texts) != robot.dof:
        given = f"{len(texts)} given" if texts else "none given"
        listed = f" ({wanted})" if wanted else ""
        raise click.UsageError(f"{robot.name} takes {robot.dof or 'no'} joint values{listed}, {given}")
    return [_read(variable, text, deg=deg) for variable, text in zip(robot.variables, texts, strict=True)]


def _read(variable: JointVariable, text: str, *, deg: bool) -> Decimal:
    from kinegen.robot.expressions import ExpressionError, parse
    from kinegen.robot.units import radians
    from kinegen.robot.values import checked_value

    try:
        expression = parse(text)
        in_degrees = deg and _is_angle(variable)
        return checked_value(radians(expression, frozenset()) if in_degrees else expression, {})
    except KeyError as error:
        raise click.UsageError(f"{variable.name}: {error.args[0]!r} is not a number") from None
    except ExpressionError as error:
        raise click.UsageError(f"{variable.name}: {error}") from None


def _is_angle(variable: JointVariable) -> bool:
    from kinegen.robot.model import JointType

    return variable.type is not JointType.PRISMATIC


def _unit(robot: Robot, variable: JointVariable, *, deg: bool) -> str:
    if not _is_angle(variable):
        return robot.units.length
    return "deg" if deg else "rad"


def _warn_of_limits(robot: Robot, q: list[Decimal], *, deg: bool) -> None:
    from kinegen.robot.units import RADIAN
    from kinegen.robot.values import checked_value

    for variable, value in zip(robot.variables, q, strict=True):
        if variable.limits is None:
            continue
        low, high = (checked_value(limit, {}) for limit in variable.limits)
        if low <= value <= high:
            continue
        unit = _unit(robot, variable, deg=deg)
        factor = checked_value(RADIAN, {}) if unit == "deg" else 1
        shown, least, most = (f"{float(each * factor):.6g}" for each in (value, low, high))
        beyond = f"{float(max(low - value, value - high) * factor):.2g} {unit}"
        where = f"{beyond} outside its limits, {least} to {most} {unit}"
        complain(f"warning: {variable.name} = {shown} {unit} is {where}")


def _frame_name(robot: Robot, frame: str, known: tuple[str, ...]) -> str:
    from kinegen.errors import KinegenError
    from kinegen.robot.model import ROOT

    known = tuple(name for name in known if name != ROOT)
    if frame.isdecimal() and 1 <= int(frame) <= len(robot.rows):
        return robot.rows[int(frame) - 1].name
    if frame not in known:
        rows = f", or a row number up to {len(robot.rows)}" if robot.rows else ""
        raise KinegenError(f"unknown frame {frame!r} (expected {', '.join(known)}{rows})")
    return frame


def _pose(robot: Robot, name: str, matrix: Any) -> str:
    """The matrix, and its position once more with the unit."""
    rows = [[_decimal(matrix[row, column]) for column in range(4)] for row in range(4)]
    position = ", ".join(row[3].rstrip("0").rstrip(".") for row in rows[:3])
    return "\n".join([strong(f"base_T_{name}"), *columns(rows), f"position {position} {robot.units.length}"])


def _decimal(value: Any) -> str:
    text = f"{float(value):.{DIGITS}f}"
    # A rotation by a right angle leaves no -0.000000000000.
    return text.removeprefix("-") if not text.strip("-0.") else text
