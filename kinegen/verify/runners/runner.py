"""What a runner is, how kernels of another process are called, and the check that their text is straight.

Why it matters is said in `kinegen.verify.source_checks`: what is straight cannot be right at all points tried and wrong
in a strip between them.
"""

from __future__ import annotations

import json
import math
import re
import subprocess
import tempfile
import threading
import weakref
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import IO, Any, Protocol

import numpy as np

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.printing import Syntax
from kinegen.errors import CompileError, ProofError
from kinegen.ir.program import Operator, Program
from kinegen.runtime.compiler import first_errors
from kinegen.support.dataclass import dataclass
from kinegen.verify.invocations import CLAMPS, DTYPES, NEAREST, Arrays

PATIENCE = 600.0
"""Seconds that one call of a tool may take."""


class Call(Protocol):
    """Evaluates a kernel."""

    def __call__(
        self, program: Program, inputs: Arrays, parameters: tuple[float, ...] | None, *, real: str, is_batch: bool
    ) -> Arrays:
        """Evaluate a kernel.

        `program`: the program that the kernel was printed from; `inputs`: its inputs, N configurations each, in the
        number type; `parameters`: values of the runtime parameters; those of the robot file if None. Returns its
        results, N configurations each, in the shapes that the program's signature gives. Raises `CompileError` if the
        tool refuses the files.
        """

    def others(self, name: str, inputs: Arrays, *, real: str) -> Arrays | None:
        """Evaluate a function beside the kernels, with the runtime parameters of the robot file.

        `name`: `inverse_nearest` (poses of the tool and joint vectors; joint vectors and flags), `within_limits` (joint
        vectors; flags), `clamp` (joint vectors; joint vectors), or `actuators_within_limits` and `clamp_actuators` (the
        same of actuator vectors); `inputs`: its inputs, N configurations each, in the number type. Returns its results,
        N configurations each, flags as numbers; None where the language has no such function.
        """

    def tables(self) -> Mapping[str, Any]:
        """Returns what the files say of the robot, by the names that Python packages use.

        `DOF`, `JOINTS`, `LIMITS`, `MODEL` and, where there is such a thing, `FRAMES`, `TIPS`, `BRANCHES`, `PARAMETERS`,
        `ACTUATORS` and `DEFAULT_PARAMS`; lists are tuples. Raises `CompileError` if the tool refuses the files.
        """


class Runner(Protocol):
    """Prepares the files of a language to be called."""

    def __call__(self, tool: str, folder: Path, kernels: RobotPrograms) -> Call:
        """Prepare what was emitted.

        `tool`: the program that compiles or runs it; `folder`: the folder with the emitted files, in which more may be
        written. Raises `CompileError` if the tool refuses the files.
        """


def run_tool(command: tuple[str, ...], folder: Path, subject: str) -> str:
    """Run a tool in a folder.

    `subject`: what it is run for, for the message. Returns what it prints. Raises `CompileError` with the first error
    that it reports, if it fails or takes longer than `PATIENCE`.
    """
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=PATIENCE, check=False)
    except subprocess.TimeoutExpired as error:
        raise CompileError(f"{command[0]} did not finish {subject} within {PATIENCE:.0f} s") from error
    except OSError as error:
        raise CompileError(f"{command[0]} cannot be run: {error.strerror}") from error
    if done.returncode:
        raise CompileError(f"{command[0]} refuses {subject}: {first_errors(done)}")
    return done.stdout


_NAME = r"[A-Za-z_]\w*"
_PLACE = rf"{_NAME}(?:\(\d+, :\)|[.]{_NAME}|\[{_NAME}(?: \+ \d+)?\]|(?:\[\d+\])+)?"
_NUMBER = r"\d[\d.]*(?:[eE][-+]?\d+)?"
_OPERAND = rf"(?:-?{_PLACE}|-?{_NUMBER}|\(-{_NUMBER}\))"
_SINE, _COSINE, _ANGLE = "SINE__", "COSINE__", "ANGLE__"


def require_forms(
    syntax: Syntax[Operator],
    owner: str,
    text: str,
    heads: Sequence[str],
    end: str,
    others: Sequence[frozenset[str]] = (),
    more: Sequence[str] = (),
) -> None:
    """Read the bodies of some functions.

    `syntax`: what they were printed in; `heads`: for each function a regular expression of its first line; `others`:
    for each function the lines of its body beside statements: comments, declarations, what it returns; `more`: forms of
    expressions beside those of the syntax. Raises `ProofError` naming the function and the line, or the function that
    is not there exactly once.
    """
    forms = _forms(syntax, more)
    lines = text.split("\n")
    for head, known in zip(heads, others or [frozenset[str]()] * len(heads), strict=True):
        starts = [number for number, line in enumerate(lines, start=1) if re.fullmatch(head, line)]
        if len(starts) != 1:
            raise ProofError(f"{owner}: {len(starts)} functions match '{head}', not one; nothing was written")
        for line in lines[starts[0] : lines.index(end, starts[0])]:
            if line.strip() not in known and not forms.fullmatch(line.strip()):
                raise ProofError(f"{owner}: '{line.strip()}' is not straight; nothing was written")


