"""What `kinegen build` says: stages as they end, then operations, files and the proof."""

from __future__ import annotations

import textwrap
from collections import Counter
from collections.abc import Iterable

from kinegen.boards.figures import reasons
from kinegen.cli.terminal import bad, faint, filled, good, strong, width
from kinegen.errors import shown
from kinegen.lines import columns
from kinegen.outputs import Kind, Quantity
from kinegen.results import BuildResult, Stage
from kinegen.robot.model import Robot
from kinegen.verify.comparison import Comparison
from kinegen.write import Written

_INDENT = "  "
_STATUS = {"unchanged": "untouched"}


def stage_line(stage: Stage) -> str:
    """A finished stage."""
    return f"{_INDENT}{stage.name:<8}{stage.seconds:6.2f} s  {faint(stage.detail)}".rstrip()


def report_lines(result: BuildResult, *, brief: bool) -> list[str]:
    """A finished build.

    Args:
        result: The build.
        brief: Whether it is one of several, so that files and proof get a line each.
    """
    lines = [*_operations(result), *_sums(result), *_cost_lines(result)]
    lines += [*_note_lines(result)]
    if brief:
        return [*lines, _files_line(result), _proof_line(result), ""]
    return [*lines, "", *_file_lines(result), "", *_proof_lines(result)]


def _operations(result: BuildResult) -> list[str]:
    """Ours beside those of the plain product, which there is for the pose alone."""
    plain = f"a plain product of link matrices: {result.plain}"
    rows = [(quantity, str(count)) for quantity, count in result.counts.items()]
    rows += [(Quantity.POSE, "not built")] * (Quantity.POSE not in result.counts)
    texts = ((str(quantity), f"{text}  {plain}" if quantity == Quantity.POSE else text) for quantity, text in rows)
    table = columns([(f"{_INDENT}  {name}", text) for name, text in texts], left=frozenset({0, 1}))
    return ["", f"{_INDENT}{strong('operations')}", *table]


def _sums(result: BuildResult) -> list[str]:
    names = [f"c{angle.label} = cos({angle.text})" for angle in result.angles if angle.is_sum]
    lines = filled(names, f"{_INDENT}  ") if names else [f"{_INDENT}  none"]
    return [f"{_INDENT}{strong('angle sums')}", *lines]


def _cost_lines(result: BuildResult) -> list[str]:
    """What the float kernels cost on a microcontroller."""
    if not result.costs:
        return []
    rows = [("    kernel", "flags", "flash", "stack", result.costs[0].unit)]
    for cost in result.costs:
        figures = (f"{cost.flash} B", f"{cost.stack} B", str(cost.calls or "-"))
        rows.append((f"    {cost.name}", cost.optimisation, *figures))
    title = f"float on {result.costs[0].target} ({result.costs[0].compiler})"
    missing = [
        line
        for reason in reasons(result.costs)
        for line in textwrap.wrap(f"{_INDENT}  {reason}", width(), subsequent_indent=f"{_INDENT}    ")
    ]
    return [f"{_INDENT}{strong(title)}", *columns(rows, left=frozenset({0, 1})), *missing]


def _note_lines(result: BuildResult) -> list[str]:
    lines = []
    for note in result.notes:
        first, *others = textwrap.wrap(f"{_INDENT}note: {note}", width(), subsequent_indent=_INDENT * 4)
        lines += [first.replace("note", strong("note"), 1), *others]
    return lines


def _file_lines(result: BuildResult) -> list[str]:
    rows = [(f"{_INDENT}{_STATUS.get(file.status, file.status)}", shown(file.path)) for file in result.written]
    return columns(rows, left=frozenset({0, 1}))


def _files_line(result: BuildResult) -> str:
    return f"{_INDENT}{strong('files')} {shown(result.folder)}: {_statuses(result.written)}"


def _statuses(written: Iterable[Written]) -> str:
    counted = Counter(_STATUS.get(file.status, file.status) for file in written)
    return ", ".join(f"{number} {status}" for status, number in counted.items())


def _proof_lines(result: BuildResult) -> list[str]:
    """One row for each form of the kernels: the kernel that uses the greatest share of its tolerance."""
    unit = result.robot.units.length
    heads = (f"position [{unit}]", "accepted", "rotation [rad]", "accepted", "share")
    rows = [("proof", "worst in", "poses", *heads, "")]
    for name, group in _by_row(result.proof.comparisons).items():
        worst = max(group, key=_share)
        rows.append(
            (
                f"  {name}",
                str(worst.quantity),
                f"{sum(comparison.poses for comparison in group):,}",
                f"{worst.position_error:.1e}",
                f"{worst.position_tolerance:.1e}",
                f"{worst.rotation_error:.1e}",
                f"{worst.rotation_tolerance:.1e}",
                percentage(worst),
                "holds" if all(comparison.holds for comparison in group) else "FAILS",
            )
        )
    lines = columns(rows, left=frozenset({0, 1, 8}))
    coloured = [line.replace("holds", good("holds")).replace("FAILS", bad("FAILS")) for line in lines]
    counts = [line for count in result.proof.counts for line in textwrap.wrap(count, width() - 2 * len(_INDENT))]
    return [*(_INDENT + line for line in coloured), *(_INDENT + line for line in counts), *_worst_lines(result)]


def _by_row(comparisons: Iterable[Comparison]) -> dict[str, list[Comparison]]:
    """Comparisons by the row of the table that they count in, in order."""
    found: dict[str, list[Comparison]] = {}
    for comparison in comparisons:
        found.setdefault(comparison.row or comparison.target, []).append(comparison)
    return found


def _worst_lines(result: BuildResult) -> list[str]:
    """Where the largest share of a tolerance is used, for each number type."""
    lines = []
    for real in ("double", "float", "q30"):
        group = [comparison for comparison in result.proof.comparisons if comparison.real == real]
        if not group:
            continue
        worst = max(group, key=_share)
        names = _input_names(result.robot, worst.quantity)
        # Kernels that are given a pose have no such numbers.
        place = [f"{name} {value:.6g}" for name, value in zip(names, worst.worst, strict=False)]
        at = ", at" if place else ""
        lines.append(f"{_INDENT}worst {real}: {worst.quantity} of {worst.frame}, {worst.target}{at}")
        lines += filled(place, _INDENT * 2)
    return lines


def _input_names(robot: Robot, quantity: Quantity) -> list[str]:
    """What the numbers that a kernel is given are called."""
    driven = (Kind.ACTUATORS_TO_JOINTS, Kind.FK_ACTUATORS, Kind.JACOBIAN_ACTUATORS)
    given = robot.actuators.readings if quantity.kind in driven else robot.variables
    return [each.name for each in given]


def _share(comparison: Comparison) -> float:
    return comparison.share


def percentage(comparison: Comparison) -> str:
    """The share of its tolerance that a kernel uses."""
    percent = 100 * comparison.share
    return f"{percent:.0f} %" if percent >= 9.95 else f"{percent:.2g} %"


def _proof_line(result: BuildResult) -> str:
    worst = max(result.proof.comparisons, key=_share)
    poses = sum(comparison.poses for comparison in result.proof.comparisons)
    held = good("holds") if result.proof.holds else bad("FAILS")
    share = f"worst {percentage(worst)} of the accepted error, in {worst.target}"
    return f"{_INDENT}{strong('proof')} {held} for {poses:,} poses; {share}"
