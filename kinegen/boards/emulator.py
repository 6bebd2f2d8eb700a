"""Runs programs on emulated boards."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

from kinegen.boards.targets import Target
from kinegen.boards.toolchain import require
from kinegen.errors import KinegenError

SECONDS = (120, 240)
"""After this time a program is taken to hang; on a busy machine it is given a second try."""

_COLOUR = re.compile(r"\x1b\[[0-9;]*m")


class HungError(KinegenError):
    """A program that did not end in time."""


def run_program(target: Target, program: Path) -> list[str]:
    """Run a program on the emulated board of a target.

    Args:
        target: The processor.
        program: The linked program.

    Returns:
        The lines that it wrote.

    Raises:
        MissingToolError: If the emulator is not installed.
        HungError: If the program has not ended in time, twice.
        KinegenError: If it faults or ends with another status than 0.
    """
    command = target.emulator.command
    require(command[0], (target.emulator.package,))
    where = f"{program.name} on {target.board} ({command[0]})"
    done = next((ended for seconds in SECONDS if (ended := _ended((*command, str(program)), seconds))), None)
    if done is None:
        raise HungError(f"{where} has not ended after {SECONDS[0]} s, and not after {SECONDS[-1]} s")
    if done.returncode:
        last = (done.stdout + done.stderr).strip().splitlines()[-3:]
        raise KinegenError(f"{where} ended with status {done.returncode}: {'; '.join(last)}")
    text = done.stdout if target.emulator.stream == "stdout" else done.stderr
    return [line for line in map(_plain, text.splitlines()) if line]


def _ended(command: tuple[str, ...], seconds: float) -> subprocess.CompletedProcess[str] | None:
    """What a command did; None if it has not ended after some seconds."""
    try:
        return subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=seconds,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return None


def _plain(line: str) -> str:
    """A line without the colours in which simavr shows what a serial port sends, and without its dot for a line end."""
    return _COLOUR.sub("", line).rstrip().removesuffix(".")
