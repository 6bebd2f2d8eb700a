"""The errors of a build beside their tolerances, in their units: the table for people, and the JSON document."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict
from operator import attrgetter
from pathlib import Path

from kinegen.driver.results import BuildResult
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import JointType, Robot
from kinegen.support.text_layout import columns
from kinegen.ui.cli.robot_command import Record, robot_record
from kinegen.ui.cli.terminal import bad, filled, good, width
from kinegen.verify.records import Comparison

_TWISTS = {Kind.TWIST: "/s", Kind.BIAS_ACCELERATION: "/s^2", Kind.ACCELERATION: "/s^2"}
_JACOBIANS = (Kind.JACOBIAN, Kind.FK_JACOBIAN, Kind.JACOBIAN_ACTUATORS)
_JOINTS = (Kind.ACTUATORS_TO_JOINTS, Kind.JOINTS_TO_ACTUATORS)


def error_units(robot: Robot, quantity: Quantity) -> tuple[str, str]:
    """Return the units of the errors of an output: a Jacobian in m/rad is not a position in m.

    The first is that of what `Comparison` calls a position error, the second that of a rotation error. Entries of a
    rotation count as radians, which they are for small errors; 1 is a number without a unit.
    """
    length, kind = robot.units.length, quantity.kind
    if kind in _TWISTS:
        return f"{length}{_TWISTS[kind]}", f"rad{_TWISTS[kind]}"
    if kind in _JACOBIANS:
        each = _per_joint(robot, length) if kind is not Kind.JACOBIAN_ACTUATORS else f"{length} per reading"
        return (f"{length}, {each}", "rad, 1") if kind is Kind.FK_JACOBIAN else (each, _turning(kind))
    if kind is Kind.HESSIAN:
        return f"{length}/rad^2", "1/rad"
    if kind is Kind.PARAMETER_JACOBIAN:
        return f"1, {length}/rad", f"rad/{length}, 1"
    if kind in _JOINTS:
        return length, ", ".join(sorted({_of(each.type, length) for each in robot.variables}, reverse=True))
    if kind.value.endswith("_jacobian") or kind is Kind.ADJOINT:
        return length, "1"
    return length, "rad"


def _turning(kind: Kind) -> str:
    return "rad per reading" if kind is Kind.JACOBIAN_ACTUATORS else "1"


def _per_joint(robot: Robot, length: str) -> str:
    """Return a length for each unit of a joint variable."""
    return ", ".join(
        sorted({"1" if each.type is JointType.PRISMATIC else f"{length}/rad" for each in robot.variables}, reverse=True)
    )


def _of(joint: JointType, length: str) -> str:
    return length if joint is JointType.PRISMATIC else "rad"


_INDENT = "  "
_WORDS = {
    "beyond limits": "outside joint limits",
    "there and back": "round trip",
    "50 digits": "against 50 digits",
}
"""How targets of comparisons are said; `proof` in documents keeps the names that they had."""

Units = tuple[str, str]


def table_lines(result: BuildResult) -> list[str]:
    """Return one row for each way to call the kernels and each pair of units, with the largest errors and shares."""
    heads = ("poses", "positions", "tolerance", "unit", "rotations", "tolerance", "unit", "worst", "output")
    rows = [("verified", *heads, "")]
    # Length errors and number errors of one row have their maxima at different outputs.
    for (name, units), group in _by_row(result.robot, result.proof.comparisons).items():
        length = max(group, key=lambda each: each.position_error)
        number = max(group, key=lambda each: each.rotation_error)
        worst = max(group, key=attrgetter("share"))
        rows.append(
            (
                f"  {said_target(name)}",
                f"{sum(comparison.poses for comparison in group):,}",
                *_cells(length.position_error, length.position_tolerance, units[0]),
                *_cells(number.rotation_error, number.rotation_tolerance, units[1]),
                percentage(worst),
                f"{worst.quantity} (0 everywhere)" if worst.is_zero else str(worst.quantity),
                "pass" if all(comparison.holds for comparison in group) else "FAIL",
            )
        )
    # Colours come last: their characters have no width.
    lines = columns(rows, left=frozenset({0, 4, 7, 9, 10}))
    coloured = [_coloured(line) for line in lines]
    sentences = (
        "positions, rotations: the largest errors; worst: the largest share of its own tolerance that an entry uses",
        *result.proof.counts,
        *gaps(result.proof.comparisons),
    )
    counts = [line for count in sentences for line in textwrap.wrap(count, width() - 2 * len(_INDENT))]
    return [*(_INDENT + line for line in coloured), *(_INDENT + line for line in counts), *_worst_lines(result)]


def said_target(target: str) -> str:
    """Return a target of a comparison in the words of the table."""
    for name, words in _WORDS.items():
        target = target.replace(name, words)
    return target


def said_stage(name: str) -> str:
    """Return the name of a stage in the same words."""
    return "verify" if name == "prove" else name


def _coloured(line: str) -> str:
    """Colour the word at the end of a row."""
    for word, paint in (("pass", good), ("FAIL", bad)):
        if line.endswith(word):
            return line.removesuffix(word) + paint(word)
    return line


def _cells(error: float, tolerance: float, unit: str) -> tuple[str, str, str]:
    """Return an error, its tolerance and their unit; dashes where an output has no such entries."""
    if error == 0 and tolerance == 0:
        return "-", "-", ""
    return f"{error:.1e}", f"{tolerance:.1e}", unit


def gaps(comparisons: Sequence[Comparison]) -> Iterator[str]:
    """Yield what the table does not show: entries that were not compared, and outputs that are 0 everywhere."""
    left, all_ = sum(each.uncompared for each in comparisons), sum(each.compared for each in comparisons)
    if left:
        yield (
            f"not compared: {left:,} of {left + all_:,} numbers, in which rounding leaves no digit (beside singular "
            "poses, or at angles beyond the range of the sine)"
        )
    moving = {each.quantity for each in comparisons if not each.is_zero}
    zeros = dict.fromkeys(str(each.quantity) for each in comparisons if each.quantity not in moving)
    if zeros:
        yield f"0 at every joint vector that was tried, so the comparison shows no more than that: {', '.join(zeros)}"


def _by_row(robot: Robot, comparisons: Iterable[Comparison]) -> dict[tuple[str, Units], list[Comparison]]:
    """Return comparisons by the row of the table that they count in, in order."""
    found: dict[tuple[str, Units], list[Comparison]] = {}
    for each in comparisons:
        units = error_units(robot, each.quantity)
        found.setdefault((each.row or each.target, units), []).append(each)
    return found


def _worst_lines(result: BuildResult) -> list[str]:
    """Return where the largest share of a tolerance is used, for each number type."""
    lines = []
    for real, worst in worst_of(result.proof.comparisons).items():
        names = _input_names(result.robot, worst.quantity)
        # Kernels that are given a pose have no such numbers.
        place = [f"{name} {value:.6g}" for name, value in zip(names, worst.worst, strict=False)]
        at = ", at" if place else ""
        lines.append(f"{_INDENT}worst {real}: {worst.quantity} of {worst.frame}, {said_target(worst.target)}{at}")
        lines += filled(place, _INDENT * 2)
    return lines


def worst_of(comparisons: Iterable[Comparison]) -> dict[str, Comparison]:
    """Return by number type the comparison that uses the largest share of its tolerance."""
    found: dict[str, Comparison] = {}
    for each in comparisons:
        if each.real not in found or each.share > found[each.real].share:
            found[each.real] = each
    return {real: found[real] for real in ("double", "float", "q30") if real in found}


def _input_names(robot: Robot, quantity: Quantity) -> list[str]:
    """Return what the numbers that a kernel is given are called."""
    driven = (Kind.ACTUATORS_TO_JOINTS, Kind.FK_ACTUATORS, Kind.JACOBIAN_ACTUATORS)
    given = robot.actuators.readings if quantity.kind in driven else robot.variables
    return [each.name for each in given]


def percentage(comparison: Comparison) -> str:
    """Return the share of its tolerance that a kernel uses, in percent."""
    percent = 100 * comparison.share
    return f"{percent:.0f} %" if percent >= 9.95 else f"{percent:.2g} %"


def build_record(file: Path, result: BuildResult) -> Record:
    """Return one build as plain data."""
    robot = result.robot
    compared = [_comparison(robot, comparison) for comparison in result.proof.comparisons]
    return {
        "file": str(file),
        "ok": True,
        "robot": robot_record(robot),
        "folder": str(result.folder),
        "backend": result.backend,
        "operations": {
            **{str(quantity): asdict(count) for quantity, count in result.counts.items()},
            "plain": asdict(result.plain),
        },
        "angle_sums": [{"name": f"c{angle.label}", "angle": angle.text} for angle in result.angles if angle.is_sum],
        "files": [{"path": str(file.path), "status": file.status} for file in result.written],
        "verification": {
            "passes": result.proof.holds,
            "reach": result.proof.reach,
            "comparisons": list(map(_renamed, compared)),
        },
        "proof": {"holds": result.proof.holds, "reach": result.proof.reach, "comparisons": compared},
        "stages": [{"title": said_stage(stage.name), **asdict(stage)} for stage in result.stages],
        "notes": list(result.notes),
    }


def _comparison(robot: Robot, comparison: Comparison) -> Record:
    length, number = error_units(robot, comparison.quantity)
    return {
        "target": comparison.target,
        "quantity": str(comparison.quantity),
        "real": comparison.real,
        "poses": comparison.poses,
        "holds": comparison.holds,
        "share": comparison.share,
        "compared": comparison.compared,
        "uncompared": comparison.uncompared,
        "is_zero": comparison.is_zero,
        "worst": list(comparison.worst),
        "frame": comparison.frame,
        "position": _error(comparison.position_error, comparison.position_tolerance, length),
        "rotation": _error(comparison.rotation_error, comparison.rotation_tolerance, number),
    }


def _renamed(comparison: Record) -> Record:
    """Return a comparison under the names of the vocabulary."""
    names = {"holds": "passes", "accepted": "tolerance"}
    found = {
        names.get(key, key): _renamed(value) if isinstance(value, dict) else value for key, value in comparison.items()
    }
    return found | ({"target": said_target(str(found["target"]))} if "target" in found else {})


def _error(error: float, accepted: float, unit: str) -> Record:
    return {"error": error, "accepted": accepted, "unit": unit}
