"""`kinegen show` and `kinegen fk`: the closed form as a textbook prints it, and the pose for joint values."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import click

from kinegen.backends.textbook import OUTPUTS, VARIABLES
from kinegen.support.text_layout import columns
from kinegen.ui.cli.robot_command import VALUED, Record, RobotCommand, document_text, json_option, robot_record
from kinegen.ui.cli.terminal import complain, say, strong, width, with_references

if TYPE_CHECKING:
    from decimal import Decimal

    from kinegen.model.robot import JointVariable, Robot

FORMATS = ("text", "latex", "mathml", "python")


@click.command("show", cls=RobotCommand, short_help="Prints the closed form.")
@click.argument("file", type=click.Path())
@click.option("--format", "notation", type=click.Choice(FORMATS), default="text", show_default=True, help="Notation.")
@click.option(
    "--output",
    type=click.Choice(tuple(OUTPUTS)),
    default="pose",
    show_default=True,
    help="The pose, or the geometric Jacobian, rows linear velocity and then angular: at the frame's origin in the "
    "axes of the base, in the frame's own axes (local), or at the origin of the base (world); or the determinant of "
    "the Jacobian in factors, with the places where each vanishes in words; or the angles of the orientation.",
)
@click.option("--from", "start", metavar="FRAME", help="Frame of reference, by name or row number; 0 is before row 1.")
@click.option("--to", "end", metavar="FRAME", help="Frame whose pose is printed; by default the tool, or every tip.")
@click.option("--steps", is_flag=True, help="Also print every link matrix on the way, and their products.")
@click.option("--link-matrix", "general", is_flag=True, help="Also print the general matrix of one row of the table.")
@click.option("--name-subexpressions", "named", is_flag=True, help="Give names to what is used more than once.")
@click.option(
    "--blocks",
    is_flag=True,
    help="Print the linear and the angular part of a Jacobian as two; of an arm in a plane, its three rows.",
)
@click.option(
    "--variables",
    type=click.Choice(VARIABLES),
    default=VARIABLES[0],
    show_default=True,
    help="Names of joint variables.",
)
def show_command(file: str, notation: str, output: str, start: str | None, end: str | None, **options: Any) -> None:
    """Prints the table and the closed form of a robot, factored as a textbook prints it.

    c1 and s1 are the cosine and sine of the first joint variable, c23 is cos(q2 + q3). Examples for the whole chain,
    from base to tool, and for a part of it:

    \b
        kinegen show robots/puma560.yaml
        kinegen show robots/puma560.yaml --from 3 --to 6
        kinegen show robots/scara.yaml --output jacobian
        kinegen show robots/ur5.yaml --output singularities
        kinegen show robots/puma560.yaml --format latex > puma560.tex
    """  # noqa: D301 - click's mark of a paragraph that stays as it is
    from kinegen.backends.textbook.sheet import make_sheet
    from kinegen.io.load import load
    from kinegen.model.variants import frame_named
    from kinegen.support.naming import only_printed

    with only_printed():
        robot = load(file)
    start, end = (None if each is None else frame_named(robot, each) for each in (start, end))
    sheet = make_sheet(robot, start, end, output=output, **options)
    match notation:
        case "text":
            from kinegen.backends.textbook.sheet_text import text_sheet

            say(text_sheet(sheet, width(), strong))
        case "latex":
            from kinegen.backends.textbook.sheet_latex import latex_sheet

            say(latex_sheet(sheet))
        case "mathml":
            from kinegen.backends.textbook.sheet_mathml import mathml_sheet

            say(with_references(mathml_sheet(sheet)))
        case _:
            from kinegen.backends.textbook.sheet_python import python_sheet

            say(python_sheet(sheet))


DIGITS = 12
"""Decimals that are printed; the reference computes with 50 digits."""

_NOTHING = 1e-40
"""What rounding of 50 digits leaves of a 0, such as the cosine of a right angle."""


_COMMA = re.compile(r",(?![^()]*\))")
"""A comma between values, not between the arguments of a function."""


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
            if word in ("--angle", "--frame", *VALUED) and rest:
                options.append(rest.pop(0))
        return super().parse_args(ctx, [*options, "--", *values])


@click.command("fk", cls=_Signed, short_help="Prints the pose for joint values.")
@click.argument("file", type=click.Path())
@click.argument("values", metavar="Q...", nargs=-1)
@click.option("--angle", type=click.Choice(["rad", "deg"]), help="Unit of angles.  [default: that of the robot file]")
@click.option("--degrees", "--deg", "asked", flag_value="deg", help="The same as --angle deg.")
@click.option("--radians", "--rad", "asked", flag_value="rad", help="The same as --angle rad.")
@click.option(
    "--frame",
    metavar="NAME",
    help="The frame instead of the tool: a joint, a row number, a named frame, or a link of a URDF or MJCF file.",
)
@json_option
def fk_command(
    file: str, values: tuple[str, ...], angle: str | None, asked: str | None, frame: str | None, as_json: bool
) -> None:
    """Prints the pose of the tool in the base frame for joint values.

    One value for each joint variable, with blanks or commas between them: a number, or an expression such as pi/2.
    Angles and lengths are in the units of the file, unless --angle states that of the angles; in degrees, pi is half a
    turn. The last line reports the unit of the angles.

    \b
        kinegen fk robots/puma560.yaml 0 -90 30 0 0 0
        kinegen fk robots/puma560.yaml --radians 0 -pi/2 0.5 0 0 0
    """  # noqa: D301 - click's mark of a paragraph that stays as it is
    from kinegen.io.load import load
    from kinegen.verify import reference

    if angle and asked and angle != asked:
        raise click.UsageError(f"--angle {angle} and angles in {asked} exclude each other")
    # Values are exact until the reference has multiplied with 50 digits.
    robot = load(file)
    asked = angle or asked
    angle = asked or robot.units.angle
    q = read_values(robot, _separated(values), deg=angle == "deg")
    outside = _warn_of_limits(robot, q, deg=angle == "deg")
    poses = reference.frames_mp(robot, [str(value) for value in q])
    names = robot.tips if frame is None else (_frame_name(robot, frame, tuple(poses)),)
    if as_json:
        found: Record = {"file": file, "robot": robot_record(robot), "angle": angle, "q": list(map(float, q))}
        matrices = [_pose_record(robot, name, poses[name]) for name in names]
        say(document_text({**found, "outside": outside, "poses": matrices}))
        return
    say("\n\n".join(_pose(robot, name, poses[name]) for name in names))
    if any(map(_is_angle, robot.variables)):
        say(f"angles taken in {angle}, {'as asked' if asked else 'the unit of the file'}")


def _separated(words: tuple[str, ...]) -> tuple[str, ...]:
    """Return the values of words with commas between all of them, such as `30,40,25`; elsewhere a comma is a slip."""
    if all(word.endswith(",") for word in words[:-1]):
        return tuple(part.strip() for word in words for part in _COMMA.split(word.removesuffix(",")))
    return words


def read_values(robot: Robot, texts: tuple[str, ...], *, deg: bool) -> list[Decimal]:
    """Return one exact value for each joint variable, in radians and the file's length unit."""
    wanted = ", ".join(f"{variable.name} [{_unit(robot, variable, deg=deg)}]" for variable in robot.variables)
    if len(texts) != robot.dof:
        given = f"{len(texts)} given" if texts else "none given"
        listed = f" ({wanted})" if wanted else ""
        raise click.UsageError(f"{robot.name} needs {robot.dof or 'no'} joint values{listed}, {given}")
    return [_read(variable, text, deg=deg) for variable, text in zip(robot.variables, texts, strict=True)]


