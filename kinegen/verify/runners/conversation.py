"""A tool that stays: it reads a line for each call and answers with lines, the last one `ready` or `wrong: ...`."""

from __future__ import annotations

import subprocess
import threading
import weakref
from pathlib import Path
from typing import IO

from kinegen.errors import CompileError
from kinegen.verify.runners.runner import PATIENCE

READY = "ready"
WRONG = "wrong: "


class Conversation:
    """One process of a tool, which ends with this object.

    Args:
        command: The tool and its arguments.
        folder: Working folder.
        title: How messages name the tool.

    Raises:
        CompileError: If the tool cannot be run.
    """

    def __init__(self, command: tuple[str, ...], folder: Path, title: str) -> None:
        self._title = title
        try:
            self._process = subprocess.Popen(
                command,
                cwd=folder,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                text=True,
                encoding="utf-8",
            )
        except OSError as error:
            raise CompileError(f"{command[0]} cannot be run: {error.strerror}") from error
        weakref.finalize(self, _end, self._process)

    def ask(self, line: str, subject: str) -> list[str]:
        """Ask for something.

        Args:
            line: What the tool reads.
            subject: What is asked for, for the message.

        Returns:
            The lines before the answer.

        Raises:
            CompileError: If the answer is not `ready`, or there is none within `PATIENCE`.
        """
        timer = threading.Timer(PATIENCE, self._process.kill)
        timer.start()
        try:
            found = _talk(self._process.stdin, self._process.stdout, line)
        finally:
            timer.cancel()
        if found[-1] != READY:
            raise CompileError(f"{self._title} refuses {subject}: {found[-1].removeprefix(WRONG) or 'it has ended'}")
        return found[:-1]


def _talk(asked: IO[str] | None, answers: IO[str] | None, line: str) -> list[str]:
    """Ask, and read up to the answer, which is empty where the process has ended."""
    if asked is None or answers is None:
        return [""]
    try:
        asked.write(f"{line}\n\n")  # Octave has a line when it has seen what follows
        asked.flush()
    except BrokenPipeError:
        return [""]
    found = [""]
    while not (found[-1] == READY or found[-1].startswith(WRONG)):
        read = answers.readline()
        found.append(read.rstrip("\n"))
        if not read:
            break
    return found[1:]


def _end(process: subprocess.Popen[str]) -> None:
    """End a process that waits for a line."""
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            pipe.close()
    try:
        process.wait(timeout=5)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
