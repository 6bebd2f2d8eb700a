"""Small C programs that time a kernel: they are compiled, run several times, and the fastest run counts."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path

MANY = 25
"""How often a program runs."""


def nanoseconds(files: Mapping[str, str], flags: tuple[str, ...]) -> float:
    """The time of one call.

    Args:
        files: C files by name; `main` prints nanoseconds for one call, and its argument is the number of calls.
        flags: Of the compiler.
    """
    with tempfile.TemporaryDirectory() as place:
        for name, text in files.items():
            Path(place, name).write_text(text, encoding="utf-8")
        sources = [name for name in files if name.endswith(".c")]
        subprocess.run(["gcc", *flags, "-D_GNU_SOURCE", "-o", "program", *sources], cwd=place, check=True)
        command = [str(Path(place, "program")), "1000"]
        found = [subprocess.run(command, capture_output=True, text=True, check=True).stdout for _ in range(MANY)]
        return min(map(float, found))