def _read(variable: JointVariable, text: str, *, deg: bool) -> Decimal:
    from kinegen.model.expression_parser import ExpressionError, parse
    from kinegen.model.expression_values import checked_value, radians

    try:
        expression = parse(text)
        in_degrees = deg and _is_angle(variable)
        return checked_value(radians(expression, frozenset()) if in_degrees else expression, {})
    except KeyError as error:
        raise click.UsageError(f"{variable.name}: {error.args[0]!r} is not a number") from None
    except ExpressionError as error:
        raise click.UsageError(f"{variable.name}: {error}") from None


def _is_angle(variable: JointVariable) -> bool:
    from kinegen.model.robot import JointType

    return variable.type is not JointType.PRISMATIC


def _unit(robot: Robot, variable: JointVariable, *, deg: bool) -> str:
    if not _is_angle(variable):
        return robot.units.length
    return "deg" if deg else "rad"


def _warn_of_limits(robot: Robot, q: list[Decimal], *, deg: bool) -> list[str]:
    """Warn of joint values outside the limits; returns the names of these joints."""
    from kinegen.model.expression_values import RADIAN, checked_value

    outside = []
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
        outside.append(variable.name)
    return outside


def _frame_name(robot: Robot, frame: str, known: tuple[str, ...]) -> str:
    from kinegen.errors import KinegenError
    from kinegen.model.robot import ROOT
    from kinegen.model.variants import frame_named

    known = tuple(name for name in known if name != ROOT)
    frame = frame_named(robot, frame)
    if frame.isdecimal() and 1 <= int(frame) <= len(robot.rows):
        return robot.rows[int(frame) - 1].name
    if frame not in known:
        rows = f", or a row number up to {len(robot.rows)}" if robot.rows else ""
        raise KinegenError(f"unknown frame {frame!r} (expected {', '.join(known)}{rows})")
    return frame


def _pose(robot: Robot, name: str, matrix: Any) -> str:
    """Return the matrix, and its position once more with the unit."""
    from kinegen.model.variants import root_label

    rows = [[_decimal(matrix[row, column]) for column in range(4)] for row in range(4)]
    position = ", ".join(row[3].rstrip("0").rstrip(".") for row in rows[:3])
    return "\n".join(
        [strong(f"{root_label(robot)}_T_{name}"), *columns(rows), f"position {position} {robot.units.length}"]
    )


def _pose_record(robot: Robot, name: str, matrix: Any) -> Record:
    """Return the matrix in the nearest doubles; what is left of a zero after 50 digits is 0."""
    from kinegen.model.variants import root_label

    rows = [[float(matrix[row, column]) for column in range(4)] for row in range(4)]
    cleared = [[value if abs(value) > _NOTHING else 0.0 for value in row] for row in rows]
    return {"frame": name, "base": root_label(robot), "matrix": cleared}


def _decimal(value: Any) -> str:
    text = f"{float(value):.{DIGITS}f}"
    # A rotation by a right angle leaves no -0.000000000000.
    return text.removeprefix("-") if not text.strip("-0.") else text
