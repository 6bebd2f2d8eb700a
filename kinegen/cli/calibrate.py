"""`kinegen calibrate`: the numbers of a table that fit measurements, and how well they are known."""

from __future__ import annotations

import json
from pathlib import Path

import click

from kinegen.calibrate.options import DEFAULT_FIT, METRES, RADIANS, Loss, Settings, quantity
from kinegen.cli.cached import warn_of_cache
from kinegen.cli.robot_command import RobotCommand
from kinegen.cli.terminal import complain, say, strong
from kinegen.errors import KinegenError, shown
from kinegen.output_file import check_output

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
    try:
        return None if text is None else quantity(text, units, example)
    except KinegenError as error:
        raise click.BadParameter(error.message) from None


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
@click.option("--force", is_flag=True, help="Overwrite OUT if it exists; the input is never overwritten.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document on stdout and nothing else.")
def command(
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
    from kinegen.calibrate.study import calibrate
    from kinegen.cli.calibrate_report import document, report
    from kinegen.write import write_file

    for path in (output, plot):
        if path is not None:
            check_output(path, (file, measurements), force=force or path is plot)
    warn_of_cache()
    study = calibrate(file, measurements, Settings(**settings))  # type: ignore[arg-type]
    written = []
    if output is not None:
        write_file(output, study.text)
        written.append(output)
    if plot is not None:
        from kinegen.calibrate.plot import draw

        write_file(plot, draw(study, plot.suffix.lower()))
        written.append(plot)
    if as_json:
        say(json.dumps(document(study, file, written), indent=2))
        return
    if study.fit.problem.arm.backend != "c":
        complain("warning: there is no C compiler, so NumPy evaluates, which is slower")
    say(strong(f"{shown(file)}: calibrated with {shown(measurements)}"))
    say("\n".join(f"  {line}".rstrip() for line in report(study)))
    for path in written:
        say(f"  wrote {shown(path)}")
