"""`kinegen prove`: Frama-C looks for run-time errors in the emitted C of a robot."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kinegen import __version__
from kinegen.api.options import INTEGERS, REALS
from kinegen.cli.build import quantities_of
from kinegen.cli.robot_command import RobotCommand
from kinegen.cli.terminal import bad, complain, faint, good, say, strong
from kinegen.errors import MissingToolError, shown
from kinegen.lines import columns
from kinegen.outputs import USUAL, Quantity

if TYPE_CHECKING:
    from kinegen.prove.evidence import Evidence, Finding
    from kinegen.prove.ranges import InputRange

_MISSING = 2
"""Exit status where Frama-C is not installed: nothing was analysed, so that nothing was shown or refuted."""

_CLAIMS = {
    "finite": "no run-time error, no infinity or NaN on the way, finite results, for all inputs in the ranges below",
    "defined": "no run-time error, all results set, for any inputs, also NaN and infinities; results may be NaN",
}

_MESSAGES = 20
"""Alarms of a function that are printed."""


@click.command("prove", cls=RobotCommand, short_help="Proves with Frama-C that the C has no run-time error.")
@click.argument("file", metavar="FILE", type=click.Path(path_type=Path))
@click.option("--real", type=click.Choice((*REALS, *INTEGERS)), default="both", show_default=True, help="Number types.")
@click.option(
    "--outputs",
    metavar="LIST",
    default=",".join(map(str, USUAL)),
    show_default=True,
    callback=quantities_of,
    help="What is computed, as for build.",
)
@click.option(
    "-o",
    "--output",
    metavar="DIR",
    type=click.Path(path_type=Path),
    help="Keep the evidence in DIR/NAME: the report, and for each function its C, the command and Frama-C's log.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document on stdout and nothing else.")
def command(file: Path, real: str, outputs: tuple[Quantity, ...], output: Path | None, as_json: bool) -> int:
    """Analyses each scalar C function of a robot with Eva, the value analysis of Frama-C, which has to be installed.

    Eva considers every input at once and raises an alarm at each operation that might fail: a read of memory that is
    not set, an access outside an array, an overflow, a division by zero. No alarm is a proof that there is no such
    error. An alarm is not a proof that there is one.

    The exit status is 0 if what is claimed of every function was shown, 1 if not, 2 if Frama-C is not installed.

    \b
        kinegen prove robots/puma560.yaml --real float
        kinegen prove arm.yaml --outputs pose,jacobian,inverse -o evidence
    """  # noqa: D301 - click's mark of a paragraph that stays as it is
    from kinegen.emit.reals import Real
    from kinegen.pipeline import lower_file
    from kinegen.prove.eva import require_program
    from kinegen.prove.stage import prove

    try:
        require_program()
    except MissingToolError as error:
        complain(f"error: {error}")
        return _MISSING
    kernels = lower_file(file, outputs)
    reals = tuple(map(Real, REALS[real])) if real in REALS else tuple(map(Real, REALS["both"] * (real == "all")))
    evidence = prove(kernels, reals, integers=real in INTEGERS, report=(lambda _: None) if as_json else _progress)
    document = {"kinegen": __version__, "format": 1, "file": str(file), **evidence.record()}
    lines = _report(file, evidence)
    say(json.dumps(document, indent=2) if as_json else "\n".join(lines))
    if output is not None:
        folder = _keep(output, evidence, document, lines)
        if not as_json:
            say(faint(f"evidence in {shown(folder)}"))
    return 0 if evidence.holds else 1


def _progress(finding: Finding) -> None:
    """One line as soon as a function is done."""
    word = good("shown") if finding.holds else bad(_failure(finding))
    say(f"  {finding.subject.function:<32}  {finding.seconds:5.1f} s  {word}")


def _failure(finding: Finding) -> str:
    """Why something was not shown."""
    outcome = finding.outcome
    if outcome.alarms > 0:
        return f"{outcome.alarms} alarm{'s' * (outcome.alarms > 1)}"
    if outcome.alarms < 0:
        return "the end of the program is not reached"
    return f"not shown: {outcome.open} assertions open, {outcome.unreached} statements not reached"


def _report(file: Path, evidence: Evidence) -> list[str]:
    """The report for people."""
    from kinegen.prove.eva import command_for

    count = sum(finding.holds for finding in evidence.findings)
    total = len(evidence.findings)
    word = good("no run-time error") if evidence.holds else bad("not shown for all functions")
    head = f"{shown(file)}: {word} ({count} of {total} functions, Frama-C {evidence.version}, Eva)"
    lines = ["", strong(head), *(f"  {line}" for line in _table(evidence)), ""]
    claims = dict.fromkeys(str(finding.subject.driver.claim) for finding in evidence.findings)
    lines += [f"  {claim}: {_CLAIMS[claim]}" for claim in claims]
    for output, reason in evidence.left_out:
        lines.append(f"  {output} was not analysed: {reason}")
    ranges = dict.fromkeys(each for finding in evidence.findings for each in finding.subject.ranges)
    if evidence.parameters:
        values = ", ".join(f"{name} = {value:.6g}" for name, value in evidence.parameters)
        lines.append(f"  runtime parameters have the values of the file: {values}")
    if ranges:
        lines += ["", "  ranges of the inputs", *(f"    {line}" for line in _ranges(tuple(ranges)))]
    for finding in evidence.findings:
        lines += [] if finding.holds else ["", f"  {finding.subject.function}: {_failure(finding)}"]
        lines += [f"    {message}" for message in finding.outcome.messages[:_MESSAGES]]
        more = len(finding.outcome.messages) - _MESSAGES
        lines += [f"    and {more} more; --json and -o have all"] * (more > 0)
    commands = dict.fromkeys(command_for(finding.subject.driver) for finding in evidence.findings)
    lines += ["", "  analysed with", *(f"    {each}" for each in commands)]
    return lines


def _table(evidence: Evidence) -> list[str]:
    rows = [("function", "claim", "alarms", f"results lie in, {evidence.length} and rad")]
    for finding in evidence.findings:
        hulls = ", ".join(f"{name} {low:.4g} to {high:.4g}" for name, low, high in finding.results)
        alarms = str(finding.outcome.alarms) if finding.outcome.alarms >= 0 else "-"
        rows.append((finding.subject.function, str(finding.subject.driver.claim), alarms, hulls or "-"))
    lines = columns(rows, left=frozenset({0, 1, 3}))
    return [strong(lines[0]), *lines[1:]]


def _ranges(ranges: tuple[InputRange, ...]) -> list[str]:
    source = {"limits": "limits of the file", "assumed": "assumed"}
    rows = [(each.name, f"{each.low:.6g}", "to", f"{each.high:.6g}", each.unit, source[each.source]) for each in ranges]
    return columns(rows, left=frozenset({0, 2, 4, 5}))


def _keep(output: Path, evidence: Evidence, document: dict[str, object], lines: list[str]) -> Path:
    """Write the evidence; what an earlier run kept there is replaced."""
    from kinegen.write import write_files

    folder = output / evidence.robot
    text = click.unstyle("\n".join(lines)).lstrip("\n") + "\n"
    write_files(folder, evidence.files(text, json.dumps(document, indent=2) + "\n"), stale=lambda _: True)
    return folder