def _forms(syntax: Syntax[Operator], more: Sequence[str]) -> re.Pattern[str]:
    """Returns what a line of a body may be."""
    expressions = [_expression(form) for form in (*syntax.forms.values(), *more)]
    defined = [_escaped(syntax.define, {"{name}": _NAME, "{value}": value}) for value in (_OPERAND, *expressions)]
    stored = _escaped(syntax.store, {"{place}": _PLACE, "{value}": _OPERAND})
    pair = syntax.sincos(_SINE, _COSINE, _ANGLE)
    pairs = [_escaped(line, {_SINE: _NAME, _COSINE: _NAME, _ANGLE: _OPERAND}) for line in pair]
    return re.compile("|".join((*defined, stored, *pairs)))


def _expression(form: str) -> str:
    return _escaped(form, {f"{{{index}}}": _OPERAND for index in range(4)})


def _escaped(form: str, places: dict[str, str]) -> str:
    """Returns a form as a regular expression, with other ones in its places."""
    parts = re.split("|".join(f"({re.escape(place)})" for place in places), form)
    return "".join(places[part] if part in places else re.escape(part) for part in parts if part)


READY = "ready"
WRONG = "wrong: "


class Conversation:
    """One process of a tool, which ends with this object.

    Raises `CompileError` if the tool cannot be run.

    Args:
        title: How messages name the tool.
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

        `line`: what the tool reads; `subject`: what is asked for, for the message. Returns the lines before the answer.
        Raises `CompileError` if the answer is not `ready`, or there is none within `PATIENCE`.
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


_TABLES = {
    "JOINT": "JOINTS",
    "FRAME": "FRAMES",
    "TIP": "TIPS",
    "BRANCH": "BRANCHES",
    "PARAMETER": "PARAMETERS",
    "ACTUATOR": "ACTUATORS",
}


def exchanged(
    inputs: Arrays, dtype: Any, shapes: Sequence[tuple[int, ...]], run: Callable[[str, str], object]
) -> Arrays:
    """Hands numbers to a tool in one file and takes its results of such shapes, N each, from another one.

    `run` is given both paths.
    """
    with tempfile.TemporaryDirectory(prefix="kinegen-") as place:
        given, found = Path(place) / "inputs", Path(place) / "results"
        given.write_bytes(np.concatenate([np.ascontiguousarray(array, dtype).ravel() for array in inputs]).tobytes())
        run(str(given), str(found))
        numbers = np.fromfile(found, dtype)
    count = len(inputs[0])
    parts = np.split(numbers, np.cumsum([count * math.prod(shape) for shape in shapes])[:-1])
    return tuple(part.reshape(count, *shape) for part, shape in zip(parts, shapes, strict=True))


def tuples(value: Any) -> Any:
    """Makes tuples of lists that JSON has."""
    return tuple(map(tuples, value)) if isinstance(value, list) else value


@dataclass(frozen=True, slots=True)
class Driven:
    """A compiled driver; see `kinegen.verify.runners.runner.Call`."""

    folder: Path
    kernels: RobotPrograms
    file: str  # The file that it calls

    def __call__(
        self, program: Program, inputs: Arrays, parameters: tuple[float, ...] | None, *, real: str, is_batch: bool
    ) -> Arrays:
        """Evaluate a kernel in a process of its own."""
        shapes = [result.shape for result in program.signature.results]
        return self._run(program.quantity.function, real, inputs, shapes, parameters or (), is_batch=is_batch)

    def others(self, name: str, inputs: Arrays, *, real: str) -> Arrays:
        """Evaluate a function beside the kernels."""
        results: list[tuple[int, ...]] = [inputs[0].shape[1:]] if name in CLAMPS else [()]
        shapes = [(self.kernels.robot.dof,), *results] if name == NEAREST else results
        return self._run(name, real, inputs, shapes)

    def _run(
        self,
        name: str,
        real: str,
        inputs: Arrays,
        shapes: Sequence[tuple[int, ...]],
        parameters: Sequence[float] = (),
        *,
        is_batch: bool = False,
    ) -> Arrays:
        form, count, values = "batch" if is_batch else "one", str(len(inputs[0])), [each.hex() for each in parameters]

        def run(given: str, found: str) -> None:
            command = ("./driver", name, form, real, count, given, found, *values)
            run_tool(command, self.folder, f"{name} of {self.file}")

        return exchanged(inputs, DTYPES[real], shapes, run)

    def tables(self) -> dict[str, Any]:
        """What the file says of the robot."""
        text = run_tool(("./driver",), self.folder, self.file)
        return {_TABLES.get(name, name): tuples(value) for name, value in json.loads(text).items()}
