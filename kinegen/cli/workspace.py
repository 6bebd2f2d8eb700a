"""`kinegen workspace`: how far an arm reaches, how much space that is, and pictures of it."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kinegen import __version__
from kinegen.cli.terminal import columns, complain, faint, say, strong

if TYPE_CHECKING:
    from kinegen.workspace.dexterous import Turning
    from kinegen.workspace.ranges import Range
    from kinegen.workspace.survey import SurveyOptions, Workspace

DEFAULT_SAMPLES = 10_000_000

_MEASURES = {1: ("length", ""), 2: ("area", "²"), 3: ("volume", "³")}


def _whole(_context: click.Context, _parameter: click.Parameter, text: str) -> int:
    """A number of samples, which may be written as 1e7."""
    try:
        number = float(text)
    except ValueError:
        raise click.BadParameter(f"{text!r} is not a number") from None
    if not number.is_integer() or not 1 <= number <= 1e11:
        raise click.BadParameter(f"{text} is not a whole number from 1 to 1e11")
    return int(number)


def _length(_context: click.Context, _parameter: click.Parameter, value: float | None) -> float | None:
    if value is not None and not 1e-300 < value < 1e300:
        raise click.BadParameter(f"{value:g} is no length of a voxel (expected more than 0)")
    return value


@click.command("workspace", short_help="Measures and draws what the tip reaches.")
@click.argument("file", metavar="FILE", type=click.Path(path_type=Path))
@click.option(
    "--samples",
    metavar="N",
    default=f"{DEFAULT_SAMPLES:.0e}".replace("+0", ""),
    show_default=True,
    callback=_whole,
    help="Joint vectors to try.",
)
@click.option(
    "--voxel",
    metavar="LENGTH",
    type=float,
    callback=_length,
    help="Edge of a voxel, in the unit of the file; by default one that the samples can fill.",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Another one, other samples.")
@click.option("--tip", metavar="NAME", help="Which tip of a tree.")
@click.option("--limits-from", metavar="FILE", type=click.Path(), help="Another robot file to take joint limits from.")
@click.option("--slices", metavar="FILE", type=click.Path(path_type=Path), help="Draw slices: .png or .svg.")
@click.option("--cloud", metavar="FILE", type=click.Path(path_type=Path), help="Write points: .npz or .parquet.")
@click.option("--threads", type=click.IntRange(min=0, max=1024), default=0, help="By default one on each processor.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document on stdout and nothing else.")
def command(
    file: Path,
    samples: int,
    voxel: float | None,
    seed: int,
    tip: str | None,
    limits_from: str | None,
    slices: Path | None,
    cloud: Path | None,
    threads: int,
    as_json: bool,
) -> None:
    """Samples the poses of a robot within its joint limits and says what its tip reaches.

    Extents and distances are sharpened by a search and good to many digits. Volume (area, where the tip stays in a
    plane) is that of the voxels that were hit; it comes with the same figure from half of the samples and from voxels
    of half the size, which tell how far it can be trusted. Joints without limits make a full turn.

    \b
        kinegen workspace robots/puma560.yaml
        kinegen workspace robots/puma560.yaml --slices puma560.svg --cloud puma560.npz
    """  # noqa: D301 - click's mark of a paragraph that stays as it is
    for path, check in ((slices, _check_picture), (cloud, _check_cloud)):
        if path is not None:
            check(path)
    study = _study(file, tip, limits_from, samples, voxel, seed, threads)
    written = _write(study, slices, cloud)
    if as_json:
        say(json.dumps(_document(study, written), indent=2))
        return
    if study.workspace.tip.backend != "c":
        complain("warning: there is no C compiler, so NumPy evaluates, which takes several times longer")
    say(strong(f"{file}: workspace of {study.workspace.tip.name}"))
    say("\n".join(f"  {line}".rstrip() for line in _report(study)))
    for path in written:
        say(f"  wrote {path}")


def _check_picture(path: Path) -> None:
    from kinegen.workspace.slices import check_picture

    check_picture(path)


def _check_cloud(path: Path) -> None:
    from kinegen.workspace.cloud import check_cloud

    check_cloud(path)


@dataclass(frozen=True, slots=True)
class _Study:
    """What was asked, and what was found."""

    file: Path
    ranges: tuple[Range, ...]
    options: SurveyOptions
    workspace: Workspace
    turning: Turning


def _study(
    file: Path, tip: str | None, limits_from: str | None, samples: int, voxel: float | None, seed: int, threads: int
) -> _Study:
    from kinegen.build import lower_file
    from kinegen.outputs import Quantity
    from kinegen.robot.load import load
    from kinegen.workspace.dexterous import find_turning
    from kinegen.workspace.ranges import joint_ranges
    from kinegen.workspace.survey import SurveyOptions, survey
    from kinegen.workspace.tip import find_tip

    kernels = lower_file(file, (Quantity.POSITION,))
    ranges = joint_ranges(kernels.robot, None if limits_from is None else load(limits_from))
    options = SurveyOptions(samples, voxel, seed, threads)
    workspace = survey(kernels.robot, find_tip(kernels, tip), ranges, options)
    return _Study(file, ranges, options, workspace, find_turning(kernels.robot, workspace))


def _write(study: _Study, slices: Path | None, cloud: Path | None) -> list[Path]:
    from kinegen.workspace.cloud import pack
    from kinegen.workspace.slices import draw
    from kinegen.write import write_files

    contents = {}
    if slices is not None:
        contents[slices] = draw(study.workspace, slices.suffix)
    if cloud is not None:
        contents[cloud] = pack(study.workspace, study.ranges, cloud.suffix)
    for path, content in contents.items():
        write_files(path.parent, {path.name: content})
    return list(contents)


# The report -----------------------------------------------------------------------------------------------------------


def _report(study: _Study) -> Iterator[str]:
    yield from _joints(study)
    yield ""
    yield from _extremes(study.workspace)
    yield ""
    yield from _counts(study.workspace)
    yield _dexterous(study)


def _joints(study: _Study) -> Iterator[str]:
    """What was varied, and over what where the file does not say."""
    workspace = study.workspace
    moving = [study.ranges[place].name for place in workspace.tip.movers]
    still = [each.name for each in study.ranges if each.name not in moving]
    varied = f"of {', '.join(moving)} " if moving else ""
    yield faint(f"{study.options.samples:,} samples {varied}in {workspace.seconds:.2g} s")
    if still:
        yield faint(f"{', '.join(still)}: no effect on the position")
    unlimited: dict[str, list[str]] = {}
    for each in study.ranges:
        if each.name in moving and not each.limited:
            how = "a full turn" if each.type != "prismatic" else f"{each.low:g} to {each.high:g} {workspace.unit}"
            unlimited.setdefault(how, []).append(each.name)
    for how, names in unlimited.items():
        yield faint(f"{', '.join(names)}: no limits in the file, taken as {how}")


def _extremes(workspace: Workspace) -> Iterator[str]:
    unit = workspace.unit
    axis = "" if workspace.axis is None else f"from the axis of {workspace.axis.name}"
    names = {"base": "from the base", "axis": axis}
    largest = max(max(abs(each.low), abs(each.high)) for each in workspace.extremes)
    digits = 4 if largest == 0 else max(0, 3 - math.floor(math.log10(largest)))
    rows = [("", "least", "most", "")]
    for each in workspace.extremes:
        low, high = (_decimal(value, digits) for value in (each.low, each.high))
        rows.append((names.get(each.name, each.name), low, high, unit))
    yield from columns(rows, left=frozenset({0, 3}))


def _decimal(value: float, digits: int) -> str:
    text = f"{value:.{digits}f}"
    return text.removeprefix("-") if not text.strip("-0.") else text


def _counts(workspace: Workspace) -> Iterator[str]:
    shape, unit = workspace.shape, workspace.unit
    if workspace.tally is None or not shape.fills:
        held = {2: "in a plane", 3: "in space"}.get(len(shape.axes), "")
        yield f"the tip sweeps a {shape.kind} {held}".rstrip() + ", which has no volume; its size is not measured"
        return
    what, power = _MEASURES[shape.dimension]
    rows = [("", "voxel", "poses", "voxels hit", what, "")]
    before = None
    stages = ("half of the samples", "all samples", "and searched at the rim", "the same, finer")
    for stage, count in zip(stages, workspace.tally.counts, strict=True):
        measure = count.measure or 0.0
        change = f"{(measure / before - 1) * 100:+.2f} %" if before else ""
        cells = f"{count.voxel:g} {unit}", f"{count.poses:,}", f"{count.hit:,}", f"{measure:.4g} {unit}{power}"
        rows.append((stage, *cells, change))
        before = measure
    yield from columns(rows, left=frozenset({0}))
    yield ""
    where = f", in the plane of {' and '.join(shape.names)}" if shape.dimension == 2 else ""
    yield strong(f"{what} {workspace.tally.counts[2].measure:.4g} {unit}{power}{where}")
    yield faint("low rather than high, since voxels that no pose hit are missing; the last line tells what size does")


def _dexterous(study: _Study) -> str:
    turning, workspace = study.turning, study.workspace
    if turning.freedom == 0:
        return "dexterous part: the tip keeps one orientation"
    if turning.freedom == 2:
        return "dexterous part: none, since the arm cannot turn the tip every way"
    ways = "about one line" if turning.freedom == 1 else "every way"
    if not turning.free:
        return f"dexterous part: none, since the tip cannot turn {ways} while it stands still"
    return f"dexterous part: not measured, since there is no closed inverse for {workspace.robot}"


# The document ---------------------------------------------------------------------------------------------------------


def _document(study: _Study, written: list[Path]) -> dict[str, Any]:
    workspace, shape = study.workspace, study.workspace.shape
    axis = workspace.axis
    return {
        "kinegen": __version__,
        "format": 1,
        "file": str(study.file),
        "robot": workspace.robot,
        "tip": workspace.tip.name,
        "unit": workspace.unit,
        "samples": study.options.samples,
        "seed": study.options.seed,
        "seconds": workspace.seconds,
        "joints": [
            {**asdict(each), "moves_the_tip": place in workspace.tip.movers} for place, each in enumerate(study.ranges)
        ],
        "shape": {"kind": shape.kind, "dimension": shape.dimension, "axes": shape.axes.tolist(), "names": shape.names},
        "extremes": {each.name: [each.low, each.high] for each in workspace.extremes},
        "first_axis": None
        if axis is None
        else {"joint": axis.name, "point": axis.point.tolist(), "direction": axis.direction.tolist()},
        "counts": [] if workspace.tally is None else [asdict(count) for count in workspace.tally.counts],
        "dexterous": {"freedom": study.turning.freedom, "free": study.turning.free},
        "written": [str(path) for path in written],
    }
