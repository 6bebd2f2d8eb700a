"""What `kinegen workspace` prints: a report for people, or one JSON document."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kinegen.support.dataclass import dataclass
from kinegen.support.text_layout import columns
from kinegen.tools.workspace.options import MEASURES, in_words
from kinegen.ui.cli.terminal import faint, strong

if TYPE_CHECKING:
    from kinegen.tools.workspace.dexterous import Dexterity, Turning
    from kinegen.tools.workspace.options import SurveyOptions
    from kinegen.tools.workspace.sampling import Workspace
    from kinegen.tools.workspace.tip_samples import Range


@dataclass(frozen=True, slots=True)
class Study:
    """What was asked, and what was found: of the dexterous part its measure, or why there is none."""

    file: Path
    ranges: tuple[Range, ...]
    options: SurveyOptions
    workspace: Workspace
    turning: Turning
    dexterity: Dexterity | str


def report(study: Study) -> Iterator[str]:
    """Yield the lines for people."""
    yield from _joints(study)
    yield ""
    yield from _extremes(study.workspace)
    yield ""
    yield from _counts(study.workspace)
    yield from _dexterous(study)


def _joints(study: Study) -> Iterator[str]:
    """Yield what was varied, and over what where the file does not say."""
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
    what = MEASURES[shape.dimension]
    # The same figure from fewer samples and from finer voxels shows how far it can be trusted.
    rows = [("", "voxel", "poses", "voxels hit", what, "")]
    before = None
    stages = ("half of the samples", "all samples", "and searched at the rim", "the same, finer")
    for stage, count in zip(stages, workspace.tally.counts, strict=True):
        measure = count.measure
        change = f"{(measure / before - 1) * 100:+.2f} %" if before and measure else ""
        words = "-" if measure is None else in_words(measure, shape.dimension, unit)
        rows.append((stage, f"{count.voxel:g} {unit}", f"{count.poses:,}", f"{count.hit:,}", words, change))
        before = measure
    yield from columns(rows, left=frozenset({0}))
    yield ""
    where = f", in the plane of {' and '.join(shape.names)}" if shape.dimension == 2 else ""
    measured = workspace.tally.counts[2].measure
    if measured is None:
        yield f"{what} not measured: there are too few samples"
        return
    whole = in_words(measured, shape.dimension, unit)
    yield strong(f"{what} {whole}{where}")
    yield from map(faint, _certainty(workspace))


def _certainty(workspace: Workspace) -> Iterator[str]:
    """Yield what is known of a figure: between what it lies, and whether more samples would have changed it."""
    if workspace.tally is None:
        return
    half, full, found, _ = workspace.tally.counts
    dimension, unit = workspace.shape.dimension, workspace.unit
    low, high = (in_words(number * found.voxel**dimension, dimension, unit) for number in (found.inside, found.hit))
    yield f"between {low} and {high}, if no voxel is missing: voxels with all neighbours, and all that were hit"
    added = (full.hit - half.hit) / full.hit
    yield f"the second half of the samples added {added:.1%} of the voxels; those that no sample hit are not counted"


def _dexterous(study: Study) -> Iterator[str]:
    found = study.dexterity
    if isinstance(found, str):
        yield f"dexterous part: {found}"
        return
    shape, unit = study.workspace.shape, study.workspace.unit
    what = MEASURES[shape.dimension]
    part = in_words(found.measure, shape.dimension, unit)
    yield strong(f"dexterous part {part}, {found.share:.1%} of the {what}")
    ways = "about one line" if study.turning.freedom == 1 else "in space"
    yield faint(
        f"as far as {found.orientations} orientations {ways} show, at one point in each of {found.voxels:,} voxels"
    )


def document(study: Study, written: list[Path]) -> dict[str, Any]:
    """Return the same and more for programs; angles are in radians, lengths in the unit of the file."""
    workspace, shape = study.workspace, study.workspace.shape
    axis = workspace.axis
    return {
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
        "dexterous": {
            "freedom": study.turning.freedom,
            "free": study.turning.free,
            **({"reason": study.dexterity} if isinstance(study.dexterity, str) else asdict(study.dexterity)),
        },
        "written": [str(path) for path in written],
    }
