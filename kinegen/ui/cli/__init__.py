"""The command line: arguments in, messages out.

Errors that a user can mend are one line on stderr and exit status 1; `--debug` adds the traceback. Wrong usage is one
line too, and exit status 2; Ctrl-C exits with 130. Nothing heavy is imported before a command runs, so that help comes
at once.
"""

from __future__ import annotations

import atexit
import gc
import importlib
import io
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress

import click

from kinegen import __version__
from kinegen.errors import KinegenError, OutputError, nearest
from kinegen.ui.cli.terminal import complain, discard_output, remembering

COMMANDS = {
    "build": "build",
    "show": "show",
    "view": "view",
    "check": "check",
    "convert": "convert",
    "compare": "convert",
    "inspect": "inspect",
    "fk": "show",
    "eval": "eval",
    "doctor": "measurements",
    "calibrate": "measurements",
    "size": "firmware",
    "prove": "firmware",
    "workspace": "workspace",
    "schema": "check",
}
"""The subcommands and the modules that have them; `build` is `build_command` there."""

INTERRUPTED = 130
"""What a shell reports of a program that Ctrl-C ended."""

_STARVED = ("failed to map segment", "cannot allocate memory", "Cannot allocate memory", "can't start new thread")
"""What libraries and Python say where memory or threads run out."""

_COLLECTED = 100_000
"""After how many new objects Python looks for cycles while a command runs. After its own number of 700 that takes a
twentieth of the time of a build, and after 10,000 a fiftieth of that of `kinegen show`: most objects are parts of
modules and expressions, which stay."""

_RESERVE = 4 << 20
"""Bytes that are free for the message when memory is at its end; the system counts them only where they are written."""

CLOSED_PIPE = 141
"""What a shell reports of a program whose reader went away, as `head` does."""


def command_of(name: str) -> click.Command:
    """Return a subcommand, imported now."""
    command: click.Command = getattr(importlib.import_module(f"kinegen.ui.cli.{COMMANDS[name]}"), f"{name}_command")
    return command


class _LateGroup(click.Group):
    """Imports a subcommand when it is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Return the subcommands, in the order of their use."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002
        """Return one subcommand."""
        return command_of(cmd_name) if cmd_name in COMMANDS else None

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the subcommand of a command line; a name that is nearly that of one is told."""
        if args[0] not in COMMANDS and not args[0].startswith("-"):
            near = nearest(args[0], COMMANDS)
            ctx.fail(f"No such command '{args[0]}'{f' (did you mean {near}?)' if near else ''}")
        return super().resolve_command(ctx, args)


@click.command(cls=_LateGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="kinegen", message="%(prog)s %(version)s")
@click.option("--debug", is_flag=True, help="Show the traceback of an error.")
def _kinegen(debug: bool) -> None:
    """Compiles robot kinematics: a Denavit-Hartenberg table in; closed form, C and Python out."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line with some arguments, by default those of the process; returns the exit status."""
    if argv is None:
        # The process ends with this command, and the system takes the memory back: no search for cycles at the end.
        atexit.register(gc.freeze)
    _open_streams()
    if isinstance(sys.stdout, io.TextIOWrapper):
        # A terminal that lacks a character of a robot's description gets an escape, not a traceback.
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        with remembering(), _collecting_rarely():
            status = _run(list(sys.argv[1:] if argv is None else argv))
        sys.stdout.flush()
    except KeyboardInterrupt:
        complain("interrupted")
        return INTERRUPTED
    except BrokenPipeError:
        discard_output()
        return CLOSED_PIPE
    except OSError as error:
        discard_output()
        complain(f"error: {_reason(error)}")
        return 1
    return status


@contextmanager
def _collecting_rarely() -> Iterator[None]:
    """Look for cycles of objects less often, and as often as before afterwards."""
    before = gc.get_threshold()
    if before[0]:  # otherwise it is switched off
        gc.set_threshold(max(before[0], _COLLECTED), *before[1:])
    try:
        yield
    finally:
        gc.set_threshold(*before)


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


def _run(arguments: list[str]) -> int:
    if "_KINEGEN_COMPLETE" in os.environ:
        # How click asks for completions in a shell.
        _kinegen.main(arguments, prog_name="kinegen")
    context = None
    try:
        with _kinegen.make_context("kinegen", arguments) as context:
            return _invoke(context)
    except click.exceptions.Exit as stop:
        return stop.exit_code
    except click.UsageError as error:
        if isinstance(error, getattr(click.exceptions, "NoArgsIsHelpError", ())):
            error.show()
            return error.exit_code
        complain(f"error: {_usage(error, context)}")
        return error.exit_code
    except click.ClickException as error:
        error.show()
        return error.exit_code


def _usage(error: click.UsageError, context: click.Context | None) -> str:
    """Return what is wrong with the arguments; where that does not say what would be right, the help does.

    Errors of the parser have no context; the group, which is `context`, knows the subcommand that began.
    """
    message = " ".join(error.format_message().split()).rstrip(".")
    if isinstance(error, click.BadParameter) and not isinstance(error, click.MissingParameter):
        return message
    begun = f"kinegen {context.invoked_subcommand}" if context and context.invoked_subcommand else "kinegen"
    return f"{message}; see '{error.ctx.command_path if error.ctx else begun} --help'"


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
            discard_output()
        from kinegen.ui.cli.robot_command import complain_of

        complain_of(reason, context)
        return 1


def _reason(error: Exception) -> str:
    """Return what a user can do something about, in a line; empty for anything else, which is a bug of ours."""
    if isinstance(error, KinegenError):
        return str(error)
    words = str(error)
    starved = isinstance(error, MemoryError | SystemError) or any(sign in words for sign in _STARVED)
    if starved and isinstance(error, MemoryError | SystemError | ImportError | RuntimeError | OSError):
        return "there is not enough memory, or a limit on memory or threads is too low (see ulimit -a)"
    if isinstance(error, OSError):
        return f"{error.strerror or error}: {error.filename}" if error.filename else error.strerror or words
    return ""
