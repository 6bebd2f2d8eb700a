"""Runs Frama-C's Eva plug-in on a program and reads its summary. Frama-C itself returns 0 whatever it finds."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from kinegen.errors import KinegenError, MissingToolError
from kinegen.prove.driver import Claim, Driver

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
    """What Eva found.

    Attributes:
        alarms: Operations that might fail.
        complaints: Errors and warnings of the analyser and of the front end.
        open: Assertions and preconditions that are not proved.
        assertions: Assertions that are.
        unreached: Statements of the program that were not come to.
        messages: One line for each alarm and each assertion that is not proved: file, line and what may go wrong.
        shown: Hull of each value that the program shows, by name.
        summary: Eva's own summary.
        text: Everything Frama-C said.
    """

    alarms: int
    complaints: int
    open: int
    assertions: int
    unreached: int
    messages: tuple[str, ...]
    shown: Mapping[str, tuple[float, float]]
    summary: str
    text: str

    def proves(self, driver: Driver) -> bool:
        """Whether all of the program was reached, nothing in it can fail, and every assertion holds."""
        failures = (self.alarms, self.complaints, self.open)
        # What is claimed to be defined may hold branches that no input of the range takes.
        reached = self.unreached == 0 or driver.claim is Claim.DEFINED
        return failures == (0, 0, 0) and reached and self.assertions == driver.assertions


def options_for(driver: Driver) -> tuple[str, ...]:
    """The options with which a program is analysed.

    Roots, arc tangents and integers use unsigned numbers that wrap round; where such functions are claimed to be
    defined, wrapping round raises no alarm, and neither do infinities and NaN.
    """
    is_finite = driver.claim is Claim.FINITE
    kept = tuple(option for option in OPTIONS if is_finite or option not in _WRAPPING)
    return (*kept, "-warn-special-float", "non-finite" if is_finite and not driver.special else "none")


def command_for(driver: Driver) -> str:
    """The command as a shell takes it, in the folder of the program's files."""
    return shlex.join([PROGRAM, *options_for(driver), "main.c"])


def analyse(driver: Driver) -> Outcome:
    """Analyse a program.

    Args:
        driver: The program.

    Returns:
        What Eva found.

    Raises:
        MissingToolError: If Frama-C is not installed.
        KinegenError: If it did not come to an end.
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
    """What `frama-c -version` says."""
    done = subprocess.run([PROGRAM, "-version"], stdout=subprocess.PIPE, text=True, check=True)
    return done.stdout.strip()


def read(text: str) -> Outcome:
    """Read what Frama-C printed.

    Args:
        text: All of it.

    Returns:
        The outcome.
    """
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
    """The alarms, each with its place."""
    found = re.findall(r"^\[eva:alarm\] (\S+:\d+): Warning:\s+(.+(?:\n  .*)*)", text, re.M)
    return tuple(dict.fromkeys(f"{place}: {' '.join(words.split()).rstrip(';')}" for place, words in found))


def _shown(text: str) -> dict[str, tuple[float, float]]:
    """The hull of each shown value over all lines about it."""
    found: dict[str, tuple[float, float]] = {}
    for name, value in re.findall(r"Frama_C_show_each_(\w+):\s+(\S[^\n]*)", text):
        numbers = [float(word) for word in re.findall(r"-?\d[\d.]*(?:e[+-]?\d+)?", value.replace("..", " "))]
        low, high = found.get(name, (numbers[0], numbers[0]))
        found[name] = (min(low, *numbers), max(high, *numbers))
    return found
