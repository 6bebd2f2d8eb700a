"""The errors that kinegen reports to a person.

Every one is a `KinegenError`; the command line prints it as one line, `file:line: message`, and exits with status 1.
"""

from __future__ import annotations


def shown(text: object) -> str:
    """A name from outside as one line that is safe on a terminal: what does not print is escaped."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in str(text))


class KinegenError(Exception):
    """Something a user can mend: a robot file, a folder, a compiler.

    Args:
        message: What is wrong and what would be right, in one line.
        path: File in which it was found, as the user named it.
        line: Line in that file, counted from 1.
    """

    def __init__(self, message: str, path: str | None = None, line: int | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.path = path
        self.line = line

    def __str__(self) -> str:
        place = ":".join(str(part) for part in (self.path, self.line) if part is not None)
        return f"{place}: {self.message}" if place else self.message


class RobotFileError(KinegenError):
    """A robot file cannot be read or does not describe a robot."""


class CompileError(KinegenError):
    """The C compiler is missing or refused the emitted code."""


class MissingToolError(CompileError):
    """Something that compiling needs is not installed; the NumPy kernels work without it."""


class WriteError(KinegenError):
    """An output could not be written; the earlier output is untouched."""


class OutputError(KinegenError):
    """What a command has to say cannot be printed."""


class ProofError(KinegenError):
    """A kernel differs from the reference by more than its tolerance."""
