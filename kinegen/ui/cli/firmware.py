"""`kinegen size` and `kinegen prove`: what kernels cost on a microcontroller, and that they have no run-time error."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from kinegen.errors import MissingToolError, shown
from kinegen.model.outputs import NUMERIC_INVERSE, USUAL, Quantity
from kinegen.support.text_layout import columns
from kinegen.ui.api.options import INTEGERS, REALS
from kinegen.ui.cli.build import names_of, quantities_of
from kinegen.ui.cli.robot_command import Record, RobotCommand, accepted, complain_of, document_text, json_option
from kinegen.ui.cli.terminal import bad, faint, good, say, strong

if TYPE_CHECKING:
    from kinegen.verify.boards.targets import Target
    from kinegen.verify.frama_c.eva import Evidence, Finding
    from kinegen.verify.frama_c.ranges import InputRange
    from kinegen.verify.records import Cost

DEFAULT_TARGET = "cortex-m4f"


def _target(_context: click.Context, _parameter: click.Parameter, name: str) -> Target:
    from kinegen.verify.boards.targets import find_target

    return accepted(find_target, name)


@click.command("size", cls=RobotCommand, short_help="Measures the kernels on a microcontroller.")
@click.argument("file", metavar="FILE", type=click.Path(path_type=Path))
@click.option(
    "--target",
    metavar="NAME",
    default=DEFAULT_TARGET,
    show_default=True,
    callback=_target,
    help="The processor. A wrong name prints the list of all names.",
)
@click.option(
    "--real", type=click.Choice((*REALS, *INTEGERS)), default="float", show_default=True, help="Number types."
)
@click.option(
    "--outputs",
    metavar="LIST",
    default=",".join(map(str, USUAL)),
    show_default=True,
    callback=quantities_of,
    help="What is computed.",
)
@click.option(
    "--wrt",
    metavar="LIST",
    default="",
    callback=names_of,
    help="Parameters, such as a2,d3, and entries of the table, such as a_elbow, that are arguments of the kernels; dh "
    "means all entries.",
)
@json_option
def size_command(
    file: Path, target: Target, real: str, outputs: tuple[Quantity, ...], wrt: tuple[str, ...], as_json: bool
) -> None:
    """Compiles each kernel by itself with the cross compiler of a target and runs it on an emulated board.

    \b
    function       bytes of the kernel function itself
    flash          the same with the sine-cosine pair and the compiler's library routines that it calls
    stack          bytes of stack that one call uses
    instructions   of one call (on an AVR: cycles); two numbers if the count depends on the angles

    Counts are exact and repeatable. They are not cycles: flash wait states and FPU latency add to them.
    """  # noqa: D301 - click wants the character, not the two letters
    from kinegen.backends.scalar_types import ScalarType
    from kinegen.driver.pipeline import lower_file
    from kinegen.support.naming import Q30
    from kinegen.verify.boards.cost import measure
    from kinegen.verify.records import reasons

    kernels = lower_file(file, outputs, wrt)
    # Of several number types, those that the target has.
    reals: tuple[str, ...] = tuple(map(ScalarType, (REALS | INTEGERS)[real]))
    if len(reals) > 1:
        reals = tuple(each for each in reals if each in target.reals)
    if real in INTEGERS:
        reals = (Q30,) if real == Q30 else (*reals, Q30)
    costs = [cost for each in reals for cost in measure(kernels, each, target)]
    left_out = [str(each) for each in kernels.solvers if each != NUMERIC_INVERSE]
    if as_json:
        document: Record = {"file": str(file), "robot": kernels.robot.name, "target": target.name}
        say(document_text({**document, "costs": [cost.record() for cost in costs], "left_out": left_out}))
        return
    say(strong(f"{shown(file)} on {target.name}: {target.title}"))
    say(faint(f"  {costs[0].compiler}, {target.board} in {target.emulator.command[0]}"))
    say("\n".join(f"  {line}" for line in _cost_table(costs)))
    for output in left_out:
        say(f"  {output} is not measured: what a call costs depends on its target, and on the calls before it")
    for reason in reasons(costs):
        say(f"  {reason}; the stack then does not include the arithmetic routines of the compiler's library")


def _cost_table(costs: list[Cost]) -> list[str]:
    from kinegen.verify.boards.cost import better

    rows = [("kernel", "real", "flags", "function", "flash", "stack", costs[0].unit, "", "operations")]
    for cost in costs:
        rivals = [other for other in costs if (other.name, other.real) == (cost.name, cost.real)]
        first = cost is rivals[0]
        rows.append(
            (
                cost.name if first else "",
                cost.real if first else "",
                cost.optimisation,
                str(cost.function_flash),
                str(cost.flash),
                str(cost.stack),
                str(cost.calls or "-"),
                "better" if cost is better(rivals) else "",
                str(cost.operations or "-") if first else "",
            )
        )
    lines = columns(rows, left=frozenset({0, 1, 2, 7, 8}))
    return [strong(lines[0]), *(line.replace("better", good("better")) for line in lines[1:])]


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
@click.option("--force", is_flag=True, help="Also replace files in DIR/NAME that kinegen did not write.")
@json_option
@click.pass_context
def prove_command(
    context: click.Context,
    file: Path,
    real: str,
    outputs: tuple[Quantity, ...],
    output: Path | None,
    force: bool,
    as_json: bool,
) -> int:
    """Analyses each scalar C function of a robot with Eva, the value analysis of Frama-C, which has to be installed.

    Eva considers every input at once and raises an alarm at each operation that might fail: a read of memory that is
    not set, an access outside an array, an overflow, a division by zero. No alarm is a proof that there is no such
    error. An alarm is not a proof that there is one.

    The exit status is 0 if what is claimed of every function was shown, 1 if not, 2 if Frama-C is not installed.

    \b
        kinegen prove robots/puma560.yaml --real float
        kinegen prove arm.yaml --outputs pose,jacobian,inverse -o evidence
    """  # noqa: D301 - click's mark of a paragraph that stays as it is
    from kinegen.backends.scalar_types import ScalarType
    from kinegen.driver.pipeline import lower_file
    from kinegen.verify.frama_c.eva import prove, require_program

    try:
        require_program()
    except MissingToolError as error:
        complain_of(error, context)
        return _MISSING
    kernels = lower_file(file, outputs)
    if output is not None:
        _check(output / kernels.robot.name, force=force)
    reals = (
        tuple(map(ScalarType, REALS[real]))
        if real in REALS
        else tuple(map(ScalarType, REALS["both"] * (real == "all")))
    )
    evidence = prove(kernels, reals, integers=real in INTEGERS, report=(lambda _: None) if as_json else _progress)
    document = document_text({"file": str(file), **evidence.record()})
    lines = _report(file, evidence)
    # Kept before anything is printed: whoever reads the report may stop before its end.
    folder = None if output is None else _keep(output, evidence, document, lines, force=force)
    say(document if as_json else "\n".join(lines))
    if folder is not None and not as_json:
        say(faint(f"evidence in {shown(folder)}"))
    return 0 if evidence.holds else 1


def _progress(finding: Finding) -> None:
    """Print one line as soon as a function is done."""
    word = good("shown") if finding.holds else bad(_failure(finding))
    say(f"  {finding.subject.function:<32}  {finding.seconds:5.1f} s  {word}")


def _failure(finding: Finding) -> str:
    """Return why something was not shown."""
    outcome = finding.outcome
    if outcome.alarms > 0:
        return f"{outcome.alarms} alarm{'s' * (outcome.alarms > 1)}"
    if outcome.alarms < 0:
        return "the end of the program is not reached"
    return f"not shown: {outcome.open} assertions open, {outcome.unreached} statements not reached"


def _report(file: Path, evidence: Evidence) -> list[str]:
    """Return the report for people."""
    from kinegen.verify.frama_c.eva import command_for

    count = sum(finding.holds for finding in evidence.findings)
    total = len(evidence.findings)
    word = good("no run-time error") if evidence.holds else bad("not shown for all functions")
    head = f"{shown(file)}: {word} ({count} of {total} functions, Frama-C {evidence.version}, Eva)"
    # What was shown of each function, and what each claim means.
    lines = ["", strong(head), *(f"  {line}" for line in _table(evidence)), ""]
    claims = dict.fromkeys(str(finding.subject.driver.claim) for finding in evidence.findings)
    lines += [f"  {claim}: {_CLAIMS[claim]}" for claim in claims]
    for output, reason in evidence.left_out:
        lines.append(f"  {output} was not analysed: {reason}")
    ranges = dict.fromkeys(each for finding in evidence.findings for each in finding.subject.ranges)
    # Under which assumptions.
    if evidence.parameters:
        values = ", ".join(f"{name} = {value:.6g}" for name, value in evidence.parameters)
        lines.append(f"  runtime parameters have the values of the file: {values}")
    if ranges:
        lines += ["", "  ranges of the inputs", *(f"    {line}" for line in _ranges(tuple(ranges)))]
    # What was not shown, and how to see it again.
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


def _check(folder: Path, *, force: bool) -> None:
    """Refuse the folder of the evidence before the analysis."""
    from kinegen.support.files.manifest import check_place
    from kinegen.support.files.write import check_files

    check_place(folder)
    check_files(folder, {"report.txt": "", "report.json": ""}, stale=lambda _: True, force=force)


def _keep(output: Path, evidence: Evidence, document: str, lines: list[str], *, force: bool) -> Path:
    """Write the evidence; what an earlier run kept there is replaced."""
    from kinegen.support.files.write import write_files

    folder = output / evidence.robot
    text = click.unstyle("\n".join(lines)).lstrip("\n") + "\n"
    write_files(folder, evidence.files(text, document + "\n"), stale=lambda _: True, force=force)
    return folder
