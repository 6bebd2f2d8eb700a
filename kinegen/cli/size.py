"""`kinegen size`: flash, stack and instructions of the kernels on a microcontroller."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kinegen import __version__
from kinegen.api.options import INTEGERS, REALS
from kinegen.cli.build import names_of, quantities_of
from kinegen.cli.robot_command import RobotCommand
from kinegen.cli.terminal import faint, good, say, strong
from kinegen.errors import KinegenError, shown
from kinegen.lines import columns
from kinegen.outputs import USUAL, Quantity

if TYPE_CHECKING:
    from kinegen.boards.figures import Cost
    from kinegen.boards.targets import Target

DEFAULT_TARGET = "cortex-m4f"


def _target(_context: click.Context, _parameter: click.Parameter, name: str) -> Target:
    from kinegen.boards.targets import find_target

    try:
        return find_target(name)
    except KinegenError as error:
        raise click.BadParameter(error.message) from error


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
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document on stdout and nothing else.")
def command(
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
    from kinegen.boards.cost import measure
    from kinegen.boards.figures import reasons
    from kinegen.emit.reals import Real
    from kinegen.naming import Q30
    from kinegen.pipeline import lower_file

    kernels = lower_file(file, outputs, wrt)
    reals: tuple[str, ...] = tuple(map(Real, (REALS | INTEGERS)[real]))
    if len(reals) > 1:
        reals = tuple(each for each in reals if each in target.reals)
    if real in INTEGERS:
        reals = (Q30,) if real == Q30 else (*reals, Q30)
    costs = [cost for each in reals for cost in measure(kernels, each, target)]
    if as_json:
        document = {"kinegen": __version__, "format": 1, "file": str(file), "robot": kernels.robot.name}
        say(json.dumps({**document, "target": target.name, "costs": [cost.record() for cost in costs]}, indent=2))
        return
    say(strong(f"{shown(file)} on {target.name}: {target.title}"))
    say(faint(f"  {costs[0].compiler}, {target.board} in {target.emulator.command[0]}"))
    say("\n".join(f"  {line}" for line in _table(costs)))
    for reason in reasons(costs):
        say(f"  {reason}; the stack then does not include the arithmetic routines of the compiler's library")


def _table(costs: list[Cost]) -> list[str]:
    from kinegen.boards.cost import better

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
