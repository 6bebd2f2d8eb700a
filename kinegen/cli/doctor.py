"""`kinegen doctor`: the small change of a robot file that makes it agree with measured or printed poses."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kinegen.cli.robot_command import RobotCommand
from kinegen.cli.terminal import complain, say
from kinegen.errors import KinegenError, shown
from kinegen.output_file import check_output

if TYPE_CHECKING:
    from kinegen.doctor.diagnosis import Diagnosis
    from kinegen.doctor.poses import Observations, Said
    from kinegen.robot.model import Robot

FORMS = ("rpy", "ypr", "rpy_xyz", "rotation_vector", "wxyz", "xyzw")


def _positive(_context: click.Context, _parameter: click.Parameter, value: float | None) -> float | None:
    if value is not None and not 0 < value < 1e300:
        raise click.BadParameter(f"{value:g} is not a tolerance (expected more than 0)")
    return value


@click.command("doctor", cls=RobotCommand, short_help="Finds the mistake when a table and measured poses differ.")
@click.argument("file", metavar="FILE", type=click.Path(path_type=Path))
@click.option("--poses", metavar="FILE.csv", type=click.Path(path_type=Path), help="Poses, one in each line.")
@click.option("--pose", "texts", metavar="'Q... = X Y Z [R...]'", multiple=True, help="One pose. May be repeated.")
@click.option("--frame", metavar="NAME", help="The frame that was measured; by default the tool.")
@click.option(
    "--angle", type=click.Choice(("deg", "rad")), help="Unit of joint values and of roll, pitch, yaw in the poses."
)
@click.option(
    "--length", type=click.Choice(("m", "cm", "mm", "in")), help="Unit of the positions and of prismatic joints."
)
@click.option("--orientation", type=click.Choice(FORMS), help="How the orientations are written.")
@click.option(
    "--tolerance",
    metavar="LENGTH",
    type=float,
    callback=_positive,
    help="How far measured positions may be off, in their unit; by default half of their last digit.",
)
@click.option(
    "--changes",
    type=click.IntRange(1, 3),
    default=3,
    show_default=True,
    help="Most changes at once. Three are tried if fewer do not fit.",
)
@click.option("--write", metavar="OUT", type=click.Path(path_type=Path), help="Write the changed file to OUT.")
@click.option(
    "--take", metavar="N", type=click.IntRange(min=1), help="Write explanation N, where the poses allow several."
)
@click.option("--force", is_flag=True, help="Overwrite OUT if it exists; an input is never overwritten.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document on stdout and nothing else.")
def command(
    file: Path,
    poses: Path | None,
    texts: tuple[str, ...],
    frame: str | None,
    angle: str | None,
    length: str | None,
    orientation: str | None,
    tolerance: float | None,
    changes: int,
    write: Path | None,
    take: int | None,
    force: bool,
    as_json: bool,
) -> int:
    """Finds the mistake when a robot file and measured or printed poses differ.

    It tries the usual mistakes, one, two and three at once: the convention, degrees and radians, millimetres and
    metres, the direction and the zero of each joint, signs of alpha, a and d, columns shifted by a row, base and tool,
    and the form of the orientations. What fits is printed as a difference of the file. If several changes fit, all are
    printed, with the pose that separates them. Nothing is written without --write.

    The CSV file has a header: the names of the joints, then x, y, z, and for orientations roll, pitch, yaw or rx, ry,
    rz or qw, qx, qy, qz. Units are those of the robot file unless --angle and --length state them; what is stated is
    not questioned.

    The exit status is 0 if the file agrees with the poses or one explanation is found, and 1 otherwise.

    \b
        kinegen doctor arm.yaml --poses measured.csv
        kinegen doctor arm.yaml --pose '0 -90 90 0 0 0 = 0.452 0.15 0.432' --write mended.yaml
    """  # noqa: D301 - click's mark of a paragraph that stays as it is
    from kinegen.cli.doctor_report import document, report
    from kinegen.doctor.diagnosis import Verdict, examine
    from kinegen.doctor.poses import Said
    from kinegen.formats.as_robot_file import as_robot_file
    from kinegen.formats.load import load

    if poses is None and not texts:
        raise click.UsageError("there are no poses: give --poses FILE.csv or --pose 'Q... = X Y Z'")
    robot = load(file)
    if not robot.dof:
        raise KinegenError(f"{robot.name} has no joint that moves, so poses say nothing of it", str(file))
    if write is not None:
        check_output(write, (file, poses), force=force)
    observed = _observed(robot, poses, texts, Said(angle, length, orientation))
    source, name = as_robot_file(file)
    found = examine(source, name, observed, _frame(robot, frame), tolerance=tolerance, most=changes)
    written = None if write is None else _write(found, write, take, "\r\n" if b"\r\n" in file.read_bytes() else "\n")
    if as_json:
        say(json.dumps(document(found, observed, robot, written), indent=2, ensure_ascii=False))
    else:
        say(report(found, observed, robot, shown(file), source, written))
    return int(found.verdict not in (Verdict.AGREES, Verdict.FOUND))


def _observed(robot: Robot, poses: Path | None, texts: tuple[str, ...], said: Said) -> Observations:
    from kinegen.doctor.pose_file import read_poses
    from kinegen.doctor.poses import observations, read_pose

    lines, form = read_poses(robot, poses) if poses is not None else ((), "")
    lines += tuple(read_pose(robot, text, place) for place, text in enumerate(texts, start=1))
    try:
        return observations(robot, lines, said, form)
    except KinegenError as error:
        raise KinegenError(error.message, str(poses) if poses else "--pose", error.line) from None


def _frame(robot: Robot, name: str | None) -> str:
    if name is not None:
        return name
    if len(robot.tips) > 1:
        raise click.UsageError(f"{robot.name} has several tips; give --frame, one of {', '.join(robot.tips)}")
    return robot.tips[0]


def _write(found: Diagnosis, write: Path, take: int | None, newline: str) -> Path | None:
    """Write the changed file, if there is one explanation or one was chosen; returns where it is."""
    from kinegen.doctor.diagnosis import Verdict
    from kinegen.write import write_file

    if take is None and found.verdict is not Verdict.FOUND:
        reason = "the file agrees with the poses" if found.verdict is Verdict.AGREES else "there is not one explanation"
        complain(f"{write}: not written: {reason}")
        return None
    if (take or 1) > len(found.findings):
        raise KinegenError(f"there are {len(found.findings)} explanations, so --take {take} is not one of them")
    text = found.findings[(take or 1) - 1].text
    if text is None:
        complain(f"{write}: not written: the explanation changes how the poses are read, not the text of the file")
        return None
    write_file(write, text.replace("\n", newline))
    return write
