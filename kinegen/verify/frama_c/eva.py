"""Runs Frama-C's Eva plug-in on all functions of a robot, and keeps its summaries as records.

The keys of `Evidence.record` are stable:

    robot       its name
    digest      of the model, as in the banners of the C files
    units       length and angle of the ranges
    parameters  the runtime parameters with their values, which are those of the file
    frama_c     version of Frama-C
    holds       whether everything that is claimed of all functions was shown
    not_analysed   outputs that were left out, each with the reason
    functions   for each: function, output, real, claim (`finite` or `defined`), holds, alarms, open (assertions that
                were not shown), unreached (statements), ranges (name, low, high, unit, source of each number of the
                inputs; none where they may be anything), results (name, low, high), messages (one for each alarm),
                command and seconds
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.scalar_types import ScalarType
from kinegen.errors import KinegenError, MissingToolError
from kinegen.model.outputs import Kind
from kinegen.support.dataclass import dataclass
from kinegen.verify.frama_c.claims import Subject, subjects
from kinegen.verify.frama_c.driver import Claim, Driver

PROGRAM = "frama-c"
PACKAGE = "frama-c-base"
"""The Debian package it comes in."""

_SAID = 3
"""Lines of Frama-C that an error repeats."""

_WRAPPING = ("-warn-unsigned-overflow", "-warn-unsigned-downcast")
"""Alarms where unsigned integers wrap round, which C defines."""

OPTIONS = (
    # 32-bit words, little-endian: like the Cortex-M and RISC-V boards; there is no machine description of their own.
    "-machdep",
    "gcc_x86_32",
    # On x86 the kernels refuse registers that keep more digits than the type.
    "-cpp-extra-args=-msse2 -mfpmath=sse",
    # The decimal constants of the kernels are not exact, and are not meant to be: the nearest number is taken.
    "-kernel-warn-key=parser:decimal-float=inactive",
    "-warn-unsigned-overflow",
    "-warn-signed-downcast",
    "-warn-unsigned-downcast",
    "-warn-invalid-pointer",
    "-warn-left-shift-negative",
    "-warn-right-shift-negative",
    "-eva",
    # Sets of integers are kept as they are up to this size: the places of an output that a driver looks at.
    "-eva-ilevel=256",
    "-eva-no-show-progress",
)


@dataclass(frozen=True, slots=True)
class Outcome:
    """What Eva found."""

    alarms: int  # Operations that might fail
    complaints: int  # Errors and warnings of the analyser and of the front end
    open: int  # Assertions and preconditions that are not proved
    assertions: int  # Assertions that are
    unreached: int  # Statements of the program that were not come to
    # One line for each alarm and each assertion that is not proved: file, line and what may go wrong
    messages: tuple[str, ...]
    shown: Mapping[str, tuple[float, float]]  # Hull of each value that the program shows, by name
    summary: str  # Eva's own summary
    text: str  # Everything Frama-C said

    def proves(self, driver: Driver) -> bool:
        """Returns whether all of the program was reached, nothing in it can fail, and every assertion holds."""
        failures = (self.alarms, self.complaints, self.open)
        # What is claimed to be defined may hold branches that no input of the range takes.
        reached = self.unreached == 0 or driver.claim is Claim.DEFINED
        return failures == (0, 0, 0) and reached and self.assertions == driver.assertions


def options_for(driver: Driver) -> tuple[str, ...]:
    """Returns the options with which a program is analysed.

    Roots, arc tangents and integers use unsigned numbers that wrap round; where such functions are claimed to be
    defined, wrapping round raises no alarm, and neither do infinities and NaN.
    """
    is_finite = driver.claim is Claim.FINITE
    kept = tuple(option for option in OPTIONS if is_finite or option not in _WRAPPING)
    return (*kept, "-warn-special-float", "non-finite" if is_finite and not driver.special else "none")


def command_for(driver: Driver) -> str:
    """Returns the command as a shell takes it, in the folder of the program's files."""
    return shlex.join([PROGRAM, *options_for(driver), "main.c"])


