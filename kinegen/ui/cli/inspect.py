"""`kinegen inspect`: the family of a robot's closed-form inverse, or what is missing for one."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator
from itertools import permutations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kinegen.errors import KinegenError, shown
from kinegen.model.variants import JOINTS
from kinegen.support.text_layout import columns
from kinegen.ui.cli.check import examine
from kinegen.ui.cli.robot_command import Record, RobotCommand, json_option, takes
from kinegen.ui.cli.terminal import strong, width

if TYPE_CHECKING:
    from kinegen.backends.textbook.singularities import LociForm
    from kinegen.derive.inverse.classification import NotClosedForm
    from kinegen.derive.inverse.family import Family
    from kinegen.derive.inverse.family_words import Constant
    from kinegen.model.robot import Robot

_INDENT = "  "
_BESIDE = 50
"""The longest name of a family that stands beside its file; a longer one is below it."""

_LONGEST = 80
"""Columns of an explanation, also where a terminal is wider: pages and mails show these lines."""

_BUILD = "kinegen build --outputs"

Ways = list[tuple[str, str]]
"""Words for `kinegen build --outputs`, and what they compute of a robot."""


@click.command("inspect", cls=RobotCommand, short_help="Names the closed-form inverse that an arm has.")
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=click.Path())
@json_option
@click.pass_context
def inspect_command(context: click.Context, files: tuple[str, ...], as_json: bool) -> int:
    """Names the family of each robot's closed-form inverse, its branches in their order, and its constants.

    The family depends on the axes of the joints, not on the convention of the table. If an arm has no family, the
    conditions that fail are listed.
    """
    return int(examine(context, files, _inspect_record if as_json else None, _inspect_lines) > 0)


def _inspect_lines(file: str, robot: Robot) -> list[str]:
    from kinegen.derive.inverse.classification import recognise
    from kinegen.derive.inverse.family import Family

    found = recognise(robot)
    lines = _family_lines(robot, found) if isinstance(found, Family) else _unknown_lines(robot, found.reasons)
    lines += _singular_lines(robot)
    lines += [line for hint in _hints(file, robot, found) for line in _explained(hint, _INDENT)]
    name = found.name if isinstance(found, Family) else "no closed-form inverse"
    head = [f"{shown(file)}: {strong(name)}"]
    if len(name) > _BESIDE:
        head = [f"{shown(file)}:", *map(strong, _explained(name, _INDENT))]
    return [*head, *lines]


def _inspect_record(file: str, robot: Robot) -> Record:
    from kinegen.backends.textbook.notation import NOTATIONS
    from kinegen.backends.textbook.sheet_sentences import equations
    from kinegen.derive.inverse.classification import recognise
    from kinegen.derive.inverse.family import Family

    found, form = recognise(robot), _loci(robot)
    singular, rank = None, form.rank if form is not None else None
    if form is not None and not form.long:
        places = ((equations(place, NOTATIONS["text"], " = "), place.words) for place in form.places)
        singular = [{"zeros": zeros, "words": words} for zeros, words in places]
    if isinstance(found, Family):
        known: Record = {"family": _family_record(robot, found), "reasons": []}
        ways, hints = [("inverse", found.name)], list[str]()
    else:
        known = {"family": None, "reasons": list(found.reasons)}
        ways, hints = [*_machines(robot), *_seen(robot)[0], *_searches(robot)], list(_arm_hints(robot))
    outputs = [{"output": output, "text": text} for output, text in ways]
    return {
        **known,
        "outputs": outputs,
        "rank": rank,
        "singular": singular,
        "hints": [*hints, *_hints(file, robot, found)],
    }


def _hints(file: str, robot: Robot, found: Family | NotClosedForm) -> Iterator[str]:
    """Yield options that another inverse needs."""
    from kinegen.derive.inverse.classification import snap_hint

    if robot.is_tree and takes("tips", Path(file)) and not robot.actuators.readings:
        yield "--tip NAME takes the arm from the base to one tip alone"
    if hint := snap_hint(robot, found):
        yield hint


def _loci(robot: Robot) -> LociForm | None:
    """Return the places where the Jacobian of the tool is singular; None where no page could hold that."""
    from kinegen.backends.textbook.singularities import loci_form

    if robot.is_tree or not robot.dof:
        return None
    try:
        return loci_form(robot, robot.root, robot.tips[0])
    except KinegenError:
        return None


def _singular_lines(robot: Robot) -> list[str]:
    from kinegen.backends.textbook.sheet_sentences import place_lines

    form = _loci(robot)
    if form is None:
        return []
    if form.long:
        return [f"{_INDENT}singular where a long determinant is 0: kinegen show --output singularities"]
    head = "singular where (kinegen show --output singularities)"
    lines = place_lines(form, min(width(), _LONGEST) - len(_INDENT), head)
    if form.rank < min(robot.dof, 6) and not form.places:
        return [f"{_INDENT}the rank of the Jacobian is {form.rank} everywhere, with {robot.dof} joints"]
    return [_INDENT + line for line in lines] if form.places else []


def _unknown_lines(robot: Robot, reasons: tuple[str, ...]) -> list[str]:
    """Return what there is for a robot without a closed-form inverse of its tool."""
    seen, unseen = _seen(robot)
    lines = [line for reason in reasons for line in _explained(reason, _INDENT)]
    for output, text in (*_machines(robot), *seen):
        lines += [*_explained(text, _INDENT), f"{_INDENT * 2}{_BUILD} {output}"]
    lines += [line for reason in unseen for line in _explained(reason, _INDENT)]
    lines += [f"{_INDENT}{text}: {_BUILD} {output}" for output, text in _searches(robot)]
    return lines + [line for hint in _arm_hints(robot) for line in _explained(hint, _INDENT)]


def _explained(text: str, indent: str) -> list[str]:
    """Return a sentence in lines; words, commands and names are not broken."""
    return textwrap.wrap(
        text,
        min(width(), _LONGEST),
        initial_indent=indent,
        subsequent_indent=indent + _INDENT,
        break_long_words=False,
        break_on_hyphens=False,
    )


def _searches(robot: Robot) -> Ways:
    """Return the inverses that are not in closed form."""
    if robot.is_tree and robot.dof:
        return [("numeric_inverse", "numeric inverse, targets of all tips")]
    if not robot.is_arm:
        return []
    complete = [("complete_inverse", "all solutions, up to 16")] if _complete_reason(robot) == "" else []
    return [("numeric_inverse", "numeric inverse, for every arm"), *complete]


def _complete_reason(robot: Robot) -> str | None:
    """Return why an arm has no complete inverse: None where that only counts its joints, empty where it has one."""
    from kinegen.backends.complete_inverse.elimination_choice import complete_of
    from kinegen.backends.complete_inverse.screws import refusal

    if refusal(robot):
        return None
    try:
        complete_of(robot)
    except KinegenError as error:
        return error.message
    return ""


def _arm_hints(robot: Robot) -> Iterator[str]:
    """Yield sentences about an arm without a closed-form inverse."""
    if robot.is_tree or not robot.is_arm:
        return
    if reason := _complete_reason(robot):
        yield reason
    if robot.dof == JOINTS and not robot.redundancy:
        yield "seven joints: --redundancy NAME gives one, or arm_angle, beside the pose"


def _machines(robot: Robot) -> Ways:
    """Return the pairs of tips between which the robot is a machine tool with five axes."""
    from kinegen.derive.inverse.five_axis_geometry import FiveAxisMachine, machine_of
    from kinegen.model.robot import TOOL

    ways = []
    for tool, workpiece in permutations(robot.tips, 2) if robot.is_tree else ((TOOL, robot.root),):
        found = machine_of(robot, workpiece, tool)
        if isinstance(found, FiveAxisMachine):
            text = f"{tool} as a tool in the frame of {workpiece}: a machine tool with five axes, {found.words}"
            ways.append((f"axis_inverse{f'@{tool}/{workpiece}' if robot.is_tree else ''}", text))
    return ways


def _seen(robot: Robot) -> tuple[Ways, list[str]]:
    """Return the pairs of tips between which the chain has a closed form; where no pair has one, the reasons."""
    from kinegen.derive.inverse.classification import NotClosedForm, recognise
    from kinegen.model.dh_conversion.elementary_transforms import seen_chain

    ways, reasons = Ways(), list[str]()
    for tool, workpiece in () if robot.is_arm else permutations(robot.tips, 2):
        found = recognise(seen_chain(robot, tool, workpiece))
        pair = f"{tool} in the frame of {workpiece}"
        if isinstance(found, NotClosedForm):
            reasons.append(f"{pair}: {found.reasons[0]}")
        else:
            ways.append((f"inverse@{tool}/{workpiece}", f"{pair}: {'; '.join([found.name, *found.conditions])}"))
    # Without a redundancy there is hardly a tree of which all joints between two tips are a family.
    return ways, reasons if robot.redundancy and not ways else []


def _family_record(robot: Robot, family: Family) -> Record:
    from kinegen.derive.inverse.family_words import constants

    return {
        "name": family.name,
        "aim": family.aim.value,
        "branches": list(family.branches),
        "meanings": list(family.meanings),
        "constants": [_constant_record(robot, constant) for constant in constants(family)],
        "conditions": list(family.conditions),
        "redundancy": family.redundancy,
        "nearly": _nearness(robot, family),
    }


def _constant_record(robot: Robot, constant: Constant) -> Record:
    value, unit = constant.value, robot.units.length
    if constant.is_angle:
        value, unit = math.radians(value), "rad"
    return {"text": constant.text, "value": value, "unit": unit, "runtime": list(constant.runtime)}


def _family_lines(robot: Robot, family: Family) -> list[str]:
    from kinegen.derive.inverse.family_words import constants

    branches = [f"{_INDENT * 2}{index}  {name}" for index, name in enumerate(family.branches)]
    rows = [_row(robot, constant) for constant in constants(family)]
    table = columns(rows, left=frozenset({0, 2})) if rows else []
    meanings = [line for meaning in family.meanings for line in _explained(meaning, _INDENT * 2)]
    conditions = [line for condition in family.conditions for line in _explained(condition, _INDENT * 2)]
    return [
        *_defect_lines(robot, family),
        f"{_INDENT}solved for the {family.aim} of the tool",
        f"{_INDENT}branches",
        *branches,
        *meanings,
        *([f"{_INDENT}constants", *table] if table else []),
        f"{_INDENT}targets",
        *conditions,
    ]


def _nearness(robot: Robot, family: Family) -> dict[str, Any] | None:
    """Return the conditions that an arm meets only nearly, and what that means; None for an arm that meets all."""
    from kinegen.derive.inverse.compact_chain import SAMPLES, tip_apart
    from kinegen.derive.inverse.derive import singular_below, size_of
    from kinegen.derive.inverse.newton_refinement import newton_steps

    if family.defect is None:
        return None
    unit, tip, size = robot.units.length, tip_apart(robot, family), size_of(robot, family)
    failing = [
        {"text": each.text, "amount": each.amount, "unit": "rad" if each.is_angle else unit}
        for each in family.defect.failing
    ]
    return {
        "failing": failing,
        "distance": tip.length,
        "angle": tip.angle,
        "samples": SAMPLES,
        "newton_steps": newton_steps(family.defect, size),
        "size": size,
        "singular_below": singular_below(robot, family),
    }


def _defect_lines(robot: Robot, family: Family) -> list[str]:
    found = _nearness(robot, family)
    if found is None:
        return []
    unit = robot.units.length
    sentences = [f"{each['text']} but for {each['amount']:.2g} {each['unit']}" for each in found["failing"]]
    away = (
        f"the tip of the nearest exact arm is up to {found['distance']:.2g} {unit} and {found['angle']:.2g} rad away "
        f"(the most of {found['samples']:,} joint vectors)"
    )
    steps = f"the target is corrected twice, then {found['newton_steps']} steps of second order"
    vanish = (
        "branches may be missing where the least singular value of the Jacobian, lengths by the reach of "
        f"{found['size']:.4g} {unit}, is below {found['singular_below']:.2g}; for more solutions there build with "
        "--outputs complete_inverse"
    )
    sentences += [away, f"each branch is refined to the actual arm: {steps}", vanish]
    lines = [line for text in sentences for line in _explained(text, _INDENT * 2)]
    return [f"{_INDENT}conditions that it nearly meets", *lines]


def _row(robot: Robot, constant: Constant) -> tuple[str, str, str]:
    unit = "deg" if constant.is_angle else robot.units.length
    runtime = f" (from {', '.join(constant.runtime)})" if constant.runtime else ""
    return f"{_INDENT * 2}{constant.text}", f"{constant.value:.6g}", f"{unit}{runtime}"
