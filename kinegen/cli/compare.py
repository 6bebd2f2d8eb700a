"""`kinegen compare`: are two files the same robot?"""

from __future__ import annotations

import dataclasses
import json
import math
from typing import TYPE_CHECKING

import click

from kinegen.cli.robot_command import RobotCommand
from kinegen.cli.terminal import good, say
from kinegen.errors import shown

if TYPE_CHECKING:
    from kinegen.compare import Comparison, Difference
    from kinegen.robot.model import Robot

_ROUNDING = 1e-11
"""Metres and radians that are the rounding of the poses compared, and print as 0."""


@click.command("compare", cls=RobotCommand, short_help="Compares two robot files.")
@click.argument("first", metavar="A", type=click.Path())
@click.argument("second", metavar="B", type=click.Path())
@click.option("--fit-offsets", is_flag=True, help="Find signs and zero offsets of the joints of B.")
@click.option(
    "--tolerance",
    type=click.FloatRange(min=0, min_open=False),
    default=1e-9,
    show_default=True,
    help="Metres and radians up to which frames are the same where there is no proof.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the comparison as JSON.")
def command(first: str, second: str, fit_offsets: bool, tolerance: float, as_json: bool) -> int:
    """Compares two robot files, in any convention, format and unit.

    Each frame that both have is compared: with a proof for every joint vector where the joint axes and the pose at
    zero are the same, otherwise by the greatest difference over the limits of A. The frames of rows do not count where
    the conventions differ, because each convention places them elsewhere.

    The exit status is 0 if the robots are the same and 1 if they are not.
    """
    from kinegen.compare import compare
    from kinegen.formats.load import load

    left, right = load(first), load(second)
    found = compare(left, right, fit_offsets=fit_offsets, tolerance=tolerance)
    if as_json:
        say(json.dumps(dataclasses.asdict(found), indent=2))
    else:
        _report(found, left, right, (shown(first), shown(second)))
    return 0 if found.same else 1


def _report(found: Comparison, left: Robot, right: Robot, files: tuple[str, str]) -> None:
    verdict = "not the same robot"
    if found.same:
        how = "proved for every joint vector" if found.proved else f"within {found.tolerance:g} m and rad"
        verdict = f"{good('the same robot')}, {how}"
    say(f"{files[0]} and {files[1]}: {verdict}")
    for note in found.notes:
        say(f"  {note}")
    for (_, name), sign, offset in zip(found.joints, found.signs, found.offsets, strict=True):
        if sign < 0 or offset:
            kind = next(each.type for each in right.variables if each.name == name)
            said = f"{offset:+.9g} m" if kind == "prismatic" else f"{math.degrees(offset):+.9g} deg"
            say(f"  {name} of {files[1]} = {'-' if sign < 0 else ''}q {said}")
    for each in found.differences:
        say(f"  {_line(each)}")
        if not each.proved and max(each.distance, each.angle) > found.tolerance:
            say(f"    at {_vector(left, each.distance_at if each.distance > 0 else each.angle_at)}")
    for names, file in ((found.only_first, files[0]), (found.only_second, files[1])):
        if names:
            say(f"  only in {file}: {', '.join(names)}")


def _line(each: Difference) -> str:
    """One frame."""
    name = each.first if each.first == each.second else f"{each.first} ({each.second})"
    aside = "" if each.decides else " (does not count: another convention)"
    if each.proved:
        return f"{name}: the same pose{aside}"
    return f"{name}: at most {_length(each.distance)} and {_angle(each.angle)} apart{aside}"


def _angle(radians: float) -> str:
    return f"{math.degrees(radians):.4g} deg" if radians >= _ROUNDING else "0 deg"


def _length(metres: float) -> str:
    if metres < _ROUNDING:
        return "0 mm"
    return f"{metres:.4g} m" if metres >= 1 else f"{1000 * metres:.4g} mm"


def _vector(robot: Robot, q: tuple[float, ...]) -> str:
    """A joint vector, in degrees and metres."""
    parts = []
    for variable, value in zip(robot.variables, q, strict=True):
        slides = variable.type == "prismatic"
        parts.append(f"{variable.name} {value:.4g} m" if slides else f"{variable.name} {math.degrees(value):.1f} deg")
    return ", ".join(parts) or "the only pose"
