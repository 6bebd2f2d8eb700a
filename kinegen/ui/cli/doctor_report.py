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
    unexplained null, or where nothing explains the poses: errors (line, position, rotation in degrees and fits of each
                pose in the file as it is), most_agree (finding and errors of what all poses but a few agree with, or
                null), calibrate (kinds of entries with which kinegen calibrate would explain the poses, or none) and
                positions_agree
    written     the file that was written, or null
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kinegen.errors import shown
from kinegen.model.robot import Convention
from kinegen.support.dataclass import dataclass
from kinegen.support.text_layout import columns
from kinegen.tools.doctor import observed_poses
from kinegen.tools.doctor.diagnosis import Diagnosis, Verdict
from kinegen.tools.doctor.findings import Finding, MostAgree, PoseError, Separation, Unexplained
from kinegen.tools.doctor.hypotheses import Candidate
from kinegen.ui.cli.terminal import bad, faint, filled, good, strong

if TYPE_CHECKING:
    from kinegen.model.robot import Robot
    from kinegen.tools.doctor.observed_poses import Observations

_MOST_SAME = 3
_MOST_POSES = 12
_KINDS = {"theta": "zeros of joints (theta)", "d": "lengths d", "a": "lengths a", "alpha": "twists alpha"}
_NOTHING = 1e-9
"""What is left of a pose that is met exactly."""


def document(found: Diagnosis, observed: Observations, robot: Robot, written: Path | None) -> dict[str, Any]:
    """Return the answer as plain data."""
    return {
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
        "unexplained": found.unexplained and _unexplained_record(found.unexplained),
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


def _unexplained_record(found: Unexplained) -> dict[str, Any]:
    most = found.most_agree
    errors = [] if most is None else [_pose_record(each) for each in most.errors]
    return {
        "errors": [_pose_record(each) for each in found.errors],
        "most_agree": most and {"finding": _finding_record(most.finding), "errors": errors},
        "calibrate": list(found.kinds),
        "positions_agree": found.positions_agree,
    }


def _pose_record(error: PoseError) -> dict[str, Any]:
    return {
        "line": error.line,
        "position": error.position,
        "rotation": math.degrees(error.rotation),
        "fits": error.fits,
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


@dataclass(frozen=True, slots=True)
class Asked:
    """What the command was given.

    Attributes:
        file: The robot file, as messages call it.
        poses: The file of poses.
        source: The text of the file; None where it is of another format, whose lines are not those of the changes.
        take: The number of the explanation that is written, where it was chosen.
    """

    file: str
    poses: str
    source: str | None
    take: int | None


def report(found: Diagnosis, observed: Observations, robot: Robot, asked: Asked, written: Path | None) -> str:
    """Return the answer as text."""
    lines = [f"{asked.file}: {robot.name}, {_counted(len(observed), 'pose')}", *filled(_heard(observed), "  ")]
    if robot.actuators.drives:
        lines.append("  the file has actuators; the poses give joint values, so actuators are left out")
    lines += [f"  file as given: {_deviation(found.start)}", *_verdict(found)]
    # Numbers stand before explanations if there are several.
    several = len(found.findings) > 1
    for number, finding in enumerate(found.findings, start=1):
        if finding.words:
            lines += ["", *_finding(finding, number if several else None, asked)]
    lines += _next(found, robot)
    if found.unexplained is not None:
        lines += _unexplained(found.unexplained, found, robot, asked)
    lines += [f"not tried: {words}" for words in found.left_out if found.verdict is Verdict.NOTHING]
    if written is not None:
        change = "the change above" if asked.take is None or not several else f"explanation {asked.take}"
        lines += ["", f"wrote {shown(written)}: {asked.file} with {change}"]
    return "\n".join(lines)


def _counted(number: int, thing: str) -> str:
    return f"{number} {thing}{'s' * (number != 1)}"


def _heard(observed: Observations) -> list[str]:
    """Return how the poses were read, so that a wrong assumption is seen."""
    stated = {True: "as stated", False: "the unit of the file"}
    parts = [f"joint values in {observed.angle} ({stated[observed.stated_angle]})"]
    parts.append(f"positions in {observed.length} ({stated[observed.stated_length]})")
    return [
        *parts,
        f"orientations as {observed_poses.WORDS[observed.form]}" if observed.form else "no orientations",
    ]


def _deviation(candidate: Candidate) -> str:
    unit = candidate.setting.pose_length
    worst, mean = (
        f"{value if value > _NOTHING else 0:.3g} {unit}" for value in (candidate.position, candidate.position_rms)
    )
    text = f"max error {worst}, RMS {mean}"
    return text + (f", orientation {_degrees(candidate.rotation)} deg" if candidate.setting.form else "")


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle) if angle > _NOTHING else 0:.3g}"


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


