"""IPython: `%load_ext kinegen`, then robots in cells with `%%robot`.

In: the YAML of a cell. Out: the proven module and the robot in the namespace of the notebook, and the closed form below
the cell. A mistake is one line with the line of the cell, not a traceback.
"""

from __future__ import annotations

import shlex
import sys
from typing import TYPE_CHECKING, Any

from kinegen.api.compiling import compile  # noqa: A004 - a name of kinegen
from kinegen.api.loading import load
from kinegen.api.words import USUAL_OUTPUTS
from kinegen.errors import KinegenError, printable

if TYPE_CHECKING:
    from kinegen.api.closed_form import ClosedForm

USAGE = "%%robot [NAME] [--outputs LIST] [--real double|float|both] [--quiet]"


class _Words:
    """The words behind `%%robot`.

    Attributes:
        name: What the module is called in the notebook; the name of the robot if it is empty.
        outputs: What is computed.
        real: Number types.
        quiet: Whether the closed form is left out.
    """

    def __init__(self, line: str) -> None:
        self.name, self.outputs, self.real, self.quiet = "", USUAL_OUTPUTS, "both", False
        try:
            words = shlex.split(line)
        except ValueError as error:
            raise KinegenError(f"%%robot: {str(error).lower()}; usage: {USAGE}") from None
        while words:
            word, _, value = words.pop(0).partition("=")
            if word == "--quiet":
                self.quiet = True
            elif word in ("--outputs", "--real"):
                value = value or (words.pop(0) if words else "")
                if not value:
                    raise KinegenError(f"%%robot: {word} needs a value; usage: {USAGE}")
                setattr(self, word[2:], value)
            elif word.isidentifier() and not self.name:
                self.name = word
            else:
                raise KinegenError(f"%%robot: unexpected {word!r}; usage: {USAGE}")


def robot_cell(shell: Any, line: str, cell: str) -> ClosedForm | None:
    """Compile the robot of a cell: `%%robot [NAME] [--outputs LIST] [--real ...] [--quiet]`.

    The module gets the name of the robot in the notebook, or NAME; `NAME_robot` is the robot itself.

    Args:
        shell: The IPython shell, whose namespace gets the names.
        line: The words behind `%%robot`.
        cell: YAML, or the text of any other format that `kinegen.load` reads.

    Returns:
        The closed form of the pose, which the notebook shows; None after a mistake, or with `--quiet`.
    """
    try:
        words = _Words(line)
        robot = load(cell if "\n" in cell else f"{cell}\n")
        module = compile(robot, words.outputs, real=words.real)
        form = None if words.quiet else robot.closed_form()
    except KinegenError as error:
        # Line 1 of the cell is that with %%robot.
        place = "" if error.line is None else f"line {error.line + 1} of the cell: "
        print(f"error: {place}{printable(error.message)}", file=sys.stderr)
        return None
    name = words.name or robot.name
    shell.push({name: module, f"{name}_robot": robot})
    for note in robot.notes:
        print(f"note: {printable(note)}")
    return form


def load_ipython_extension(shell: Any) -> None:
    """What `%load_ext kinegen` calls: it adds the cell magic `%%robot`.

    Args:
        shell: The IPython shell.
    """

    def robot(line: str, cell: str) -> Any:
        return robot_cell(shell, line, cell)

    robot.__doc__ = robot_cell.__doc__
    shell.register_magic_function(robot, magic_kind="cell", magic_name="robot")
