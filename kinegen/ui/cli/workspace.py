"""`kinegen workspace`: how far an arm reaches, how much space that is, and pictures of it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kinegen.errors import KinegenError, shown
from kinegen.support.dataclass import dataclass
from kinegen.support.files.manifest import check_output
from kinegen.tools.workspace.options import MOST_SAMPLES, Plane, SurveyOptions
from kinegen.ui.cli.robot_command import RobotCommand, document_text, json_option, sample_count
from kinegen.ui.cli.terminal import complain, say, strong, warn_of_cache
from kinegen.ui.cli.workspace_report import Study, document, report

if TYPE_CHECKING:
    from kinegen.model.robot import Robot
    from kinegen.tools.workspace.dexterous import Dexterity, Turning
    from kinegen.tools.workspace.sampling import Workspace
    from kinegen.tools.workspace.tip_samples import Range, Tip

DEFAULT_SAMPLES = 10_000_000


def _whole(_context: click.Context, _parameter: click.Parameter, text: str) -> int:
    return sample_count(text, 1, MOST_SAMPLES)


def _length(_context: click.Context, _parameter: click.Parameter, value: float | None) -> float | None:
    if value is not None and not 1e-300 < value < 1e300:
        raise click.BadParameter(f"{value:g} is not the edge of a voxel (expected more than 0)")
    return value


def _planes(_context: click.Context, _parameter: click.Parameter, texts: tuple[str, ...]) -> tuple[Plane, ...]:
    """Return planes such as y=0, in the order in which they are to be drawn."""
    planes = []
    for text in texts:
        axis, _, number = text.replace(" ", "").partition("=")
        try:
            plane = Plane(("x", "y", "z").index(axis), float(number))
        except ValueError:
            raise click.BadParameter(f"{text!r} is not a plane (expected x=..., y=... or z=..., such as y=0)") from None
        if not math.isfinite(plane.at):
            raise click.BadParameter(f"{text!r} is not a plane (expected a finite number)")
        planes.append(plane)
    return tuple(planes)


@click.command("workspace", cls=RobotCommand, short_help="Measures and draws the reachable workspace.")
@click.argument("file", metavar="FILE", type=click.Path(path_type=Path))
@click.option(
    "--samples",
    metavar="N",
    default=f"{DEFAULT_SAMPLES:.0e}".replace("+0", ""),
    show_default=True,
    callback=_whole,
    help="Number of joint vectors to try.",
)
@click.option(
    "--voxel",
    metavar="LENGTH",
    type=float,
    callback=_length,
    help="Edge of a voxel, in the unit of the file; by default a size that the samples can fill.",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of the random samples.")
@click.option("--tip", metavar="NAME", help="A tip of a tree, a link, a named frame, or wrist_centre.")
@click.option("--limits-from", metavar="FILE", type=click.Path(), help="Another robot file to take joint limits from.")
@click.option("--slices", metavar="FILE", type=click.Path(path_type=Path), help="Draw slices: .png or .svg.")
@click.option(
    "--plane",
    "planes",
    metavar="AXIS=VALUE",
    multiple=True,
    callback=_planes,
    help="A plane for --slices, such as y=0, in the unit of the file. May be repeated.",
)
@click.option("--cloud", metavar="FILE", type=click.Path(path_type=Path), help="Write points: .npz or .parquet.")
@click.option(
    "--threads",
    type=click.IntRange(min=0, max=1024),
    default=0,
    show_default=True,
    help="Number of threads; 0 means one for each processor.",
)
@click.option("--workers", type=click.IntRange(1, 4096), default=1, show_default=True, help="Processes; needs Dask.")
@click.option("--scheduler", metavar="ADDRESS", default="", help="A scheduler of Dask, such as tcp://10.0.0.1:8786.")
@click.option("--force", is_flag=True, help="Overwrite the files of --slices and --cloud if they exist.")
@json_option
def workspace_command(
    file: Path,
    samples: int,
    voxel: float | None,
    seed: int,
    tip: str | None,
    limits_from: str | None,
    slices: Path | None,
    planes: tuple[Plane, ...],
    cloud: Path | None,
    threads: int,
    workers: int,
    scheduler: str,
    force: bool,
    as_json: bool,
) -> None:
    """Samples the poses of a robot within its joint limits and reports what its tip reaches.

    A search from the best samples refines extents and distances to many digits. Volume (area, where the tip stays in a
    plane) is that of the voxels that were hit. The same figure from half of the samples and from voxels of half the
    size shows how far it can be trusted. Joints without limits make a full turn. The dexterous part, where the tip can
    have every orientation, needs an arm with a closed-form inverse.

    \b
        kinegen workspace robots/puma560.yaml
        kinegen workspace robots/puma560.yaml --slices puma560.svg --plane y=0 --cloud puma560.npz
        kinegen workspace robots/puma560.yaml --tip wrist_centre
    """  # noqa: D301 - click's mark of a paragraph that stays as it is
    for path, check in ((slices, _check_picture), (cloud, _check_cloud)):
        if path is not None:
            check(path)
            check_output(path, (file, None if limits_from is None else Path(limits_from)), force=force)
    if planes and slices is None:
        raise click.UsageError("--plane chooses what --slices draws; name its file with --slices")
    warn_of_cache()
    crew = Crew(workers, scheduler)
    study = _study(file, tip, limits_from, SurveyOptions(samples, voxel, seed, threads), crew)
    written = _write(study, slices, planes, cloud)
    if as_json:
        say(document_text(document(study, written)))
        return
    if study.workspace.tip.backend != "c":
        complain("warning: there is no C compiler, so NumPy evaluates, which is many times slower")
    say(strong(f"{shown(file)}: workspace of {study.workspace.tip.name}"))
    say("\n".join(f"  {line}".rstrip() for line in report(study)))
    for path in written:
        say(f"  wrote {shown(path)}")


def _check_picture(path: Path) -> None:
    from kinegen.tools.workspace.slices import check_picture

    check_picture(path)


def _check_cloud(path: Path) -> None:
    from kinegen.tools.workspace.sampling import check_cloud

    check_cloud(path)


@dataclass(frozen=True, slots=True)
class Crew:
    """Which processes sift samples: so many on this machine, or those of a scheduler at an address."""

    workers: int
    scheduler: str


def _study(file: Path, tip: str | None, limits_from: str | None, options: SurveyOptions, crew: Crew) -> Study:
    from kinegen.driver.pipeline import lower_file
    from kinegen.io.load import load
    from kinegen.model.variants import frame_named
    from kinegen.tools.workspace.dexterous import find_turning
    from kinegen.tools.workspace.tip_samples import find_tip, joint_ranges, position_of

    robot = load(file)
    kernels = lower_file(file, (position_of(robot, tip and frame_named(robot, tip)),))
    ranges = joint_ranges(kernels.robot, None if limits_from is None else load(limits_from))
    workspace = _survey(kernels.robot, find_tip(kernels), ranges, options, crew)
    # The dexterous part needs every orientation, the tool itself, and the limits of its own file.
    turning = find_turning(kernels.robot, workspace)
    reason = _no_dexterity(turning, workspace)
    if not reason and workspace.tip.name not in kernels.robot.tips:
        reason = "not measured, since the inverse is that of the tool"
    if not reason and limits_from is not None:
        reason = "not measured, since the inverse uses the limits of its own file"
    dexterity = reason or _dexterity(file, ranges, workspace, turning)
    return Study(file, ranges, options, workspace, turning, dexterity)


def _survey(robot: Robot, tip: Tip, ranges: tuple[Range, ...], options: SurveyOptions, crew: Crew) -> Workspace:
    """Return the survey, by threads of this process or by others."""
    from kinegen.tools.workspace.sampling import survey

    if crew.workers == 1 and not crew.scheduler:
        return survey(robot, tip, ranges, options)
    from kinegen.tools.datasets.cluster import processes
    from kinegen.tools.datasets.workspace_cluster import in_processes
    from kinegen.tools.workspace.tip_samples import position_of
    from kinegen.ui.api.building import compile as compiled

    # Other machines may have other processors, so their bits are made the same.
    position = position_of(robot, tip.name)
    with processes(0 if crew.scheduler else crew.workers, crew.scheduler) as client:
        module = compiled(robot, str(position), real="double", reproducible=bool(crew.scheduler))
        return survey(robot, tip, ranges, options, in_processes(client, module, position.function))


def _no_dexterity(turning: Turning, workspace: Workspace) -> str:
    """Return why there is no dexterous part, or nothing."""
    if turning.freedom == 0:
        return "none, since the tip has only one orientation"
    if turning.freedom == 2:
        return "none, since the arm cannot turn the tip to every orientation"
    if workspace.tally is not None and workspace.shape.fills and workspace.tally.counts[2].measure is None:
        return "not measured, because the region is not measured"
    ways = "about one line" if turning.freedom == 1 else "to every orientation"
    if not turning.free:
        return f"none, since the tip cannot turn {ways} while it stays in place"
    return (
        ""
        if workspace.tally is not None and workspace.tally.counts[2].measure is not None
        else "not measured, because the region is not measured"
    )


def _dexterity(file: Path, ranges: tuple[Range, ...], workspace: Workspace, turning: Turning) -> Dexterity | str:
    """Return what the closed-form inverse finds, or why there is none."""
    from kinegen.driver.pipeline import lower_file
    from kinegen.model.outputs import Kind, Quantity
    from kinegen.tools.workspace.dexterous import dexterous_part, find_inverse

    try:
        kernels = lower_file(file, (Quantity(Kind.INVERSE),))
    except KinegenError as error:
        # The conditions that fail are the business of `kinegen inspect`.
        return f"not measured, since {error.message.partition(':')[0]}"
    if kernels.robot.redundancy:
        return "not measured, since an inverse with a redundancy does not say which poses are reached"
    return dexterous_part(workspace, turning, find_inverse(kernels, ranges))


def _write(study: Study, slices: Path | None, planes: tuple[Plane, ...], cloud: Path | None) -> list[Path]:
    from kinegen.support.files.write import write_file
    from kinegen.tools.workspace.sampling import pack
    from kinegen.tools.workspace.slices import draw

    contents = {}
    if slices is not None:
        contents[slices] = draw(study.workspace, slices.suffix, planes)
    if cloud is not None:
        contents[cloud] = pack(study.workspace, study.ranges, cloud.suffix)
    for path, content in contents.items():
        write_file(path, content)
    return list(contents)
