"""Runs Frama-C's Eva plug-in on a program and reads its summary. Frama-C itself returns 0 whatever it finds."""

from __future__ import annotations

import os
import re
import subprocess
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from tests.prove.driver import Driver

PROGRAM = "frama-c"
PACKAGE = "frama-c-base"
"""The Debian package it comes in."""

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
        shown: Hull of each value that the program shows, by name.
        summary: Eva's own summary.
        text: Everything Frama-C said.
    """

    alarms: int
    complaints: int
    open: int
    assertions: int
    unreached: int
    shown: Mapping[str, tuple[float, float]]
    summary: str
    text: str

    def proves(self, driver: Driver) -> bool:
        """Whether all of the program was reached, nothing in it can fail, and every assertion holds."""
        failures = (self.alarms, self.complaints, self.open, self.unreached)
        return failures == (0, 0, 0, 0) and self.assertions == driver.assertions


def analyse(driver: Driver, special: str = "non-finite") -> Outcome:
    """Analyse a program.

    Args:
        driver: The program.
        special: Which numbers raise an alarm where they come up: `non-finite` or `none`.

    Returns:
        What Eva found.

    Raises:
        RuntimeError: If Frama-C did not come to an end.
    """
    with tempfile.TemporaryDirectory(prefix="prove-") as place:
        for name, text in driver.files.items():
            (Path(place) / name).write_text(text, encoding="utf-8")
        done = subprocess.run(
            [PROGRAM, *OPTIONS, "-warn-special-float", special, "main.c"],
            cwd=place,
            env={**os.environ, "PWD": place},  # which Frama-C believes
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
    if done.returncode != 0 or "ANALYSIS SUMMARY" not in done.stdout:
        raise RuntimeError(f"{PROGRAM} did not finish {driver.name}:\n{done.stdout[-4000:]}")
    return read(done.stdout)


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
        shown=_shown(text),
        summary="\n".join(line.rstrip() for line in summary.splitlines() if line.strip().strip("-")),
        text=text,
    )


def _shown(text: str) -> dict[str, tuple[float, float]]:
    """The hull of each shown value over all lines about it."""
    found: dict[str, tuple[float, float]] = {}
    for name, value in re.findall(r"Frama_C_show_each_(\w+):\s+(\S[^\n]*)", text):
        numbers = [float(word) for word in re.findall(r"-?\d[\d.]*(?:e[+-]?\d+)?", value.replace("..", " "))]
        low, high = found.get(name, (numbers[0], numbers[0]))
        found[name] = (min(low, *numbers), max(high, *numbers))
    return found
