"""The C compiler of this machine, and the machine's processor."""

from __future__ import annotations

import hashlib
import os
import platform
import shlex
import shutil
import subprocess
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from threading import Event

from kinegen.errors import CompileError, MissingToolError

_NAMES = ("cc", "gcc", "clang")
_LINES = 3
"""Lines of the compiler's words that a message repeats."""
_GLANCE = 0.2
"""Seconds between two looks at whether a running compiler is still wanted."""


@dataclass(frozen=True, slots=True)
class Compiler:
    """A C compiler.

    Attributes:
        command: How to call it.
        version: What it says about itself.
    """

    command: tuple[str, ...]
    version: str

    @property
    def scheduling(self) -> tuple[str, ...]:
        """Flags that suit long straight loops.

        gcc keeps the order of the source for x86 and so waits for results; told to look for another one before it
        gives out registers, it gains 5 percent with AVX-512, 16 with AVX2 and 31 with SSE2, and the bits stay.
        """
        return ("-fschedule-insns", "-fsched-pressure") if "Free Software Foundation" in self.version else ()

    def run(self, folder: Path, arguments: tuple[str, ...], subject: str, stop: Event | None = None) -> None:
        """Call it in a folder.

        Args:
            folder: Working folder.
            arguments: What follows the command.
            subject: What is being made, for the message.
            stop: Once it is set, the compiler is ended if it runs and not begun if it does not.

        Raises:
            CompileError: With the compiler's first words, if it fails or is ended.
        """
        done = _run((*self.command, *arguments), folder, stop)
        if done.returncode:
            lines = [line.strip() for line in done.stderr.splitlines() if line.strip()]
            errors = [line for line in lines if "error" in line.lower()] or lines
            reason = "; ".join(errors[:_LINES]) or f"it ended with status {done.returncode}"
            raise CompileError(f"{self.command[0]} refuses {subject}: {reason}")


def find_compiler() -> Compiler:
    """Find the C compiler: the one named in the environment as CC, else cc, gcc or clang.

    Returns:
        The compiler.

    Raises:
        CompileError: If there is none.
    """
    named = shlex.split(os.environ.get("CC", ""))
    for command in [named] if named else [[name] for name in _NAMES]:
        if shutil.which(command[0]):
            done = _run((*command, "--version"), Path.cwd())
            return Compiler(tuple(command), done.stdout + done.stderr)
    wanted = f"CC names {named[0]}, which does not exist" if named else f"none of {', '.join(_NAMES)} was found"
    raise MissingToolError(f"there is no C compiler ({wanted}): install one, for example with `apt install gcc`")


def _run(command: tuple[str, ...], folder: Path, stop: Event | None = None) -> subprocess.CompletedProcess[str]:
    if stop and stop.is_set():
        return subprocess.CompletedProcess(command, 1, "", "it was not begun")
    with subprocess.Popen(
        command,
        cwd=folder,
        env=os.environ | {"LC_ALL": "C"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
    ) as process:
        while True:
            try:
                output, errors = process.communicate(timeout=_GLANCE)
            except subprocess.TimeoutExpired:
                if stop and stop.is_set():
                    process.kill()
                continue
            except BaseException:
                process.kill()
                raise
            return subprocess.CompletedProcess(command, process.returncode, output, errors)


@dataclass(frozen=True, slots=True)
class Processor:
    """The processor of this machine.

    Attributes:
        machine: Its family, such as x86_64.
        features: Digest of the model and instructions that the system reports.
    """

    machine: str
    features: str

    def describe(self) -> str:
        """A text that differs between processors for which `-march=native` may differ."""
        return f"{self.machine} {self.features}"


@cache
def processor() -> Processor:
    """The processor of this machine."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = [platform.processor()]
    told = {line for line in lines if line.startswith(("model name", "flags", "Features", "CPU"))} or set(lines)
    return Processor(platform.machine(), hashlib.sha256("\n".join(sorted(told)).encode()).hexdigest())
