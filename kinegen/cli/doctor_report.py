"""What `kinegen doctor` prints: the explanations with their differences of the file, as text and as JSON.

The JSON document has these keys:

    kinegen     version
    format      1
    robot       name of the robot
    poses       how many, with their units and the form of their orientations
    verdict     agrees, found, ambiguous or nothing
    before      position (worst), position_rms and rotation (worst, degrees) of the file as it is
    findings    changes (words), same (other ways to write the same robot), fits, position, position_rms, rotation,
                text (the changed file, or null), reason (why there is no text)
    untested    single changes that the poses do not test
    hidden      those that no pose tests if no more is measured of it
    measure     joints, positions and orientations (one for each finding) of the pose to measure next, or null
    tried       how many combinations were evaluated
    left_out    what was not tried
    written     the file that was written, or null
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kinegen import __version__
from kinegen.cli.terminal import bad, faint, filled, good, strong
from kinegen.doctor import readings
from kinegen.doctor.diagnosis import Diagnosis, Finding, Verdict
from kinegen.doctor.separate import Separation
from kinegen.doctor.space import Candidate
from kinegen.errors import shown

if TYPE_CHECKING:
    from kinegen.doctor.poses import Observations
    from kinegen.robot.model import Robot

_MOST_SAME = 3
_NOTHING = 1e-9
"""What is left of a pose that is met exactly."""


def document(found: Diagnosis, observed: Observations, robot: Robot, written: Path | None) -> dict[str, Any]:
    """The answer as plain data."""
    return {
        "kinegen": __version__,
        "format": 1,
        "robot": robot.name,
        "poses": {
            "count": len(observed),
            "angle": observed.angle,
            "length": observed.length,
            "orientation": observed.form or None,
        },
        "verdict": str(found.verdict),
        "before": _errors(found.start),
        "findings": [_finding_record(finding) for finding in found.findings],
        "untested": list(found.untested),
        "hidden": list(found.hidden),
        "measure": _separation_record(found.separation),
        "tried": found.tried,
        "left_out": list(found.left_out),
        "written": None if written is None else str(written),
    }


def _errors(candidate: Candidate) -> dict[str, Any]:
    return {
        "fits": candidate.fits,
        "position": candidate.position,
        "position_rms": candidate.position_rms,
        "rotation": math.degrees(candidate.rotation),
        "length": candidate.setting.pose_length,
    }


def _finding_record(finding: Finding) -> dict[str, Any]:
    return {
        "changes": list(finding.words),
        "same": [list(words) for words in finding.same],
        **_errors(finding.candidate),
        "text": finding.text,
        "reason": finding.reason or None,
    }


def _separation_record(found: Separation | None) -> dict[str, Any] | None:
    if found is None:
        return None
    return {
        "joints": list(found.joints),
        "positions": found.positions.tolist(),
        "orientations": found.orientations.tolist(),
        "distance": found.distance,
        "rotation": found.degrees,
    }


def report(found: Diagnosis, observed: Observations, robot: Robot, file: str, source: str, written: Path | None) -> str:
    """The answer as text."""
    lines = [f"{file}: {robot.name}, {_counted(len(observed), 'pose')}", *filled(_heard(observed), "  ")]
    lines += [f"  as it is: {_deviation(found.start)}", *_verdict(found)]
    several = len(found.findings) > 1
    for number, finding in enumerate(found.findings, start=1):
        if finding.words:
            lines += ["", *_finding(finding, number if several else None, file, source)]
    lines += _next(found, robot)
    lines += [f"not tried: {words}" for words in found.left_out if found.verdict is Verdict.NOTHING]
    if written is not None:
        lines += ["", f"written: {shown(written)}"]
    return "\n".join(lines)


def _counted(number: int, thing: str) -> str:
    return f"{number} {thing}{'s' * (number != 1)}"


def _heard(observed: Observations) -> list[str]:
    """How the poses were read, so that a wrong assumption is seen."""
    stated = {True: "as stated", False: "the unit of the file"}
    parts = [f"joint values in {observed.angle} ({stated[observed.stated_angle]})"]
    parts.append(f"positions in {observed.length} ({stated[observed.stated_length]})")
    return [*parts, f"orientations as {readings.WORDS[observed.form]}" if observed.form else "no orientations"]


def _deviation(candidate: Candidate) -> str:
    unit = candidate.setting.pose_length
    worst, mean = (
        f"{value if value > _NOTHING else 0:.3g} {unit}" for value in (candidate.position, candidate.position_rms)
    )
    text = f"worst {worst}, RMS {mean}"
    return text + (f", orientation {math.degrees(candidate.rotation):.3g} deg" if candidate.setting.form else "")


def _verdict(found: Diagnosis) -> list[str]:
    match found.verdict:
        case Verdict.AGREES:
            return [good("the file agrees with the poses")]
        case Verdict.FOUND:
            return [good("one explanation agrees with all poses")]
        case Verdict.AMBIGUOUS:
            count = len(found.findings)
            return [bad(f"the poses cannot separate these {count} explanations")]
    head = "no small change makes the file agree with the poses"
    if not found.findings:
        return [bad(head), "nothing that was tried reduces the errors to a tenth"]
    return [
        bad(head),
        "The nearest ones follow; none is an explanation. If the poses are measured, give --tolerance; what",
        "remains after a right change is a matter of calibration.",
    ]


def _finding(finding: Finding, number: int | None, file: str, source: str) -> Iterator[str]:
    head = "; ".join(finding.words)
    yield strong(f"{number}. {head}" if number is not None else head)
    yield f"  then: {_deviation(finding.candidate)}"
    for words in finding.same[:_MOST_SAME]:
        yield faint(f"  the same robot: {'; '.join(words)}")
    if len(finding.same) > _MOST_SAME:
        yield faint(f"  and {len(finding.same) - _MOST_SAME} more ways to write the same robot")
    if finding.reason:
        yield f"  the text of the file cannot be changed for this: {finding.reason}"
    elif finding.text is None:
        yield f"  the file stays as it is; {_options(finding)}"
    else:
        yield from _difference(finding.text, file, source)
        if said := _options(finding):
            yield f"  and {said}"


def _options(finding: Finding) -> str:
    """What to say of the poses, as options of this command."""
    setting = finding.candidate.setting
    fields = {name for change in finding.candidate.changes for name, _ in change.fields}
    options = []
    if "joint_angle" in fields and ("pose_angle" in fields or setting.form not in readings.ANGLES):
        options.append(f"--angle {setting.joint_angle}")
    elif fields & {"joint_angle", "pose_angle"} and "form" not in fields:
        names = {"joint_angle": "joint values", "pose_angle": "orientations"}
        return " and ".join(f"the {name} are in {getattr(setting, key)}" for key, name in names.items() if setting.form)
    elif "table_angle" in fields:
        options.append(f"--angle {setting.joint_angle}")
    if fields & {"pose_length", "table_length"}:
        options.append(f"--length {setting.pose_length}")
    if "form" in fields:
        options.append(f"--orientation {setting.form}")
    return f"for these poses give {' '.join(options)}" if options else ""


def _difference(text: str, file: str, source: str) -> Iterator[str]:
    lines = difflib.unified_diff(source.splitlines(), text.splitlines(), file, file, n=1, lineterm="")
    for line in lines:
        mark = good if line.startswith("+") else bad if line.startswith("-") else faint
        yield f"  {mark(shown(line))}" if line[:1] in "+-@" else f"  {shown(line)}"


def _next(found: Diagnosis, robot: Robot) -> Iterator[str]:
    """What is not tested, and the pose to measure next."""
    if found.untested or found.hidden:
        yield ""
    if found.untested:
        yield from ("not tested by these poses:", *filled(_by_row(found.untested), "  "))
    if found.hidden:
        kind = "poses" if found.start.setting.form else "positions"
        yield from (f"never tested by {kind} alone:", *filled(_by_row(found.hidden), "  "))
    if found.verdict is Verdict.AMBIGUOUS:
        yield from ("",) if found.separation else ("", "no pose within the joint limits separates all of them")
    if found.separation is not None:
        yield from _measure(found, found.separation, robot)


def _measure(found: Diagnosis, here: Separation, robot: Robot) -> Iterator[str]:
    """The pose, and what is to be seen there."""
    setting = found.findings[0].candidate.setting
    values = zip(robot.variables, here.joints, strict=True)
    yield from ("measure at:", *filled([f"{variable.name} {value:.6g}" for variable, value in values], "  "))
    for number, (position, turned) in enumerate(zip(here.positions, here.orientations, strict=True), start=1):
        name = f"  {number}." if found.verdict is Verdict.AMBIGUOUS else "  the explanation above:"
        place = f"position {', '.join(f'{value:.6g}' for value in position)} {setting.pose_length}"
        turn = ", ".join(f"{value:.5g}" for value in turned)
        yield f"{name} {place}{turn and f', orientation {turn}'}"
    if found.untested:
        apart = f"{here.distance:.3g} {setting.pose_length}"
        also = f" and {here.degrees:.3g} deg" if setting.form else ""
        yield f"  the nearest of the others: {apart}{also} away"


def _by_row(untested: tuple[str, ...]) -> list[str]:
    """Changes with those of one joint together."""
    rows: dict[str, list[str]] = {}
    for words in untested:
        row, mark, what = words.partition(": ")
        rows.setdefault(f"{row}{mark}", []).append(what)
    return [f"{row}{', '.join(what)}" for row, what in rows.items()]
