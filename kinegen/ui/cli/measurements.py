"""`kinegen doctor` and `kinegen calibrate`: the mistakes and the numbers of a table, from measured poses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from kinegen.errors import KinegenError, shown
from kinegen.io.columns import METRES, RADIANS
from kinegen.support.files.manifest import check_output
from kinegen.tools.calibrate.options import DEFAULT_FIT, Loss, Settings, quantity
from kinegen.ui.cli.robot_command import RobotCommand, accepted, document_text, json_option
from kinegen.ui.cli.terminal import complain, say, strong, warn_of_cache

if TYPE_CHECKING:
    from kinegen.model.robot import Robot
    from kinegen.tools.doctor.diagnosis import Diagnosis
    from kinegen.tools.doctor.observed_poses import Observations, Said

FORMS = ("rpy", "ypr", "rpy_xyz", "zyz", "rotation_vector", "wxyz", "xyzw")


def _positive(_context: click.Context, _parameter: click.Parameter, value: float | None) -> float | None:
    if value is not None and not 0 < value < 1e300:
        raise click.BadParameter(f"{value:g} is not a tolerance (expected more than 0)")
    return value


def _angle(_context: click.Context, _parameter: click.Parameter, text: str | None) -> float | None:
    try:
        return None if text is None else quantity(text, RADIANS, "0.2deg")
    except KinegenError as error:
        raise click.BadParameter(error.message.replace("an uncertainty", "an angle")) from None


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
@click.option("--orientation", "form", type=click.Choice(FORMS), help="How the orientations are written.")
@click.option(
    "--tolerance",
    metavar="LENGTH",
    type=float,
    callback=_positive,
    help="How far measured positions may be off, in their unit; by default half of their last digit.",
)
@click.option(
    "--tolerance-angle",
    metavar="ANGLE",
    callback=_angle,
    help="How far measured orientations may be off, as 0.2deg; by default as --tolerance, over the reach.",
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
@json_option
def doctor_command(
    file: Path,
    poses: Path | None,
    texts: tuple[str, ...],
    frame: str | None,
    tolerance: float | None,
    tolerance_angle: float | None,
    changes: int,
    write: Path | None,
    take: int | None,
    force: bool,
    as_json: bool,
    **said: str | None,
) -> int:
    """Finds the mistake when a robot file and measured or printed poses differ.

    It tries the usual mistakes, one, two and three at once: the convention, degrees and radians, millimetres and
    metres, the direction and the zero of each joint, signs of alpha, a and d, columns shifted by a row, base and tool,
    and the form of the orientations. Then rarer ones: one wrong number, exchanged columns, rows and entries, coupled
    joints. What fits is printed as a difference of the file. If several changes fit, all are
    printed, with the pose that separates them. Nothing is written without --write.

    The CSV file has a header: the names of the joints (or q1, q2, ...), then x, y, z, and for orientations roll, pitch,
    yaw or rx, ry, rz or qw, qx, qy, qz. Units are those of the robot file unless --angle and --length state them; then
    they are taken as certain.

    The exit status is 0 if the file agrees with the poses or one explanation is found, and 1 otherwise.

    \b
        kinegen doctor arm.yaml --poses measured.csv
        kinegen doctor arm.yaml --pose '0 -90 90 0 0 0 = 0.452 0.15 0.432' --write fixed.yaml
    """  # noqa: D301 - click's mark of a paragraph that stays as it is
    from kinegen.io.load import load
    from kinegen.io.robot_file.document import as_robot_file
    from kinegen.tools.doctor.diagnosis import Verdict, examine
    from kinegen.tools.doctor.observed_poses import Said
    from kinegen.tools.doctor.residual import Tolerance
    from kinegen.ui.cli.doctor_report import Asked, document, report

    if poses is None and not texts:
        raise click.UsageError("there are no poses: give --poses FILE.csv or --pose 'Q... = X Y Z'")
    # Whatever can be refused is refused before the search.
    robot = load(file)
    if not robot.dof:
        raise KinegenError(f"{robot.name} has no joint that moves, so poses say nothing of it", str(file))
    if write is not None:
        check_output(write, (file, poses), force=force)
    observed = _observed(robot, poses, texts, Said(**said))
    # The changes are those of a robot file, also where the input is of another format.
    source, name = as_robot_file(file)
    limits = Tolerance(tolerance, tolerance_angle)
    found = examine(source, name, observed, _frame(robot, frame), tolerance=limits, most=changes)
    written = None if write is None else _write(found, write, take, file)
    if as_json:
        say(document_text(document(found, observed, robot, written), ensure_ascii=False))
    else:
        asked = Asked(shown(file), shown(poses) if poses else "POSES.csv", source if name == str(file) else None, take)
        say(report(found, observed, robot, asked, written))
    return int(found.verdict not in (Verdict.AGREES, Verdict.FOUND))


def _observed(robot: Robot, poses: Path | None, texts: tuple[str, ...], said: Said) -> Observations:
    from kinegen.tools.doctor.observed_poses import observations, read_pose
    from kinegen.tools.doctor.pose_file import read_poses

    lines, form, said = read_poses(robot, poses, said) if poses is not None else ((), "", said)
    lines += tuple(read_pose(robot, text, place) for place, text in enumerate(texts, start=1))
    try:
        return observations(robot, lines, said, form)
    except KinegenError as error:
        raise KinegenError(error.message, str(poses) if poses else "--pose", error.line) from None


def _frame(robot: Robot, name: str | None) -> str:
    from kinegen.model.variants import frame_named

    if name is not None:
        return frame_named(robot, name)
    if len(robot.tips) > 1:
        raise click.UsageError(f"{robot.name} has several tips; give --frame, one of {', '.join(robot.tips)}")
    return robot.tips[0]


def _write(found: Diagnosis, write: Path, take: int | None, file: Path) -> Path | None:
    """Write the changed file, if there is one explanation or one was chosen; returns where it is."""
    from kinegen.support.files.write import write_file
    from kinegen.tools.doctor.diagnosis import Verdict

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
    # The changed file keeps the line ends of the first one.
    write_file(write, text.replace("\n", "\r\n") if b"\r\n" in file.read_bytes() else text)
    return write


_PICTURES = (".png", ".svg")


def _words(_context: click.Context, _parameter: click.Parameter, text: str) -> tuple[str, ...]:
    words = tuple(word.strip() for word in text.split(",") if word.strip())
    if not words:
        raise click.BadParameter(f"nothing to vary (expected words such as {','.join(DEFAULT_FIT)})")
    return words


def _length_sigma(_context: click.Context, _parameter: click.Parameter, text: str | None) -> float | None:
    return _sigma(text, METRES, "0.05mm")


def _angle_sigma(_context: click.Context, _parameter: click.Parameter, text: str | None) -> float | None:
    return _sigma(text, RADIANS, "0.1mrad")


def _sigma(text: str | None, units: dict[str, float], example: str) -> float | None:
    return None if text is None else accepted(quantity, text, units, example)


def _picture(_context: click.Context, _parameter: click.Parameter, path: Path | None) -> Path | None:
    if path is not None and path.suffix.lower() not in _PICTURES:
        raise click.BadParameter(f"{shown(path)} is not a picture (expected .png or .svg)")
    return path


@click.command("calibrate", cls=RobotCommand, short_help="Fits the table of a robot to measurements.")
@click.argument("file", metavar="FILE", type=click.Path(path_type=Path))
@click.argument("measurements", metavar="MEASUREMENTS", type=click.Path(path_type=Path))
@click.option("-o", "--output", metavar="OUT", type=click.Path(path_type=Path), help="The calibrated robot file.")
@click.option(
    "--fit",
    metavar="WORDS",
    default=",".join(DEFAULT_FIT),
    show_default=True,
    callback=_words,
    help="What to vary: theta, a, d, alpha, beta, base, tool, or names such as theta_elbow,base_x,a2.",
)
@click.option("--frame", metavar="NAME", default="", help="The frame that was measured, if it is not the tool.")
@click.option("--length", type=click.Choice(list(METRES)), help="Unit of measured lengths; by default that of FILE.")
@click.option("--angle", type=click.Choice(list(RADIANS)), help="Unit of angles; by default that of FILE.")
@click.option("--sigma", metavar="LENGTH", callback=_length_sigma, help="Uncertainty of lengths (1 sigma), as 0.05mm.")
@click.option("--sigma-angle", metavar="ANGLE", callback=_angle_sigma, help="Uncertainty of orientations, as 0.1mrad.")
@click.option(
    "--loss",
    type=click.Choice([str(loss) for loss in Loss]),
    default=str(Loss.HUBER),
    show_default=True,
    help="How residuals count beyond 3 sigma.",
)
@click.option("--folds", type=click.IntRange(0, 100), default=5, show_default=True, help="Parts for cross-validation.")
@click.option("--suggest", metavar="N", type=click.IntRange(0, 100), default=0, help="Suggest N poses to measure next.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of folds and suggestions.")
@click.option("--ignore", metavar="COLUMN", multiple=True, help="A column to leave out. May be repeated.")
@click.option(
    "--plot",
    metavar="FILE",
    type=click.Path(path_type=Path),
    callback=_picture,
    help="Draw errors before and after: .png or .svg.",
)
@click.option("--force", is_flag=True, help="Overwrite OUT and the file of --plot if they exist, but never an input.")
@json_option
def calibrate_command(
    file: Path,
    measurements: Path,
    output: Path | None,
    plot: Path | None,
    force: bool,
    as_json: bool,
    **settings: object,
) -> None:
    """Fits numbers of a robot file to MEASUREMENTS and writes a calibrated robot file.

    MEASUREMENTS is CSV or Parquet with one column for each joint (its name, or q1, q2, ...) and what was measured: x,
    y, z; an orientation (qw qx qy qz, roll pitch yaw, or rx ry rz); a distance (to_q1, to_q2, ... or anchor); or a
    plane or sphere that was touched. Units may follow a name, as in x[mm].

    Rows between nearly parallel axes get a second twist (Hayati). What the measurements cannot distinguish is named,
    and keeps its value.

    \b
        kinegen calibrate ur5.yaml measured.csv --sigma 0.05mm --sigma-angle 0.1mrad -o ur5_12345.yaml
        kinegen calibrate ur5.yaml tracker.csv --fit theta,base,tool_x,tool_y,tool_z --suggest 10
    """  # noqa: D301 - click's mark of a paragraph that stays as it is
    from kinegen.support.files.write import write_file
    from kinegen.tools.calibrate.run import calibrate
    from kinegen.ui.cli.calibrate_report import document, report

    for path in (output, plot):
        if path is not None:
            check_output(path, (file, measurements), force=force)
    warn_of_cache()
    # The files are written before anything is printed.
    study = calibrate(file, measurements, Settings(**settings))  # type: ignore[arg-type]
    written = []
    if output is not None:
        write_file(output, study.text)
        written.append(output)
    if plot is not None:
        from kinegen.tools.calibrate.run import draw

        write_file(plot, draw(study, plot.suffix.lower()))
        written.append(plot)
    if as_json:
        say(document_text(document(study, file, written)))
        return
    if study.fit.problem.arm.backend != "c":
        complain("warning: there is no C compiler, so NumPy evaluates, which is slower")
    say(strong(f"{shown(file)}: calibrated with {shown(measurements)}"))
    say("\n".join(f"  {line}".rstrip() for line in report(study)))
    for path in written:
        say(f"  wrote {shown(path)}")