def _finding(finding: Finding, number: int | None, asked: Asked) -> Iterator[str]:
    head = "; ".join(finding.words)
    yield strong(f"{number}. {head}" if number is not None else head)
    yield f"  after the change: {_deviation(finding.candidate)}"
    for words in finding.same[:_MOST_SAME]:
        yield faint(f"  the same robot: {'; '.join(words)}")
    if len(finding.same) > _MOST_SAME:
        yield faint(f"  and {len(finding.same) - _MOST_SAME} more ways to write the same robot")
    if finding.reason:
        yield f"  the text of the file cannot be changed for this: {finding.reason}"
    elif finding.text is None:
        yield f"  the file stays as it is; {_options(finding)}"
    else:
        if asked.source is None:
            yield "  --write OUT.yaml writes a robot file with it; the lines of this file are not those of a table"
        else:
            yield from _difference(finding.text, asked.file, asked.source)
        if said := _options(finding):
            yield f"  and {said}"


def _options(finding: Finding) -> str:
    """Return what to say of the poses, as options of this command."""
    setting = finding.candidate.setting
    fields = {name for change in finding.candidate.changes for name, _ in change.fields}
    options = []
    if "joint_angle" in fields and ("pose_angle" in fields or setting.form not in observed_poses.ORIENTATION_ANGLES):
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


def _unexplained(left: Unexplained, found: Diagnosis, robot: Robot, asked: Asked) -> Iterator[str]:
    """Yield what may be said where nothing explains all poses: which poses are off, and what else can be done."""
    turned, unit = bool(found.start.setting.form), found.start.setting.pose_length
    if left.most_agree is not None:
        yield from _most_agree(left.most_agree, asked)
    # The worst poses first, since one bad measurement may be all there is.
    yield from [""] * bool(found.findings)
    yield "the errors of each pose, in the file as it is:"
    rows = [("line", f"position [{unit}]", *(["orientation [deg]"] * turned))]
    worst = sorted(left.errors, key=lambda error: (-error.position, -error.rotation))[:_MOST_POSES]
    rows += [(str(each.line), f"{each.position:.3g}", *([_degrees(each.rotation)] * turned)) for each in worst]
    yield from (f"  {line}" for line in columns(rows))
    if len(left.errors) > _MOST_POSES:
        yield f"  and {len(left.errors) - _MOST_POSES} more, which are smaller (--json lists all)"
    if left.positions_agree:
        yield "all positions agree, so the orientations are in another form, or the tool is turned"
    if left.kinds:
        kinds = ",".join(left.kinds)
        several = "entries" if len(left.kinds) > 1 else _KINDS[kinds]
        units = f"--angle {found.start.setting.joint_angle} --length {unit}"
        yield f"small errors of several {several} explain the poses; fit them:"
        yield f"  kinegen calibrate {asked.file} {asked.poses} --fit {kinds} {units}"
    elif left.is_near and left.most_agree is None and any(row.convention is not Convention.ETS for row in robot.rows):
        yield "errors that are small everywhere are a matter of kinegen calibrate"


def _most_agree(most: MostAgree, asked: Asked) -> Iterator[str]:
    good = sum(each.fits for each in most.errors)
    unit = most.finding.candidate.setting.pose_length
    what = "with the change below" if most.finding.words else "with the file as it is"
    yield f"{good} of {len(most.errors)} poses agree {what}; measure the others again, or leave them out:"
    for each in most.errors:
        if not each.fits:
            turn = f" and {_degrees(each.rotation)} deg" if most.finding.candidate.setting.form else ""
            yield f"  line {each.line}: {each.position:.3g} {unit}{turn} off"
    if most.finding.words:
        yield from ("", *_finding(most.finding, None, asked))


def _difference(text: str, file: str, source: str) -> Iterator[str]:
    lines = difflib.unified_diff(source.splitlines(), text.splitlines(), file, file, n=1, lineterm="")
    for line in lines:
        mark = good if line.startswith("+") else bad if line.startswith("-") else faint
        yield f"  {mark(shown(line))}" if line[:1] in "+-@" else f"  {shown(line)}"


def _next(found: Diagnosis, robot: Robot) -> Iterator[str]:
    """Yield what is not tested, and the pose to measure next."""
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
    """Yield the pose, and what is to be seen there."""
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
    """Return changes with those of one joint together."""
    rows: dict[str, list[str]] = {}
    for words in untested:
        row, mark, what = words.partition(": ")
        rows.setdefault(f"{row}{mark}", []).append(what)
    return [f"{row}{', '.join(what)}" for row, what in rows.items()]
