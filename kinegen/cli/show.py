"""`kinegen show`: the table and the closed form, as a textbook prints them."""

from __future__ import annotations

import click

from kinegen.cli.robot_command import RobotCommand
from kinegen.cli.terminal import say, strong, width
from kinegen.outputs import Reference

OUTPUTS = {
    "pose": None,
    "jacobian": Reference.LOCAL_WORLD_ALIGNED,
    "jacobian_local": Reference.LOCAL,
    "jacobian_world": Reference.WORLD,
}
FORMATS = ("text", "latex", "mathml", "python")


@click.command("show", cls=RobotCommand, short_help="Prints the closed form.")
@click.argument("file", type=click.Path())
@click.option("--format", "notation", type=click.Choice(FORMATS), default="text", show_default=True, help="Notation.")
@click.option(
    "--output",
    type=click.Choice(tuple(OUTPUTS)),
    default="pose",
    show_default=True,
    help="The pose, or the geometric Jacobian, rows linear velocity and then angular: at the frame's origin in the "
    "axes of the base, in the frame's own axes (local), or at the origin of the base (world).",
)
@click.option("--from", "start", metavar="FRAME", help="Frame of reference, by name or row number; 0 is before row 1.")
@click.option("--to", "end", metavar="FRAME", help="Frame whose pose is printed; by default the tool, or every tip.")
@click.option("--steps", is_flag=True, help="Also print every link matrix on the way.")
def command(file: str, notation: str, output: str, start: str | None, end: str | None, steps: bool) -> None:
    """Prints the table and the closed form of a robot, factored as a textbook prints it.

    c1 and s1 are the cosine and sine of the first joint variable, c23 is cos(q2 + q3). Examples for the whole chain,
    from base to tool, and for a part of it:

    \b
        kinegen show robots/puma560.yaml
        kinegen show robots/puma560.yaml --from 3 --to 6
        kinegen show robots/scara.yaml --output jacobian
        kinegen show robots/puma560.yaml --format latex > puma560.tex
    """  # noqa: D301 - click's mark of a paragraph that stays as it is
    from kinegen.formats.load import load
    from kinegen.textbook.sheet import make_sheet

    sheet = make_sheet(load(file), start, end, steps=steps, jacobian=OUTPUTS[output])
    match notation:
        case "text":
            from kinegen.textbook.sheet_text import text_sheet

            say(text_sheet(sheet, width(), strong))
        case "latex":
            from kinegen.textbook.sheet_latex import latex_sheet

            say(latex_sheet(sheet))
        case "mathml":
            from kinegen.textbook.sheet_mathml import mathml_sheet

            say(mathml_sheet(sheet))
        case _:
            from kinegen.textbook.sheet_python import python_sheet

            say(python_sheet(sheet))