def analyse(driver: Driver) -> Outcome:
    """Analyse a program.

    Returns what Eva found. Raises `MissingToolError` if Frama-C is not installed; `KinegenError` if it did not come to
    an end.
    """
    require_program()
    with tempfile.TemporaryDirectory(prefix="prove-") as place:
        for name, text in driver.files.items():
            (Path(place) / name).write_text(text, encoding="utf-8")
        done = subprocess.run(
            [PROGRAM, *options_for(driver), "main.c"],
            cwd=place,
            env={**os.environ, "PWD": place},  # which Frama-C believes
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
    if done.returncode != 0 or "ANALYSIS SUMMARY" not in done.stdout:
        said = [line for line in done.stdout.splitlines() if line.strip()]
        raise KinegenError(f"{PROGRAM} did not finish {driver.name}: {'; '.join(said[-_SAID:]) or 'it said nothing'}")
    return read(done.stdout)


def require_program() -> None:
    """Say how to install Frama-C where it is missing."""
    if shutil.which(PROGRAM) is None:
        raise MissingToolError(
            f"{PROGRAM} is not installed (Debian: apt-get install --no-install-recommends {PACKAGE}; "
            "elsewhere: opam install frama-c)"
        )


def version() -> str:
    """Returns what `frama-c -version` says."""
    done = subprocess.run([PROGRAM, "-version"], stdout=subprocess.PIPE, text=True, check=True)
    return done.stdout.strip()


def read(text: str) -> Outcome:
    """Reads what Frama-C printed."""
    summary = text[text.index("ANALYSIS SUMMARY") :].partition("\n")[2]
    counted = re.findall(r"^ +by the (?:Eva analyzer|Frama-C kernel): +(\d+) errors? +(\d+) warnings?", summary, re.M)
    alarms = re.search(r"^ +(\d+) alarms? generated", summary, re.M)
    reached = re.search(r"^ +In these functions, (\d+) statements reached \(out of (\d+)\)", summary, re.M)
    logic = re.findall(r"^ +(Assertions|Preconditions) +(\d+) valid +(\d+) unknown +(\d+) invalid", summary, re.M)
    return Outcome(
        # A program whose end is never reached has no such line, and that is no proof.
        alarms=int(alarms[1]) if alarms else -1,
        complaints=sum(int(number) for pair in counted for number in pair),
        open=sum(int(unknown) + int(invalid) for _, _, unknown, invalid in logic),
        assertions=sum(int(valid) for kind, valid, _, _ in logic if kind == "Assertions"),
        unreached=int(reached[2]) - int(reached[1]) if reached else -1,
        messages=_messages(text),
        shown=_shown(text),
        summary="\n".join(line.rstrip() for line in summary.splitlines() if line.strip().strip("-")),
        text=text,
    )


def _messages(text: str) -> tuple[str, ...]:
    """Returns the alarms, each with its place."""
    found = re.findall(r"^\[eva:alarm\] (\S+:\d+): Warning:\s+(.+(?:\n  .*)*)", text, re.M)
    return tuple(dict.fromkeys(f"{place}: {' '.join(words.split()).rstrip(';')}" for place, words in found))


def _shown(text: str) -> dict[str, tuple[float, float]]:
    """Returns the hull of each shown value over all lines about it."""
    found: dict[str, tuple[float, float]] = {}
    for name, value in re.findall(r"Frama_C_show_each_(\w+):\s+(\S[^\n]*)", text):
        numbers = [float(word) for word in re.findall(r"-?\d[\d.]*(?:e[+-]?\d+)?", value.replace("..", " "))]
        low, high = found.get(name, (numbers[0], numbers[0]))
        found[name] = (min(low, *numbers), max(high, *numbers))
    return found


@dataclass(frozen=True, slots=True)
class Finding:
    """What Eva found in one function.

    Attributes:
        outcome: What Eva said.
    """

    subject: Subject
    outcome: Outcome
    seconds: float

    @property
    def holds(self) -> bool:
        """Whether what is claimed of the function was shown."""
        return self.outcome.proves(self.subject.driver)

    @property
    def results(self) -> tuple[tuple[str, float, float], ...]:
        """Hulls of what the function gives: name, lower and upper bound."""
        prefix = f"{self.subject.called}_"
        return tuple((name.removeprefix(prefix), *hull) for name, hull in self.outcome.shown.items())

    def record(self) -> dict[str, object]:
        """Returns the finding as plain data."""
        return {
            "function": self.subject.function,
            "output": self.subject.output,
            "real": self.subject.real,
            "claim": str(self.subject.driver.claim),
            "holds": self.holds,
            "alarms": self.outcome.alarms,
            "open": self.outcome.open,
            "unreached": self.outcome.unreached,
            "ranges": [asdict(each) for each in self.subject.ranges],
            "results": [{"name": name, "low": low, "high": high} for name, low, high in self.results],
            "messages": list(self.outcome.messages),
            "command": command_for(self.subject.driver),
            "seconds": round(self.seconds, 1),
        }


@dataclass(frozen=True, slots=True)
class Evidence:
    """What was found in all functions of a robot.

    Attributes:
        digest: Of its model.
        length: The unit of lengths.
        parameters: The runtime parameters, each with the value at which the functions were analysed.
        version: Of Frama-C.
        left_out: Outputs that were not analysed, each with the reason.
    """

    robot: str
    digest: str
    length: str
    parameters: tuple[tuple[str, float], ...]
    version: str
    findings: tuple[Finding, ...]
    left_out: tuple[tuple[str, str], ...]

    @property
    def holds(self) -> bool:
        """Whether what is claimed of every function was shown."""
        return all(finding.holds for finding in self.findings)

    def record(self) -> dict[str, object]:
        """Returns the evidence as plain data."""
        return {
            "robot": self.robot,
            "digest": self.digest,
            "units": {"length": self.length, "angle": "rad"},
            "parameters": dict(self.parameters),
            "frama_c": self.version,
            "holds": self.holds,
            "not_analysed": [{"output": output, "reason": reason} for output, reason in self.left_out],
            "functions": [finding.record() for finding in self.findings],
        }

    def files(self, report: str, document: str) -> dict[str, str]:
        """Returns the files of a folder that keeps the evidence.

        `report`: what is printed for people; `document`: the same for programs, as JSON. Text by path: the two, and for
        each function its program, the command and what Frama-C said.
        """
        found = {"report.txt": report, "report.json": document}
        for finding in self.findings:
            stem = finding.subject.function
            found |= {f"{stem}/{name}": text for name, text in finding.subject.driver.files.items()}
            found[f"{stem}/command.txt"] = command_for(finding.subject.driver) + "\n"
            found[f"{stem}/frama-c.txt"] = finding.outcome.text
        return found


_COMPLETE = "it iterates for eigenvalues; intervals say nothing of where that ends"
_RANGE = "its search has loops; intervals say nothing of where they end"
_TRACKER = "it chooses among solutions and iterates; intervals say nothing of the choice"
_SEARCH = "a search with a loop; intervals say nothing of where it ends"


def prove(
    kernels: RobotPrograms, reals: tuple[ScalarType, ...], *, integers: bool, report: Callable[[Finding], object]
) -> Evidence:
    """Analyse the scalar C functions of a robot.

    Args:
        kernels: The robot and its programs.
        reals: Number types.
        integers: Whether to analyse the kernels in integers, too.
        report: Called with each finding as soon as it is there, in the order of the functions.

    Returns:
        The findings, whether everything was shown or not.

    Raises:
        MissingToolError: If Frama-C is not installed.
        KinegenError: If Frama-C did not come to an end, or integers cannot evaluate an output.
    """
    require_program()
    found = []
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for finding in pool.map(examine, subjects(kernels, reals, integers=integers)):
            found.append(finding)
            report(finding)
    left_out = ((str(Kind.NUMERIC_INVERSE), _SEARCH),) * kernels.numeric_inverse
    left_out += ((str(Kind.COMPLETE_INVERSE), _COMPLETE),) * kernels.complete_inverse
    left_out += ((str(Kind.REDUNDANCY_RANGE), _RANGE),) * kernels.redundancy_range
    left_out += ((str(Kind.INVERSE_TRACKER), _TRACKER),) * kernels.inverse_tracker
    robot = kernels.robot
    names = (parameter.name for parameter in robot.runtime_parameters)
    parameters = tuple(zip(names, map(float, kernels.defaults), strict=True))
    return Evidence(robot.name, robot.digest, robot.units.length, parameters, version(), tuple(found), left_out)


def examine(subject: Subject) -> Finding:
    """Analyse one function."""
    begin = time.perf_counter()
    outcome = analyse(subject.driver)
    return Finding(subject, outcome, time.perf_counter() - begin)
