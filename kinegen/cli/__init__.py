"""The command line: arguments in, messages out; one module per subcommand.

Errors that a user can mend are one line on stderr and exit status 1; `--debug` adds the traceback. Wrong usage is one
line too, and exit status 2; Ctrl-C exits with 130. Nothing heavy is imported before a command runs, so that help comes
at once.
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
from kinegen.errors import KinegenError, OutputError

COMMANDS = (
    "build",
    "show",
    "view",
    "check",
    "convert",
    "compare",
    "inspect",
    "fk",
    "eval",
    "doctor",
    "calibrate",
    "size",
    "prove",
    "workspace",
    "schema",
)
"""The subcommands, each in the module of that name, as its `command`."""

INTERRUPTED = 130
"""What a shell reports of a program that Ctrl-C ended."""

_STARVED = ("failed to map segment", "cannot allocate memory", "Cannot allocate memory", "can't start new thread")
"""What libraries and Python say where memory or threads run out."""

_RESERVE = 4 << 20
"""Bytes that are free for the message when memory is at its end; the system counts them only where they are written."""

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
    _open_streams()
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
        _discard_output()
        return CLOSED_PIPE
    except OSError as error:
        _discard_output()
        complain(f"error: {_reason(error)}")
        return 1
    return status


def _open_streams() -> None:
    """Give a process that was started without stdin, stdout or stderr ones that lead nowhere.

    Otherwise the next file that is opened would take their place.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            mode = "r" if number == 0 else "w"
            with suppress(OSError):
                handle = os.open(os.devnull, os.O_RDWR)
                if handle != number:
                    os.dup2(handle, number)
                    os.close(handle)
                setattr(sys, name, open(number, mode, encoding="utf-8", closefd=False))  # noqa: SIM115


def _discard_output() -> None:
    """Python flushes stdout once more at exit, and must not fail at it again."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _run(arguments: list[str]) -> int:
    if "_KINEGEN_COMPLETE" in os.environ:
        # How click asks for completions in a shell.
        _kinegen.main(arguments, prog_name="kinegen")
    try:
        with _kinegen.make_context("kinegen", arguments) as context:
            return _invoke(context)
    except click.exceptions.Exit as stop:
        return stop.exit_code
    except click.UsageError as error:
        if isinstance(error, getattr(click.exceptions, "NoArgsIsHelpError", ())):
            error.show()
            return error.exit_code
        complain(f"error: {_usage(error)}")
        return error.exit_code
    except click.ClickException as error:
        error.show()
        return error.exit_code


def _usage(error: click.UsageError) -> str:
    """What is wrong with the arguments; where that does not say what would be right, the help does."""
    message = " ".join(error.format_message().split()).rstrip(".")
    if isinstance(error, click.BadParameter) and not isinstance(error, click.MissingParameter):
        return message
    return f"{message}; see '{error.ctx.command_path if error.ctx else 'kinegen'} --help'"


def _invoke(context: click.Context) -> int:
    reserve = bytearray(_RESERVE)
    try:
        return int(_kinegen.invoke(context) or 0)
    except (BrokenPipeError, click.exceptions.Exit, click.ClickException):
        raise
    except Exception as error:
        del reserve
        reason = _reason(error)
        if not reason:
            raise
        if context.params["debug"]:
            import traceback

            traceback.print_exc()
        if isinstance(error, OutputError):
            _discard_output()
        complain(f"error: {reason}")
        return 1


def _reason(error: Exception) -> str:
    """What a user can do something about, in a line; empty for anything else, which is a bug of ours."""
    if isinstance(error, KinegenError):
        return str(error)
    words = str(error)
    starved = isinstance(error, MemoryError | SystemError) or any(sign in words for sign in _STARVED)
    if starved and isinstance(error, MemoryError | SystemError | ImportError | RuntimeError | OSError):
        return "there is not enough memory, or a limit on memory or threads is too low (see ulimit -a)"
    if isinstance(error, OSError):
        return f"{error.strerror or error}: {error.filename}" if error.filename else error.strerror or words
    return ""
