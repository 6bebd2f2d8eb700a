"""The C compiler of this machine, and the machine's processor."""

from __future__ import annotations

import hashlib
import os
import platform
import shutil
import subprocess
import time
from functools import cache
from pathlib import Path
from threading import Event

from kinegen.errors import CompileError, MissingToolError
from kinegen.support.dataclass import dataclass
from kinegen.support.system import end_group, words

_NAMES = ("cc", "gcc", "clang")
_HELPERS = ("as", "ld")
"""Programs besides the compiler itself that a wrapper or a compiler finds on the PATH."""
_VARIABLES = (
    *("CPATH", "C_INCLUDE_PATH", "LIBRARY_PATH", "LD_RUN_PATH", "GCC_EXEC_PREFIX", "COMPILER_PATH"),
    *("CCC_OVERRIDE_OPTIONS", "SDKROOT", "MACOSX_DEPLOYMENT_TARGET", "SOURCE_DATE_EPOCH"),
)
"""Variables of the environment that change what compilers make of the same words."""
_SECONDS = "KINEGEN_COMPILER_SECONDS"
_PATIENCE = 1800.0
"""Seconds that one call of a compiler may take, unless the variable says otherwise."""
_SMALL = 1 << 20
"""Bytes up to which a compiler is taken for a wrapper and read."""
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
        identity: The programs that the command consists of and leads to, and the variables that they heed.
    """

    command: tuple[str, ...]
    version: str
    identity: tuple[str, ...] = ()

    @property
    def scheduling(self) -> tuple[str, ...]:
        """Flags that suit long straight loops.

        gcc keeps the order of the source for x86 and so waits for results; told to look for another one before it
        gives out registers, it gains 5 percent with AVX-512, 16 with AVX2 and 31 with SSE2, and the bits stay.
        """
        return ("-fschedule-insns", "-fsched-pressure") if self._is_gcc else ()

    @property
    def haste(self) -> tuple[str, ...]:
        """Flags that suit functions of thousands of lines, instead of `scheduling`.

        The search for another order, the joining of instructions, the assignment of registers and values that are
        computed earlier take gcc a time that grows with the square of such a function's length. The loops stay vectors
        and the bits stay. Registers given out by priority take a quarter less of gcc's time than by colouring, and
        kernels of 240 rows a tenth to a fifth less of theirs. Where known values are not looked for across blocks,
        constants are loaded as they are used and not kept in registers, of which there are too few: that is a third
        less of gcc's time for kernels of one configuration, and a quarter less of theirs.
        """
        flags = "--param=max-combine-insns=2", "-fira-region=one", "-fira-algorithm=priority", "-fno-gcse"
        known = "-fno-rerun-cse-after-loop", "-fno-cse-follow-jumps", "-fno-tree-pre", "-fno-predictive-commoning"
        return (*flags, *known) if self._is_gcc else ()

    @property
    def _is_gcc(self) -> bool:
        return "Free Software Foundation" in self.version

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
            raise CompileError(f"{self.command[0]} refuses {subject}: {first_errors(done)}")


def first_errors(done: subprocess.CompletedProcess[str]) -> str:
    """The first errors that a tool reports, in one line."""
    lines = [line.strip() for line in done.stderr.splitlines() if line.strip()]
    errors = [line for line in lines if "error" in line.lower()] or lines
    return "; ".join(errors[:_LINES]) or f"it ended with status {done.returncode}"


def find_compiler() -> Compiler:
    """Find the C compiler: the one named in the environment as CC, else cc, gcc or clang.

    Returns:
        The compiler.

    Raises:
        MissingToolError: If none is named and none is there.
        CompileError: If the one that CC names is not there, or does not run.
    """
    try:
        named = words(os.environ.get("CC", ""))
    except ValueError as error:
        raise CompileError(f"CC is not a command: {str(error).lower()} in {os.environ['CC']!a}") from None
    if named and not shutil.which(named[0]):
        raise CompileError(f"CC names {named[0]}, which does not exist or is not a program; correct it or unset CC")
    for command in [named] if named else [[name] for name in _NAMES]:
        if shutil.which(command[0]):
            done = _run((*command, "--version"), Path.cwd())
            return Compiler(tuple(command), done.stdout + done.stderr, _identity(command))
    wanted = f"none of {', '.join(_NAMES)} was found"
    raise MissingToolError(f"there is no C compiler ({wanted}): install one, for example with `apt install gcc`")


def _identity(command: list[str]) -> tuple[str, ...]:
    """What tells one compiler from another that says the same of itself: a wrapper, and what it may lead to."""
    programs = [_program(word) for word in dict.fromkeys((*command, *_NAMES, *_HELPERS))]
    return (*filter(None, programs), *(f"{name}={os.environ[name]}" for name in _VARIABLES if name in os.environ))


def _program(word: str) -> str:
    """A program by its place, size and time, and a small one by its bytes; empty for a word that is none."""
    found = shutil.which(word)
    if found is None:
        return ""
    path = Path(os.path.realpath(found))
    try:
        status = path.stat()
        digest = hashlib.sha256(path.read_bytes()).hexdigest() if status.st_size < _SMALL else ""
    except OSError:
        return str(path)
    return f"{path} {status.st_size} {status.st_mtime_ns} {digest}"


def _patience() -> float:
    """Seconds that one call may take."""
    text = os.environ.get(_SECONDS, "")
    try:
        seconds = float(text) if text else _PATIENCE
    except ValueError:
        seconds = 0.0
    if not seconds > 0:
        raise CompileError(f"{_SECONDS} is {text!a}, expected a number of seconds")
    return seconds


def _run(command: tuple[str, ...], folder: Path, stop: Event | None = None) -> subprocess.CompletedProcess[str]:
    if stop and stop.is_set():
        return subprocess.CompletedProcess(command, 1, "", "it was not begun")
    deadline = time.monotonic() + (patience := _patience())
    with _started(command, folder) as process:
        while True:
            try:
                output, errors = process.communicate(timeout=_GLANCE)
            except subprocess.TimeoutExpired:
                if stop and stop.is_set():
                    end_group(process)
                elif time.monotonic() > deadline:
                    end_group(process)
                    told = f"it was stopped after {patience:g} s; {_SECONDS} can name more"
                    return subprocess.CompletedProcess(command, 1, "", f"error: {told}")
                continue
            except BaseException:
                end_group(process)
                raise
            return subprocess.CompletedProcess(command, process.returncode, output, errors)


def _started(command: tuple[str, ...], folder: Path) -> subprocess.Popen[str]:
    """Start a program in a session of its own, so that it can be ended with all that it started."""
    try:
        return subprocess.Popen(
            command,
            cwd=folder,
            env=os.environ | {"LC_ALL": "C"},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            start_new_session=True,
        )
    except OSError as error:
        raise CompileError(f"{command[0]} cannot be run: {error.strerror or error}") from None


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
