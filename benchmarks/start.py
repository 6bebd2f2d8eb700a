"""What commands take to start: `python -m benchmarks.start`.

The processor time of `kinegen check` and `kinegen show` for a SCARA, beside that of `import sympy`, which `show` cannot
do without. The commands run in turns, so that a busy machine slows all of them alike, and modules are compiled before,
as an installation leaves them. Valgrind, where it is installed, counts instructions besides: these are the same on
every run.
"""

from __future__ import annotations

import os
import re
import shutil
import statistics
import subprocess
import sys
from pathlib import Path

from benchmarks.speed.clock import spent_by_children
from benchmarks.speed.machine import processor_name

ROOT = Path(__file__).resolve().parents[1]
SCARA = str(ROOT / "robots" / "scara.yaml")

COMMANDS = {
    "import sympy": ("-c", "import sympy"),
    "kinegen check": ("-m", "kinegen", "check", SCARA),
    "kinegen show": ("-m", "kinegen", "show", SCARA),
}
"""What is compared; the first is the measure of the others."""

ASKED = {"kinegen check": 0.4, "kinegen show": 1.2}
"""At most this share of the first."""

TURNS = 15


def main() -> int:
    """Measure and print; 0, since machines differ."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    environment["PYTHONPATH"] = str(ROOT)
    spent: dict[str, list[float]] = {name: [] for name in COMMANDS}
    for turn in range(TURNS + 1):
        for name, arguments in COMMANDS.items():
            before = spent_by_children()
            _run([sys.executable, *arguments], environment)
            if turn:  # the first compiles modules
                spent[name].append(spent_by_children() - before)
    counted = {name: _instructions(arguments, environment) for name, arguments in COMMANDS.items()}
    measure, *_ = COMMANDS
    print(f"{processor_name()}, load {os.getloadavg()[0]:.2f}, medians of {TURNS} turns")
    print(f"{'':<16}{'processor, s':>14}{'share':>8}{'instructions, 1e6':>20}{'share':>8}{'asked':>8}")
    for name in COMMANDS:
        seconds = statistics.median(spent[name])
        share = statistics.median(one / other for one, other in zip(spent[name], spent[measure], strict=True))
        count = f"{counted[name]:>20.0f}{counted[name] / counted[measure]:>8.2f}" if counted[measure] else f"{'-':>28}"
        print(f"{name:<16}{seconds:>14.3f}{share:>8.2f}{count}{ASKED.get(name, ''):>8}")
    return 0


def _run(command: list[str], environment: dict[str, str]) -> str:
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return done.stderr


def _instructions(arguments: tuple[str, ...], environment: dict[str, str]) -> float:
    """Millions of instructions, by Valgrind; 0 without it."""
    valgrind = shutil.which("valgrind")
    if valgrind is None:
        return 0.0
    options = ["--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=/dev/null"]
    told = _run([valgrind, *options, sys.executable, *arguments], {**environment, "PYTHONHASHSEED": "0"})
    found = re.search(r"I\s+refs:\s+([\d,]+)", told)
    return float(found[1].replace(",", "")) / 1e6 if found else 0.0


if __name__ == "__main__":
    sys.exit(main())
