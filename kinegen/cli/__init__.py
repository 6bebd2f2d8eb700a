"""The command line: arguments in, messages out; one module per subcommand.

Errors that a user can mend are one line on stderr and exit status 1; `--debug` adds the traceback. Wrong usage exits
with 2, Ctrl-C with 130. Nothing heavy is imported before a command runs, so that help comes at once.
"""

from __future__ import annotations

import importlib
import io
import os
import sys
from collections.abc import Sequence
from contextlib import suppress

import click

from kinegen import __version__
from kinegen.cli.interrupt import remembering
from kinegen.cli.terminal import complain
from kinegen.errors import KinegenError

COMMANDS = ("build", "show", "check", "inspect", "fk", "size", "workspace", "schema")
"""The subcommands, each in the module of that name, as its `command`."""

INTERRUPTED = 130
"""What a shell reports of a program that Ctrl-C ended."""

CLOSED_PIPE = 141
"""What a shell reports of a program whose reader went away, as `head` does."""


class _LateGroup(click.Group):
    """Imports a subcommand when it is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """The subcommands, in the order of their use."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002
        """One subcommand."""
        if cmd_name not in COMMANDS:
            return None
        command: click.Command = importlib.import_module(f"kinegen.cli.{cmd_name}").command
        return command


@click.command(cls=_LateGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="kinegen", message="%(prog)s %(version)s")
@click.option("--debug", is_flag=True, help="Show the traceback of an error.")
def _kinegen(debug: bool) -> None:
    """Compiles robot kinematics: a Denavit-Hartenberg table in; closed form, C and Python out."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        argv: The arguments after the program's name; those of the process if left out.

    Returns:
        The exit status.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):
        # A terminal that lacks a character of a robot's description gets an escape, not a traceback.
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        with remembering():
            status = _run(list(sys.argv[1:] if argv is None else argv))
        sys.stdout.flush()
    except KeyboardInterrupt:
        complain("interrupted")
        return INTERRUPTED
    except BrokenPipeError:
        # Python flushes once more at exit and must not find the closed pipe again.
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return CLOSED_PIPE
    return status


def _run(arguments: list[str]) -> int:
    if "_KINEGEN_COMPLETE" in os.environ:
        # How click asks for completions in a shell.
        _kinegen.main(arguments, prog_name="kinegen")
    try:
        with _kinegen.make_context("kinegen", arguments) as context:
            return _invoke(context)
    except click.exceptions.Exit as stop:
        return stop.exit_code
    except click.ClickException as error:
        error.show()
        return error.exit_code


def _invoke(context: click.Context) -> int:
    try:
        return int(_kinegen.invoke(context) or 0)
    except KinegenError as error:
        if context.params["debug"]:
            import traceback

            traceback.print_exc()
        complain(f"error: {error}")
        return 1
